"""The command line of ``check.py``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Sequence, Tuple

from rosclingo.errors import OptionsError, shorten
from rosclingo.solver.option_parser import OptionParser
from rosclingo.solver.options import Options, constants
from rosclingo.wire.term_text import number
from rosoclingo.in_process.inputs import MESSAGE, read_input
from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.values.ids import GOAL, type_event
from rosoclingo.tools.check.findings import Words
from rosoclingo.tools.plan.command_line import number_type, parse_planner

_EPISODES = 50
_SECONDS = 300.0

_EPILOG = """\
With --theory dl, the encoding may have difference constraints, as with the solver node. All else
is handed to clingo, such as -c NAME=TERM or -t N; -c steps=N, the longest plan, and -c r=N are the
mode's as well. Exit status: 0 if nothing was found; 1 if something was; 2 if the command line, a
goal or a message is wrong."""


@dataclass(frozen=True)
class Chosen:
    """The parsed command line.

    Attributes:
        words: Files and options for clingo, in the words that ``plan.py`` takes.
        options: The same, for the planner.
        mode: A mode's name or path; empty for that which fits.
        requests: The only requests; none for those that the encoding declares.
        messages: The only messages, with their sources; none for those that the encoding declares.
        episodes: How many random episodes there are, at most.
        seconds: How long the runs may take together; 0 for as long as they take.
        seed: Start of the random numbers.
        live: Whether to compare with the running system.
    """

    words: Words
    options: Options
    mode: str
    requests: Tuple[str, ...]
    messages: Tuple[Pair, ...]
    episodes: int
    seconds: float
    seed: int
    live: bool

    @property
    def steps(self) -> int:
        """The longest plan, by the constant ``steps``; 0 without that."""
        return max(0, number(constants(self.options.clingo).get("steps", "")) or 0)


def parse(arguments: Sequence[str], *, knows_live: bool = True) -> Chosen:
    """Parses the command line without the program's name; ends the process on an error.

    Args:
        arguments: The command line.
        knows_live: Whether there is a way to look at a running system.

    Raises:
        RosclingoError: A file or a term is wrong.
    """
    parser = OptionParser(
        prog="check.py",
        usage="check.py FILE... [options] [clingo options]",
        description="Says whether an encoding fits, before anything runs.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    # fmt: off
    add("--mode", default="", metavar="M",
        help="a mode's name or path, as of plan.py; by default one that fits the encoding")
    add("--goal", action="append", default=[], metavar="REQUEST",
        help="ask for this only, and not for all that the encoding declares; repeatable")
    add("--event", action="append", default=[], metavar="SOURCE:VALUE",
        help="send this message only, and not all that the encoding declares; repeatable")
    add("--episodes", type=_count, default=_EPISODES, metavar="N",
        help=f"how many random runs there are; by default {_EPISODES}")
    add("--seconds", type=number_type(), default=_SECONDS, metavar="S",
        help=f"how long all runs may take together, and each a tenth of that; by default "
        f"{_SECONDS:g}, and 0 for as long as they take")
    add("--seed", type=int, default=0, metavar="S", help="of what comes in them; by default 0")
    add("--live", action="store_true", help="compare with the system that runs, too; needs ROS")
    # fmt: on
    given, rest = parser.parse_known_args(arguments)
    if given.live and not knows_live:
        raise OptionsError("--live needs ROS: type rosrun rosoclingo check.py")
    return Chosen(
        tuple(rest),
        parse_planner(rest, "check.py"),
        given.mode,
        tuple(read_input(f"{GOAL}:{text}").value for text in given.goal),
        tuple(_message(text) for text in given.event),
        given.episodes,
        given.seconds,
        given.seed,
        given.live,
    )


def _message(text: str) -> Pair:
    one = read_input(text)
    if one.kind != MESSAGE:
        raise OptionsError(
            f"{text!r}: expected SOURCE:VALUE; a goal has the option --goal, and a source with "
            f"this name is put into brackets, {type_event(one.kind, one.value)!r}"
        )
    return one.source, one.value


def _count(text: str) -> int:
    value = number(text)
    if value is None or value < 0:
        raise argparse.ArgumentTypeError(f"a number from 0 on is needed: {shorten(text)}")
    return value
