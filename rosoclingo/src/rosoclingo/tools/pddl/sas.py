"""Planning tasks with finite-domain variables: SAS+, the format of Fast Downward's translator."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, Dict, Iterator, List, Mapping, Sequence, Set, Tuple

from rosoclingo.tools.pddl.expressions import PddlError

Assignment = Tuple[int, int]
"""A variable and the number of its value."""


@dataclass(frozen=True)
class SasEffect:
    """A change of a variable, under conditions on the state before it."""

    conditions: Tuple[Assignment, ...]
    variable: int
    value: int


@dataclass(frozen=True)
class SasOperator:
    """A ground action.

    Attributes:
        name: The action and its objects, with blanks between.
        preconditions: The values that variables need to have.
        exclusions: The values that they must not have.
        effects: The changes of variables.
    """

    name: str
    preconditions: Tuple[Assignment, ...]
    exclusions: Tuple[Assignment, ...]
    effects: Tuple[SasEffect, ...]


@dataclass(frozen=True)
class SasRule:
    """A ground rule of a derived variable.

    Attributes:
        variable: The derived variable.
        conditions: The values that variables need to have.
        tests: The tests of numbers that need to hold, as atoms of the translator.
    """

    variable: int
    conditions: Tuple[Assignment, ...]
    tests: Tuple[str, ...] = ()


@dataclass(frozen=True)
class TranslatedTask:
    """A planning task.

    Attributes:
        variables: Of each variable, the names of its values.
        init: The first value of each; derived ones have the one with which nothing is derived.
        goal: The values that are wanted.
        operators: The ground actions.
        strata: The stratum of each derived variable, from 0 on: what a rule negates has a lower one
            than what it derives.
        rules: The rules of derived variables.
    """

    variables: Tuple[Tuple[str, ...], ...]
    init: Tuple[int, ...]
    goal: Tuple[Assignment, ...]
    operators: Tuple[SasOperator, ...]
    strata: Mapping[int, int] = field(default_factory=dict)
    rules: Tuple[SasRule, ...] = ()

    def derived_state(self, holds: Callable[[str], bool]) -> List[int]:
        """Returns the initial state with the values of derived variables.

        Args:
            holds: Whether a test of numbers holds initially.
        """
        state = list(self.init)
        for stratum in sorted(set(self.strata.values())):
            waiting = [
                rule
                for rule in self.rules
                if self.strata[rule.variable] == stratum and all(map(holds, rule.tests))
            ]
            is_new = True
            while is_new:
                is_new = False
                for rule in waiting:
                    before = state[rule.variable] == self.init[rule.variable]
                    if before and all(state[v] == x for v, x in rule.conditions):
                        state[rule.variable] = 1 - state[rule.variable]
                        is_new = True
        return state


def parse_sas(text: str) -> TranslatedTask:
    """Returns the task of a file of the translator.

    Raises:
        PddlError: It is not in the format, version 3.
    """
    lines = _Lines(text)
    try:
        return _parse(lines)
    except (IndexError, ValueError) as err:
        raise PddlError(
            f"the translator's output, line {lines.number}, is not SAS+: {err}"
        ) from err


class _Lines:
    """The lines of the file, in their order."""

    def __init__(self, text: str) -> None:
        self._lines = text.splitlines()
        self.number = 0

    def text(self) -> str:
        self.number += 1
        return self._lines[self.number - 1]

    def integer(self) -> int:
        return int(self.text())

    def integers(self) -> List[int]:
        return [int(word) for word in self.text().split()]

    def skip(self, wanted: str) -> None:
        found = self.text()
        if found != wanted:
            raise ValueError(f"{wanted} is expected instead of {found}")

    def assignments(self) -> Tuple[Assignment, ...]:
        return tuple(self.assignment() for _ in range(self.integer()))

    def assignment(self) -> Assignment:
        variable, value = self.integers()
        return variable, value


def _parse(lines: _Lines) -> TranslatedTask:
    lines.skip("begin_version")
    lines.skip("3")
    lines.skip("end_version")
    lines.skip("begin_metric")
    lines.integer()
    lines.skip("end_metric")
    found = [_variable(lines) for _ in range(lines.integer())]
    variables = tuple(values for _, values in found)
    for _ in range(lines.integer()):  # mutexes between variables
        lines.skip("begin_mutex_group")
        lines.assignments()
        lines.skip("end_mutex_group")
    lines.skip("begin_state")
    init = tuple(lines.integer() for _ in variables)
    lines.skip("end_state")
    lines.skip("begin_goal")
    goal = lines.assignments()
    lines.skip("end_goal")
    operators = [_operator(lines) for _ in range(lines.integer())]
    rules = tuple(_rule(lines) for _ in range(lines.integer()))
    strata = {variable: stratum for variable, (stratum, _) in enumerate(found) if stratum >= 0}
    united = tuple(_united(operators, variables))
    return TranslatedTask(variables, init, goal, united, strata, rules)


def _variable(lines: _Lines) -> Tuple[int, Tuple[str, ...]]:
    lines.skip("begin_variable")
    lines.text()  # its name is a number
    stratum = lines.integer()  # -1 if it is not derived
    values = tuple(lines.text() for _ in range(lines.integer()))
    lines.skip("end_variable")
    return stratum, values


def _rule(lines: _Lines) -> SasRule:
    lines.skip("begin_rule")
    conditions = lines.assignments()
    variable, _, _ = lines.integers()  # with its value by default, and its other one
    lines.skip("end_rule")
    return SasRule(variable, conditions)


def _operator(lines: _Lines) -> SasOperator:
    lines.skip("begin_operator")
    name = lines.text().strip()  # one without objects ends in a blank
    preconditions = list(lines.assignments())
    effects = []
    for _ in range(lines.integer()):
        numbers = lines.integers()
        count = numbers[0]
        pairs = numbers[1 : 1 + 2 * count]
        variable, before, after = numbers[1 + 2 * count :]
        if before >= 0:
            preconditions.append((variable, before))
        effects.append(SasEffect(tuple(zip(pairs[::2], pairs[1::2])), variable, after))
    lines.integer()  # its cost
    lines.skip("end_operator")
    unique = tuple(dict.fromkeys(preconditions))
    return SasOperator(name, unique, (), tuple(effects))


def _united(
    operators: Sequence[SasOperator], variables: Sequence[Sequence[str]]
) -> Iterator[SasOperator]:
    """Unites operators of the same name, which the translator makes of negative conditions.

    Raises:
        PddlError: They differ in more than the values of variables, each for itself.
    """
    by_name: Dict[str, List[SasOperator]] = {}
    for operator in operators:
        by_name.setdefault(operator.name, []).append(operator)
    for name, alike in by_name.items():
        only = alike[0]
        if len(alike) == 1 and len(dict(only.preconditions)) == len(only.preconditions):
            yield only
            continue
        values: Dict[int, Set[int]] = {}
        for operator in alike:
            for variable, value in operator.preconditions:
                values.setdefault(variable, set()).add(value)
        count = math.prod(len(those) for those in values.values())
        if len(alike) != count or any(set(o.effects) != set(alike[0].effects) for o in alike):
            raise PddlError(f"{name}: what it needs or changes has alternatives: write it as "
                            "several actions")  # fmt: skip
        needed = [(v, *those) for v, those in values.items() if len(those) == 1]
        excluded = [
            (variable, value)
            for variable, those in values.items()
            for value in range(len(variables[variable]))
            if len(those) > 1 and value not in those
        ]
        yield SasOperator(name, tuple((v, x) for v, x in needed), tuple(excluded), alike[0].effects)
