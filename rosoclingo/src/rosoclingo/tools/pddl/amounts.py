"""Amounts in PDDL: sums of numbers that actions change and of what is constant.

With ``(distance a b)`` 4 and the changing number ``(battery r)``, the amount
``(- (battery r) (* 2 (distance a b)))`` is the :class:`Linear` form battery - 8. Fractions are
exact, so that 0.1 + 0.2 is 0.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import AbstractSet, Dict, Mapping, Optional, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.domain import ActionSchema, number_of
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word
from rosoclingo.tools.pddl.support import PddlPart

Name = Tuple[str, ...]
"""A function and its objects."""

Binding = Mapping[str, str]
"""The objects of variables."""

LARGEST_NUMBER = 999_999_999
"""The largest number of the library ``actions.lp``."""

_OPERATIONS = ("+", "-", "*", "/")


@dataclass(frozen=True)
class Linear:
    """A sum of numbers with factors, and of a constant."""

    factors: Dict[Name, Fraction]
    constant: Fraction

    def minus(self, other: Linear) -> Linear:
        """Returns the difference."""
        return self.plus(other.times(Fraction(-1)))

    def plus(self, other: Linear) -> Linear:
        """Returns the sum; a number whose factor becomes 0 is not in it."""
        factors = dict(self.factors)
        for name, factor in other.factors.items():
            factors[name] = factors.get(name, Fraction(0)) + factor
        kept = {name: factor for name, factor in factors.items() if factor}
        return Linear(kept, self.constant + other.constant)

    def times(self, factor: Fraction) -> Linear:
        """Returns the product with a constant."""
        factors = {name: own * factor for name, own in self.factors.items() if own * factor}
        return Linear(factors, self.constant * factor)

    def replaced(self, name: Name, by: Linear) -> Linear:
        """Returns the sum with something else in the place of a number."""
        factor = self.factors.get(name)
        if factor is None:
            return self
        rest = {other: own for other, own in self.factors.items() if other != name}
        return Linear(rest, self.constant).plus(by.times(factor))

    def bounds(self, head: str) -> Tuple[Optional[int], Optional[int]]:
        """Returns the least and the largest whole number with which ``(HEAD self 0)`` holds.

        None is no bound. A constant has no bound if the comparison holds, and is empty, with 1 and
        0, if not.
        """
        if not self.factors:
            value = self.constant
            holds = {
                "<": value < 0, "<=": value <= 0, ">=": value >= 0, ">": value > 0, "=": value == 0
            }[head]  # fmt: skip
            return (None, None) if holds else (1, 0)
        (factor,) = self.factors.values()
        border = -self.constant / factor
        if factor < 0:
            head = {"<": ">", "<=": ">=", ">=": "<=", ">": "<", "=": "="}[head]
        least = math.floor(border) + 1 if head == ">" else math.ceil(border)
        most = math.ceil(border) - 1 if head == "<" else math.floor(border)
        return (None if head in ("<", "<=") else least), (None if head in (">", ">=") else most)


class Amounts:
    """Reads amounts."""

    def __init__(self, first: Mapping[Name, float], changing: AbstractSet[str]) -> None:
        """Takes the values of numbers at first, and which functions actions change."""
        self._first = first
        self._changing = changing

    def linear(
        self, part: PddlPart, objects: Binding, schema: Optional[ActionSchema] = None
    ) -> Linear:
        """Returns the amount of an expression.

        Args:
            part: The expression.
            objects: The objects of its variables.
            schema: The action that it is in, which says what ``?duration`` is.

        Raises:
            PddlError: It is no amount, or no sum; the message says where.
        """
        value = number_of(part)
        if value is not None:
            return Linear({}, Fraction(str(value)))
        lasts = schema.duration if schema is not None else None
        if part.text == "?duration" and lasts is not None:
            return Linear({}, self.constant(lasts, objects, schema))
        if isinstance(part, ListForm) and part.head in _OPERATIONS:
            return self._computed(part, objects, schema)
        if isinstance(part, Word):
            raise PddlError(f"{part.place}: {shorten(part.text)} is no amount")
        name = ground(part, objects)
        if part.head in self._changing:
            return Linear({name: Fraction(1)}, Fraction(0))
        if name not in self._first:
            raise PddlError(f"{part.place}: {name_text(name)} has no value in :init")
        return Linear({}, Fraction(str(self._first[name])))

    def constant(
        self, part: PddlPart, objects: Binding, schema: Optional[ActionSchema] = None
    ) -> Fraction:
        """Returns the value of an expression that no action changes.

        Raises:
            PddlError: It is none; the message says where.
        """
        return constant_of(part, self.linear(part, objects, schema))

    def _computed(self, form: ListForm, objects: Binding, schema: Optional[ActionSchema]) -> Linear:
        amounts = [self.linear(each, objects, schema) for each in form.parts[1:]]
        if not amounts or (len(amounts) < 2 and form.head != "-"):
            raise PddlError(f"{form.place}: {shorten(form.text)} is no amount")
        total, *others = amounts
        if not others:
            return total.times(Fraction(-1))
        if len(others) > 1 and form.head in ("-", "/"):
            raise PddlError(f"{form.place}: {shorten(form.text)} is no amount: {form.head} has two "
                            "parts")  # fmt: skip
        for other in others:
            total = _apply(form, total, other)
        return total


def _apply(form: ListForm, left: Linear, right: Linear) -> Linear:
    if form.head == "+":
        return left.plus(right)
    if form.head == "-":
        return left.minus(right)
    if form.head == "*" and not left.factors:
        return right.times(left.constant)
    if right.factors:
        raise PddlError(f"{form.place}: {shorten(form.text)} multiplies or divides by what changes")
    if form.head == "/" and not right.constant:
        raise PddlError(f"{form.place}: {shorten(form.text)} divides by 0")
    return left.times(right.constant if form.head == "*" else 1 / right.constant)


def constant_of(part: PddlPart, amount: Linear) -> Fraction:
    """Returns the value of an expression whose amount is known.

    Raises:
        PddlError: An action changes it.
    """
    if amount.factors:
        raise PddlError(f"{part.place}: {shorten(part.text)} changes, and an amount has to be "
                        "constant")  # fmt: skip
    return amount.constant


def ground(form: ListForm, objects: Binding) -> Name:
    """Returns an atom or a number with objects in the place of variables."""
    return tuple(objects.get(part.text, part.text) for part in form.parts)


def key(text: str) -> Name:
    """Returns a number by its text in ``:init``."""
    return tuple(text.strip("()").split())


def name_text(name: Name) -> str:
    """Returns how a number is written in PDDL."""
    return shorten(f"({' '.join(name)})")


def shown(value: Fraction) -> str:
    """Returns a value as messages show it."""
    try:
        return f"{float(value):g}"
    except OverflowError:
        return "too large"
