"""Imports a planning task in PDDL: the command ``pddl.py``."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import Dict, NoReturn, Optional, Sequence

from rosclingo.errors import RosclingoError, shorten
from rosclingo.terminal import say
from rosclingo.wire.term_text import number
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.files import ImportOptions, import_task, write_files

_PROGRAM = "pddl.py"
_EPILOG = """\
It needs Fast Downward: pip install up-fast-downward. Requirements: :strips :typing
:negative-preconditions :equality :conditional-effects :action-costs :numeric-fluents
:durative-actions :derived-predicates :adl; what is not understood is refused by name, file and
line. Exit status: 0, or 2 if the task or an option is not understood; then nothing is written. With
--plan, it is that of plan.py."""


def main(arguments: Optional[Sequence[str]] = None) -> NoReturn:
    """Runs the command and ends the process.

    Args:
        arguments: The command line without the program's name; by default that of the process.
    """
    chosen = _parser().parse_args(arguments)
    try:
        options = ImportOptions(
            name=chosen.name, library=chosen.library, actuator=chosen.actuator,
            actuators=chosen.actuators, changing=chosen.changing, limits=_limits(chosen.most),
            slots=chosen.slots,
        )  # fmt: skip
        texts = import_task(chosen.domain, chosen.problem, options)
        files = write_files(texts, chosen.folder.expanduser())
    except RosclingoError as err:
        say(_PROGRAM, str(err))
        sys.exit(2)
    for file in files:
        print(f"wrote {file}")
    encoding, instance, _ = files
    command = [str(encoding), str(instance), "-c", "steps=1000", "--goal", "goal"]
    if chosen.plan:
        from rosoclingo.tools.plan.command import main as plan  # noqa: PLC0415 (takes a moment)

        plan(command)
    print(f"try it: plan.py {shlex.join(command)}")
    sys.exit(0)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_PROGRAM,
        description="Writes an encoding of a planning task in PDDL, an instance and examples.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("domain", type=Path, metavar="DOMAIN", help="the domain's file, such as domain.pddl")
    add("problem", type=Path, metavar="PROBLEM", help="the problem's file")
    add("--folder", type=Path, default=Path(), metavar="DIR",
        help="where the files are written; by default here")  # fmt: skip
    add("--name", type=_file_name, metavar="NAME",
        help="what they are called; by default as the domain")  # fmt: skip
    add("--actuators", action="append", default=[], metavar="TYPE",
        help="objects of this type, or for which this predicate holds at first, are actuators: the "
        "first one among an action's objects does it; repeatable")  # fmt: skip
    add("--actuator", default="robot", metavar="NAME",
        help="who does all other actions; by default robot")  # fmt: skip
    add("--changing", action="append", default=[], metavar="PREDICATE",
        help="messages may change its facts, though no action does; repeatable")  # fmt: skip
    add("--most", action="append", default=[], metavar="FUNCTION=N",
        help="how large its numbers can get; repeatable")  # fmt: skip
    add("--slots", type=_positive, metavar="N",
        help="how many requests are planned for at the same time")  # fmt: skip
    add("--plan", action="store_true", help="plan the goal at once, as plan.py does")
    add("--library", metavar="FILE",
        help="where the encoding says that actions.lp is; by default where it is now")  # fmt: skip
    return parser


def _file_name(text: str) -> str:
    if not text or "/" in text or text.startswith("."):
        raise argparse.ArgumentTypeError(f"{text!r} is no name of a file")
    return text


def _positive(text: str) -> int:
    value = number(text)
    if value is None or value < 1:
        raise argparse.ArgumentTypeError(f"{shorten(text)!r} is no number from 1 on")
    return value


def _limits(texts: Sequence[str]) -> Dict[str, int]:
    limits: Dict[str, int] = {}
    for text in texts:
        name, _, most = text.partition("=")
        limit = number(most)
        if limit is None or limit < 0:
            raise PddlError(
                f"--most {shorten(text)}: there can be FUNCTION=NUMBER, such as battery=100"
            )
        limits[name.lower()] = limit
    return limits
