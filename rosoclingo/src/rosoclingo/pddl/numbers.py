"""Numbers, durations and costs of ground actions, as the library ``actions.lp`` has them.

A number of the library is from 0 to a limit, and an action uses, gives or fills it. So a number
that some condition reads has to be an integer that actions change by constants:

- ``(>= (battery ?r) 5)`` is needed, and a decrease uses what has to be there;
- ``(<= (load ?r) 2)`` goes with an increase in the same action, which says how large it can get;
- ``(assign (battery ?r) 100)`` is for the largest value only.

Numbers that no condition reads are left out, as no action depends on them; they may be costs. What
compares constants alone, such as ``(>= (capacity ?truck) (weight ?box))``, is decided at once.
"""

from __future__ import annotations

import operator
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Mapping, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.pddl.domain import ActionSchema, Domain, Problem, number_of
from rosoclingo.pddl.expressions import ListForm, PddlError, Word
from rosoclingo.pddl.support import PddlPart

Name = Tuple[str, ...]
"""A function and its objects."""

_COMPARE: Dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">=": operator.ge, ">": operator.gt,
}  # fmt: skip
_OPERATIONS: Dict[str, Callable[[float, float], float]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
}  # fmt: skip
_FLIPPED = {"<": ">", "<=": ">=", ">=": "<=", ">": "<"}
_LARGEST = 2**31 - 1  # clingo's integers
_TIME = ("total-time",)


@dataclass(frozen=True)
class NumericUse:
    """How a ground action depends on numbers and changes them; and its cost.

    Attributes:
        needs: How much there has to be of each number, if it uses less.
        uses: What it takes of each.
        gives: What it adds to each.
        fills: Which ones it makes as large as can be.
        cost: What it costs.
    """

    needs: Dict[Name, int]
    uses: Dict[Name, int]
    gives: Dict[Name, int]
    fills: Tuple[Name, ...]
    cost: int

    @property
    def changes_something(self) -> bool:
        """Tells whether some number is another one afterwards."""
        return bool(self.uses or self.gives or self.fills)


