r"""Reads the planning task from the rows that answer sets show, see ``lib/task.lp``.

Rows of what is said in base are read once, all others with each search.

>>> reader = TaskReader()
>>> reader.read_facts(['base_action(arm,open)', 'base_needs(arm,open,"|",door,"|",shut)',
...                    'base_sets(arm,open,"|",door,"|",wide)'])
>>> task = reader.read(['task_is(door,"|",shut)', 'task_wish(1,"|",door,"|",wide)'])
>>> print(*task.lines(), sep="\n")
door is shut
request 1 wants door = wide
arm: open, cost 1
    needs door = shut
    door = wide
"""

from __future__ import annotations

from collections import defaultdict
from typing import Container, DefaultDict, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.engine.actions import ActionReader
from rosoclingo.engine.derived import Derivation, Rule
from rosoclingo.engine.moves import Moves
from rosoclingo.engine.relevance import Relevance
from rosoclingo.engine.rest import first_obstacle
from rosoclingo.engine.rows import (
    BASE,
    MOST_AMOUNT,
    SEARCH,
    SEPARATOR,
    TaskRows,
    joined,
    level_of,
    read_rows,
)
from rosoclingo.engine.task import (
    PlanningTask,
    TaskAction,
    TaskFact,
    TaskRequest,
    TaskState,
    TaskTimes,
)
from rosoclingo.engine.ways import WayMap
from rosoclingo.errors import TaskError

_OF_MAPS = ("way", "moves", "drains", "reserves", "speed")
_OF_TIMES = (
    "duration", "speed", "due", "limit_since", "weight", "ready", "keeps", "prefers", "earliest",
    "latest",
)  # fmt: skip
_PLAN = "plan_"
_WAY = "plan_way"


def plan_rows(symbols: Iterable[str]) -> Tuple[str, ...]:
    """Returns the rows of an answer set that say in which step each action of its plan ends."""
    return tuple(text for text in symbols if text.startswith(_PLAN))


