"""The command line of a solver node: encodings, and what is handed to clingo."""

from __future__ import annotations

import glob
import os
import re
from dataclasses import dataclass
from typing import List, Sequence, Tuple

from rosclingo.errors import OptionsError, TermError
from rosclingo.solver.terms import parse_term

USAGE = """\
usage: run.py [-f FILE]... [clingo options] [ROS remappings]

Runs clingo as a ROS node, with a service ~control and an action at the node's own name.

  -f FILE, --file FILE  load the encoding FILE, or FILE.lp if FILE is not a file; repeatable
  -h, --help            print this text

All else is handed to clingo, for instance:
  -c NAME=TERM          replace the value of a #const
  -t N                  search with N threads
  --opt-mode=optN       enumerate the optimal answer sets
  --configuration=NAME  use another configuration of the solver, such as jumpy

Private parameters: ~allow_scripts, ~load_path, ~max_request_bytes (see docs/protocol.md).
"""
_MOST_CHOICES = 20  # files of a folder that are named, where one is missing


@dataclass(frozen=True)
class Options:
    """A parsed command line.

    Attributes:
        files: Paths of the encodings, which exist.
        clingo: Options for clingo, in their order.
        help: Whether the user asked for the usage.
    """

    files: Tuple[str, ...] = ()
    clingo: Tuple[str, ...] = ()
    help: bool = False


def parse_options(arguments: Sequence[str]) -> Options:
    """Parses a command line without program name and ROS remappings.

    Raises:
        OptionsError: A file is missing, or an option lacks its value.
    """
    files: List[str] = []
    clingo: List[str] = []
    rest = list(arguments)
    while rest:
        argument = rest.pop(0)
        if argument in ("-h", "--help"):
            return Options(help=True)
        if argument in ("-f", "--file"):
            files.append(_existing(_value(argument, rest)))
        elif argument.startswith("--file="):
            files.append(_existing(argument[len("--file=") :]))
        elif argument.startswith("-f"):
            files.append(_existing(argument[len("-f") :]))
        elif argument in ("-c", "--cons", "--const"):
            clingo += ["-c", _checked_const(_value(argument, rest))]
        elif argument.startswith(("--cons=", "--const=")):
            clingo += ["-c", _checked_const(argument.partition("=")[2])]
        elif argument.startswith("-c"):
            clingo += ["-c", _checked_const(argument[len("-c") :])]
        elif argument.endswith(".lp") and not argument.startswith("-"):
            raise OptionsError(f"'{argument}' needs -f before it to be loaded as an encoding")
        else:
            clingo.append(argument)
    return Options(tuple(files), tuple(clingo))


def _value(option: str, rest: List[str]) -> str:
    if not rest:
        raise OptionsError(f"option {option} needs a value after it")
    return rest.pop(0)


def _existing(path: str) -> str:
    """Returns the path, or the path with ``.lp``, because the manual names files without it."""
    path = os.path.expanduser(path)
    for candidate in (path, f"{path}.lp"):
        if os.path.isfile(candidate):
            return candidate
    raise OptionsError(
        f"there is no file '{path}', nor '{path}.lp', seen from {os.getcwd()}; {_choices(path)}"
    )


def _choices(path: str) -> str:
    """Returns a hint that names the encodings where one is missing."""
    folder = os.path.dirname(path)
    there = sorted(glob.glob(os.path.join(glob.escape(folder), "*.lp")))
    if not 0 < len(there) <= _MOST_CHOICES:
        return "check the path"
    names = ", ".join(os.path.basename(file)[: -len(".lp")] for file in there)
    return f"{folder or 'this folder'} has {names}; give one of these, or the path of another file"


def _checked_const(definition: str) -> str:
    """Checks a constant's definition, because clingo reads beyond the end of a wrong one."""
    name, equals, value = definition.partition("=")
    if not equals or not re.fullmatch(r"[_']*[a-z][A-Za-z0-9_']*", name.strip()):
        raise OptionsError(f"option -c expects NAME=TERM, such as -c max=14, not '{definition}'")
    try:
        parse_term(value)
    except TermError as err:
        raise OptionsError(f"option -c {definition}: {err}") from err
    return definition
