"""Finds out what the encodings of systems say, from what their planners say of themselves."""

from __future__ import annotations

import threading
from queue import SimpleQueue
from typing import Callable, Dict, Optional, Tuple

import rospy
from std_msgs.msg import String

from rosclingo.errors import RosclingoError
from rosclingo.ros.low_latency import subscriber
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.known import KnownEncoding, read_encoding
from rosoclingo.errors import LaunchedError

_PLANNER = "planner"  # the solver of a node with the loop that has the encoding

Learn = Callable[[KnownEncoding], None]


class EncodingReader:
    """Reads the encodings of systems, one after the other, in a thread of its own.

    rospy's threads only put what was heard into a queue.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        """Starts the reading thread.

        Args:
            warn: Called with the reason why an encoding cannot be read.
        """
        self._warn = warn
        self._heard: SimpleQueue[Tuple[str, str, Learn]] = SimpleQueue()
        self._subscribed: Dict[str, rospy.Subscriber] = {}
        threading.Thread(target=self._run, name="encodings", daemon=True).start()

    def listen(self, node: str, learn: Learn) -> None:
        """Has a node's encoding read, or that of its planner, each time that it says what it is.

        Args:
            node: The resolved name of a planning node or a planner.
            learn: Called with what is known, in the thread.
        """
        if node not in self._subscribed:

            def on_about(message: String) -> None:
                self._heard.put((node, message.data, learn))

            self._subscribed[node] = subscriber(f"{node}/about", String, on_about)

    def _run(self) -> None:
        while True:
            node, said, learn = self._heard.get()
            try:
                self._read(Launched.decode(node, said), learn)
            except (LaunchedError, RosclingoError, OSError) as err:
                self._warn(str(err))
            except Exception:  # a bug must not end the thread
                rospy.logerr("internal error", exc_info=True)

    def _read(self, launched: Launched, learn: Learn) -> None:
        planner: Optional[str] = launched.solvers.get(_PLANNER)
        if planner is not None:
            self.listen(planner, learn)
        else:
            learn(read_encoding(launched))
