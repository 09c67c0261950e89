"""The planning task of a search as data: actions, the present state, and requests.

A plan for it is a sequence of numbers of actions; :meth:`PlanningTask.execute` does them in that
order and says what is wrong if one of them is not possible.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

from rosoclingo.engine import kinds
from rosoclingo.engine.derived import UNDERIVED, Derivation
from rosoclingo.errors import TaskError

TaskFact = Tuple[str, str]
"""A variable and its value."""


class Kind(enum.IntEnum):
    """The ways in which an action treats a number, see :mod:`rosoclingo.engine.kinds`."""

    TAKES = kinds.TAKES
    ADDS = kinds.ADDS
    BECOMES = kinds.BECOMES
    LEAST = kinds.NEEDS_LEAST
    MOST = kinds.NEEDS_MOST


@dataclass(frozen=True)
class Change:
    """A value that a variable gets, only if others have some values before the action."""

    variable: str
    value: str
    conditions: Tuple[TaskFact, ...] = ()


@dataclass(frozen=True)
class TaskAction:
    """An action of an actuator, or a robot's way from one place to another.

    Attributes:
        actuator: The actuator.
        name: The action, or the place to which a way leads.
        start: The place from which a way leads; empty if this is no way.
        needs: Values that variables must have.
        others: Values that variables must not have.
        changes: What it changes.
        numbers: What it does to numbers, and needs of them.
        occupies: What no other actuator may occupy meanwhile.
        cost: What it costs, a whole number; of a way, the sum of its lengths.
        seconds: How long it takes; it matters only if the task counts seconds.
    """

    actuator: str
    name: str
    start: str = ""
    needs: Tuple[TaskFact, ...] = ()
    others: Tuple[TaskFact, ...] = ()
    changes: Tuple[Change, ...] = ()
    numbers: Tuple[Tuple[Kind, str, int], ...] = ()
    occupies: Tuple[str, ...] = ()
    cost: int = 1
    seconds: int = 1

    def __str__(self) -> str:
        if self.start:
            return f"{self.actuator}: {self.start} -> {self.name}"
        return f"{self.actuator}: {self.name}"


@dataclass(frozen=True)
class TaskRequest:
    """A request: values of variables and bounds of numbers that are to hold at the same time.

    Attributes:
        values: The values.
        bounds: For a number, the least and the largest level.
    """

    values: Tuple[TaskFact, ...] = ()
    bounds: Tuple[Tuple[str, int, int], ...] = ()


@dataclass(frozen=True)
class TaskTimes:
    """The times of a task that counts seconds, all from now on.

    Attributes:
        due: The seconds within which a request is to be met; without one, it is never late.
        weights: The value of each second for which a request is late; 1 if none is given.
        ready: The seconds after which a variable has a value that an action has set.
        keeps: The seconds for which a variable keeps a value at most.
        earliest: The seconds before which a request is not to be met.
        latest: The seconds after which a request is of no use.
        free: The seconds after which an actuator that is busy is free.
        since: The seconds after which a variable gets the value, or a number the level, that it has
            in the task's state. Negative if it has had the value for some time.
        prefers: The name of what is minimised after lateness: waits, makespan or cost.
        together: If positive, what is preferred is minimised together with lateness, and this is
            the value of each second, or unit of cost, of it.
    """

    due: Mapping[str, int]
    weights: Mapping[str, int]
    ready: Mapping[TaskFact, int]
    keeps: Mapping[TaskFact, int]
    earliest: Mapping[str, int]
    latest: Mapping[str, int]
    free: Mapping[str, int]
    since: Mapping[str, int]
    prefers: str = "waits"
    together: int = 0


@dataclass
class TaskState:
    """The values of variables and the levels of numbers at some time.

    Attributes:
        values: The values of variables; a variable without one is unknown.
        levels: The levels of numbers.
    """

    values: Dict[str, str]
    levels: Dict[str, int]


@dataclass(frozen=True)
class Executed:
    """The result of executing a plan.

    Attributes:
        state: What there is after it.
        met: The requests that are met, each after how many actions.
        cost: What it costs.
    """

    state: TaskState
    met: Mapping[str, int]
    cost: int


@dataclass(frozen=True)
class PlanningTask:
    """A planning task. Immutable.

    Attributes:
        state: What there is now.
        limits: The largest level of each number; the smallest one is 0.
        actions: What can be done, without what cannot help.
        requests: What is wanted, by the slot of each request.
        hopeless: Requests for which nothing that can be done is enough.
        left: What is left of the plan before, in order.
        elder: The request that has waited longest of those that have waited too long; else empty.
        derivation: The variables whose values follow from those of others.
        failed: The actions that have just failed, each after its actuator and a comma.
        ripening: Variables that get their value by themselves, only after some time.
        is_begun: Whether what is left of the plan before is being executed.
        times: Its times; None if it does not count seconds, and actions last as long as they cost.
    """

    state: TaskState
    limits: Mapping[str, int]
    actions: Sequence[TaskAction]
    requests: Mapping[str, TaskRequest]
    hopeless: Tuple[str, ...] = ()
    left: Sequence[Sequence[TaskFact]] = ()
    elder: str = ""
    derivation: Derivation = UNDERIVED
    failed: Tuple[str, ...] = ()
    ripening: Tuple[str, ...] = ()
    is_begun: bool = True
    times: Optional[TaskTimes] = None

    def execute(self, plan: Sequence[int]) -> Executed:
        """Does actions in an order.

        Args:
            plan: Their numbers.

        Raises:
            TaskError: One of them is not possible; the message names it, its position and why.
        """
        state = TaskState(dict(self.state.values), dict(self.state.levels))
        met = {slot: 0 for slot in self.requests if self._is_met(slot, state)}
        for position, number in enumerate(plan, 1):
            self.do(number, state, position)
            for slot in self.requests:
                if slot not in met and self._is_met(slot, state):
                    met[slot] = position
        return Executed(state, met, sum(self.actions[number].cost for number in plan))

    def do(self, number: int, state: TaskState, position: int = 0) -> None:
        """Does an action, which changes the state.

        Raises:
            TaskError: It is not possible.
        """
        action = self.actions[number]
        reason = next(self.obstacles(action, state), "")
        if reason:
            raise TaskError(f"action {position} of the plan, {action}, is not possible: {reason}")
        for change in _happening(action, state):
            state.values[change.variable] = change.value
        for kind, number_, amount in action.numbers:
            if kind is Kind.TAKES:
                state.levels[number_] -= amount
            elif kind is Kind.ADDS:
                state.levels[number_] += amount
            elif kind is Kind.BECOMES:
                state.levels[number_] = amount
        self.derivation.derive(state.values, state.levels)

    def obstacles(self, action: TaskAction, state: TaskState) -> Iterator[str]:
        """Yields why an action is not possible, in sentences."""
        for variable, value in action.needs:
            now = state.values.get(variable, "unknown")
            if now != value:
                yield f"{variable} is {now}, and not {value}"
        for variable, value in action.others:
            if state.values.get(variable) == value:
                yield f"{variable} is {value}"
        given: Dict[str, str] = {}
        for change in _happening(action, state):
            if given.setdefault(change.variable, change.value) != change.value:
                yield f"it gives {change.variable} two values"
        for kind, number, amount in action.numbers:
            level = state.levels.get(number, -1)
            if kind in (Kind.TAKES, Kind.LEAST) and level < amount:
                yield f"{number} is {level}, and less than {amount}"
            elif kind is Kind.MOST and level > amount:
                yield f"{number} is {level}, and more than {amount}"
            elif kind is Kind.ADDS and level + amount > self.limits[number]:
                yield f"{number} is {level}, and has no room for {amount} more"

    def _is_met(self, slot: str, state: TaskState) -> bool:
        request = self.requests[slot]
        return all(
            state.values.get(variable) == value for variable, value in request.values
        ) and all(
            least <= state.levels.get(number, -1) <= most for number, least, most in request.bounds
        )

    def lines(self) -> Iterator[str]:
        """Yields the task as text for people."""
        yield from (
            f"{variable} is {value}" for variable, value in sorted(self.state.values.items())
        )
        for number, limit in sorted(self.limits.items()):
            yield f"{number} is {self.state.levels.get(number, 'unknown')} of {limit}"
        for slot, request in self.requests.items():
            wishes = [f"{variable} = {value}" for variable, value in request.values]
            wishes += [f"{least} <= {number} <= {most}" for number, least, most in request.bounds]
            yield f"request {slot} wants {', '.join(wishes)}"
        yield from (f"request {slot} is out of reach" for slot in self.hopeless)
        yield from map(str, self.derivation.rules)
        for action in self.actions:
            yield from _describe(action)


def _happening(action: TaskAction, state: TaskState) -> List[Change]:
    """Returns the changes of an action whose conditions hold."""
    return [
        change
        for change in action.changes
        if all(state.values.get(variable) == value for variable, value in change.conditions)
    ]


def _describe(action: TaskAction) -> Iterator[str]:
    yield f"{action}, cost {action.cost}"
    needs = [f"{variable} = {value}" for variable, value in action.needs]
    needs += [f"{variable} != {value}" for variable, value in action.others]
    words = {Kind.LEAST: ">=", Kind.MOST: "<=", Kind.TAKES: ">="}
    needs += [f"{number} {words[kind]} {n}" for kind, number, n in action.numbers if kind in words]
    if needs:
        yield f"    needs {', '.join(needs)}"
    signs = {Kind.TAKES: "-=", Kind.ADDS: "+=", Kind.BECOMES: "="}
    effects: List[str] = []
    for change in action.changes:
        text = f"{change.variable} = {change.value}"
        given = " and ".join(f"{variable} = {value}" for variable, value in change.conditions)
        effects.append(f"{text} if {given}" if given else text)
    effects += [
        f"{number} {signs[kind]} {n}" for kind, number, n in action.numbers if kind in signs
    ]
    if effects:
        yield f"    {', '.join(effects)}"
