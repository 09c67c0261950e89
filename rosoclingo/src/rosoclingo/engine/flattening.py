"""Turns a task into integers, for the search."""

from __future__ import annotations

from collections import defaultdict
from typing import Any, DefaultDict, Dict, List, Set, Tuple

from rosoclingo.engine import kinds
from rosoclingo.engine.derived import NO, YES, Rule
from rosoclingo.engine.flat import FlatAction, FlatEffects, FlatPairs, FlatRule, FlatTask
from rosoclingo.engine.task import PlanningTask, TaskAction, TaskFact, TaskRequest

_HARD = 100  # the value of each second after which a request is of no use
_OVERDUE = 10  # that of each second that one waits which has waited too long
_AIMS = {"waits": kinds.WAITS, "makespan": kinds.MAKESPAN, "cost": kinds.COST}


def flatten(task: PlanningTask) -> FlatTask:
    """Returns a task in integers; its actions have the same numbers."""
    return _Flattener(task).flat()


class _Facts(Dict[TaskFact, Tuple[int, int]]):
    """The numbers of variables and values, by facts; a new fact gets new ones."""

    def __init__(self) -> None:
        self.variables: Dict[str, int] = {}
        self.by_variable: List[Dict[str, int]] = []

    def __missing__(self, fact: TaskFact) -> Tuple[int, int]:
        variable, value = fact
        number = self.variables.setdefault(variable, len(self.variables))
        if number == len(self.by_variable):
            self.by_variable.append({})
        values = self.by_variable[number]
        found = self[fact] = number, values.setdefault(value, len(values))
        return found


class _Flattener:
    """Numbers the values, variables, numbers and actuators that matter."""

    def __init__(self, task: PlanningTask) -> None:
        self._task = task
        self._facts = _Facts()
        self._numbers = {name: number for number, name in enumerate(task.limits)}
        self._read: Set[str] = set()  # variables whose values matter
        for action in task.actions:
            self._read.update([variable for variable, _ in action.needs])
            if action.others:
                self._read.update([variable for variable, _ in action.others])
            for change in action.changes:
                if change.conditions:
                    self._read.update([variable for variable, _ in change.conditions])
        for request in task.requests.values():
            self._read.update([variable for variable, _ in request.values])
        self._read = task.derivation.closure(self._read)
        self._actuators: DefaultDict[str, int] = defaultdict(lambda: len(self._actuators))

    def flat(self) -> FlatTask:
        task, facts = self._task, self._facts
        actions = [self._action(action) for action in task.actions]
        requests = [self._request(request) for request in task.requests.values()]
        rules = [self._rule(rule) for rule in task.derivation.rules if rule.variable in self._read]
        strata = self._strata()
        # A variable that has no value, or one that nothing asks for, has a value of its own.
        initial = [facts[name, task.state.values.get(name, "")][1] for name in facts.variables]
        return FlatTask(
            domains=[len(values) for values in facts.by_variable],
            initial=initial,
            limits=list(task.limits.values()),
            levels=[task.state.levels.get(name, -1) for name in task.limits],
            requests=requests,
            actions=actions,
            strata=tuple(strata),
            rules=tuple(rules),
            occupied=self._occupied(),
            **self._times(),
        )

    def _times(self) -> Dict[str, Any]:
        """Returns the fields of a task that counts seconds."""
        times = self._task.times
        if times is None:
            return {}
        slots = {slot: number for number, slot in enumerate(self._task.requests)}
        due = [
            (slots[slot], seconds, times.weights.get(slot, 1))
            for slot, seconds in times.due.items()
            if slot in slots
        ]
        due += [(slots[slot], n, _HARD) for slot, n in times.latest.items() if slot in slots]
        if self._task.elder in slots:
            due.append((slots[self._task.elder], 0, _OVERDUE))
        facts = self._facts  # nothing depends on the values that these do not have
        return {
            "durations": [action.seconds for action in self._task.actions],
            "due": due,
            "ready": [(*facts[f], n) for f, n in times.ready.items() if f in facts],
            "keeps": [(*facts[f], n) for f, n in times.keeps.items() if f in facts],
            "free": [
                (self._actuators[name], seconds)
                for name, seconds in times.free.items()
                if name in self._actuators
            ],
            "since": [
                (facts.variables[name], seconds)
                for name, seconds in times.since.items()
                if name in facts.variables
            ],
            "levels_since": [
                (self._numbers[name], seconds)
                for name, seconds in times.since.items()
                if name in self._numbers
            ],
            "earliest": [(slots[s], n) for s, n in times.earliest.items() if s in slots],
            "aim": (_AIMS.get(times.prefers, kinds.WAITS), times.together),
        }

    def _occupied(self) -> List[List[int]]:
        """Returns what keeps actions of several actuators from going on at once.

        This is what they occupy, and variables that they change and that nothing asks for.
        """
        users: DefaultDict[Tuple[str, str], Set[str]] = defaultdict(set)
        of_actions: List[List[Tuple[str, str]]] = []
        for action in self._task.actions:
            things = [("thing", thing) for thing in action.occupies]
            things += [
                ("variable", change.variable)
                for change in action.changes
                if change.variable not in self._read
            ]
            of_actions.append(things)
            for thing in things:
                users[thing].add(action.actuator)
        shared = [thing for thing, actuators in users.items() if len(actuators) > 1]
        if not shared:
            return []
        numbers = {thing: number for number, thing in enumerate(shared)}
        return [
            [numbers[thing] for thing in dict.fromkeys(things) if thing in numbers]
            for things in of_actions
        ]

    def _action(self, action: TaskAction) -> FlatAction:
        facts, read = self._facts, self._read
        needs = [facts[fact] for fact in action.needs]
        others = [facts[fact] for fact in action.others] if action.others else []
        effects: FlatEffects = []
        for change in action.changes:
            variable = change.variable
            if variable in read:
                given = [facts[fact] for fact in change.conditions] if change.conditions else []
                effects.append((given, *facts[variable, change.value]))
        numbers = (
            [(int(kind), self._numbers[name], amount) for kind, name, amount in action.numbers]
            if action.numbers
            else []
        )
        return needs, others, effects, numbers, action.cost, self._actuators[action.actuator]

    def _rule(self, rule: Rule) -> FlatRule:
        facts = self._facts
        return (
            [facts[fact] for fact in rule.needs],
            [(self._numbers[name], least, most) for name, least, most in rule.bounds],
            *facts[rule.variable, YES],
        )

    def _strata(self) -> List[FlatPairs]:
        strata: Dict[int, FlatPairs] = {}
        for name, stratum in self._task.derivation.strata.items():
            if name in self._read:
                strata.setdefault(stratum, []).append(self._facts[name, NO])
        return [strata[stratum] for stratum in sorted(strata)]

    def _request(
        self, request: TaskRequest
    ) -> Tuple[List[Tuple[int, int]], List[Tuple[int, int, int]]]:
        return (
            [self._facts[fact] for fact in request.values],
            [(self._numbers[name], least, most) for name, least, most in request.bounds],
        )
