"""Conditions of observers on fields: range, pattern, equality, value, covariance, silence.

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

import clingo

from rosclingo.wire.term_text import is_plain, number
from rosoclingo_interfaces.errors import EntryError, ReadingError
from rosoclingo_interfaces.observation.fields import FieldPath, Slots

Reading = Optional[str]
"""None if a condition does not hold; else a waypoint, a value, or an empty text for others."""

HOLDS: Reading = ""
"""The reading of a condition that holds, and names no waypoint."""

LONGEST_TEXT = 10_000
"""Longer texts are not searched: a pattern could take for ever."""

_LONGEST_VALUE = 1_000  # characters of a text that is told
_MOST = 2**31 - 1  # the greatest integer of clingo's

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
class ValueCondition:
    """Holds always, and reads a value as a term: an integer, ``true`` or ``false``, or a text.

    A text is read as a name or a term such as ``box(3)`` if it is one, else as a string in quotes.

    >>> from types import SimpleNamespace
    >>> percent = ValueCondition(FieldPath.parse("percentage"), 100.0, 5, is_number=True)
    >>> percent.read(SimpleNamespace(percentage=0.33), None)
    '35'

    Attributes:
        field: The value.
        times: A number's factor.
        step: A number is rounded to a multiple of this.
        hysteresis: How much beyond the middle between two such multiples another one is read.
        is_number: Whether the field has to be a number.
    """

    field: FieldPath
    times: float = 1.0
    step: int = 1
    hysteresis: float = 0.0
    is_number: bool = False

    def check(self, message: str, slots: Slots) -> None:
        """Checks that a type of messages has such a field.

        Raises:
            EntryError: It has not.
        """
        kinds = _NUMBERS if self.is_number else _NUMBERS | {"bool", "string"}
        what = "a number" if self.is_number else "a number, a truth value or a text"
        _expect(self.field, message, slots, kinds, what)

    def read(self, message: Any, before: Reading) -> Reading:
        """Returns the value's term.

        Raises:
            ReadingError: There is no value, or it makes no term.
        """
        values = self.field.values(message)
        if len(values) != 1:
            raise ReadingError(f"{self.field.text} has {len(values)} values, and not one")
        (value,) = values
        if isinstance(value, bool):
            return "true" if value else "false"
        if isinstance(value, str):
            if len(value) > _LONGEST_VALUE:
                raise ReadingError(f"{self.field.text} has more than {_LONGEST_VALUE} characters")
            return value if is_plain(value) else str(clingo.String(value))
        scaled = float(value) * self.times
        if not abs(scaled) <= _MOST - self.step:  # nor NaN
            raise ReadingError(f"{self.field.text} is {value}, which makes no integer of clingo's")
        told = None if before is None else number(before)
        if told is not None and abs(scaled - told) <= self.step / 2 + self.hysteresis:
            return before
        return str(round(scaled / self.step) * self.step)


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
