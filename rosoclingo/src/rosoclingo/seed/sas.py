"""A task in the format SAS+, version 3, in which Fast Downward's search reads it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Sequence, Tuple

from rosoclingo.seed.task import Effect, Operator, SeedFact, SeedTask

_YES, _NO = "yes", "no"
_UNKNOWN = "unknown value"  # no term, so that it is no variable's value


@dataclass(frozen=True)
class SasTask:
    """A task as text, with the operators and variables to which numbers in its plans refer.

    Attributes:
        text: The text.
        operators: The operators, in the order of their numbers.
        initial: The values of variables before a plan.
        goal: Those that they are to have after it.
    """

    text: str
    operators: Sequence[Operator]
    initial: Mapping[str, str]
    goal: Mapping[str, str]


def write(task: SeedTask) -> SasTask:
    """Returns a task as text; the names of its operators are their numbers.

    If there are several requests, each is met by an operator of its own, since it need not be so
    in the end.
    """
    operators = list(task.operators)
    goal: Dict[str, str] = {}
    if len(task.wishes) == 1:
        goal = dict(*task.wishes.values())
    initial = dict(task.initial)
    for request, wishes in task.wishes.items() if not goal else ():
        met = f"met {request}"
        initial[met], goal[met] = _NO, _YES
        operators.append(Operator(needs=wishes, sets=[(met, _YES)], cost=0))
    return SasTask(_Writer(initial, operators, goal).text(), operators, initial, goal)


class _Writer:
    """Numbers variables and their values, and writes them.

    For a value that a variable must not have, there is another variable that says that it has
    another one: with an operator for each other value, there would be too many.
    """

    def __init__(
        self, initial: Mapping[str, str], operators: Sequence[Operator], goal: Mapping[str, str]
    ) -> None:
        self._operators = operators
        self._goal = goal
        self._initial = dict(initial)
        self._differing: Dict[str, List[Tuple[str, str]]] = {}  # values with their variables
        for variable, value in dict.fromkeys(fact for one in operators for fact in one.others):
            other = _other(variable, value)
            self._differing.setdefault(variable, []).append((value, other))
            self._initial[other] = _NO if self._initial.get(variable) == value else _YES
        self._variables: Dict[str, int] = {}
        self._values: List[Dict[str, int]] = []

    def text(self) -> str:
        operators = "".join(self._operator(n, one) for n, one in enumerate(self._operators))
        goal = self._facts(self._goal.items())
        for variable, value in self._initial.items():
            self._number((variable, value))
        initial = "".join(
            f"{self._number((variable, self._initial.get(variable, _UNKNOWN)))[1]}\n"
            for variable in list(self._variables)
        )
        variables = "".join(
            self._variable(name, number) for name, number in self._variables.items()
        )
        return (
            f"begin_version\n3\nend_version\nbegin_metric\n0\nend_metric\n"
            f"{len(self._variables)}\n{variables}0\n"
            f"begin_state\n{initial}end_state\nbegin_goal\n{goal}end_goal\n"
            f"{len(self._operators)}\n{operators}0\n"
        )

    def _number(self, fact: SeedFact) -> Tuple[int, int]:
        """Returns the numbers of a variable and of its value."""
        variable, value = fact
        number = self._variables.setdefault(variable, len(self._variables))
        if number == len(self._values):
            self._values.append({})
        values = self._values[number]
        return number, values.setdefault(value, len(values))

    def _facts(self, facts: Iterable[SeedFact]) -> str:
        numbers = [self._number(fact) for fact in facts]
        lines = "".join(f"{variable} {value}\n" for variable, value in numbers)
        return f"{len(numbers)}\n{lines}"

    def _variable(self, name: str, number: int) -> str:
        values = list(self._values[number])
        if len(values) == 1:
            values.append(_UNKNOWN)
        facts = "".join(f"Atom {_predicate(name, value)}({number}, {value})\n" for value in values)
        return f"begin_variable\nvar{number}\n-1\n{len(values)}\n{facts}end_variable\n"

    def _operator(self, number: int, one: Operator) -> str:
        needs = [*one.needs.items(), *((_other(*fact), _YES) for fact in one.others)]
        prevail = self._facts(needs)
        effects = [Effect({}, fact) for fact in one.sets]
        effects += one.effects
        lines = "".join(
            self._effect(effect.conditions, fact)
            for effect in effects
            for fact in self._with_differing(effect.fact)
        )
        count = lines.count("\n")
        return f"begin_operator\n{number}\n{prevail}{count}\n{lines}{one.cost}\nend_operator\n"

    def _with_differing(self, fact: SeedFact) -> List[SeedFact]:
        """Returns a new value with what it says of those that the variable may not have."""
        variable, value = fact
        return [fact] + [
            (other, _NO if unwanted == value else _YES)
            for unwanted, other in self._differing.get(variable, ())
        ]

    def _effect(self, conditions: Mapping[str, str], fact: SeedFact) -> str:
        numbers = [self._number(condition) for condition in conditions.items()]
        needed = "".join(f"{variable} {value} " for variable, value in numbers)
        variable, value = self._number(fact)
        return f"{len(numbers)} {needed}{variable} -1 {value}\n"


def _other(variable: str, value: str) -> str:
    return f"{variable} is not {value}"


def _predicate(variable: str, value: str) -> str:
    """Returns what a fact has in common with others, for landmarks of which one is needed."""
    return f"{variable.partition('(')[0]}-{value.partition('(')[0]}".replace(" ", "-")
