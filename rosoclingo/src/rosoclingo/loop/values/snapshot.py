"""Snapshots as text: dataclasses of texts, numbers, enums, collections and one another.

The saved state of each part of the loop is a dataclass from which the part is restored:
the part itself, or a base class of it.

>>> @dataclasses.dataclass
... class Point:
...     x: int
...     names: Tuple[str, ...]
>>> encode(Point(1, ("a", "b")))
'{"x": 1, "names": ["a", "b"]}'
>>> decode(Point, encode(Point(1, ("a", "b"))))
Point(x=1, names=('a', 'b'))
"""

from __future__ import annotations

import dataclasses
import enum
import functools
import json
import sys
from collections import deque
from typing import (
    Any,
    Dict,
    Optional,
    Tuple,
    Type,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

T = TypeVar("T")

_ATOMS = frozenset((str, int, float, bool, type(None)))


def encode(snapshot: Any) -> str:
    """Returns a snapshot as JSON."""
    return json.dumps(plain(snapshot))


def take_over(part: Any, saved: Any) -> None:
    """Restores the saved attributes of a part.

    Args:
        part: The part.
        saved: An instance of its dataclass, which is not used again.
    """
    for field in dataclasses.fields(saved):
        setattr(part, field.name, getattr(saved, field.name))


def plain(value: Any) -> Any:
    """Converts a value for JSON: a dictionary to a list of its items, a set to a sorted list."""
    kind: Any = type(value)
    if kind in _ATOMS:
        return value
    names = _names(kind)
    if names is not None:
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, dict):
        return [[plain(key), plain(of)] for key, of in value.items()]
    if isinstance(value, set):
        return sorted(map(plain, value), key=str)
    if isinstance(value, (deque, list, tuple)):
        return list(map(plain, value))
    return value.value if isinstance(value, enum.Enum) else value


@functools.lru_cache(maxsize=None)
def type_hints(kind: Any) -> Dict[str, Any]:
    """Returns the types of a dataclass's fields by name, in their order; not to be changed."""
    hints = get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


@functools.lru_cache(maxsize=None)
def _names(kind: Any) -> Optional[Tuple[str, ...]]:
    """Returns the names of a dataclass's fields; None for another type."""
    if not dataclasses.is_dataclass(kind):
        return None
    return tuple(field.name for field in dataclasses.fields(kind))


def decode(kind: Type[T], text: str) -> T:
    """Returns the snapshot of which :func:`encode` has made a text.

    Args:
        kind: The snapshot's class.
        text: The text.

    Raises:
        ValueError: The text is not one of such a snapshot; the message says where it differs.
    """
    return remade(kind, json.loads(text))


def remade(kind: Type[T], value: Any) -> T:
    """Returns the snapshot of which :func:`plain` has made a value.

    Raises:
        ValueError: The value is not one of such a snapshot; the message says where it differs.
    """
    made: T = _decode(kind, value, getattr(kind, "__name__", "value"))
    return made


def _decode(kind: Any, value: Any, place: str) -> Any:
    """Converts a value of JSON back to one of a type."""
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = type_hints(kind)
        if not isinstance(value, dict) or sorted(value) != sorted(hints):
            raise ValueError(f"{place}: expected {', '.join(hints)}: {value!r:.200}")
        return kind(
            **{name: _decode(hint, value[name], f"{place}.{name}") for name, hint in hints.items()}
        )
    origin, arguments = get_origin(kind), list(get_args(kind))
    if origin is Union:  # Optional
        return None if value is None else _decode(arguments[0], value, place)
    if origin is not None:
        if not isinstance(value, list):
            raise ValueError(f"{place}: expected a list: {value!r:.200}")
        if origin is dict:
            arguments = [Tuple[tuple(arguments)]]
        is_pair = origin is tuple and arguments[1:] != [...]
        kinds = arguments if is_pair else arguments[:1] * len(value)
        if len(kinds) != len(value):
            raise ValueError(f"{place}: expected {len(kinds)} values: {value!r:.200}")
        return origin(_decode(k, v, f"{place}[{i}]") for i, (k, v) in enumerate(zip(kinds, value)))
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return kind(value)
    is_whole = kind is float and type(value) is int and abs(value) <= sys.float_info.max
    if type(value) is not kind and not is_whole:
        raise ValueError(f"{place}: expected {kind.__name__}: {value!r:.200}")
    return value
