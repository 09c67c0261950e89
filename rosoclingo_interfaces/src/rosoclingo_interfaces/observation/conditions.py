"""Conditions of observers on a field's value: range, pattern, equality, covariance, silence.

Needs no ROS. A condition is read at each message, and remembers nothing: it is given what was read
before, by which hysteresis works.

>>> from types import SimpleNamespace
>>> low = RangeCondition(FieldPath.parse("percentage"), high=0.2, hysteresis=0.05)
>>> low.read(SimpleNamespace(percentage=0.15), None), low.read(SimpleNamespace(percentage=0.22), "")
('', '')
>>> print(low.read(SimpleNamespace(percentage=0.3), ""))
None
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Optional, Pattern, Union

from rosoclingo_interfaces.errors import EntryError, ReadingError
from rosoclingo_interfaces.observation.fields import FieldPath, Slots

Reading = Optional[str]
"""None if a condition does not hold; else a waypoint, or an empty text for most conditions."""

HOLDS: Reading = ""
"""The reading of a condition that holds, and names no waypoint."""

LONGEST_TEXT = 10_000
"""Longer texts are not searched: a pattern could take for ever."""

_INTEGERS = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)} | {
    "byte",
    "char",
}
_NUMBERS = _INTEGERS | {"float32", "float64"}
_KINDS = {bool: {"bool"}, int: _INTEGERS, str: {"string"}}
_COVARIANCES = {"float64[36]", "float64[9]"}  # of a pose, of a position


@dataclass(frozen=True)
class RangeCondition:
    """Holds if a number, or any number of a list, is in a range; ends outside of a wider one.

    Attributes:
        field: The number, or the list.
        low: The least number of the range.
        high: The greatest one.
        hysteresis: By how much the range is wider on both sides, when the condition has held.
    """

    field: FieldPath
    low: float = -math.inf
    high: float = math.inf
    hysteresis: float = 0.0

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has such a field.

        Raises:
            EntryError: It has not.
        """
        _expect(self.field, message, slots, _NUMBERS, "a number")

    def read(self, message: Any, before: Reading) -> Reading:
        """Returns whether the condition holds.

        Infinities are numbers in a list only, where laser scanners say by them that nothing is
        there.

        Raises:
            ReadingError: There is no number.
        """
        values = [float(one) for one in self.field.values(message)]
        may_be_infinite = self.field.has_lists
        numbers = [
            one for one in values if math.isfinite(one) or (may_be_infinite and math.isinf(one))
        ]
        if not numbers:
            raise ReadingError(f"{self.field.text} has no number: {values[:3]}")
        more = 0.0 if before is None else self.hysteresis
        inside = any(self.low - more <= one <= self.high + more for one in numbers)
        return HOLDS if inside else None


@dataclass(frozen=True)
class PatternCondition:
    """Holds if a regular expression is found in a text.

    Attributes:
        field: The text.
        pattern: The expression.
    """

    field: FieldPath
    pattern: Pattern[str]

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has such a field.

        Raises:
            EntryError: It has not.
        """
        _expect(self.field, message, slots, _KINDS[str], "a text")

    def read(self, message: Any, _: Reading) -> Reading:
        """Returns whether the condition holds.

        Raises:
            ReadingError: The text is too long.
        """
        texts = self.field.values(message)
        if any(len(text) > LONGEST_TEXT for text in texts):
            raise ReadingError(f"{self.field.text} has more than {LONGEST_TEXT} characters")
        return HOLDS if any(map(self.pattern.search, texts)) else None


@dataclass(frozen=True)
class EqualsCondition:
    """Holds if a truth value, an integer or a text is the same as a given one.

    Attributes:
        field: The compared field.
        value: With what.
    """

    field: FieldPath
    value: Union[bool, int, str]

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has such a field.

        Raises:
            EntryError: It has not.
        """
        name = {bool: "a truth value", int: "an integer", str: "a text"}[type(self.value)]
        _expect(self.field, message, slots, _KINDS[type(self.value)], name)

    def read(self, message: Any, _: Reading) -> Reading:
        """Returns whether the condition holds."""
        return HOLDS if self.value in self.field.values(message) else None


@dataclass(frozen=True)
class CovarianceCondition:
    """Holds if a position is uncertain: its greatest variance in the plane is above a limit.

    Attributes:
        field: The covariance matrix of a pose, or of a position.
        above: The limit, in square metres.
        hysteresis: How far below the limit the condition ends, in square metres.
    """

    field: FieldPath
    above: float
    hysteresis: float = 0.0

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has such a field.

        Raises:
            EntryError: It has not.
        """
        _expect(self.field, message, slots, _COVARIANCES, "a covariance matrix")

    def read(self, message: Any, before: Reading) -> Reading:
        """Returns whether the covariance exceeds the limit.

        Raises:
            ReadingError: The matrix is none.
        """
        (matrix,) = self.field.values(message)
        row = math.isqrt(len(matrix))
        if row * row != len(matrix) or row < 2:
            raise ReadingError(f"{self.field.text} has {len(matrix)} numbers, and is no matrix")
        x, y = float(matrix[0]), float(matrix[row + 1])
        mixed = (float(matrix[1]) + float(matrix[row])) / 2
        # The greater eigenvalue, which is the variance along the longer axis of the ellipse.
        variance = (x + y) / 2 + math.hypot((x - y) / 2, mixed)
        if not math.isfinite(variance) or x < 0 or y < 0:
            raise ReadingError(f"{self.field.text} is no covariance: {x:g}, {y:g}, {mixed:g}")
        limit = self.above if before is None else self.above - self.hysteresis
        return HOLDS if variance > limit else None


@dataclass(frozen=True)
class SilenceCondition:
    """Holds if no message was heard for some time.

    Attributes:
        seconds: The time, of the observer's clock.
    """

    seconds: float

    def check(self, _message: str, _slots: Slots) -> None:
        """Takes any type of messages."""

    def read(self, message: Any, _: Reading) -> Reading:
        """Returns whether the condition holds.

        Args:
            message: For how many seconds nothing has been heard.
            _: Is not used.
        """
        return HOLDS if message >= self.seconds else None


def _expect(field: FieldPath, message: str, slots: Slots, kinds: Any, name: str) -> None:
    kind = field.kind(message, slots)
    if kind not in kinds:
        lists = " (write [*] behind a list for each of its entries)" if "[" in kind else ""
        raise EntryError(
            f"field: {field.text or 'the message'} of {message} is {kind}; {name} is needed{lists}"
        )
