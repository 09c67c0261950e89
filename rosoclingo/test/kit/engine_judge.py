"""Random small planning tasks, and a judge of plans that shares no code with the search."""

from __future__ import annotations

import random
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

from rosoclingo.engine.flat import FlatAction, FlatNumbers, FlatPairs, FlatRequest, FlatTask
from rosoclingo.engine.kinds import (
    ADDS,
    BECOMES,
    COST,
    MAKESPAN,
    NEEDS_LEAST,
    NEEDS_MOST,
    TAKES,
    WAITS,
)


class Moment(NamedTuple):
    """A state, with the requests that are met."""

    values: Tuple[int, ...]
    levels: Tuple[int, ...]
    met: Tuple[bool, ...]


def pairs(draw: random.Random, domains: Sequence[int], most: int) -> FlatPairs:
    chosen = draw.sample(range(len(domains)), draw.randint(0, min(most, len(domains))))
    return [(variable, draw.randrange(domains[variable])) for variable in chosen]


def random_numbers(draw: random.Random, limits: Sequence[int]) -> FlatNumbers:
    return [
        (draw.randint(TAKES, NEEDS_MOST), number, draw.randint(0, limits[number]))
        for number in draw.choices(range(len(limits)), k=draw.randint(0, 2))
    ]


def random_walk(draw: random.Random, task: FlatTask, length: int) -> List[Moment]:
    moments = [begin(task)]
    for _ in range(length):
        following = [after(task, moments[-1], action) for action in task.actions]
        possible = [one for one in following if one is not None and one not in moments]
        if not possible:
            break
        moments.append(draw.choice(possible))
    return moments


def random_request(draw: random.Random, task: FlatTask) -> FlatRequest:
    """Draws a request: mostly of what holds after some actions, else of anything."""
    if draw.random() < 0.1:
        return pairs(draw, task.domains, 3), []
    end = random_walk(draw, task, draw.randint(2, 9))[-1]
    values = [
        (variable, value)
        for variable, value in enumerate(end.values)
        if draw.random() < (0.2 if value == task.initial[variable] else 0.8)
    ]
    ranges = []
    for number, level in enumerate(end.levels):
        if draw.random() < 0.4:
            limit = task.limits[number]
            ranges.append((number, draw.randint(0, level), draw.randint(level, limit)))
    return values, ranges