class TaskReader:
    """Reads tasks of one encoding. One thread makes the calls.

    Attributes:
        has_facts: Whether it knows what is said in base.
    """

    def __init__(self) -> None:
        self.has_facts = False
        self._facts: TaskRows = {}
        self._actions = ActionReader({})
        self._derivation = Derivation()
        self._map = WayMap({})
        self._ways: object = None  # those of the map

    def read_facts(self, symbols: Iterable[str]) -> None:
        """Reads what is said in base."""
        self._facts = read_rows(symbols, BASE)
        self._actions = ActionReader(self._facts)
        self._derivation = _derivation(self._facts)
        self.has_facts = True
        self._ways = None

    def read(
        self,
        symbols: Iterable[str],
        followed: Iterable[str] = (),
        step: int = 0,
        ages: Optional[Mapping[str, float]] = None,
    ) -> PlanningTask:
        """Reads the task of a search: what is said in base, and what its answer set shows.

        Args:
            symbols: The answer set.
            followed: What :func:`plan_rows` has returned of the plan before.
            step: The current step, as the plan before counts steps.
            ages: How many seconds ago each request has come, by slots; now, if nothing is said.

        Raises:
            TaskError: A variable has two values.
        """
        new, limits, state, actions, moves = self._read(symbols)
        requests = _requests(new["wish"], limits)
        derivation = self._derivation
        failed = tuple(choice for (choice,) in new["failed"])
        relevance = Relevance(state, moves.reserving(actions), requests, moves, derivation)
        return PlanningTask(
            state,
            limits,
            relevance.actions,
            {slot: each for slot, each in requests.items() if slot not in relevance.hopeless},
            tuple(slot for slot in requests if slot in relevance.hopeless),
            _without(_left(followed, step, failed), [choice for (choice,) in new["busy"]]),
            min(((int(n), slot) for slot, n in new["overdue"]), default=(0, ""))[1],
            derivation,
            failed,
            tuple(variable for (variable,) in new["ripening"]),
            times=self._times(new, ages or {}),
        )

    def _times(self, new: TaskRows, ages: Mapping[str, float]) -> Optional[TaskTimes]:
        """Returns the times of a task; None if nothing is said of seconds."""
        rows = joined(
            {name: self._facts.get(name, []) for name in _OF_TIMES},
            {name: new.get(name, []) for name in _OF_TIMES},
        )
        if not any(rows.values()):
            return None
        due: Dict[str, int] = {}
        for name in ("due", "limit_since"):
            for slot, text in rows[name]:
                seconds = number(text)
                if seconds is not None:
                    seconds -= int(ages.get(slot, 0)) if name == "limit_since" else 0
                    due[slot] = min(seconds, due.get(slot, seconds))
        weights: Dict[str, int] = {}
        for slot, text in rows["weight"]:
            weights[slot] = max(0, level_of(text), weights.get(slot, 0))
        ready: Dict[TaskFact, int] = {}
        for variable, value, text in rows["ready"]:
            fact = variable, value
            ready[fact] = max(0, level_of(text), ready.get(fact, 0))
        keeps: Dict[TaskFact, int] = {}
        for variable, value, text in rows["keeps"]:
            fact, seconds = (variable, value), level_of(text)
            if seconds >= 0:
                keeps[fact] = min(seconds, keeps.get(fact, seconds))
        preferred = min(([*row, "0"] for row in rows["prefers"]), default=["waits", "0"])
        together = max(0, level_of(preferred[1]))
        free = {actuator: int(text) for actuator, text in new["free"]}
        since: Dict[str, int] = {}
        for name, text in new["since"]:
            since[name] = max(int(text), since.get(name, int(text)))
        earliest = {slot: int(text) for slot, text in new["earliest"]}
        latest = {slot: int(text) for slot, text in new["latest"]}
        return TaskTimes(
            due, weights, ready, keeps, earliest, latest, free, since, preferred[0], together
        )

    def obstacle(self, symbols: Iterable[str], plan: Iterable[str]) -> str:
        """Returns why a plan is not possible for a task; empty if it is.

        Args:
            symbols: The answer set that shows the task.
            plan: What :func:`plan_rows` has returned of the plan.

        Raises:
            TaskError: A variable has two values.
        """
        _, limits, state, actions, moves = self._read(symbols)
        return first_obstacle(state, limits, actions, moves, _left(plan, -1, ()))

    def _read(
        self, symbols: Iterable[str]
    ) -> Tuple[TaskRows, Dict[str, int], TaskState, List[TaskAction], Moves]:
        """Returns the rows of a search, the limits of numbers, the state, actions and moves."""
        new = defaultdict(list, read_rows(symbols, SEARCH))
        limits = {name: level_of(most) for name, most in new["limit"]}
        values = dict(new["is"])
        if len(values) < len(new["is"]):
            raise TaskError("a variable has two values")
        levels = {name: level_of(values.pop(name)) for name in limits if name in values}
        state = TaskState(values, {name: level for name, level in levels.items() if level >= 0})
        if new["affected"]:
            derived = dict(values)
            self._derivation.derive(derived, state.levels)
            values.update((name, derived[name]) for (name,) in new["affected"])
        rows = joined({name: self._facts.get(name, []) for name in _OF_MAPS}, new)
        actions = self._actions.read(new, limits)
        moves = Moves(
            self._map_of(rows),
            limits,
            actions,
            robots=rows["moves"],
            draining=rows["drains"],
            reserving=rows["reserves"],
            speeds=rows["speed"],
        )
        return new, limits, state, actions, moves

    def _map_of(self, rows: TaskRows) -> WayMap:
        closed = {(start, end) for start, end in rows["closed"]}
        lately = {(start, end): int(length) for start, end, length in rows["lately"]}
        key = (frozenset(closed), tuple(sorted(lately.items())))
        if self._ways != key:
            ways = {(start, end): int(length) for start, end, length in rows["way"]}
            ways.update((way, length) for way, length in lately.items() if way in ways)
            self._ways = key
            self._map = WayMap({way: n for way, n in ways.items() if way not in closed})
        return self._map