@dataclass
class _Change:
    """The conditions and effects of a ground action on a number, each with its place."""

    most: Optional[Tuple[int, str]] = None
    least: Optional[Tuple[int, str]] = None
    by: Dict[str, Tuple[int, str]] = field(default_factory=dict)

    def amount(self, head: str) -> int:
        return self.by[head][0] if head in self.by else 0


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
        self._first = {_key(text): value for text, value in problem.numbers.items()}
        self._limits = limits
        self._is_timed = any(schema.duration is not None for schema in domain.actions)
        changes = [change for schema in domain.actions for change in schema.changes]
        self._changing = {_function(change.parts[1]) for change in changes}
        self._read = {
            form.head
            for schema in domain.actions
            for comparison in schema.comparisons
            for form in comparison.forms()
            if form.head in self._changing
        }
        self.largest: Dict[Name, int] = {}

    def read(self, actions: Sequence[Tuple[str, Sequence[str]]]) -> List[Optional[NumericUse]]:
        """Returns how ground actions use numbers; from then on, ``largest`` has the limits.

        There is None for an action that is never possible, because of constants.

        Args:
            actions: For each its name and its objects.

        Raises:
            PddlError: The library has no such condition or change.
        """
        bound = [(self._schemas[name], _binding(self._schemas[name], o)) for name, o in actions]
        changes = [self._changes(schema, binding) for schema, binding in bound]
        self._find_limits([change for each in changes if each for change in each.items()])
        return [
            None if change is None else self._use(change, self._cost(schema, binding))
            for change, (schema, binding) in zip(changes, bound)
        ]

    def first(self, number: Name) -> int:
        """Returns the value that a number has at first."""
        return round(self._first[number])

    def _changes(
        self, schema: ActionSchema, binding: Mapping[str, str]
    ) -> Optional[Dict[Name, _Change]]:
        found: Dict[Name, _Change] = {}

        def of(form: PddlPart) -> _Change:
            assert isinstance(form, ListForm)
            name = _ground(form, binding)
            self._check_first(name, form.place)
            return found.setdefault(name, _Change())

        for comparison in schema.comparisons:
            head, left, right = comparison.head, comparison.parts[1], comparison.parts[2]
            if _function(right) in self._read and _function(left) not in self._read:
                head, left, right = _FLIPPED[head], right, left
            if _function(left) not in self._read:
                sides = (self._evaluate(side, schema, binding) for side in (left, right))
                if not _COMPARE[head](*sides):
                    return None
                continue
            bound = self._integer(right, schema, binding) + {">": 1, "<": -1}.get(head, 0)
            if head in (">", ">="):
                of(left).least = bound, comparison.place
            else:
                of(left).most = bound, comparison.place
        for change in schema.changes:
            target = change.parts[1]
            if _function(target) in self._read:
                by = of(target).by
                by[change.head] = self._integer(change.parts[2], schema, binding), change.place
                if len(by) > 1:
                    raise PddlError(f"{change.place}: {schema.name} changes "
                                    f"{shorten(target.text)} twice")  # fmt: skip
        return found

    def _check_first(self, name: Name, place: str) -> None:
        value = self._first.get(name)
        if value is None:
            raise PddlError(f"{place}: {_text(name)} has no value in :init")
        if not (0 <= value <= _LARGEST and value.is_integer()):
            raise PddlError(f"{place}: {_text(name)} is {value:g} in :init, and has to be a whole "
                            "number from 0 on")  # fmt: skip

    def _find_limits(self, changes: Sequence[Tuple[Name, _Change]]) -> None:
        open_ended: Dict[Name, str] = {}
        for name, change in changes:
            limit = max(self.first(name), change.amount("assign"))
            if "increase" in change.by:
                amount, place = change.by["increase"]
                if change.most is not None:
                    limit = max(limit, change.most[0] + amount)
                else:
                    open_ended[name] = place
            self.largest[name] = max(limit, self.largest.get(name, 0))
        for name in self.largest:
            if name[0] in self._limits:
                self.largest[name] = self._limits[name[0]]
                if self.first(name) > self.largest[name]:
                    raise PddlError(f"{_text(name)} is {self.first(name)} in :init, which is more "
                                    f"than --most {name[0]}={self.largest[name]}")  # fmt: skip
            elif name in open_ended:
                raise PddlError(
                    f"{open_ended[name]}: nothing says how large {_text(name)} can get: say it by "
                    f"--most {name[0]}=NUMBER"
                )

    def _use(self, changes: Mapping[Name, _Change], cost: int) -> NumericUse:
        use = NumericUse({}, {}, {}, tuple(n for n, c in changes.items() if "assign" in c.by), cost)
        for name, change in changes.items():
            taken, given = change.amount("decrease"), change.amount("increase")
            if change.least is not None and change.least[0] > taken:
                use.needs[name] = change.least[0]
            limit = self.largest[name]
            if change.most is not None and change.most[0] + given < limit:
                most, place = change.most
                raise PddlError(
                    f"{place}: {_text(name)} can be {most} at most, with {given} added, and "
                    f"elsewhere {limit}: each number has one limit"
                )
            if "assign" in change.by and change.by["assign"][0] != limit:
                value, place = change.by["assign"]
                raise PddlError(
                    f"{place}: {_text(name)} becomes {value}, and it can be {limit}: a number is "
                    "filled, or changed by a difference"
                )
            if taken:
                use.uses[name] = taken
            if given:
                use.gives[name] = given
        return use

    def _cost(self, schema: ActionSchema, binding: Mapping[str, str]) -> int:
        metric = self._problem.metric
        lasts = 1.0
        if schema.duration is not None:
            lasts = self._evaluate(schema.duration, schema, binding)
        if metric is None:
            cost = lasts if self._is_timed else 1.0
        else:
            cost = self._added(metric, schema, binding, lasts)
        if not 0 <= cost <= _LARGEST:
            raise PddlError(
                f"{schema.place}: {schema.name} costs {cost:g}, and costs are from 0 on"
            )
        return round(cost)

    def _added(
        self, metric: PddlPart, schema: ActionSchema, binding: Mapping[str, str], lasts: float
    ) -> float:
        """Returns how much larger an action makes the metric, which is a sum."""
        value = number_of(metric)
        if value is not None:
            return 0.0
        name = (metric.text,) if isinstance(metric, Word) else _ground(metric, {})
        if name == _TIME:
            return lasts
        if isinstance(metric, ListForm) and metric.head == "+":
            return sum(self._added(part, schema, binding, lasts) for part in metric.parts[1:])
        if isinstance(metric, ListForm) and metric.head == "*" and len(metric.parts) == 3:
            for factor, part in (metric.parts[1:], metric.parts[:0:-1]):
                value = number_of(factor)
                if value is not None:
                    return value * self._added(part, schema, binding, lasts)
        if isinstance(metric, ListForm) and metric.head in ("-", "/", "*"):
            raise PddlError(f"{metric.place}: {shorten(metric.text)} in :metric is not understood: "
                            "there can be sums, and products with a number")  # fmt: skip
        total = 0.0
        for change in schema.changes:
            target = change.parts[1]
            if isinstance(target, ListForm) and _ground(target, binding) == name:
                if change.head != "increase":
                    raise PddlError(f"{change.place}: {change.head} of {shorten(target.text)}: "
                                    "what is minimized can only be increased")  # fmt: skip
                total += self._evaluate(change.parts[2], schema, binding)
        return total

    def _integer(self, part: PddlPart, schema: ActionSchema, binding: Mapping[str, str]) -> int:
        value = self._evaluate(part, schema, binding)
        if not (0 <= value <= _LARGEST and value.is_integer()):
            raise PddlError(f"{part.place}: {shorten(part.text)} is {value:g} for {schema.name}: "
                            "it has to be a whole number from 0 on")  # fmt: skip
        return round(value)

    def _evaluate(self, part: PddlPart, schema: ActionSchema, binding: Mapping[str, str]) -> float:
        value = number_of(part)
        if value is not None:
            return value
        if part.text == "?duration" and schema.duration is not None:
            return self._evaluate(schema.duration, schema, binding)
        if isinstance(part, ListForm) and part.head in _OPERATIONS and len(part.parts) == 3:
            left, right = (self._evaluate(each, schema, binding) for each in part.parts[1:])
            if part.head == "/" and right == 0:
                raise PddlError(f"{part.place}: {shorten(part.text)} divides by 0")
            return _OPERATIONS[part.head](left, right)
        if isinstance(part, Word) or part.head in _OPERATIONS:
            raise PddlError(f"{part.place}: {shorten(part.text)} is no amount")
        if part.head in self._changing:
            raise PddlError(f"{part.place}: {shorten(part.text)} changes, and an amount has to be "
                            "constant")  # fmt: skip
        name = _ground(part, binding)
        if name not in self._first:
            raise PddlError(f"{part.place}: {_text(name)} has no value in :init")
        return self._first[name]


def _binding(schema: ActionSchema, objects: Sequence[str]) -> Dict[str, str]:
    return dict(zip(schema.parameters, objects))


def _ground(form: ListForm, binding: Mapping[str, str]) -> Name:
    """Returns an atom or a number with objects in the place of variables."""
    return tuple(binding.get(part.text, part.text) for part in form.parts)


def ground_atom(form: ListForm, schema: ActionSchema, objects: Sequence[str]) -> Name:
    """Returns an atom of an action for its objects."""
    return _ground(form, _binding(schema, objects))


def _key(text: str) -> Name:
    return tuple(text.strip("()").split())


def _function(part: PddlPart) -> str:
    return part.head if isinstance(part, ListForm) else part.text


def _text(name: Name) -> str:
    return shorten(f"({' '.join(name)})")
