"""Reads lists of names with their types."""

from __future__ import annotations

from typing import Dict, List, Sequence

from rosclingo.errors import shorten
from rosoclingo.pddl.expressions import PddlError, Word
from rosoclingo.pddl.support import PddlPart

OBJECT = "object"
"""The type of all."""


def typed_list(parts: Sequence[PddlPart], *, may_repeat: bool = False) -> Dict[str, str]:
    """Reads names with their types, such as ``a b - place c - robot``.

    Args:
        parts: Them.
        may_repeat: Whether a name may be there twice, as a kind of ``object`` and of something
            else, as types of competitions are; it is a kind of that.
    """
    types: Dict[str, str] = {}
    waiting: List[Word] = []
    words = iter(parts)
    for part in words:
        if not isinstance(part, Word):
            raise PddlError(f"{part.place}: a name is expected instead of {shorten(part.text)}")
        if part.text != "-":
            waiting.append(part)
            continue
        kind = next(words, part)
        if not isinstance(kind, Word) or kind is part:
            raise PddlError(f"{kind.place}: the name of one type is expected after -")
        _add(types, waiting, kind.text, may_repeat=may_repeat)
        waiting = []
    _add(types, waiting, OBJECT, may_repeat=may_repeat)
    return types


def _add(types: Dict[str, str], names: Sequence[Word], kind: str, *, may_repeat: bool) -> None:
    for name in names:
        before = types.get(name.text, OBJECT)
        if name.text in types and not (may_repeat and OBJECT in (before, kind)):
            raise PddlError(f"{name.place}: {shorten(name.text)} is there twice")
        types[name.text] = before if kind == OBJECT else kind
