"""Numbers, durations and costs of ground actions, as the library ``actions.lp`` has them.

A number of the library is a whole number from 0 to a limit. All that an action says of it counts:

- conditions compare one number with a constant; of several lower bounds the largest one counts, and
  of several upper bounds the smallest one;
- increases and decreases are added; ``(assign (battery ?r) 100)`` is the only change of its number;
- a decrease has to be there, and an increase has to find room, whatever the conditions are. So an
  action with an increase needs an upper bound, which says how large the number can get.

A bound ``over all`` or ``at end`` is about the number after the action's own beginning. Numbers
that no condition and no goal reads are left out, as no action depends on them; they may be costs.
What compares constants alone, such as ``(>= (capacity ?truck) (weight ?box))``, is decided at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.amounts import (
    LARGEST_NUMBER,
    Amounts,
    Binding,
    Linear,
    Name,
    constant_of,
    ground,
    key,
    name_text,
    shown,
)
from rosoclingo.tools.pddl.domain import ActionSchema, Domain, Problem, number_of
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word
from rosoclingo.tools.pddl.support import PddlPart

_TIME = ("total-time",)

Bounds = Dict[Name, Tuple[int, Optional[int]]]
"""The least and the largest value of numbers; None for no upper bound."""


@dataclass(frozen=True)
class NumericUse:
    """How a ground action depends on numbers and changes them; and its cost.

    Attributes:
        needs: How much there has to be of each number, if it uses less.
        uses: What it takes of each.
        gives: What it adds to each.
        fills: Which ones it makes as large as can be.
        cost: What it costs.
        most: How large each number may be before, if that is less than there is room for.
        sets: Which value it gives to each.
    """

    needs: Dict[Name, int]
    uses: Dict[Name, int]
    gives: Dict[Name, int]
    fills: Tuple[Name, ...]
    cost: int
    most: Dict[Name, int] = field(default_factory=dict)
    sets: Dict[Name, int] = field(default_factory=dict)

    @property
    def changes_something(self) -> bool:
        """Tells whether some number is another one afterwards."""
        return bool(self.uses or self.gives or self.fills or self.sets)


@dataclass
class _Interval:
    """The values that a number may have; no end means that there is no bound."""

    least: int = 0
    most: Optional[int] = None

    def narrow(self, least: Optional[int], most: Optional[int]) -> None:
        if least is not None:
            self.least = max(self.least, least)
        if most is not None:
            self.most = most if self.most is None else min(self.most, most)

    @property
    def is_empty(self) -> bool:
        return self.most is not None and self.most < self.least


@dataclass
class _Change:
    """The effects of a ground action on a number: a difference or a value, with its place."""

    by: Fraction = Fraction(0)
    value: Optional[Fraction] = None
    place: str = ""
    text: str = ""

    def applied(self, number: Name) -> Linear:
        """Returns what the number is after the change, by what it is before."""
        if self.value is not None:
            return Linear({}, self.value)
        return Linear({number: Fraction(1)}, self.by)


@dataclass
class _GroundUse:
    """The conditions and effects of a ground action on numbers."""

    bounds: Dict[Name, _Interval]
    changes: Dict[Name, _Change]

    def names(self) -> Iterator[Name]:
        yield from dict.fromkeys([*self.bounds, *self.changes])


class Numbers:
    """The numbers of a problem."""

    def __init__(self, domain: Domain, problem: Problem, limits: Mapping[str, int]) -> None:
        """Takes a task.

        Args:
            domain: Its domain.
            problem: Its problem.
            limits: For functions, how large their numbers can get.
        """
        self._schemas = {schema.name: schema for schema in domain.actions}
        self._problem = problem
        self._first = {key(text): value for text, value in problem.numbers.items()}
        self._limits = limits
        self._is_timed = any(schema.duration is not None for schema in domain.actions)
        changing = {
            _function(change.parts[1])
            for schema in domain.actions
            for change in (*schema.changes, *schema.later_changes)
        }
        self._amounts = Amounts(self._first, changing)
        self._tests = {test.name: test for test in domain.tests}
        compared = [*problem.comparisons, *(test.comparison for test in domain.tests)]
        for schema in domain.actions:
            compared += [*schema.comparisons, *schema.later_comparisons]
        self._read = {form.head for each in compared for form in each.forms()} & changing
        self.largest: Dict[Name, int] = {}

    def read(
        self, actions: Sequence[Tuple[str, Sequence[str]]], tests: Iterable[Name] = ()
    ) -> List[Optional[NumericUse]]:
        """Returns how ground actions use numbers; from then on, ``largest`` has the limits.

        There is None for an action that is never possible, because of its numbers.

        Args:
            actions: For each its name and its objects.
            tests: The tests of numbers in rules, each by its name and objects.

        Raises:
            PddlError: The library has no such condition or change.
        """
        bound = [(self._schemas[name], binding(self._schemas[name], o)) for name, o in actions]
        found = [self._ground(schema, objects) for schema, objects in bound]
        asked = [bounds or {} for bounds in map(self.tested, tests)]
        self._find_limits([use for use in found if use is not None], asked)
        return [
            None if use is None else self._use(use, self._cost(schema, objects))
            for use, (schema, objects) in zip(found, bound)
        ]

    def first(self, number: Name) -> int:
        """Returns the value that a number has at first."""
        return round(self._first[number])

    def are_within(self, bounds: Bounds) -> bool:
        """Tells whether numbers are within bounds at first."""
        return all(
            least <= self.first(name) and (most is None or self.first(name) <= most)
            for name, (least, most) in bounds.items()
        )

    def goal(self) -> Bounds:
        """Returns the least and the largest value of each number in the goal; None is no bound.

        Raises:
            PddlError: A comparison of the goal is not understood, or never holds.
        """
        bounds: Dict[Name, _Interval] = {}
        for comparison in self._problem.comparisons:
            if not self._narrow(bounds, comparison, {}, {}, None):
                raise PddlError(f"{comparison.place}: {shorten(comparison.text)} in :goal never "
                                "holds, whatever is done")  # fmt: skip
        return {name: (interval.least, interval.most) for name, interval in bounds.items()}

    def tested(self, test: Name) -> Optional[Bounds]:
        """Returns the bounds of numbers in a test of a rule; None if the test never holds.

        Raises:
            PddlError: Its comparison is not understood.
        """
        name, *objects = test
        one = self._tests[name]
        bounds: Dict[Name, _Interval] = {}
        if not self._narrow(bounds, one.comparison, dict(zip(one.types, objects)), {}, None):
            return None
        return {name: (interval.least, interval.most) for name, interval in bounds.items()}

    def _ground(self, schema: ActionSchema, objects: Binding) -> Optional[_GroundUse]:
        begun = self._changes(schema.changes, schema, objects)
        later = self._changes(schema.later_changes, schema, objects)
        bounds: Dict[Name, _Interval] = {}
        for comparison in schema.comparisons:
            if not self._narrow(bounds, comparison, objects, {}, schema):
                return None
        for comparison in schema.later_comparisons:
            if not self._narrow(bounds, comparison, objects, begun, schema):
                return None
        for name, change in later.items():
            before = begun.get(name)
            if before is None:
                begun[name] = change
            elif before.value is not None or change.value is not None or before.by * change.by < 0:
                raise PddlError(
                    f"{change.place}: {schema.name} changes {name_text(name)} at its start and "
                    "back, or again, at its end: this is understood of increases alone, or of "
                    "decreases alone; what is occupied meanwhile has to be a fact"
                )
            else:
                before.by += change.by
        for name, change in begun.items():
            self._check_first(name, change.place)
            self._check_whole(change, schema)
        return _GroundUse(bounds, begun)

    def _narrow(
        self,
        bounds: Dict[Name, _Interval],
        comparison: ListForm,
        objects: Binding,
        begun: Mapping[Name, _Change],
        schema: Optional[ActionSchema],
    ) -> bool:
        """Adds a comparison to the bounds of its number; returns whether it can hold."""
        left, right = (self._amounts.linear(p, objects, schema) for p in comparison.parts[1:])
        difference = left.minus(right)
        for name, change in begun.items():
            difference = difference.replaced(name, change.applied(name))
        if len(difference.factors) > 1:
            raise PddlError(
                f"{comparison.place}: {shorten(comparison.text)} compares "
                f"{' and '.join(map(name_text, difference.factors))}, which both change: there can "
                "be one number and what is constant"
            )
        least, most = difference.bounds(comparison.head)
        if not difference.factors:
            return (least, most) == (None, None)
        (name,) = difference.factors
        self._check_first(name, comparison.place)
        bounds.setdefault(name, _Interval()).narrow(least, most)
        return not bounds[name].is_empty

    def _changes(
        self, forms: Sequence[ListForm], schema: ActionSchema, objects: Binding
    ) -> Dict[Name, _Change]:
        """Returns the changes of numbers that are read, all of one moment."""
        found: Dict[Name, _Change] = {}
        for form in forms:
            target = form.parts[1]
            if _function(target) not in self._read or not isinstance(target, ListForm):
                continue
            name = ground(target, objects)
            amount = self._amounts.linear(form.parts[2], objects, schema)
            by = {"increase": 1, "decrease": -1}.get(form.head)
            if by is None and amount.factors == {name: Fraction(1)}:  # (assign X (+ X 1))
                by, amount = 1, Linear({}, amount.constant)
            constant = constant_of(form.parts[2], amount)
            is_new = name not in found
            change = found.setdefault(name, _Change())
            change.place, change.text = form.parts[2].place, form.parts[2].text
            if by is not None and change.value is None:
                change.by += by * constant
            elif by is None and is_new:
                change.value = constant
            else:
                raise PddlError(
                    f"{form.place}: {schema.name} assigns {name_text(name)}, and changes it "
                    "otherwise, too: an assignment has to be the only change of its number"
                )
        return found

    def _check_first(self, name: Name, place: str) -> None:
        value = self._first.get(name)
        if value is None:
            raise PddlError(f"{place}: {name_text(name)} has no value in :init")
        if not (0 <= value <= LARGEST_NUMBER and value.is_integer()):
            raise PddlError(
                f"{self._problem.place_of(name)}: {name_text(name)} is {value:g} in :init, and has "
                f"to be a whole number from 0 to {LARGEST_NUMBER}, as actions compare and change it"
            )

    def _check_whole(self, change: _Change, schema: ActionSchema) -> None:
        amount = abs(change.by) if change.value is None else change.value
        if amount.denominator != 1 or not 0 <= amount <= LARGEST_NUMBER:
            raise PddlError(
                f"{change.place}: {shorten(change.text)} is {shown(amount)} for {schema.name}: it "
                f"has to be a whole number from 0 to {LARGEST_NUMBER}"
            )

    def _find_limits(self, uses: Sequence[_GroundUse], asked: Sequence[Bounds]) -> None:
        self.largest = {}
        open_ended: Dict[Name, str] = {}
        places: Dict[Name, str] = {}
        for name in (name for bounds in (self.goal(), *asked) for name in bounds):
            self.largest[name] = self.first(name)
        for use in uses:
            for name in use.names():
                change = use.changes.get(name, _Change())
                limit = max(self.first(name), round(change.value or 0))
                if change.value is None and change.by > 0:
                    most = use.bounds.get(name, _Interval()).most
                    places[name] = change.place
                    if most is None:
                        open_ended[name] = change.place
                    else:
                        limit = max(limit, most + round(change.by))
                self.largest[name] = max(limit, self.largest.get(name, 0))
        for name, limit in self.largest.items():
            if name[0] in self._limits:
                self.largest[name] = self._limits[name[0]]
                if self.first(name) > self.largest[name]:
                    raise PddlError(f"{name_text(name)} is {self.first(name)} in :init, which is "
                                    f"more than --most {name[0]}={self.largest[name]}")  # fmt: skip
            elif name in open_ended:
                raise PddlError(
                    f"{open_ended[name]}: nothing says how large {name_text(name)} can get: say it "
                    f"by --most {name[0]}=NUMBER"
                )
            elif limit > LARGEST_NUMBER:
                raise PddlError(
                    f"{places[name]}: {name_text(name)} can become {limit}: numbers can be from 0 "
                    f"to {LARGEST_NUMBER}; --most {name[0]}=NUMBER says a limit"
                )

    def _use(self, ground_use: _GroundUse, cost: int) -> NumericUse:
        use = NumericUse({}, {}, {}, (), cost)
        fills: List[Name] = []
        for name in ground_use.names():
            limit = self.largest[name]
            change = ground_use.changes.get(name, _Change())
            bound = ground_use.bounds.get(name, _Interval())
            if change.value is not None:
                value = round(change.value)
                if value > limit:
                    raise PddlError(
                        f"{change.place}: {name_text(name)} becomes {value}, which is more than "
                        f"--most {name[0]}={limit}"
                    )
                if value == limit:
                    fills.append(name)
                else:
                    use.sets[name] = value
            taken, given = max(0, -round(change.by)), max(0, round(change.by))
            if bound.least > taken:
                use.needs[name] = min(bound.least, LARGEST_NUMBER)
            if bound.most is not None and bound.most < limit - given:
                use.most[name] = bound.most
            if taken:
                use.uses[name] = taken
            if given:
                use.gives[name] = given
        return NumericUse(use.needs, use.uses, use.gives, tuple(fills), cost, use.most, use.sets)

    def _cost(self, schema: ActionSchema, objects: Binding) -> int:
        metric = self._problem.metric
        lasts = 1.0
        if schema.duration is not None:
            lasts = _as_float(self._amounts.constant(schema.duration, objects, schema))
        if metric is None:
            cost = lasts if self._is_timed else 1.0
        else:
            cost = self._added(metric, schema, objects, lasts)
        if not 0 <= cost <= LARGEST_NUMBER:
            raise PddlError(f"{schema.place}: {schema.name} costs {cost:g}, and costs are from 0 "
                            f"to {LARGEST_NUMBER}")  # fmt: skip
        return round(cost)

    def _added(
        self, metric: PddlPart, schema: ActionSchema, objects: Binding, lasts: float
    ) -> float:
        """Returns by how much an action increases the metric, which is a sum."""
        value = number_of(metric)
        if value is not None:
            return 0.0
        name = (metric.text,) if isinstance(metric, Word) else ground(metric, {})
        if name == _TIME:
            return lasts
        if isinstance(metric, ListForm) and metric.head == "+":
            return sum(self._added(part, schema, objects, lasts) for part in metric.parts[1:])
        if isinstance(metric, ListForm) and metric.head == "*" and len(metric.parts) == 3:
            for factor, part in (metric.parts[1:], metric.parts[:0:-1]):
                value = number_of(factor)
                if value is not None:
                    return value * self._added(part, schema, objects, lasts)
        if isinstance(metric, ListForm) and metric.head in ("-", "/", "*"):
            raise PddlError(f"{metric.place}: {shorten(metric.text)} in :metric is not understood: "
                            "there can be sums, and products with a number")  # fmt: skip
        total = 0.0
        for change in (*schema.changes, *schema.later_changes):
            target = change.parts[1]
            if isinstance(target, ListForm) and ground(target, objects) == name:
                if change.head != "increase":
                    raise PddlError(f"{change.place}: {change.head} of {shorten(target.text)}: "
                                    "what is minimized can only be increased")  # fmt: skip
                total += _as_float(self._amounts.constant(change.parts[2], objects, schema))
        return total


def binding(schema: ActionSchema, objects: Sequence[str]) -> Dict[str, str]:
    """Returns the objects of an action's variables."""
    return dict(zip(schema.parameters, objects))


def ground_atom(form: ListForm, schema: ActionSchema, objects: Sequence[str]) -> Name:
    """Returns an atom of an action for its objects."""
    return ground(form, binding(schema, objects))


def _as_float(amount: Fraction) -> float:
    """Returns an amount as a number with a point; one that is too large is infinite."""
    try:
        return float(amount)
    except OverflowError:
        return math.inf if amount > 0 else -math.inf


def _function(part: PddlPart) -> str:
    return part.head if isinstance(part, ListForm) else part.text
