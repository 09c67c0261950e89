"""Types: lists of names with types, ``(either ...)``, and subtypes."""

from __future__ import annotations

import itertools
from typing import Dict, Iterator, List, Mapping, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word, list_form
from rosoclingo.tools.pddl.support import PddlPart

OBJECT = "object"
"""The supertype of all types."""


def kinds_of(kind: str, supertypes: Mapping[str, str]) -> List[str]:
    """Returns a type and all types above it, of which the last one is ``object``."""
    found: List[str] = []
    while kind not in found:
        found.append(kind)
        kind = supertypes.get(kind, OBJECT)
    return found if OBJECT in found else [*found, OBJECT]


def typed_list(parts: Sequence[PddlPart], *, may_repeat: bool = False) -> Dict[str, str]:
    """Reads names with their types, such as ``a b - place c - robot``.

    Args:
        parts: The names, hyphens and types.
        may_repeat: Whether a name may have two types of which one is ``object``, as in domains of
            competitions; then the other one counts.
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


def either(form: ListForm) -> Tuple[str, ...]:
    """Returns the types of ``(either ...)``.

    Raises:
        PddlError: The form is something else.
    """
    if form.head != "either" or len(form.parts) < 2:
        raise PddlError(f"{form.place}: {shorten(form.text)} is not understood: there can be a "
                        "type, or (either TYPE...)")  # fmt: skip
    return tuple(part.text for part in form.parts[1:])


def one_type_each(variables: ListForm) -> Iterator[ListForm]:
    """Yields lists of variables that have one type each, one for each choice of types."""
    choices = [
        either(part) if isinstance(part, ListForm) else (part.text,) for part in variables.parts
    ]
    for chosen in itertools.product(*choices):
        yield list_form(variables.place, *chosen)
