"""The planning task for a first plan, read from the terms that an answer set shows.

Encodings show it by terms whose parts are separated by ``"|"``, see ``lib/seed.lp`` of
rosoclingo_aspprograms.

>>> task = read_task(['seed_is(door,"|",shut)', 'seed_needs(arm,open,"|",door,"|",shut)',
...                   'seed_sets(arm,open,"|",door,"|",wide)', 'seed_wish(1,"|",door,"|",wide)'])
>>> task.initial, task.wishes
({'door': 'shut'}, {'1': {'door': 'wide'}})
>>> [(one.choice, one.needs, one.sets) for one in task.operators]
[('arm,open', {'door': 'shut'}, [('door', 'wide')])]
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import DefaultDict, Dict, List, Mapping, Sequence, Tuple

SeedFact = Tuple[str, str]
"""A variable and its value."""

_PREFIX = "seed_"
_SEPARATOR = ',"|",'


@dataclass(frozen=True)
class Effect:
    """An effect that happens only under conditions."""

    conditions: Mapping[str, str]
    fact: SeedFact


@dataclass(frozen=True)
class Operator:
    """An action, a robot's way, or a request that is met.

    Attributes:
        choice: The arguments of the atom that says it in a plan: an actuator and its action, or a
            robot and a place; empty for a request that is met.
        needs: The values of variables that it needs.
        others: Values that variables must not have.
        sets: Its effects.
        effects: Those that happen only under conditions.
        numbers: The numbers that it takes from, gives to or needs.
        cost: What it costs.
        robot: The robot that goes; empty if it is no way.
    """

    choice: str = ""
    needs: Mapping[str, str] = field(default_factory=dict)
    others: Sequence[SeedFact] = ()
    sets: Sequence[SeedFact] = ()
    effects: Sequence[Effect] = ()
    numbers: Sequence[str] = ()
    cost: int = 1
    robot: str = ""

    def is_possible(self, state: Mapping[str, str]) -> bool:
        """Tells whether variables have the values that it needs."""
        return all(state.get(variable) == value for variable, value in self.needs.items()) and all(
            state.get(variable) != value for variable, value in self.others
        )

    def apply(self, state: Dict[str, str]) -> None:
        """Gives variables the values that they have after it."""
        happening = [
            effect.fact for effect in self.effects if effect.conditions.items() <= state.items()
        ]
        state.update([*self.sets, *happening])


@dataclass(frozen=True)
class SeedTask:
    """Holds all that a planner needs for a first plan, without numbers.

    Attributes:
        initial: The variables' values now; a variable without one is lost.
        operators: What may be done.
        wishes: For each request, the values that variables are to have.
    """

    initial: Mapping[str, str]
    operators: Sequence[Operator]
    wishes: Mapping[str, Mapping[str, str]]


def position(robot: str) -> str:
    """Returns the variable that says where a robot is."""
    return f"at({robot})"


def read_task(symbols: Sequence[str]) -> SeedTask:
    """Reads the planning task that an answer set shows.

    Raises:
        ValueError: It does not show a task.
    """
    rows: DefaultDict[str, List[List[str]]] = defaultdict(list)
    for text in symbols:
        if text.startswith(_PREFIX):
            name, _, arguments = text[:-1].partition("(")
            rows[name[len(_PREFIX) :]].append(arguments.split(_SEPARATOR))
    wishes: DefaultDict[str, Dict[str, str]] = defaultdict(dict)
    for request, variable, value in rows["wish"]:
        wishes[request][variable] = value
    if sum(map(len, wishes.values())) < len(rows["wish"]):
        raise ValueError("a request wants a variable to have two values")
    return SeedTask(
        dict(_pairs(rows["is"])), [*_actions(rows), *_ways(rows["leads"])], dict(wishes)
    )


def _pairs(rows: Sequence[Sequence[str]]) -> List[SeedFact]:
    return [(variable, value) for variable, value in rows]


def _actions(rows: Mapping[str, Sequence[Sequence[str]]]) -> List[Operator]:
    needs, others, sets = (_facts(rows[name]) for name in ("needs", "other", "sets"))
    numbers: DefaultDict[str, List[str]] = defaultdict(list)
    for action, number in rows["counts"]:
        numbers[action].append(number)
    conditions: DefaultDict[Tuple[str, str], List[SeedFact]] = defaultdict(list)
    for action, index, variable, value in rows["condition"]:
        conditions[action, index].append((variable, value))
    effects: DefaultDict[str, List[Effect]] = defaultdict(list)
    for action, index, variable, value in rows["sets_if"]:
        needed = conditions[action, index]
        if len(dict(needed)) == len(needed):  # else it never happens
            effects[action].append(Effect(dict(needed), (variable, value)))
    costs = {action: int(cost) for action, cost in rows["costs"]}
    return [
        Operator(
            action,
            dict(needs[action]),
            others[action],
            sets[action],
            effects[action],
            numbers[action],
            costs.get(action, 1),
        )
        for action in dict.fromkeys([*sets, *effects])
        if len(dict(needs[action])) == len(needs[action])  # else it is never possible
    ]


def _facts(rows: Sequence[Sequence[str]]) -> DefaultDict[str, List[SeedFact]]:
    """Returns the facts of each action."""
    facts: DefaultDict[str, List[SeedFact]] = defaultdict(list)
    for action, variable, value in rows:
        facts[action].append((variable, value))
    return facts


def _ways(rows: Sequence[Sequence[str]]) -> List[Operator]:
    return [
        Operator(
            f"{robot},{goal}",
            needs={position(robot): start},
            sets=[(position(robot), goal)],
            cost=int(length),
            robot=robot,
        )
        for robot, start, goal, length in rows
    ]
