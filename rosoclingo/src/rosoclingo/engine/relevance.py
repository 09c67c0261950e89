"""Finds the part of a task that can be reached and may help."""

from __future__ import annotations

from collections import defaultdict
from typing import DefaultDict, Dict, Iterable, List, Mapping, Sequence, Set, Tuple

from rosoclingo.engine.derived import NO, UNDERIVED, YES, Derivation, Rule
from rosoclingo.engine.moves import Moves
from rosoclingo.engine.task import Change, Kind, TaskAction, TaskFact, TaskRequest, TaskState

_RAISES = (Kind.ADDS, Kind.BECOMES)
_LOWERS = (Kind.TAKES, Kind.BECOMES)


class Relevance:
    """The part of a task that matters.

    What is reached is a superset of what can be: actions are taken to undo nothing, and numbers to
    be large enough.

    Attributes:
        actions: What may be done and may help, with the ways of robots.
        hopeless: The requests of which some wish cannot be reached.
    """

    def __init__(
        self,
        state: TaskState,
        actions: Sequence[TaskAction],
        requests: Mapping[str, TaskRequest],
        moves: Moves,
        derivation: Derivation = UNDERIVED,
    ) -> None:
        self._state = state
        self._derivation = derivation
        self._rules_of: DefaultDict[str, List[Rule]] = defaultdict(list)
        for rule in derivation.rules:
            self._rules_of[rule.variable].append(rule)
        actions = [*actions, *map(_as_action, derivation.rules)]
        self._moves = moves
        self._requests = requests
        self._robots = {f"at({robot})": robot for robot in moves.robots}
        self._spots: DefaultDict[str, Dict[str, None]] = defaultdict(dict)  # by at(R)
        for fact in _asked(actions, requests) if self._robots else ():
            if fact[0] in self._robots:
                self._spots[fact[0]][fact[1]] = None
        self._reached: Dict[TaskFact, None] = {}
        self._possible = self._find_possible(actions)
        self._reached_of: DefaultDict[str, List[TaskFact]] = defaultdict(list)  # by variable
        for fact in self._reached:
            self._reached_of[fact[0]].append(fact)
        self.hopeless = {
            slot for slot, request in requests.items() if not self._is_reached(request)
        }
        self.actions = self._find_helpful()

    # Forwards.

    def _find_possible(self, actions: Sequence[TaskAction]) -> List[TaskAction]:
        reached, values, robots = self._reached, self._state.values, self._robots
        waiting: DefaultDict[TaskFact, List[int]] = defaultdict(list)
        differing: DefaultDict[str, List[Tuple[str, int]]] = defaultdict(list)
        missing: List[int] = []
        possible: List[int] = []
        new: List[TaskFact] = list(values.items())
        reached.update(dict.fromkeys(new))

        def do(number: int) -> None:
            possible.append(number)
            for change in actions[number].changes:
                reach((change.variable, change.value))

        def reach(fact: TaskFact) -> None:
            if fact not in reached:
                reached[fact] = None
                new.append(fact)

        for number, action in enumerate(actions):
            conditions = len(action.needs)
            for fact in action.needs:
                waiting[fact].append(number)
            for variable, value in action.others:
                if values.get(variable) == value:
                    differing[variable].append((value, number))
                    conditions += 1
            missing.append(conditions)
        for derived in self._derivation.strata:  # what it rests on may not hold any more
            reach((derived, NO))
        for number, conditions in enumerate(missing):
            if not conditions:
                do(number)
        while new:
            fact = new.pop()
            variable, value = fact
            fulfilled = waiting.pop(fact, [])
            if variable in differing:
                waiting_for_others = differing.pop(variable)
                fulfilled += [
                    number for unwanted, number in waiting_for_others if unwanted != value
                ]
                rest = [each for each in waiting_for_others if each[0] == value]
                if rest:
                    differing[variable] = rest
            for number in fulfilled:
                missing[number] -= 1
                if not missing[number]:
                    do(number)
            if variable in robots:
                spots = [p for p in self._spots[variable] if (variable, p) not in reached]
                for way in self._moves.ways(robots[variable], value, spots):
                    reach((variable, way.name))
        return [actions[number] for number in sorted(possible)]

    def _is_reached(self, request: TaskRequest) -> bool:
        for fact in request.values:
            if fact not in self._reached:
                return False
        for number, least, most in request.bounds:
            level = self._state.levels.get(number, -1)
            if level < least and not self._may_become(number, least, is_least=True):
                return False
            if level > most and not self._may_become(number, most, is_least=False):
                return False
        return True

    def _may_become(self, number: str, bound: int, *, is_least: bool) -> bool:
        if bound < 0:
            return False
        kinds = _RAISES if is_least else _LOWERS
        changing = (
            kind in kinds
            and name == number
            and (kind is not Kind.BECOMES or _fits(n, bound, is_least))
            for action in self._possible
            for kind, name, n in action.numbers
        )
        return any(changing) or (not is_least and number in self._moves.drained)

    # Backwards.

    def _find_helpful(self) -> List[TaskAction]:
        achievers: DefaultDict[object, List[TaskAction]] = defaultdict(list)
        for action in self._possible:
            for change in action.changes:
                achievers[change.variable, change.value].append(action)
            for kind, name, _ in action.numbers:
                if kind in _RAISES:
                    achievers[name, True].append(action)
                if kind in _LOWERS:
                    achievers[name, False].append(action)
        helpful: Dict[int, TaskAction] = {}
        robots: Set[str] = set()
        new: List[object] = []
        known: Set[object] = set()

        def want(what: object) -> None:
            if what not in known:
                known.add(what)
                new.append(what)

        def want_values(variable: str, without: str = "") -> None:
            for fact in self._reached_of[variable]:
                if fact[1] != without:
                    want(fact)

        for slot, request in self._requests.items():
            if slot not in self.hopeless:
                for fact in request.values:
                    want(fact)
                for number, _, _ in request.bounds:
                    want((number, True))
                    want((number, False))
        while new:
            what = new.pop()
            assert isinstance(what, tuple)
            for rule in self._rules_of.get(what[0], ()) if what[1] == NO else ():
                for variable, value in rule.needs:
                    want_values(variable, value)
                for name, _, _ in rule.bounds:
                    want((name, True))
                    want((name, False))
            robot = self._robots.get(what[0])
            if robot and robot not in robots:
                robots.add(robot)
                want_values(what[0])
                for name in self._moves.numbers_of(robot):
                    want((name, True))
            for action in achievers.get(what, ()):
                if id(action) in helpful:
                    continue
                helpful[id(action)] = action
                for fact in action.needs:
                    want(fact)
                for variable, value in action.others:
                    want_values(variable, value)
                for change in action.changes:
                    for variable, _ in change.conditions:
                        want_values(variable)
                for kind, name, _ in action.numbers:
                    if kind in (Kind.TAKES, Kind.LEAST):
                        want((name, True))
                    elif kind in (Kind.ADDS, Kind.MOST):
                        want((name, False))
        ordered = [
            action
            for action in self._possible
            if id(action) in helpful and action.actuator  # none does what is derived
        ]
        return [*ordered, *self._ways(ordered, sorted(robots))] if robots else ordered

    def _ways(self, actions: Sequence[TaskAction], robots: Sequence[str]) -> Iterable[TaskAction]:
        """Yields the ways of robots to where something may be done."""
        requests = {slot: r for slot, r in self._requests.items() if slot not in self.hopeless}
        spots: DefaultDict[str, Dict[str, None]] = defaultdict(dict)
        stands: DefaultDict[str, Dict[str, None]] = defaultdict(dict)
        for variable, value in _asked(actions, requests):
            spots[variable][value] = None
        for action in actions:
            for change in action.changes:
                stands[change.variable][change.value] = None
        for robot in robots:
            variable = f"at({robot})"
            ends = [place for place in spots[variable] if (variable, place) in self._reached]
            now = self._state.values.get(variable)
            starts = dict.fromkeys([*([] if now is None else [now]), *ends, *stands[variable]])
            for start in starts:
                if (variable, start) in self._reached:
                    yield from self._moves.ways(robot, start, ends)


def _as_action(rule: Rule) -> TaskAction:
    """Returns a rule as an action that derives its variable."""
    levels = [
        (kind, name, level)
        for name, least, most in rule.bounds
        for kind, level in ((Kind.LEAST, least), (Kind.MOST, most))
    ]
    return TaskAction(
        "", rule.variable, needs=rule.needs, changes=(Change(rule.variable, YES),),
        numbers=tuple(levels),
    )  # fmt: skip


def _fits(amount: int, bound: int, is_least: bool) -> bool:
    return amount >= bound if is_least else amount <= bound


def _asked(
    actions: Iterable[TaskAction], requests: Mapping[str, TaskRequest]
) -> Iterable[TaskFact]:
    """Yields the facts that actions need, and that requests want."""
    for action in actions:
        yield from action.needs
        for change in action.changes:
            yield from change.conditions
    for request in requests.values():
        yield from request.values
