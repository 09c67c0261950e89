"""Incremental snapshots: splits a snapshot into rows, and finds those that have changed.

A row is a field, or an element of a set or of a dictionary:

>>> @dataclasses.dataclass
... class Place:
...     name: str
...     ways: Dict[str, int]
>>> place, rows = Place("hall", {"door": 1}), ChangedRows(Place)
>>> rows.changes(place)
[RowChange(field='name', key='', value='"hall"'), RowChange(field='ways', key='"door"', value='1')]
>>> place.ways["stairs"] = 2
>>> rows.changes(place)
[RowChange(field='ways', key='"stairs"', value='2')]
"""

from __future__ import annotations

import dataclasses
import functools
import json
from collections import deque
from operator import attrgetter
from typing import (
    Any,
    Dict,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Tuple,
    Union,
    get_args,
    get_origin,
)  # fmt: skip

from rosoclingo.loop.values.snapshot import plain, remade, type_hints

_NOTHING = object()
_ENCODER = json.JSONEncoder(separators=(",", ":"))


class RowChange(NamedTuple):
    """A changed row.

    Attributes:
        field: The field, with the names of those that it is in: ``state.progress.step``.
        key: For an element of a set or dictionary, the element or its key; else empty.
        value: What the row holds now; None if it is gone.
    """

    field: str
    key: str
    value: Optional[str]


class _Leaf:
    """A leaf of the snapshot's tree of fields, which is saved as one row or as several.

    Attributes:
        path: The attributes that lead there.
        name: The same as a text.
        kind: ``set``, ``dict`` or ``value``; ``parts`` for a value in which something may change.
        grows: Whether it is a set of which nothing is ever removed.
        of: Returns the field of a snapshot.
    """

    def __init__(self, path: Tuple[str, ...], kind: str, *, grows: bool = False) -> None:
        self.path = path
        self.name = ".".join(path)
        self.kind = kind
        self.grows = grows
        self.of = attrgetter(self.name)


class ChangedRows:
    """Finds the rows of a snapshot that differ from the written ones. Not thread-safe."""

    def __init__(self, kind: type) -> None:
        """Begins with no row written.

        Args:
            kind: The snapshot's class, a dataclass.
        """
        self._leaves = _leaves(kind)
        self._old: Dict[str, Any] = {}  # copies
        self._sources: Dict[str, Any] = {}  # of what they are copies

    def changes(self, snapshot: Any) -> List[RowChange]:
        """Returns the changes since the last call, which are to be written now."""
        found: List[RowChange] = []
        for leaf in self._leaves:
            value, old = leaf.of(snapshot), self._old.get(leaf.name, _NOTHING)
            if leaf.kind == "parts":
                value = _text(value)
            if leaf.grows and self._sources.get(leaf.name) is value and len(value) == len(old):
                continue  # there may be a million
            if value == old and (leaf.kind != "dict" or list(value) == list(old)):
                continue
            self._sources[leaf.name] = value
            found += _differences(leaf, value, old)
            is_collection = isinstance(value, (set, dict, list, deque))
            self._old[leaf.name] = value.copy() if is_collection else value
        return found


def read(kind: type, rows: Mapping[Tuple[str, str], str]) -> Any:
    """Builds a snapshot from its rows.

    Args:
        kind: The snapshot's class.
        rows: The values by field and key, in the order in which the rows were added.

    Raises:
        ValueError: They are not those of such a snapshot; the message says where they differ.
    """
    by_field: Dict[str, Dict[str, str]] = {}
    for (field, key), value in rows.items():
        by_field.setdefault(field, {})[key] = value
    root: Dict[str, Any] = {}
    for leaf in _leaves(kind):
        owner = root
        for name in leaf.path[:-1]:
            owner = owner.setdefault(name, {})
        held = by_field.pop(leaf.name, {})
        if leaf.kind == "set":
            owner[leaf.path[-1]] = [json.loads(key) for key in held]
        elif leaf.kind == "dict":
            owner[leaf.path[-1]] = [[json.loads(k), json.loads(v)] for k, v in held.items()]
        elif list(held) != [""]:
            raise ValueError(f"there is no {leaf.name}")
        else:
            owner[leaf.path[-1]] = json.loads(held[""])
    if by_field:
        raise ValueError(f"{', '.join(by_field)} is not known")
    return remade(kind, root)


@functools.lru_cache(maxsize=None)
def _leaves(kind: Any, path: Tuple[str, ...] = ()) -> Tuple[_Leaf, ...]:
    found: List[_Leaf] = []
    for name, hint in type_hints(kind).items():
        here = (*path, name)
        if isinstance(hint, type) and dataclasses.is_dataclass(hint):
            found += _leaves(hint, here)
        elif get_origin(hint) in (set, dict) and not any(map(_may_change, get_args(hint))):
            grows = getattr(kind, "ONLY_GROWS", False)
            found.append(_Leaf(here, get_origin(hint).__name__, grows=grows))
        else:
            is_fixed = not any(map(_may_change, get_args(hint)))
            found.append(_Leaf(here, "value" if is_fixed else "parts"))
    return tuple(found)


def _may_change(hint: Any) -> bool:
    """Whether a type is mutable, or has mutable parts."""
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        frozen: bool = hint.__dataclass_params__.frozen  # type: ignore[attr-defined]
        return not frozen
    if get_origin(hint) in (tuple, Union):
        return any(map(_may_change, get_args(hint)))
    return get_origin(hint) is not None


def _differences(leaf: _Leaf, value: Any, old: Any) -> Iterator[RowChange]:
    if leaf.kind == "parts":
        yield RowChange(leaf.name, "", value)
    elif leaf.kind == "value":
        yield RowChange(leaf.name, "", _text(value))
    elif leaf.kind == "set":
        old = set() if old is _NOTHING else old
        yield from (RowChange(leaf.name, key, None) for key in sorted(map(_text, old - value)))
        yield from (RowChange(leaf.name, key, "") for key in sorted(map(_text, value - old)))
    else:
        old = {} if old is _NOTHING else old
        kept = [key for key in old if key in value]
        same = set(kept if list(value)[: len(kept)] == kept else ())  # else in another order
        yield from (RowChange(leaf.name, _text(key), None) for key in old if key not in same)
        for key, of in value.items():
            if key not in same or old[key] != of:
                yield RowChange(leaf.name, _text(key), _text(of))


def _text(value: Any) -> str:
    return _ENCODER.encode(plain(value))
