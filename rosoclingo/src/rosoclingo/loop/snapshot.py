"""Snapshots as text: frozen dataclasses of texts, numbers, enums, tuples and one another.

>>> @dataclasses.dataclass(frozen=True)
... class Point:
...     x: int
...     name: str = ""
>>> encode(Point(1, "a"))
'{"x": 1, "name": "a"}'
>>> decode(Point, encode(Point(1, "a")))
Point(x=1, name='a')
"""

from __future__ import annotations

import dataclasses
import enum
import json
from typing import Any, Type, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")


def encode(snapshot: Any) -> str:
    """Returns a snapshot as JSON."""
    return json.dumps(dataclasses.asdict(snapshot), default=lambda member: member.value)


def decode(kind: Type[T], text: str) -> T:
    """Returns the snapshot of which :func:`encode` has made a text.

    Args:
        kind: The snapshot's class.
        text: The text.

    Raises:
        ValueError: The text is not one of such a snapshot; the message says where it differs.
    """
    made: T = _decode(kind, json.loads(text), kind.__name__)
    return made


def _decode(kind: Any, value: Any, place: str) -> Any:
    """Returns a value of a type, made of what JSON has made of it."""
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        names = [field.name for field in dataclasses.fields(kind)]
        if not isinstance(value, dict) or sorted(value) != sorted(names):
            raise ValueError(f"{place}: expected {', '.join(names)}: {value!r:.200}")
        return kind(
            **{name: _decode(hints[name], value[name], f"{place}.{name}") for name in names}
        )
    origin, arguments = get_origin(kind), list(get_args(kind))
    if origin is Union:  # Optional
        return None if value is None else _decode(arguments[0], value, place)
    if origin is tuple:
        if not isinstance(value, list):
            raise ValueError(f"{place}: expected a list: {value!r:.200}")
        kinds = arguments[:1] * len(value) if arguments[1:] == [...] else arguments
        if len(kinds) != len(value):
            raise ValueError(f"{place}: expected {len(kinds)} values: {value!r:.200}")
        return tuple(_decode(k, v, f"{place}[{i}]") for i, (k, v) in enumerate(zip(kinds, value)))
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return kind(value)
    if type(value) is not kind and not (kind is float and type(value) is int):
        raise ValueError(f"{place}: expected {kind.__name__}: {value!r:.200}")
    return value
