"""Compares the runs in two bags: the command ``compare.py``. Needs no ROS."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NoReturn, Optional, Sequence, Tuple

from rosclingo.terminal import say
from rosoclingo.bags.compare import cli, text_report
from rosoclingo.bags.compare.comparison import Comparison, Level, compare
from rosoclingo.bags.compare.junit import Suite
from rosoclingo.bags.read.run import Run
from rosoclingo.errors import BagError

_PROGRAM = "compare"


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Runs the command and ends the process.

    Args:
        arguments: The command line without the program's name; by default that of the process.

    The exit status is 0 if there is no difference, 1 if there is one, 2 if the bags cannot be
    compared or the command line is wrong, or 130 after Ctrl-C.
    """
    options = _parser().parse_args(cli.arguments(arguments))
    expected, seen = options.bag, options.seen
    suite = Suite(f"comparison of {expected.name} and {seen.name}", f"compare.{expected.stem}")
    try:
        sys.exit(cli.run(_PROGRAM, options, suite, lambda: _compare(options)))
    except KeyboardInterrupt:
        sys.exit(130)


def _compare(options: argparse.Namespace) -> Tuple[Comparison, float]:
    bag, seen_bag = options.bag, options.seen
    expected = Run.of(cli.read(_PROGRAM, bag, options.name))
    seen = Run.of(cli.read(_PROGRAM, seen_bag, options.seen_name or options.name))
    if expected.is_empty and (seen.is_empty or expected.is_cut):
        raise BagError(
            f"{bag}: nothing can be compared with {seen_bag}: no goal has got a status, and the "
            "loop has put out nothing; record a run that does something"
        )
    if expected.is_cut:
        say(_PROGRAM, f"{bag}: {text_report.CUT}")
    if seen.is_cut:
        say(
            _PROGRAM, f"{seen_bag}: the recording ends while the loop was at work; what is missing "
            "at the end may have happened after it"
        )  # fmt: skip
    comparison = compare(expected, seen, Level(options.level), is_replay=False)
    cli.tell(comparison)
    print(text_report.summary(comparison))
    return comparison, 0.0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="compare.py",
        description="Compares the runs in two bags and says what is different.",
        epilog="Exit status: 0 no difference, 1 differences, 2 the bags cannot be compared.",
    )
    add = parser.add_argument
    add("bag", type=Path, metavar="EXPECTED.bag", help="a bag of record.py or rosbag record")
    add("seen", type=Path, metavar="SEEN.bag", help="another one, of a later run")
    cli.add_options(parser)
    add("--seen-name", metavar="NODE", help="which node's run of SEEN.bag, if not --name")
    return parser
