"""The command line of ``plan.py``."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Pattern, Sequence

from rosclingo.errors import OptionsError
from rosclingo.solver.option_parser import OptionParser
from rosclingo.solver.options import Options, constants, mark_files, parse_options
from rosclingo.solver.threads import AUTO, read_threads, with_threads
from rosoclingo.in_process.answers import Answers
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.in_process.simulation import Seconds
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, ONE_BY_ONE_SECONDS
from rosoclingo.loop.values.ids import GOAL

_MODE = "dynamic.incremental.recording"
_STEPS = 50  # the longest plan; the modes' own default is too short for trying
_WHY_SECONDS = 20.0
_PROFILE_SECONDS = 60.0
_OF_THE_MODE = ("steps", "r")  # constants

_EPILOG = """\
With --theory dl, the encoding may have difference constraints, as with the solver node. All else
is handed to clingo, such as -c NAME=TERM or -t N; -c steps=N, the longest plan, and -c r=N are the
mode's as well. Exit status: 0; 1 if there is no plan, or a goal was not reached; 2 if the command
line, a file, a goal or a message is wrong."""


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Reads the command line without the program's name; ends the process if it is none.

    Returns:
        The options by their names, and besides: ``options`` for the planner, ``mode_options`` for
        the mode, and the ``inputs``, in the order in which they come.

    Raises:
        RosclingoError: A file or a term is wrong.
    """
    chosen, rest = make_parser().parse_known_args(arguments)
    options = with_threads(parse_planner(rest, "plan.py"), chosen.threads)
    chosen.options = options
    alone = ("at", "lasts", "fail", "no_answer", "fail_probability", "action_timeout", "commands")
    for option in alone if not chosen.simulate else ():
        if getattr(chosen, option):
            raise OptionsError(f"--{option.replace('_', '-')} is for a run: add --simulate")
    if chosen.profile_seconds is not None and not chosen.profile:
        raise OptionsError("--profile-seconds is for a profile: add --profile")
    if chosen.profile_seconds is None:
        chosen.profile_seconds = _PROFILE_SECONDS
    chosen.inputs = [
        *(read_input(text) for text in chosen.event),
        *(read_input(f"{GOAL}:{text}") for text in chosen.goal),
        *(read_input(text, when) for when, text in chosen.at),
    ]
    chosen.mode_options = _mode_options(options.clingo)
    chosen.lasting = _lasting(chosen)
    return chosen


def make_parser() -> OptionParser:
    """Returns the parser of all options but the planner's."""
    parser = OptionParser(
        prog="plan.py",
        usage="plan.py FILE... [--goal REQUEST]... [options] [clingo options]",
        description="Plans without a ROS master, and executes the plan in a simulation.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--goal", action="append", default=[], metavar="REQUEST", help="such as 'bring(o9,o14)'")
    add("--event", action="append", default=[], metavar="SOURCE:VALUE",
        help="a message before the goals, such as 'info:blocked(c3,c4)'")  # fmt: skip
    add("--mode", default=_MODE, metavar="M",
        help=f"a mode's name or path, or {SINGLE} for one node; by default {_MODE}")  # fmt: skip
    add("--simulate", action="store_true", help="execute the plan; the loop is the robot's own")
    add("--at", action="append", nargs=2, default=[], metavar=("STEP", "INPUT"),
        help="what comes in a step: goal:REQUEST, cancel:NUMBER or SOURCE:VALUE; in:N instead of a "
        "step means in the loop's N-th command, and after:N after it")  # fmt: skip
    add("--fail", type=_pattern, metavar="REGEX", help="actions that fail, where it is found")
    add("--no-answer", type=_pattern, metavar="REGEX", help="those that are never answered")
    add("--action-timeout", type=number_type(), default=0.0, metavar="S",
        help="an action without an answer for so long counts as failed or as timeout")  # fmt: skip
    add("--fail-probability", type=number_type(1.0), default=0.0, metavar="P", help="of the others")
    add("--seed", type=int, default=0, metavar="N", help="of these failures; by default 0")
    add(
        "--seconds",
        type=number_type(),
        default=None,
        metavar="S",
        help="how long an action takes; by default what the encoding says, else 1",
    )
    add("--lasts", action="append", nargs=2, default=[], metavar=("REGEX", "S"),
        help="how long actions take where it is found; the first one counts")  # fmt: skip
    add("--most-steps", type=int, default=1000, metavar="N", help="when the simulation ends")
    add("--commands", action="store_true", help="also tell each command of the mode")
    add("--task", action="store_true",
        help="also print the planning task: the state, the requests and all actions; for "
        "encodings with lib/actions.lp")  # fmt: skip
    add("--abort-unreachable", action="store_true",
        help="a goal without a plan ends alone, and not all with the loop")  # fmt: skip
    add("--patience", type=number_type(), default=DEFAULT_PATIENCE, metavar="S",
        help="when an optimising search ends that has found a plan; 0 for when it is through; by "
        "default 1 if its encoding looks for better plans while robots act, 0.25 if that has "
        "lib/actions.lp, else 0")  # fmt: skip
    add("--one-by-one-seconds", type=number_type(), default=ONE_BY_ONE_SECONDS, metavar="S",
        help="how long one horizon after the other is searched, until several take turns; by "
        f"default {ONE_BY_ONE_SECONDS:g}, and 0 for always")  # fmt: skip
    add("--seed-planner", metavar="NAME", help="accepted, and has no effect any more")
    add("--threads", type=read_threads, default=1, metavar="N",
        help=f"search with N threads, or {AUTO} for as many as there are spare cores")  # fmt: skip
    add("--why-seconds", type=number_type(), default=_WHY_SECONDS, metavar="S",
        help=f"how long to look why there is no plan; by default {_WHY_SECONDS:g}, and 0 for "
        "not at all")  # fmt: skip
    add("--profile", action="store_true",
        help="say how long grounding and searches took, and what was grounded: the atoms of each "
        "predicate and the instances of each statement")  # fmt: skip
    add("--profile-seconds", type=number_type(), default=None, metavar="S",
        help=f"when a profile ends the planning; by default {_PROFILE_SECONDS:g}, and 0 for when "
        "that is through")  # fmt: skip
    add("--json", action="store_true", help="print plan, goals and journal as JSON")
    add("--picture", type=Path, metavar="FILE", help="draw the plan or the run; .svg, .png, .pdf")
    return parser


