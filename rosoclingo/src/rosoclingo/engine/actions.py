"""Makes the actions of a task of what rows say of them."""

from __future__ import annotations

from collections import defaultdict
from typing import (
    DefaultDict,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from rosclingo.wire.term_text import number, split_term
from rosoclingo.engine.rows import MOST_AMOUNT, TaskRows, joined, level_of, unique
from rosoclingo.engine.task import Change, Kind, TaskAction, TaskFact

_CONDITION, _EFFECT, _FILLS = "condition", "sets_if", "fills"
_OF_ACTIONS = ("action", "needs", "other", "sets", _FILLS, "uses", "gives", "least", "most",
               "occupies", "costs", "duration", "learned", _CONDITION, _EFFECT)  # fmt: skip


class ActionReader:
    """Reads the actions of searches; those of which base says all are read once.

    One thread makes the calls.
    """

    def __init__(self, facts: TaskRows) -> None:
        """Takes what is said in base."""
        self._facts = facts
        self._limits: Dict[str, int] = {}
        self._variables = {
            row[1] if name == _FILLS else row[-2]
            for name in _OF_ACTIONS[1:]
            for row in facts.get(name, ())
        }
        self._known: Optional[Dict[str, TaskAction]] = None
        limits: Dict[str, int] = {}
        for name, limit in facts.get("number", ()):
            limits[name] = min(level_of(limit), limits.get(name, MOST_AMOUNT))
        self.read({}, limits)

    def read(self, rows: TaskRows, limits: Mapping[str, int]) -> List[TaskAction]:
        """Returns the actions that can be done at all.

        Args:
            rows: What a search alone knows.
            limits: The largest level of each number.
        """
        mine = {name: limit for name, limit in limits.items() if name in self._variables}
        if self._known is None or mine != self._limits:
            self._limits = mine
            self._known = dict(_read_actions(self._facts, limits))
        touched = {row[0] for name in _OF_ACTIONS for row in rows.get(name, ())}
        if not touched:
            return list(self._known.values())
        facts = {
            name: [row for row in self._facts.get(name, ()) if row[0] in touched]
            for name in _OF_ACTIONS
        }
        kept = [action for choice, action in self._known.items() if choice not in touched]
        new = dict(_read_actions(joined(facts, rows), limits))
        return [*kept, *new.values()]


class _Said:
    """Collects what is said of one action."""

    __slots__ = ("changes", "costs", "durations", "needs", "numbers", "occupies", "others", "turns")

    def __init__(self) -> None:
        self.needs: List[TaskFact] = []
        self.others: List[TaskFact] = []
        self.changes: List[Change] = []
        self.numbers: Dict[Tuple[Kind, str], int] = {}
        self.turns: Dict[str, Set[int]] = {}
        self.occupies: List[str] = []
        self.costs: Set[int] = set()
        self.durations: Set[int] = set()


def _read_actions(rows: TaskRows, limits: Mapping[str, int]) -> Iterator[Tuple[str, TaskAction]]:
    """Yields the actions that can be done at all, each with its actuator and name as one text."""
    rows = defaultdict(list, rows)
    said: Dict[str, _Said] = {row[0]: _Said() for row in rows["action"]}
    for choice, variable, value in _known(rows["needs"], said):
        one = said[choice]
        if variable in limits:
            _bound(one, Kind.LEAST, variable, value)
            _bound(one, Kind.MOST, variable, value)
        else:
            one.needs.append((variable, value))
    for choice, variable, value in _known(rows["other"], said):
        said[choice].others.append((variable, value))
    for choice, variable, value in _known(rows["sets"], said):
        if variable in limits:
            said[choice].turns.setdefault(variable, set()).add(level_of(value))
        else:
            said[choice].changes.append(Change(variable, value))
    for choice, variable in _known(rows[_FILLS], said):
        if variable in limits:
            said[choice].turns.setdefault(variable, set()).add(limits[variable])
    for name, kind in (("uses", Kind.TAKES), ("gives", Kind.ADDS)):
        for choice, variable, value in _known(unique(rows[name]), said):
            if variable in limits:
                numbers = said[choice].numbers
                before = numbers.get((kind, variable), 0)
                amount = level_of(value)
                numbers[kind, variable] = MOST_AMOUNT + 1 if amount < 0 else before + amount
    for name, kind in (("least", Kind.LEAST), ("most", Kind.MOST)):
        for choice, variable, value in _known(rows[name], said):
            if variable in limits:
                _bound(said[choice], kind, variable, value)
    for choice, what in _known(rows["occupies"], said):
        said[choice].occupies.append(what)
    for choice, cost in _known(rows["costs"], said):
        said[choice].costs.add(number(cost) or 0)
    for choice, seconds in _known(rows["duration"], said):
        said[choice].durations.add(level_of(seconds))
    for choice, seconds in _known(rows["learned"], said):
        said[choice].durations = {level_of(seconds)}
    conditions: DefaultDict[Tuple[str, str], List[TaskFact]] = defaultdict(list)
    for choice, index, variable, value in rows[_CONDITION]:
        conditions[choice, index].append((variable, value))
    for choice, index, variable, value in _known(rows[_EFFECT], said):
        needed = conditions[choice, index]
        if len(dict(needed)) == len(set(needed)):  # else it never happens
            said[choice].changes.append(Change(variable, value, tuple(dict.fromkeys(needed))))
    for choice, one in said.items():
        action = _action(choice, one, limits)
        if action is not None:
            yield choice, action


def _known(rows: Iterable[Sequence[str]], said: Mapping[str, _Said]) -> Iterator[Sequence[str]]:
    return (row for row in rows if row[0] in said)


def _bound(one: _Said, kind: Kind, variable: str, value: str) -> None:
    """Adds a bound of a number: the strictest one counts."""
    amount = number(value)
    key = kind, variable
    if kind is Kind.LEAST:
        amount = MOST_AMOUNT + 1 if amount is None else amount
        one.numbers[key] = max(one.numbers.get(key, amount), amount)
    else:
        amount = -1 if amount is None or amount > MOST_AMOUNT else amount
        one.numbers[key] = min(one.numbers.get(key, amount), amount)


def _action(choice: str, one: _Said, limits: Mapping[str, int]) -> Optional[TaskAction]:
    """Returns an action, None if it can never be done."""
    set_values = {(each.variable, each.value) for each in one.changes if not each.conditions}
    for facts in (set(one.needs), set_values):
        if len(dict(facts)) < len(facts):
            return None
    if -1 in one.durations:
        return None
    for (kind, name), amount in one.numbers.items():
        is_bounded = amount < 0 if kind is Kind.MOST else amount > limits[name]
        changes_twice = kind in (Kind.TAKES, Kind.ADDS) and name in one.turns
        if is_bounded or changes_twice:
            return None
    for name, turns in one.turns.items():
        (level, *more) = turns
        if more or not 0 <= level <= limits[name]:
            return None
        one.numbers[Kind.BECOMES, name] = level
    actuator, action = split_term(f"x({choice})")[1]
    return TaskAction(
        actuator,
        action,
        needs=tuple(dict.fromkeys(one.needs)),
        others=tuple(dict.fromkeys(one.others)),
        changes=tuple(one.changes),
        numbers=tuple((kind, name, amount) for (kind, name), amount in one.numbers.items()),
        occupies=tuple(one.occupies),
        cost=sum(one.costs) if one.costs else 1,
        seconds=max(one.durations, default=1),
    )
