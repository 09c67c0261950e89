"""Reads a node's private parameters; a wrong value is an error that names it."""

from __future__ import annotations

import math
import re
from typing import Any, Dict, List, Optional, Pattern, Sequence

import rospy
import yaml

from rosclingo import strict_yaml
from rosclingo.errors import ParameterError, TermError
from rosclingo.solver.terms import parse_term
from rosclingo.solver.threads import read_threads

NOTHING = r"(?!)"
"""A regular expression that matches nothing."""


def number(
    name: str, default: float, most: float = math.inf, *, least: float = 0.0, what: str = "a number"
) -> float:
    """Returns a finite number.

    Args:
        name: The parameter's name, as of all functions here without ``~``.
        default: What it is if it is not set, or an empty text, as launch files have it.
        most: The largest number that it may be.
        least: The smallest one.
        what: What it is, for the error.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, default)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (is_number and least <= value <= most and math.isfinite(value)):
        first = f" from {least:.15g}" if least > -math.inf else ""
        last = f" to {most:.15g}" if most < math.inf else ""
        raise wrong(name, f"expected {what}{first}{last}: {value}")
    return float(value)


def positive(name: str, default: float, most: float = math.inf) -> float:
    """Returns a number greater than 0.

    Raises:
        ParameterError: It is something else.
    """
    value = number(name, default, most)
    if value == 0:
        raise wrong(name, f"expected a number greater than 0: {value:g}")
    return value


def integer(name: str, default: int, most: float = math.inf, *, least: int = 0) -> int:
    """Returns an integer, by default from 0 on.

    Raises:
        ParameterError: It is something else.
    """
    value = number(name, default, most, least=least, what="an integer")
    if not value.is_integer():
        raise wrong(name, f"expected an integer: {value}")
    return int(value)


def threads() -> int:
    """Returns the number of threads of a solver, ``~threads``.

    Raises:
        ParameterError: It is something else.
    """
    try:
        return read_threads(_get("threads", 1))
    except ValueError as err:
        raise wrong("threads", err) from err


def flag(name: str, default: bool) -> bool:
    """Reads a Boolean parameter.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, default)
    if not isinstance(value, bool):
        raise wrong(name, f"expected true or false: {value}")
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
        raise wrong(name, f"expected a regular expression: {value}: {err}") from err


def text(name: str, default: Optional[str] = None) -> str:
    """Returns a text, which has to be there if it has no default.

    Raises:
        ParameterError: It is not, or is something else.
    """
    value = _get(name, default)
    if not isinstance(value, str):
        raise wrong(name, f"expected a text: {'there is none' if value is None else value}")
    return value


def words(name: str, default: Sequence[str] = (), separator: Optional[str] = None) -> List[str]:
    """Returns a list of words, or those of a text with separators, by default blanks.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, list(default))
    if isinstance(value, str):
        value = value.split(separator)
    if not isinstance(value, list) or not all(isinstance(word, str) for word in value):
        raise wrong(name, f"expected a list of words: {value}")
    return value


def mapping(name: str) -> Dict[str, Any]:
    """Returns a mapping of texts, or that of a text in YAML; by default an empty one.

    Raises:
        ParameterError: It is something else.
    """
    value = _get(name, {})
    try:
        value = strict_yaml.load(value) if isinstance(value, str) else value
    except yaml.YAMLError as err:
        raise wrong(name, f"expected a mapping in YAML: {err}") from err
    value = {} if value is None else value
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise wrong(name, f"expected a mapping, such as {{'go(*)': {{...}}}}: {value!r:.200}")
    return value


def terms(name: str, default: Sequence[str] = ()) -> List[str]:
    """Returns a list of terms.

    Raises:
        ParameterError: It is something else.
    """
    try:
        return [str(parse_term(word)) for word in words(name, default)]
    except TermError as err:
        raise wrong(name, f"expected a list of terms: {err}") from err


def wrong(name: str, reason: object) -> ParameterError:
    """Returns the error that says why a parameter is wrong."""
    return ParameterError(f"parameter {rospy.resolve_name(f'~{name}')}: {reason}")


def _get(name: str, default: Any) -> Any:
    value = rospy.get_param(f"~{name}", None)
    if value is None or value == "":
        return default
    if value != default:
        # A parameter of the command line outlives the node: the next of the same name has it too.
        rospy.loginfo("parameter %s is %s", rospy.resolve_name(f"~{name}"), value)
    return value
