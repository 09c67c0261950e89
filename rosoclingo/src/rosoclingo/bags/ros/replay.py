"""Replays a bag through the nodes and says what is different: the command ``replay.py``."""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import tempfile
from pathlib import Path
from types import FrameType
from typing import NoReturn, Optional, Tuple

from rosclingo.terminal import PROGRESS, say
from rosclingo.wire.commands import Result
from rosoclingo.bags.compare import cli, text_report
from rosoclingo.bags.compare.comparison import Comparison, Level, compare
from rosoclingo.bags.compare.junit import Suite
from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.startup import check, has_same_encodings, starts
from rosoclingo.bags.ros.player import Replayed, play
from rosoclingo.errors import BagError
from rosoclingo.loop.journal import CommandDone, Event, PlanFound


def main() -> NoReturn:
    """Runs the command and ends the process.

    The exit status is 0 if there is no difference, 1 if there is one, 2 if the bag cannot be
    replayed or the command line is wrong, or 130 after Ctrl-C.
    """
    options = _parser().parse_args(cli.arguments())
    suite = Suite(f"replay of {options.bag.name}", f"replay.{options.bag.stem}")
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupt)
    try:
        status = cli.run("replay", options, suite, lambda: _replay(options))
    except KeyboardInterrupt:
        status = 130
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)  # all that was started has ended; rospy would talk to a master that is gone


def _replay(options: argparse.Namespace) -> Tuple[Comparison, float]:
    recording = cli.read("replay", options.bag, options.name)
    run = Run.of(recording)
    if run.is_empty:
        raise BagError(
            f"{options.bag}: nothing can be compared: no goal has got a status, and the loop of "
            f"{recording.name} has put out nothing; record a run that does something"
        )
    if run.is_cut:
        say("replay", f"{options.bag}: {text_report.CUT}")
    check(options.bag, recording, options.allow_scripts or options.files == "disk")
    with tempfile.TemporaryDirectory(prefix="replay-") as name:
        folder = Path(name)
        files = None if options.files == "disk" else folder / "files"
        processes = starts(
            recording, files, controller=options.controller, planner=options.planner,
            single=options.single, system=options.system,
            store=folder / "run.store" if options.kill else None,
        )  # fmt: skip
        given = (options.controller, options.planner, options.single, options.system)
        same_encodings = has_same_encodings(recording, given, disk=files is None)
        replayed = play(
            recording.name, run, processes, folder,
            rate=options.rate, timeout=options.timeout, kills=options.kill,
            same_encodings=same_encodings, show=_say_progress,
        )  # fmt: skip
    PROGRESS.clear()
    return _judge(recording, run, replayed, Level(options.level)), replayed.seconds


def _judge(recording: Recording, run: Run, replayed: Replayed, level: Level) -> Comparison:
    """Compares, and prints what is different."""
    comparison = compare(
        run, Run(replayed.entries), level, stalls=replayed.stalls, failure=replayed.failure
    )
    cli.tell(comparison)
    cut_off = sum(_is_cut_off(entry.event) for entry in recording.entries)
    if comparison.differences and cut_off:
        print(
            f"searches that were cut off in the recording: {cut_off}; how far clingo came is up to "
            "chance, so that it may find another plan of the same length afterwards"
        )
    if replayed.skipped:
        print(f"answers that were not sent, as their actions did not come: {replayed.skipped}")
    if replayed.killed:
        print(f"nodes that were killed and started again, as in the recording: {replayed.killed}")
    times = [entry.seconds for entry in recording.entries]
    speed = text_report.speed(replayed.seconds, times[-1] - times[0])
    print(f"{text_report.summary(comparison)}, {speed}")
    return comparison


def _is_cut_off(event: Event) -> bool:
    if isinstance(event, CommandDone):
        return event.result is Result.UNKNOWN
    # Of newer versions, the replay knows what was found.
    return isinstance(event, PlanFound) and not event.is_best and event.quality is None


def _say_progress(passed: int, count: int, seconds: float) -> None:
    PROGRESS.show(f"replay: {passed} of {count} inputs, {seconds:.0f} s")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="replay.py",
        description="Replays a bag through the nodes and says what is different.",
        epilog="Exit status: 0 no difference, 1 differences, 2 the bag cannot be replayed.",
    )
    add = parser.add_argument
    add("bag", type=Path, metavar="BAG", help="the bag, recorded by record.py or rosbag record")
    cli.add_options(parser)
    add("--planner", metavar="ARGS", help="another command line for the planner")
    add("--controller", metavar="ARGS", help="another command line for the controller")
    add("--single", metavar="ARGS", help="replay with run-1.0.py and this command line")
    add("--files", choices=["bag", "disk"], default="bag",
        help="where the files of the recorded command lines come from (default: bag)")  # fmt: skip
    add("--allow-scripts", action="store_true",
        help="let #script blocks run that are in the bag's encodings")  # fmt: skip
    add("--system", metavar="LAUNCH",
        help="arguments of roslaunch for what starts everything instead")  # fmt: skip
    add("--kill", action="store_true",
        help="kill nodes where those of the recording had died; by default none dies")  # fmt: skip
    rate = "send R times as fast as recorded, 1 for real time (default: as fast as possible)"
    add("--rate", type=_positive, metavar="R", help=rate)
    add("--timeout", type=_positive, default=60.0, metavar="SECONDS",
        help="give up after so long without progress (default: 60)")  # fmt: skip
    return parser


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"a positive number is needed, not {text!r}")
    return value


def _interrupt(_: int, frame: Optional[FrameType]) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):  # nothing interrupts ending the processes
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt
