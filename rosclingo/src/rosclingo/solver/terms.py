"""Parses any text to ground terms, by clingo; :mod:`rosclingo.wire.term_text` takes them apart.

>>> str(parse_term("go( room(2+1) )"))
'go(room(3))'
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Optional

import clingo

from rosclingo.errors import TermError, shorten
from rosclingo.solver.arithmetic import LARGEST, find_overflow
from rosclingo.solver.lexical import MAX_NESTING, STRING, too_deep

_OPERATION = re.compile(STRING + r"|(?P<operator>[-+*/\\&?^~|])")
_NOTABLE = re.compile(
    STRING + r"|(?<![\w'])(?P<number>0x[0-9A-Fa-f]+|0o[0-7]+|0b[01]+|[0-9]+)"
    # A division that cannot go wrong; its divisor is then looked at as any number.
    r"|[/\\]\s*(?=[1-9][0-9]*(?![0-9]|\s*\*\*))"
    r"|(?P<division>[/\\])"
    r"|(?P<keyword>(?<![\w'])not(?![\w']))"
    r'|(?P<stray>["%])'  # a quote that begins no string, or a comment
)


def parse_term(text: str) -> clingo.Symbol:
    """Parses one ground term, such as ``event(commit,do(arm,pickup(4)),1)``.

    Args:
        text: The term in clingo's syntax.

    Returns:
        The term; arithmetic in it is evaluated.

    Raises:
        TermError: The text is not exactly one ground term, has a number outside of clingo's 32
            bits or arithmetic that leaves them, or nests too deeply.

    Thread-safe.
    """
    return _parse(text) if len(text) > 1000 else _parse_short(text)


def quote(text: str) -> str:
    """Returns a text in quotes for a message: one line, control characters escaped, shortened."""
    if len(text) > 200:
        return f"{text[:150]!r}... ({len(text)} characters)"
    return repr(text)


def _parse(text: str) -> clingo.Symbol:
    problem = _problem(text)
    if problem is not None:
        raise TermError(f"{quote(text)} is not a ground term: {problem}")
    overflow = None
    try:
        term = clingo.parse_term(text)
        if any(match["operator"] for match in _OPERATION.finditer(text)):
            overflow = find_overflow(text)
    except UnicodeDecodeError as err:
        # clingo quotes a single byte of the character that it stumbled over.
        raise TermError(
            f"{quote(text)} is not a ground term: only strings in double quotes may hold characters"
            " other than ASCII"
        ) from err
    except RuntimeError as err:
        raise TermError(f"{quote(text)} is not a ground term: {_reason(str(err))}") from err
    if overflow is not None:
        raise TermError(f"{quote(text)} is not a ground term: arithmetic overflow: {overflow}")
    return term


_parse_short = lru_cache(maxsize=4096)(_parse)


def _problem(text: str) -> Optional[str]:
    if not text.strip():
        return "it is empty"
    if "\0" in text:
        return "it holds a NUL character"
    try:
        text.encode()
    except UnicodeEncodeError:
        return "it is not valid Unicode"
    for match in _NOTABLE.finditer(text):
        number = match["number"]
        if number and (len(number) > 40 or _value(number) > LARGEST):
            return f"a number in it is larger than {LARGEST}"
        if match["division"]:
            # clingo ends the process when it divides by zero here, or -2147483648 by -1.
            return "it holds a division by something else than a positive number"
        if match["keyword"]:
            return "not is no name: no program could hold it"  # though clingo parses it here
        if match["stray"]:
            # Without a look at the rest: clingo looks for a string's end behind every quote.
            return f"unexpected token: {match['stray']}"
    if too_deep(text):
        return f"it nests deeper than {MAX_NESTING} levels"
    return None


def _value(number: str) -> int:
    return int(number, 0) if number[1:2] in ("x", "o", "b") else int(number)


def _reason(message: str) -> str:
    """Takes the reason out of clingo's message, which begins like ``<string>:1:4: error:``.

    The column is left out: clingo counts it wrongly while it parses a term.
    """
    match = re.match(r"<string>:\d+:\d+: error: (.*)", message, re.DOTALL)
    if not match:
        return "it holds an operation that is not defined"
    reason = " ".join(match[1].split())
    variable = re.fullmatch(r"unexpected token: (_*[A-Z]\w*|[A-Z_])", reason)
    if variable:
        return f"{shorten(variable[1])} begins a variable"
    return reason