def simulated(chosen: argparse.Namespace) -> Dict[str, Any]:
    """Returns the arguments of a :class:`.Simulation` that a command line means, by their names."""
    patterns = {name: getattr(chosen, name) for name in ("fail", "no_answer")}
    answers = Answers(
        fail_probability=chosen.fail_probability,
        seed=chosen.seed,
        **{name: pattern for name, pattern in patterns.items() if pattern is not None},
    )
    return {
        "inputs": chosen.inputs,
        "answer": answers.next,
        "seconds": chosen.lasting,
        "most_steps": chosen.most_steps,
        "action_timeout": chosen.action_timeout,
        "abort_unreachable": chosen.abort_unreachable,
        "patience": chosen.patience,
        "one_by_one_seconds": chosen.one_by_one_seconds,
        "improves": False,  # a search ends when --patience says so, and no other begins
    }


def parse_planner(words: Sequence[str], program: str) -> Options:
    """Reads the planner's files, of which any may stand without -f before it, and its options.

    Args:
        words: What was typed.
        program: The program that wants them.

    Raises:
        OptionsError: There is no file, or one is missing.
    """
    options = parse_options([*mark_files(words)])
    if not options.files:
        raise OptionsError(f"name the planner's encoding and instance: {program} FILE.lp...")
    return options


def _lasting(chosen: argparse.Namespace) -> Seconds:
    """Returns the function that gives the duration of actions."""
    lasts = []
    for regex, text in chosen.lasts:
        try:
            lasts.append((_pattern(regex), number_type()(text)))
        except argparse.ArgumentTypeError as err:
            raise OptionsError(f"--lasts: {err}") from err
        except ValueError as err:
            raise OptionsError(f"--lasts {regex} {text}: {text!r} is no number from 0 on") from err

    def seconds(_: str, action: str) -> Optional[float]:
        return next((found for regex, found in lasts if regex.search(action)), chosen.seconds)

    return seconds


def _pattern(text: str) -> Pattern[str]:
    try:
        return re.compile(text)
    except re.error as err:
        raise argparse.ArgumentTypeError(f"{text!r} is no regular expression: {err}") from err


def number_type(most: float = float("inf")) -> Callable[[str], float]:
    """Returns an argparse type: a number from 0 on; all else raises a ``ValueError``."""

    def number(text: str) -> float:
        value = float(text)
        if not 0 <= value <= most:
            raise ValueError(text)
        return value

    return number


def _mode_options(clingo: Sequence[str]) -> List[str]:
    """Returns the constants of the command line that are the mode's."""
    given = {"steps": str(_STEPS)}
    given.update(pair for pair in constants(clingo).items() if pair[0] in _OF_THE_MODE)
    return [word for name, text in given.items() for word in ("-c", f"{name}={text}")]
