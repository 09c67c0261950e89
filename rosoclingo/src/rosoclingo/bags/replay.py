"""Replays a bag through the nodes and says what is different: the command ``replay.py``."""

from __future__ import annotations

import argparse
import math
import os
import re
import signal
import sys
import tempfile
import time
from pathlib import Path
from types import FrameType
from typing import Callable, List, NoReturn, Optional, Tuple

from rosoclingo.bags import junit, show
from rosoclingo.bags.comparison import Comparison, Level, compare
from rosoclingo.bags.errors import BagError
from rosoclingo.bags.model import Recording
from rosoclingo.bags.player import Replayed, play
from rosoclingo.bags.reader import read_recording
from rosoclingo.bags.replayable import check
from rosoclingo.bags.startup import Changes, starts

_REMAPPING = re.compile(r"[\w~/]+:=")
_PROGRESS_SECONDS = 2.0


def main() -> NoReturn:
    """Runs the command and ends the process.

    The exit status is 0 if there is no difference, 1 if there is one, 2 if the bag cannot be
    replayed or the command line is wrong, or 130 after Ctrl-C.
    """
    options = _parser().parse_args([one for one in sys.argv[1:] if not _REMAPPING.match(one)])
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    try:
        status = _run(options)
    except KeyboardInterrupt:
        status = 130
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # all that was started has ended; rospy would talk to a master that is gone


def _run(options: argparse.Namespace) -> int:
    results = [file for file in (options.junit, options.gtest_output) if file is not None]
    try:
        comparison, seconds = _replay(options)
        for file in results:
            junit.write_results(file, options.bag, comparison, seconds)
    except BagError as err:
        return _give_up(options.bag, results, str(err))
    except Exception as err:  # 1 would say that there is a difference
        return _give_up(options.bag, results, f"{options.bag}: internal error: {err!r}")
    return 1 if comparison.differences else 0


def _give_up(bag: Path, results: List[Path], reason: str) -> int:
    print(f"replay: {reason}", file=sys.stderr)
    try:
        for file in results:
            junit.write_error(file, bag, reason)
    except BagError as err:
        print(f"replay: {err}", file=sys.stderr)
    return 2


def _replay(options: argparse.Namespace) -> Tuple[Comparison, float]:
    recording = read_recording(options.bag, options.name)
    for remark in recording.remarks:
        print(f"replay: {options.bag}: {remark}", file=sys.stderr)
    check(options.bag, recording, options.allow_scripts or options.files == "disk")
    changes = Changes(
        options.controller, options.planner, options.single, options.system,
        options.files == "disk",
    )  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="replay-") as name:
        folder = Path(name)
        replayed = play(
            recording,
            starts(recording, changes, folder / "files"),
            folder,
            rate=options.rate,
            timeout=options.timeout,
            progress=_progress(),
        )
    return _judge(recording, replayed, Level(options.level)), replayed.seconds


def _judge(recording: Recording, replayed: Replayed, level: Level) -> Comparison:
    """Compares, and prints what is different."""
    comparison = compare(
        recording.entries,
        replayed.entries,
        level,
        has_journal=recording.has_journal,
        stalls=replayed.stalls,
        failure=replayed.failure,
    )
    said = show.describe(comparison)
    if said:
        print(said)
    if replayed.skipped:
        print(f"answers that were not sent, as their actions did not come: {replayed.skipped}")
    times = [entry.seconds for entry in recording.entries]
    print(show.summary(comparison, replayed.seconds, times[-1] - times[0]))
    return comparison


def _progress() -> Callable[[int, int], None]:
    """Returns what says on stderr how far the replay is, if it takes long."""
    times: List[float] = []  # when it was called first, and when it said something

    def say(sent: int, all_: int) -> None:
        now = time.monotonic()
        if all_ and now - (times or [now])[-1] >= _PROGRESS_SECONDS:
            print(f"replay: {sent} of {all_} inputs, {now - times[0]:.0f} s", file=sys.stderr)
            times[1:] = [now]
        elif not times:
            times.append(now)

    return say


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="replay.py",
        description="Replays a bag through the nodes and says what is different.",
        epilog="Exit status: 0 no difference, 1 differences, 2 the bag cannot be replayed.",
    )
    add = parser.add_argument
    add("bag", type=Path, metavar="BAG", help="the bag, recorded by record.py or rosbag record")
    add("--level", choices=[level.value for level in Level], default=Level.EXACT.value,
        help="what has to be the same: the actions (exact, the default), the goals' outcomes and "
        "the plans' lengths (equivalent), the goals' outcomes (outcome)")  # fmt: skip
    add("--planner", metavar="ARGS", help="another command line for the planner")
    add("--controller", metavar="ARGS", help="another command line for the controller")
    add("--single", metavar="ARGS", help="replay with run-1.0.py and this command line")
    add("--files", choices=["bag", "disk"], default="bag",
        help="where the files of the recorded command lines come from (default: bag)")  # fmt: skip
    add("--allow-scripts", action="store_true",
        help="let #script blocks run that are in the bag's encodings")  # fmt: skip
    add("--system", metavar="LAUNCH",
        help="arguments of roslaunch for what starts everything instead")  # fmt: skip
    add("--name", metavar="NODE", help="which node's run, if the bag has several")
    rate = "send R times as fast as recorded, 1 for real time (default: as fast as possible)"
    add("--rate", type=_positive, metavar="R", help=rate)
    add("--timeout", type=_positive, default=60.0, metavar="SECONDS",
        help="give up after so long without any event (default: 60)")  # fmt: skip
    add("--junit", type=Path, metavar="FILE", help="write the results as JUnit's XML")
    add("--gtest_output", type=_gtest, help=argparse.SUPPRESS)  # rostest gives these two
    add("--text", action="store_true", help=argparse.SUPPRESS)
    return parser


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"a positive number is needed, not {text!r}")
    return value


def _gtest(text: str) -> Path:
    return Path(text[len("xml:") :] if text.startswith("xml:") else text)


def _interrupt(_: int, frame: Optional[FrameType]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # nothing interrupts ending the processes
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt
