"""Planning tasks with finite-domain variables: SAS+, the format of Fast Downward's translator."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, Iterator, List, Sequence, Set, Tuple

from rosoclingo.pddl.expressions import PddlError

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
        effects: What changes.
    """

    name: str
    preconditions: Tuple[Assignment, ...]
    exclusions: Tuple[Assignment, ...]
    effects: Tuple[SasEffect, ...]


@dataclass(frozen=True)
class TranslatedTask:
    """A planning task. A variable is the names of its values."""

    variables: Tuple[Tuple[str, ...], ...]
    init: Tuple[int, ...]
    goal: Tuple[Assignment, ...]
    operators: Tuple[SasOperator, ...]


def parse_sas(text: str) -> TranslatedTask:
    """Returns the task of a file of the translator.

    Raises:
        PddlError: It has axioms, or it is not in the format, version 3.
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
    variables = tuple(_variable(lines) for _ in range(lines.integer()))
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
    if lines.integer():
        raise PddlError("the task needs axioms, which are not understood: quantifiers and "
                        "disjunctions have to be written as several actions")  # fmt: skip
    return TranslatedTask(variables, init, goal, tuple(_united(operators, variables)))


def _variable(lines: _Lines) -> Tuple[str, ...]:
    lines.skip("begin_variable")
    lines.text()  # its name is a number
    if lines.integer() != -1:
        raise PddlError("the task needs axioms, which are not understood: quantifiers and "
                        "disjunctions have to be written as several actions")  # fmt: skip
    values = tuple(lines.text() for _ in range(lines.integer()))
    lines.skip("end_variable")
    return values


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