def random_task(draw: random.Random, *, actors: int = 2, actions: int = 20) -> FlatTask:
    """Draws a task with each kind of need, effect and number."""
    domains = [draw.choice([1, 2, 3, 3, 4, 4]) for _ in range(draw.randint(3, 5))]
    limits = [draw.randint(1, 4) for _ in range(draw.randint(0, 2))]
    drawn: List[FlatAction] = []
    for _ in range(draw.randint(actions // 2, actions)):
        changed = pairs(draw, domains, 2) or [(0, draw.randrange(domains[0]))]
        effects = [
            (pairs(draw, domains, draw.choice([0, 0, 1, 2])), variable, value)
            for variable, value in changed
        ]
        drawn.append(
            (
                pairs(draw, domains, draw.choice([1, 1, 2])),
                pairs(draw, domains, draw.choice([0, 0, 1])),
                effects,
                random_numbers(draw, limits) if limits and draw.random() < 0.3 else [],
                draw.choice([0, 1, 1, 2, 3]),
                draw.randrange(-1, actors),
            )
        )
    initial = [draw.randrange(size) for size in domains]
    levels = [draw.randint(0, limit) for limit in limits]
    occupied = (
        [draw.choice([[], [], [0], [1], [0, 1]]) for _ in drawn] if draw.random() < 0.3 else []
    )
    task = FlatTask(domains, initial, limits, levels, [], drawn, occupied=occupied)
    requests = [random_request(draw, task) for _ in range(draw.choice([0, 1, 1, 2, 3, 4]))]
    return task._replace(requests=requests)


def random_derived_task(draw: random.Random, *, actors: int = 2, actions: int = 20) -> FlatTask:
    """Draws a task with derived variables, which actions need and requests want."""
    plain = random_task(draw, actors=actors, actions=actions)
    first = len(plain.domains)
    strata = [0]
    for _ in range(draw.randint(1, 4)):
        strata.append(strata[-1] + draw.randint(0, 1))
    derived = range(first, first + len(strata))
    rules = []
    for variable, stratum in zip(derived, strata):
        for _ in range(draw.choice([1, 1, 2, 3])):
            needs = pairs(draw, plain.domains, 2)
            other = draw.choice(derived)
            if strata[other - first] <= stratum and draw.random() < 0.7:
                needs.append((other, int(strata[other - first] == stratum or draw.random() < 0.4)))
            levels = []
            if plain.limits and draw.random() < 0.2:
                low = draw.randint(0, plain.limits[0])
                levels.append((0, low, draw.randint(low, plain.limits[0])))
            rules.append((needs, levels, variable, 1))

    def needing(action: FlatAction) -> FlatAction:
        needs, others, effects, *rest = action
        if draw.random() < 0.3:
            needs = [*needs, (draw.choice(derived), draw.randrange(2))]
        elif draw.random() < 0.1:
            others = [*others, (draw.choice(derived), draw.randrange(2))]
        if draw.random() < 0.2:
            conditions, variable, value = effects[0]
            more = (draw.choice(derived), draw.randrange(2))
            effects = [([*conditions, more], variable, value), *effects[1:]]
        return (needs, others, effects, *rest)

    task = plain._replace(
        domains=[*plain.domains, *(2 for _ in strata)],
        initial=[*plain.initial, *(0 for _ in strata)],
        actions=[needing(action) for action in plain.actions],
        requests=[],
        strata=tuple(
            [(v, 0) for v, s in zip(derived, strata) if s == stratum]
            for stratum in sorted(set(strata))
        ),
        rules=tuple(rules),
    )
    requests = [random_request(draw, task) for _ in range(draw.choice([1, 1, 2, 3]))]
    return task._replace(requests=requests)


def derive(task: FlatTask, moment: Moment) -> Moment:
    """Gives derived variables their values, by trying all rules again and again."""
    values = list(moment.values)
    for stratum in task.strata:
        here = dict(stratum)
        for variable, value in stratum:
            values[variable] = value
        is_new = True
        while is_new:
            is_new = False
            for needs, levels, variable, value in task.rules:
                if (
                    variable in here
                    and values[variable] != value
                    and all(values[one] == wanted for one, wanted in needs)
                    and all(low <= moment.levels[n] <= high for n, low, high in levels)
                ):
                    values[variable] = value
                    is_new = True
    return moment._replace(values=tuple(values))


def basis(task: FlatTask) -> Dict[int, Tuple[Set[int], Set[int]]]:
    """Returns the variables and numbers on which each derived variable rests."""
    found: Dict[int, Tuple[Set[int], Set[int]]] = {
        variable: (set(), set()) for stratum in task.strata for variable, _ in stratum
    }
    for _ in found:
        for needs, levels, variable, _ in task.rules:
            found[variable][1].update(number for number, _, _ in levels)
            for one, _ in needs:
                variables, numbers = found.get(one, ({one}, set()))
                found[variable][0].update(variables)
                found[variable][1].update(numbers)
    return found


def meet(task: FlatTask, moment: Moment) -> Moment:
    moment = derive(task, moment)
    met = tuple(
        before
        or (
            all(moment.values[variable] == value for variable, value in values)
            and all(least <= moment.levels[number] <= most for number, least, most in ranges)
        )
        for before, (values, ranges) in zip(moment.met, task.requests)
    )
    return moment._replace(met=met)


def begin(task: FlatTask) -> Moment:
    return meet(
        task,
        Moment(tuple(task.initial), tuple(task.levels), (False,) * len(task.requests)),
    )


def after(task: FlatTask, moment: Moment, action: FlatAction) -> Optional[Moment]:
    """Returns what holds after an action, None if it cannot be done."""
    needs, others, effects, numbers, _, _ = action
    values, levels = list(moment.values), list(moment.levels)
    if any(values[variable] != value for variable, value in needs):
        return None
    if any(values[variable] == value for variable, value in others):
        return None
    for number, level in enumerate(moment.levels):
        changes = [(kind, amount) for kind, one, amount in numbers if one == number]
        takes = sum(amount for kind, amount in changes if kind == TAKES)
        adds = sum(amount for kind, amount in changes if kind == ADDS)
        if takes > level or level + adds > task.limits[number]:
            return None
        if any(kind == NEEDS_LEAST and level < amount for kind, amount in changes):
            return None
        if any(kind == NEEDS_MOST and level > amount for kind, amount in changes):
            return None
        levels[number] += adds - takes
        for kind, amount in changes:
            if kind == BECOMES:
                levels[number] = amount
    for conditions, variable, value in effects:
        if all(moment.values[one] == wanted for one, wanted in conditions):
            values[variable] = value
    return meet(task, Moment(tuple(values), tuple(levels), moment.met))


def execute(task: FlatTask, plan: Sequence[int]) -> Optional[List[Moment]]:
    """Returns what holds at first and after each action; None if one of them is not possible."""
    moments = [begin(task)]
    for index in plan:
        moment = after(task, moments[-1], task.actions[index])
        if moment is None:
            return None
        moments.append(moment)
    return moments


def run(task: FlatTask, plan: Sequence[int]) -> Optional[List[Moment]]:
    """Returns what holds at first and after each action; None if that is no plan for all."""
    moments = execute(task, plan)
    return moments if moments and all(moments[-1].met) else None


def has_plan(task: FlatTask) -> bool:
    """Searches breadth-first."""
    known = {begin(task)}
    waiting = list(known)
    while waiting:
        moment = waiting.pop()
        if all(moment.met):
            return True
        for action in task.actions:
            following = after(task, moment, action)
            if following is not None and following not in known:
                known.add(following)
                waiting.append(following)
    return False


def random_timed_task(draw: random.Random, *, actors: int = 2, actions: int = 20) -> FlatTask:
    """Draws a task that counts seconds, without values that are kept for some time only."""
    task = random_task(draw, actors=actors, actions=actions)
    requests = range(len(task.requests))
    return task._replace(
        durations=[draw.randint(0, 9) for _ in task.actions],
        due=[
            (one, draw.randint(-5, 30), draw.randint(0, 3))
            for one in requests
            if draw.random() < 0.7
        ],
        ready=[
            (variable, draw.randrange(size), draw.randint(1, 20))
            for variable, size in enumerate(task.domains)
            if draw.random() < 0.3
        ],
        aim=(draw.randrange(3), draw.choice([0, 0, 1, 2])),
    )


class Item(NamedTuple):
    """An action, or a request that becomes met, with things by what it has to do with them."""

    reads: frozenset
    writes: frozenset
    takes: frozenset
    heeds: frozenset
    wants_room: frozenset
    alters: frozenset
    occupies: frozenset = frozenset()


def with_basis(task: FlatTask, item: Item) -> Item:
    """Returns an item that reads, too, on what derived variables rest."""
    found = [each for v, each in basis(task).items() if v in item.reads]
    numbers = frozenset(number for _, levels in found for number in levels)
    return item._replace(
        reads=item.reads.union(*(variables for variables, _ in found)),
        heeds=item.heeds | numbers,
        wants_room=item.wants_room | numbers,
    )


def item_of_action(task: FlatTask, index: int) -> Item:
    needs, others, effects, numbers, _, _ = task.actions[index]

    def of(*kinds: int) -> frozenset:
        return frozenset(number for kind, number, _ in numbers if kind in kinds)

    conditions = [pair for conditions, _, _ in effects for pair in conditions]
    return Item(
        frozenset(variable for variable, _ in [*needs, *others, *conditions]),
        frozenset(variable for _, variable, _ in effects),
        of(TAKES),
        of(NEEDS_LEAST, NEEDS_MOST),
        of(NEEDS_MOST),
        of(ADDS, BECOMES),
        frozenset(task.occupied[index] if task.occupied else ()),
    )


def item_of_request(task: FlatTask, request: FlatRequest) -> Item:
    values, ranges = request
    return Item(
        frozenset(variable for variable, _ in values),
        frozenset(),
        frozenset(),
        frozenset(number for number, _, _ in ranges),
        frozenset(number for number, _, most in ranges if most < task.limits[number]),
        frozenset(),
    )


def waits(later: Item, earlier: Item) -> bool:
    """Tells whether an item begins only when an earlier one has ended, as lib/order.lp has it."""
    return bool(
        earlier.writes & (later.reads | later.writes)
        or earlier.reads & later.writes
        or earlier.alters & (later.takes | later.heeds | later.alters)
        or earlier.takes & (later.alters | later.wants_room)
        or earlier.heeds & (later.alters | later.takes)
        or earlier.occupies & later.occupies
    )


class Schedule:
    """The times of a plan's items, by pairwise comparison."""

    def __init__(self, task: FlatTask) -> None:
        self._task = task
        self._ended: List[Tuple[Item, int]] = []
        self.met: Dict[int, int] = {}  # when each request is met
        self._actors: Dict[int, int] = {}
        self.makespan = 0
        self._add_met((False,) * len(task.requests), begin(task).met)

    def copy(self) -> Schedule:
        other = Schedule(self._task)
        other._ended, other._actors = list(self._ended), dict(self._actors)
        other.met = dict(self.met)
        other.makespan = self.makespan
        return other

    def key(self) -> tuple:
        return (
            frozenset(self._ended),
            tuple(sorted(self._actors.items())),
        )

    def _begin(self, item: Item) -> int:
        return max((end for other, end in self._ended if waits(item, other)), default=0)

    def _add(self, item: Item, end: int, effects: Sequence[Tuple[FlatPairs, int, int]]) -> None:
        """Adds an item; what it writes may be ready later than that is through."""
        late = {}
        for variable, value, seconds in self._task.ready:
            if any(pair[1:] == (variable, value) for pair in effects):
                late[variable] = end + seconds
        self._ended.append((item._replace(writes=item.writes - frozenset(late)), end))
        for variable, ready in late.items():
            nothing: frozenset = frozenset()
            only = Item(nothing, frozenset([variable]), *[nothing] * 4)
            self._ended.append((only, ready))

    def add(self, index: int, before: Moment, following: Moment) -> None:
        item = with_basis(self._task, item_of_action(self._task, index))
        cost, actor = self._task.actions[index][4:]
        lasts = self._task.durations[index] if self._task.durations else cost
        end = max(self._begin(item), self._actors.get(actor, 0) if actor >= 0 else 0) + lasts
        self._add(item, end, self._task.actions[index][2])
        if actor >= 0:
            self._actors[actor] = end
        self.makespan = max(self.makespan, end)
        self._add_met(before.met, following.met)

    def _add_met(self, before: Sequence[bool], met: Sequence[bool]) -> None:
        new = [number for number, was in enumerate(before) if met[number] and not was]
        items = [
            with_basis(self._task, item_of_request(self._task, self._task.requests[number]))
            for number in new
        ]
        times = [self._begin(item) for item in items]
        self._ended += zip(items, times)
        self.met.update(zip(new, times))


def value_of(task: FlatTask, plan: Sequence[int]) -> Tuple[int, ...]:
    """Returns makespan and cost of a plan, or the value that it has in seconds."""
    moments = run(task, plan)
    assert moments is not None
    schedule = Schedule(task)
    for index, before, following in zip(plan, moments, moments[1:]):
        schedule.add(index, before, following)
    cost = sum(task.actions[index][4] for index in plan)
    if not task.durations:
        return schedule.makespan, cost
    late = sum(weight * max(0, schedule.met[one] - due) for one, due, weight in task.due)
    makespan = max([schedule.makespan, *schedule.met.values()])
    preferred = {WAITS: sum(schedule.met.values()), MAKESPAN: makespan, COST: cost}[task.aim[0]]
    rest = makespan if task.aim[0] == COST else cost
    together = task.aim[1]
    return (0, late + together * preferred, rest) if together else (0, late, preferred, rest)


def least_makespan(task: FlatTask, bound: int) -> int:
    """Returns the least makespan of all plans, by trying all of them up to a bound."""

    def longer(moment: Moment, schedule: Schedule) -> Iterator[Tuple[Moment, Schedule]]:
        for index, action in enumerate(task.actions):
            following = after(task, moment, action)
            if following is not None:
                extended = schedule.copy()
                extended.add(index, moment, following)
                yield following, extended

    best = bound
    waiting = [(begin(task), Schedule(task))]
    known = set()
    while waiting:
        moment, schedule = waiting.pop()
        if all(moment.met):
            best = min(best, schedule.makespan)
            continue
        for following, extended in longer(moment, schedule):
            key = (following, extended.key())
            if extended.makespan < best and key not in known:
                known.add(key)
                waiting.append((following, extended))
    return best
