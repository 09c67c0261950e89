"""Runs a demo as a program: waits, prints a summary, draws it, and ends with an exit status."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from typing import Callable, List, NoReturn, Protocol

import rospy

from rosclingo.errors import RosclingoError
from rosclingo.ros.init import init_node
from rosoclingo.drawing.errors import PictureError

_POLL_SECONDS = 0.05  # how often the main thread looks at what it waits for


class DemoProgram(Protocol):
    """A demo. The main thread makes the calls."""

    def run(self) -> List[str]:
        """Runs to the end, and returns the faults."""

    def lines(self, seconds: float) -> List[str]:
        """Returns the summary, with the seconds of wall time."""

    def draw(self, folder: Path) -> List[Path]:
        """Writes the pictures to a folder, if there is anything to draw; returns their names.

        Raises:
            OSError: They cannot be written.
            PictureError: matplotlib is missing.
        """


def run_demo(name: str, usage: str, make: Callable[[], DemoProgram]) -> NoReturn:
    """Runs a demo, and ends the process.

    Args:
        name: The node's name.
        usage: What ``--help`` prints.
        make: Makes the demo when the node is initialised.

    The exit status is 1 if something was wrong, else 0.
    """
    init_node(name, usage=usage)
    begin = time.monotonic()
    wrong: List[str] = []
    try:
        demo = make()
        wrong = demo.run()
        print("", *demo.lines(time.monotonic() - begin), sep="\n", flush=True)
        for file in demo.draw(Path(str(rospy.get_param("~output", "."))).absolute()):
            print(f"  {file}", flush=True)
    except PictureError as err:
        print(f"no picture: {err}", file=sys.stderr)
    except (OSError, RosclingoError) as err:
        wrong.append(str(err))
    for line in wrong:
        print(f"wrong: {line}", file=sys.stderr)
    rospy.signal_shutdown("the demo has ended")
    sys.exit(1 if wrong else 0)


def wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Waits until something holds, the node is shut down, or the time is over.

    Args:
        condition: What has to hold.
        seconds: Longest time to wait, of wall time.

    Returns:
        Whether it holds.
    """
    end = time.monotonic() + seconds
    pause = threading.Event()
    while not condition():
        if rospy.is_shutdown() or time.monotonic() > end:
            return False
        pause.wait(_POLL_SECONDS)
    return True
