"""Ground terms as text, in the form in which clingo prints them, taken apart without clingo.

clingo prints a term always in the same way, so that equal texts mean equal terms. What a user has
written is brought into that form by :func:`rosclingo.solver.terms.parse_term`.

Everything here takes any text, and is thread-safe. What is no term is read as far as it goes.

>>> split_term("do(robot,go(c3,1),12)")
('do', ['robot', 'go(c3,1)', '12'])
>>> last_number("query(12)")
12
"""

from __future__ import annotations

import re
from typing import List, Optional, Tuple

_NAME = r"(?:(?!not(?![\w']))_*[a-z][\w']*)"
_FLAT = rf"(?:{_NAME}|0|[1-9][0-9]{{0,8}})"
_FLAT_TERM = re.compile(_FLAT, re.ASCII)
_FLAT_CALL = re.compile(rf"(?<![\w'])(?![0-9]){_FLAT}\({_FLAT}(?:,{_FLAT})*\)(?![\w'(])", re.ASCII)
_CALL = re.compile(rf"(-?{_NAME})?(?:\((.*)\))?", re.ASCII | re.DOTALL)
_MARK = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\\?\Z)|[(),]', re.DOTALL)
_NUMBER = re.compile(r"-?[0-9]{1,10}")  # clingo's have no more digits
_LAST_NUMBER = re.compile(rf"[,(]({_NUMBER.pattern})\)\Z")


def is_plain(text: str) -> bool:
    """Returns whether a text is a ground term as clingo prints it, of names and numbers only.

    clingo keeps each term for as long as the process lives, so it does not get to see such terms of
    strangers.

    Args:
        text: The text. One that is longer than 1000 characters, or nests deeper than 10 levels, is
            not plain.
    """
    for _ in range(10 if len(text) <= 1000 else 0):
        if _FLAT_TERM.fullmatch(text):
            return True
        text = _FLAT_CALL.sub("x", text)
    return False


def split_term(text: str) -> Tuple[str, List[str]]:
    """Returns the name and the arguments of a term.

    Returns:
        The name with the sign of ``-name``; none for what has none, such as a tuple or a number. No
        arguments for a constant.
    """
    match = _CALL.fullmatch(text)
    if match is None:
        return "", []
    arguments = split_list(match[2] or "")
    if not match[1] and len(arguments) == 2 and not arguments[1]:  # (1,)
        del arguments[1]
    return match[1] or "", arguments


def split_list(text: str) -> List[str]:
    """Returns the terms of a list with commas between them, such as ``go(c3,fast), 1``."""
    parts, begin, depth = [], 0, 0
    for mark in _MARK.finditer(text):
        kind = text[mark.start()]
        if kind == "(":
            depth += 1
        elif kind == ")":
            depth -= 1
        elif kind == "," and not depth:
            parts.append(text[begin : mark.start()].strip())
            begin = mark.end()
    rest = text[begin:].strip()
    return [*parts, rest] if parts or rest else []


def number(text: str) -> Optional[int]:
    """Returns a number's value, or None for any other term."""
    return int(text) if _NUMBER.fullmatch(text) else None


def last_number(atom: str) -> Optional[int]:
    """Returns the last argument of an atom if it is a number, such as a step."""
    match = _LAST_NUMBER.search(atom)
    return int(match[1]) if match else None


def compact(text: str) -> str:
    """Returns a term without spaces, which compares it with one that clingo prints."""
    return "".join(text.split())