def _derivation(rows: TaskRows) -> Derivation:
    needs: DefaultDict[str, List[TaskFact]] = defaultdict(list)
    bounds: DefaultDict[str, List[Tuple[str, int, int]]] = defaultdict(list)
    for index, variable, value in rows.get("given", ()):
        needs[index].append((variable, value))
    for index, name, amount in rows.get("given_least", ()):
        bounds[index].append((name, int(amount), MOST_AMOUNT))
    for index, name, amount in rows.get("given_most", ()):
        bounds[index].append((name, 0, int(amount)))
    return Derivation(
        [variable for (variable,) in rows.get("derived", ())],
        [
            Rule(variable, tuple(needs[index]), tuple(bounds[index]))
            for index, variable in rows.get("rule", ())
        ],
    )


def _requests(rows: Sequence[Sequence[str]], limits: Dict[str, int]) -> Dict[str, TaskRequest]:
    values: DefaultDict[str, List[TaskFact]] = defaultdict(list)
    bounds: DefaultDict[str, Dict[str, Tuple[int, int]]] = defaultdict(dict)
    for slot, variable, value in rows:
        wished = values[slot]
        if variable not in limits:
            wished.append((variable, value))
            continue
        name, arguments = split_term(value)
        least, most = bounds[slot].get(variable, (0, limits[variable]))
        amount = number(arguments[0])
        if name == "least":
            least = max(least, MOST_AMOUNT + 1 if amount is None else amount)
        else:
            most = min(most, -1 if amount is None or amount > MOST_AMOUNT else amount)
        bounds[slot][variable] = least, most
    return {
        slot: TaskRequest(tuple(wished), tuple((name, *of) for name, of in bounds[slot].items()))
        for slot, wished in values.items()
    }


def _without(
    layers: Sequence[Sequence[TaskFact]], busy: Sequence[str]
) -> Sequence[Sequence[TaskFact]]:
    """Returns what is left of a plan without the actions that actuators are at.

    The state of a task is the one after these. An action that may be done twice, such as to charge,
    would be done again.

    Args:
        layers: What is left of the plan.
        busy: The actions under way, each after its actuator and a comma.
    """
    kept = [[*layer] for layer in layers]
    for choice in busy:
        prefix = f"{split_term(f'busy({choice})')[1][0]},"
        own = (
            (layer, fact)
            for layer in kept
            for fact in layer
            if not fact[1] and fact[0].startswith(prefix)
        )
        layer, fact = next(own, ([], ("", "")))
        if fact[0] == choice:
            layer.remove(fact)
    return [layer for layer in kept if layer]


def _left(
    followed: Iterable[str], step: int, failed: Container[str]
) -> Sequence[Sequence[TaskFact]]:
    """Returns what is left of a plan: ways and actions of each layer, in this order.

    Args:
        followed: TaskRows that say in which step each of them ends.
        step: The last step that is over.
        failed: The actions that have failed in it, and are done again.
    """
    layers: DefaultDict[int, Tuple[List[TaskFact], List[TaskFact]]] = defaultdict(lambda: ([], []))
    for text in followed:
        name, _, arguments = text[:-1].partition("(")
        layer, *what, end = arguments.split(SEPARATOR)
        is_way = name == _WAY
        choice = f"{what[0]},go({what[1]})" if is_way else what[0]
        if int(end) > step or (int(end) == step and choice in failed):
            layers[int(layer)][not is_way].append((what[0], what[1] if is_way else ""))
    return [[*ways, *actions] for _, (ways, actions) in sorted(layers.items())]
