"""The options and exit statuses of the commands that compare runs. Needs no ROS."""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosclingo.terminal import say
from rosoclingo.bags.compare import junit, text_report
from rosoclingo.bags.compare.comparison import Comparison, Level
from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.errors import BagError
from rosoclingo.loop.journal import Entry

_GAPS_SHOWN = 5
_REMAPPING = re.compile(r"[\w~/]+:=")


def arguments(given: Optional[Sequence[str]] = None) -> List[str]:
    """Returns a command line, by default that of the process, without ROS's remappings."""
    return [one for one in (sys.argv[1:] if given is None else given) if not _REMAPPING.match(one)]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Adds the options that these commands share."""
    add = parser.add_argument
    add("--level", choices=[level.value for level in Level], default=Level.EXACT.value,
        help="what has to be the same: the actions (exact, the default), the goals' outcomes and "
        "the plans' lengths (equivalent), the goals' outcomes (outcome)")  # fmt: skip
    add("--name", metavar="NODE", help="which node's run, if the bag has several")
    add("--junit", type=Path, metavar="FILE", help="write the results as JUnit's XML")
    add("--gtest_output", type=_gtest, help=argparse.SUPPRESS)  # rostest gives these two
    add("--text", action="store_true", help=argparse.SUPPRESS)


def run(
    program: str,
    options: argparse.Namespace,
    suite: junit.Suite,
    compare: Callable[[], Tuple[Comparison, float]],
) -> int:
    """Compares, writes the results, and returns the exit status.

    Args:
        program: What messages begin with.
        options: The options of :func:`add_options`.
        suite: What the results are called.
        compare: Compares and prints, and returns what came out and how many seconds it took.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a bag's texts may have any character
            stream.reconfigure(errors="backslashreplace")
    results = [file for file in (options.junit, options.gtest_output) if file is not None]
    try:
        comparison, seconds = compare()
        for file in results:
            junit.write_results(file, suite, comparison, seconds)
    except RosclingoError as err:
        return _give_up(program, results, suite, str(err))
    except BrokenPipeError:  # who reads it has seen enough, such as head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 2
    except Exception as err:  # 1 would say that there is a difference
        return _give_up(program, results, suite, f"{suite.name}: internal error: {err!r}")
    return 1 if comparison.differences else 0


def read(program: str, bag: Path, name: Optional[str]) -> Recording:
    """Reads a recording that has all events of its run, but for those after its end.

    Prints the faults of the bag.

    Args:
        program: What messages begin with.
        bag: The bag.
        name: Which node's run.

    Raises:
        BagError: It cannot be read, or lacks events; the message says which, and what to do.
    """
    recording = read_recording(bag, name)
    for remark in recording.remarks:
        say(program, f"{bag}: {remark}")
    first = recording.entries[0].number if recording.entries else 1
    if first > 1:
        raise BagError(
            f"{bag}: the first {first - 1} events of the run are missing; start record.py with "
            "the system (record:=FILE of the launch files)"
        )
    gaps = _gaps(recording.entries)
    if gaps:
        more = f" and {len(gaps) - _GAPS_SHOWN} more gaps" if len(gaps) > _GAPS_SHOWN else ""
        raise BagError(
            f"{bag}: of the run's {recording.entries[-1].number} events are missing: "
            f"{', '.join(gaps[:_GAPS_SHOWN])}{more}; what happened then is not known: use an "
            "undamaged copy of the bag, or record again"
        )
    return recording


def tell(comparison: Comparison) -> None:
    """Prints the differences, if there are any."""
    said = text_report.describe(comparison)
    if said:
        print(said)


def _give_up(program: str, results: List[Path], suite: junit.Suite, reason: str) -> int:
    say(program, reason)
    try:
        for file in results:
            junit.write_error(file, suite, reason)
    except BagError as err:
        say(program, str(err))
    return 2


def _gtest(text: str) -> Path:
    return Path(text[len("xml:") :] if text.startswith("xml:") else text)


def _gaps(entries: Sequence[Entry]) -> List[str]:
    """Returns the numbers that are missing: ``3`` or ``5 to 9``."""
    gaps = []
    for before, after in zip(entries, entries[1:]):
        first, last = before.number + 1, after.number - 1
        if first <= last:
            gaps.append(str(first) if first == last else f"{first} to {last}")
    return gaps
