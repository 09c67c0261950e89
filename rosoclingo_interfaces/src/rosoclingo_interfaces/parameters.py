"""Reads a node's private parameters; a wrong value is an error that names it."""

from __future__ import annotations

import math
import re
from typing import Any, List, Optional, Pattern, Sequence

import rospy

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term
from rosoclingo_interfaces.errors import ParameterError

NOTHING = r"(?!)"
"""A regular expression that matches nothing."""


def number(name: str, default: float, most: float = math.inf) -> float:
    """Returns a number from 0 on.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, default)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and 0 <= value <= most and math.isfinite(value)):
        bound = "" if most == math.inf else f" to {most:g}"
        raise _wrong(name, f"a number from 0{bound}", value)
    return float(value)


def integer(name: str, default: int) -> int:
    """Returns an integer from 0 on.

    Raises:
        ParameterError: It is something else.
    """
    value = number(name, default)
    if not value.is_integer():
        raise _wrong(name, "an integer from 0 on", value)
    return int(value)


def flag(name: str, default: bool) -> bool:
    """Returns true or false.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, default)
    if not isinstance(value, bool):
        raise _wrong(name, "true or false", value)
    return value


def pattern(name: str, default: str = NOTHING) -> Pattern[str]:
    """Returns a regular expression.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, "")
    try:
        return re.compile(str(value) or default)
    except re.error as err:
        raise _wrong(name, "a regular expression", f"{value}: {err}") from err


def text(name: str, default: Optional[str] = None) -> str:
    """Returns a text, which has to be there if it has no default.

    Raises:
        ParameterError: It is not, or is something else.
    """
    value = _get(name, default)
    if not isinstance(value, str):
        raise _wrong(name, "a text", "there is none" if value is None else value)
    return value


def words(name: str, default: Sequence[str] = ()) -> List[str]:
    """Returns a list of words, which may also be given as a text with spaces between them.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, list(default))
    if isinstance(value, str):
        value = value.split()
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise _wrong(name, "a list of words", value)
    return value


def terms(name: str, default: Sequence[str] = ()) -> List[str]:
    """Returns a list of terms.

    Raises:
        ParameterError: It is something else.
    """
    try:
        return [str(parse_term(word)) for word in words(name, default)]
    except TermError as err:
        raise _wrong(name, "a list of terms", err) from err


def _get(name: str, default: Any) -> Any:
    value = rospy.get_param(f"~{name}", None)
    if value is None or value == "":
        return default
    # A parameter of the command line outlives the node: the next of the same name has it too.
    rospy.loginfo("parameter %s is %s", rospy.resolve_name(f"~{name}"), value)
    return value


def _wrong(name: str, expected: str, value: Any) -> ParameterError:
    return ParameterError(
        f"parameter {rospy.resolve_name('~' + name)}: expected {expected}: {value}"
    )
