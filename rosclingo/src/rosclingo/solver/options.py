"""The command line of a solver node: encodings, a theory, and what is handed to clingo."""

from __future__ import annotations

import glob
import os
import re
from dataclasses import dataclass
from typing import Dict, Iterable, Iterator, List, NamedTuple, Sequence, Tuple

from rosclingo.errors import OptionsError, TermError
from rosclingo.solver.terms import parse_term

USAGE = """\
usage: run.py [-f FILE]... [--theory dl] [clingo options] [ROS remappings]

Runs clingo as a ROS node, with a service ~control and an action at the node's own name.

  -f FILE, --file FILE  load the encoding FILE, or FILE.lp if FILE is not a file; repeatable
  --theory dl           take difference constraints, as of clingo-dl, if that package is installed
  -h, --help            print this text

All else is handed to clingo, for instance:
  -c NAME=TERM          replace the value of a #const
  -t N                  search with N threads
  --opt-mode=optN       enumerate the optimal answer sets
  --configuration=NAME  use another configuration of the solver, such as jumpy

Private parameters: ~threads, ~allow_scripts, ~load_path, ~max_request_bytes, ~diagnostics_period,
~slow_seconds (see docs/protocol.md).
"""
_OPTION = re.compile(r"(?:(--file|--const|--cons|--theory)(?:=(.*))?|(-[fc])(.+)?)", re.DOTALL)
_NAMES = {"--file": "-f", "--const": "-c", "--cons": "-c"}  # of the same options
_MOST_CHOICES = 20  # files of a folder that are named, where one is missing


@dataclass(frozen=True)
class Options:
    """A parsed command line.

    Attributes:
        files: Paths of the encodings, which exist.
        clingo: Options for clingo, in their order.
        help: Whether the user asked for the usage.
        theory: The name of the theory that extends clingo; "" for none.
    """

    files: Tuple[str, ...] = ()
    clingo: Tuple[str, ...] = ()
    help: bool = False
    theory: str = ""


class Argument(NamedTuple):
    """An option with its value, or one word of what clingo gets.

    Attributes:
        option: ``-f``, ``-c`` or ``--theory``, however it was spelled; else empty.
        value: The value of the option, or the word.
    """

    option: str
    value: str


def arguments(words: Iterable[str]) -> Iterator[Argument]:
    """Splits a command line into options and words, without program name and ROS remappings.

    Raises:
        OptionsError: An option lacks its value.
    """
    rest = iter(words)
    for word in rest:
        match = _OPTION.fullmatch(word)
        if match is None:
            yield Argument("", word)
            continue
        name, value = (match[1], match[2]) if match[1] else (match[3], match[4])
        value = next(rest, None) if value is None else value
        if value is None:
            raise OptionsError(f"option {word} needs a value after it")
        yield Argument(_NAMES.get(name, name), value)


def mark_files(words: Iterable[str], folder: str = "") -> Iterator[str]:
    """Puts ``-f`` before each file of a command line, where files may stand without it.

    That is a word that ends in ``.lp``, whatever there is, or follows no option and is no number of
    answer sets. What follows an option of clingo's may be its value: it is a file if there is one
    of this name, which has a dot or a slash.

    Args:
        words: The command line.
        folder: From which relative paths are seen; by default the working directory.

    Raises:
        OptionsError: An option lacks its value.
    """
    may_be_value = False
    for option, value in arguments(words):
        if option:
            yield from (option, value)
        elif _is_file(value, folder, may_be_value):
            yield from ("-f", value)
        else:
            yield value
        may_be_value = not option and value.startswith("-")


def _is_file(word: str, folder: str, may_be_value: bool) -> bool:
    if word.startswith("-") or word.endswith(".lp"):
        return not word.startswith("-")
    is_there = os.path.isfile(os.path.join(folder, os.path.expanduser(word)))
    if may_be_value:
        return is_there and ("." in word or os.sep in word)
    return is_there or not word.isdecimal()


def parse_options(words: Sequence[str]) -> Options:
    """Parses a command line without program name and ROS remappings.

    Raises:
        OptionsError: A file is missing, or an option lacks its value.
    """
    files: List[str] = []
    clingo: List[str] = []
    theory = ""
    for option, value in arguments(words):
        if option == "-f":
            files.append(_existing(value))
        elif option == "-c":
            clingo += ["-c", _checked_const(value)]
        elif option == "--theory":
            if not value:
                raise OptionsError(f"option {option} needs a name, such as {option} dl")
            theory = value
        elif value in ("-h", "--help"):
            return Options(help=True)
        elif value.endswith(".lp") and not value.startswith("-"):
            raise OptionsError(f"'{value}' needs -f before it to be loaded as an encoding")
        else:
            clingo.append(value)
    return Options(tuple(files), tuple(clingo), theory=theory)


def constants(clingo: Sequence[str]) -> Dict[str, str]:
    """Returns the values of constants that options for clingo set, by name; the last one counts.

    Args:
        clingo: The options, as those of :class:`Options`.
    """
    definitions = (value for option, value in zip(clingo, clingo[1:]) if option == "-c")
    parts = (definition.partition("=") for definition in definitions)
    return {name.strip(): value.strip() for name, _, value in parts}


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
    """Returns a hint for a missing file: the encodings in its folder."""
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
