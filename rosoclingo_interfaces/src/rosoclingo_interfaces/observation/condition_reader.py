"""Reads conditions on a field from entries of YAML files. Needs no ROS."""

from __future__ import annotations

import math
import re
from typing import Callable, Mapping, Union

import numpy as np

from rosclingo.solver.terms import quote
from rosoclingo_interfaces.errors import EntryError
from rosoclingo_interfaces.observation.conditions import (
    EqualsCondition,
    PatternCondition,
    RangeCondition,
)
from rosoclingo_interfaces.observation.fields import FieldPath
from rosoclingo_interfaces.observation.yaml_entry import YamlEntry

FieldCondition = Union[RangeCondition, PatternCondition, EqualsCondition]
"""A condition on the value of a field."""


def read_field(entry: YamlEntry, default: str, key: str = "field") -> FieldPath:
    """Returns the path of an entry's field.

    Args:
        entry: The entry.
        default: The path if the key is not there.
        key: The key.

    Raises:
        EntryError: It is no path.
    """
    try:
        return FieldPath.parse(entry.text(key, default))
    except EntryError as err:
        raise entry.wrong(err, key) from err


def _read_range(entry: YamlEntry) -> RangeCondition:
    inner = entry.inner("range")
    inner.check_keys(("below", "above", "from", "to", "hysteresis"))
    given = {key for key in ("below", "above", "from", "to") if key in inner}
    if given not in ({"below"}, {"above"}, {"from", "to"}):
        raise inner.wrong("range: expected below, or above, or from and to")
    low, high = inner.number("from", -math.inf), inner.number("to", math.inf)
    # A bound itself is outside, as the words say it.
    if "above" in inner:
        low = float(np.nextafter(inner.number("above"), math.inf))
    if "below" in inner:
        high = float(np.nextafter(inner.number("below"), -math.inf))
    if low > high:
        raise inner.wrong("range: from is greater than to", "from")
    hysteresis = inner.number("hysteresis", unit="the field's unit")
    return RangeCondition(read_field(entry, "data"), low, high, hysteresis)


def _read_pattern(entry: YamlEntry) -> PatternCondition:
    text = entry.text("pattern")
    try:
        return PatternCondition(read_field(entry, "data"), re.compile(text))
    except re.error as err:
        raise entry.wrong(
            f"pattern: expected a regular expression: {quote(text)}: {err}", "pattern"
        ) from err


def _read_equals(entry: YamlEntry) -> EqualsCondition:
    return EqualsCondition(read_field(entry, "data"), entry.scalar("equals"))


FIELD_CONDITIONS: Mapping[str, Callable[[YamlEntry], FieldCondition]] = {
    "range": _read_range,
    "pattern": _read_pattern,
    "equals": _read_equals,
}
"""By keys: reads the condition of an entry that has the key, on its ``field``.

Each raises an :class:`.EntryError` if it is wrong.
"""
