"""Paths of fields in messages, such as ``pose.pose.position.x`` and ``ranges[*]``. Needs no ROS.

>>> from types import SimpleNamespace
>>> scan = SimpleNamespace(ranges=(1.5, 2.5))
>>> FieldPath.parse("ranges[*]").values(scan)
[1.5, 2.5]
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Callable, List, Mapping, Optional, Tuple

from rosclingo.solver.terms import quote
from rosoclingo_interfaces.errors import EntryError, ReadingError

Slots = Callable[[str], Optional[Mapping[str, str]]]
"""Returns the fields of a message's type with their types; None if it is no such type."""

_STEP = re.compile(r"([A-Za-z]\w*)(?:\[(\*|\d{1,9})\])?")
_ARRAY = re.compile(r"(.*)\[(\d*)\]")


@dataclass(frozen=True)
class FieldPath:
    """The path from a message to one of its fields, or to all entries of a list in it.

    Attributes:
        text: As the user has written it; empty for the message itself.
        steps: Names of fields; with each the index of an entry, ``*`` for all, or None.
    """

    text: str
    steps: Tuple[Tuple[str, Optional[str]], ...]

    @classmethod
    def parse(cls, text: str) -> FieldPath:
        """Parses a path.

        Raises:
            EntryError: It is none.
        """
        steps = []
        for part in text.split(".") if text else ():
            match = _STEP.fullmatch(part)
            if match is None:
                raise EntryError(
                    "field: expected names such as pose.pose.position.x or ranges[*], not "
                    f"{quote(text)}"
                )
            steps.append((match[1], match[2]))
        return cls(text, tuple(steps))

    def kind(self, message: str, slots: Slots) -> str:
        """Returns the type of the field, such as ``float32`` or ``float64[36]``.

        Args:
            message: The message's type, such as ``sensor_msgs/LaserScan``.
            slots: Looks types up.

        Raises:
            EntryError: There is no such field; the message names those that there are.
        """
        kind = message
        for name, index in self.steps:
            fields = slots(kind)
            if fields is None:
                raise EntryError(f"field: {self.text}: {kind} has no fields, such as {name}")
            if name not in fields:
                known = ", ".join(fields) or "none"
                raise EntryError(
                    f"field: {self.text}: {kind} has no field {name}; there are: {known}"
                )
            kind = fields[name]
            array = _ARRAY.fullmatch(kind)
            if index is not None:
                if array is None:
                    raise EntryError(f"field: {self.text}: {name} is no list, but {kind}")
                if array[2] and index != "*" and int(index) >= int(array[2]):
                    raise EntryError(
                        f"field: {self.text}: {name} has {array[2]} entries, from 0 on"
                    )
                kind = array[1]
        return kind

    def values(self, message: Any) -> List[Any]:
        """Returns the values in a message: one, or those of all entries of lists.

        Raises:
            ReadingError: There is no such entry.
        """
        found = [message]
        for name, index in self.steps:
            found = [getattr(one, name) for one in found]
            if index == "*":
                found = [entry for one in found for entry in one]
            elif index is not None:
                if any(int(index) >= len(one) for one in found):
                    raise ReadingError(f"{name} has no entry {index}")
                found = [one[int(index)] for one in found]
        return found

    @property
    def has_lists(self) -> bool:
        """True if the values are those of all entries of a list."""
        return any(index == "*" for _, index in self.steps)
