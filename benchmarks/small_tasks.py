"""Small random tasks with time, as encodings for actions.lp, their optima, and a judge of plans.

Two robots do two to four jobs: they do something at a place, or take a thing from one place to
another. Before it is taken, a cook may prepare it, or a robot loads an oven with it, and fetches it
when it is ready. The optima are found by enumeration: all ways to share the jobs among the robots
and cooks, in all orders, each timed as early as it can be. No code is shared with the planner.
"""

from __future__ import annotations

import itertools
import random
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Set, Tuple

from time_tasks import Act, write_task

PREFERENCES = ("waits", "makespan", "cost")
MOST_ORDERS = 60_000  # of a task
_ENCODING = """
moves(R) :- robot(R).
actuator(C) :- cook(C).
initially(at(R),V) :- start(R,V).
number(room(R),N) :- robot(R), room(N).
request(serve(I)) :- takes(put,I,N).

#program present(k,t).
% job(ID,I,K): so says the request in slot ID. acts(R,A,I,K): R can do A for job I.
job(ID,I,k) :- asked(ID,serve(I),k).
acts(R,(load;pick;put),I,k) :- robot(R), job(ID,I,k).
acts(C,cook,I,k) :- cook(C), job(ID,I,k).
own(ID,where(ID),there,k) :- job(ID,I,k).
own(ID,food(ID),raw,k) :- job(ID,I,k).
wants(ID,where(ID),done,k) :- job(ID,I,k).
due(ID,N,k) :- job(ID,I,k), due_in(I,N).
weight(ID,P,k) :- job(ID,I,k), late_weight(I,P).
ready(food(ID),hot,N,k) :- job(ID,I,k), ready_after(I,N).
at_most(food(ID),hot,N,k) :- job(ID,I,k), fresh(I,N).
at_most(where(ID),R,N,k) :- job(ID,I,k), carried(I,N), robot(R).

action(R,cook(I),k) :- acts(R,cook,I,k), takes(cook,I,N).
action(R,load(I),k) :- acts(R,load,I,k), takes(load,I,N).
action(R,pick(I),k) :- acts(R,pick,I,k), takes(pick,I,N).
action(R,put(I),k) :- acts(R,put,I,k).
duration(R,cook(I),N,k) :- acts(R,cook,I,k), takes(cook,I,N).
duration(R,load(I),N,k) :- acts(R,load,I,k), takes(load,I,N).
duration(R,pick(I),N,k) :- acts(R,pick,I,k), takes(pick,I,N).
duration(R,put(I),N,k) :- acts(R,put,I,k), takes(put,I,N).
needs(R,load(I),at(R),V,k) :- acts(R,load,I,k), spot(load,I,V).
needs(R,pick(I),at(R),V,k) :- acts(R,pick,I,k), spot(pick,I,V).
needs(R,put(I),at(R),V,k) :- acts(R,put,I,k), spot(put,I,V).

needs(R,A,food(ID),raw,k) :- job(ID,I,k), acts(R,(cook;load),I,k), A = (cook(I);load(I)).
sets(R,A,food(ID),hot,k) :- job(ID,I,k), acts(R,(cook;load),I,k), A = (cook(I);load(I)).
needs(R,pick(I),food(ID),hot,k) :- job(ID,I,k), acts(R,pick,I,k), takes((cook;load),I,N).
sets(R,pick(I),food(ID),taken,k) :- job(ID,I,k), acts(R,pick,I,k), takes((cook;load),I,N).
needs(R,pick(I),where(ID),there,k) :- job(ID,I,k), acts(R,pick,I,k).
sets(R,pick(I),where(ID),R,k) :- job(ID,I,k), acts(R,pick,I,k).
uses(R,pick(I),room(R),1,k) :- acts(R,pick,I,k).
needs(R,put(I),where(ID),R,k) :- job(ID,I,k), acts(R,put,I,k), takes(pick,I,N).
needs(R,put(I),where(ID),there,k) :- job(ID,I,k), acts(R,put,I,k), not takes(pick,I,_).
sets(R,put(I),where(ID),done,k) :- job(ID,I,k), acts(R,put,I,k).
gives(R,put(I),room(R),1,k) :- acts(R,put,I,k), takes(pick,I,N).
"""


class Optimum(NamedTuple):
    """The value of a plan, which is to be as small as possible, part by part.

    Attributes:
        late: The weighted lateness; with what is preferred if both count together.
        preferred: What is preferred; 0 if both count together.
    """

    late: int
    preferred: int


@dataclass
class Job:
    """What a request wants.

    Attributes:
        takes: The seconds of each of its actions: cook or load, pick, and put.
        spots: Where each of these is done, but cooking.
        ready: The seconds from the end of cooking or loading until the thing is ready.
        fresh: The seconds after which it may not be picked up any more.
        carried: The seconds after which it may not be carried any more.
        due: The second after which it is late.
        weight: Of each second of that.
    """

    takes: Dict[str, int]
    spots: Dict[str, str]
    ready: int = 0
    fresh: Optional[int] = None
    carried: Optional[int] = None
    due: Optional[int] = None
    weight: int = 1

    @property
    def preparing(self) -> str:
        """The action that prepares the thing; "" for none."""
        return next((kind for kind in ("cook", "load") if kind in self.takes), "")


class Order(NamedTuple):
    """An action of a job."""

    kind: str
    job: int


@dataclass
class SmallTask:
    """A task.

    Attributes:
        name: Its seed and what it prefers.
        ways: The length of each way, in both directions.
        starts: Where each robot is at first.
        speeds: How many percent of a way's length each robot needs.
        room: How much each robot can carry.
        cooks: How many cooks there are.
        jobs: What is to be done.
        prefers: What is minimised after lateness.
        together: If positive, what that counts together with lateness.
    """

    name: str
    ways: List[Tuple[str, str, int]]
    starts: List[str]
    speeds: List[int]
    room: int
    cooks: int
    jobs: List[Job]
    prefers: str
    together: int

    def __post_init__(self) -> None:
        self.goals = [f"serve({number})" for number in range(len(self.jobs))]
        places = {place for start, end, _ in self.ways for place in (start, end)}
        far = 10**6
        self.lengths = {(v, w): 0 if v == w else far for v in places for w in places}
        for start, end, length in self.ways:
            self.lengths[start, end] = self.lengths[end, start] = length
        for via, start, end in itertools.product(places, repeat=3):
            length = self.lengths[start, via] + self.lengths[via, end]
            self.lengths[start, end] = min(self.lengths[start, end], length)

    @property
    def robots(self) -> List[str]:
        """The robots' names."""
        return [f"r({number})" for number in range(len(self.starts))]

    def seconds(self, robot: int, start: str, end: str) -> int:
        """Returns how long a robot needs from one place to another."""
        return -(-self.lengths[start, end] * self.speeds[robot] // 100)

    def value(self, ends: Sequence[int], length: int) -> Optimum:
        """Returns the value of a plan.

        Args:
            ends: When each job is done.
            length: Of all ways that robots go.
        """
        late = sum(
            job.weight * max(0, end - job.due)
            for job, end in zip(self.jobs, ends)
            if job.due is not None
        )
        cost = length + sum(len(job.takes) for job in self.jobs)
        preferred = {"waits": sum(ends), "makespan": max(ends), "cost": cost}[self.prefers]
        if self.together:
            return Optimum(late + self.together * preferred, 0)
        return Optimum(late, preferred)

    def write(self, folder: Path) -> List[str]:
        """Writes the encoding into a folder, and returns the planner's files."""
        return write_task(folder, self.name, self._facts(), _ENCODING)

    def _facts(self) -> Iterator[str]:
        yield "#defined due_in/2. #defined ready_after/2. #defined fresh/2. #defined carried/2."
        yield "#defined cook/1. #defined spot/3. #defined late_weight/2. #defined takes/3."
        yield (
            f"prefers({self.prefers},{self.together})."
            if self.together
            else (f"prefers({self.prefers}).")
        )
        yield f"room({self.room})."
        if self.cooks:
            yield f"cook(c(1..{self.cooks}))."
        for robot, start, speed in zip(self.robots, self.starts, self.speeds):
            yield f"robot({robot}). start({robot},{start}). speed({robot},{speed})."
        for start, end, length in self.ways:
            yield f"way({start},{end}). way({end},{start}). length({start},{end},{length})."
        for number, job in enumerate(self.jobs):
            yield from (f"takes({kind},{number},{each})." for kind, each in job.takes.items())
            yield from (f"spot({kind},{number},{place})." for kind, place in job.spots.items())
            if job.ready:
                yield f"ready_after({number},{job.ready})."
            if job.fresh is not None:
                yield f"fresh({number},{job.fresh})."
            if job.carried is not None:
                yield f"carried({number},{job.carried})."
            if job.due is not None:
                yield f"due_in({number},{job.due}). late_weight({number},{job.weight})."


def draw(seed: int) -> Tuple[SmallTask, Optimum]:
    """Returns a random task that has a plan, with its optimum."""
    for attempt in itertools.count():
        task = _draw(random.Random(f"{seed} {attempt}"), seed)
        if _count(task) <= MOST_ORDERS:
            best = optimum(task)
            if best is not None:
                return task, best
    raise AssertionError


def _draw(dice: random.Random, seed: int) -> SmallTask:
    places = [f"v{number}" for number in range(dice.randint(4, 7))]
    ways = [
        (places[dice.randrange(number)], places[number], 2 * dice.randint(2, 15))
        for number in range(1, len(places))
    ]
    if ways[-1][0] != places[1]:
        ways.append((places[1], places[-1], 2 * dice.randint(2, 15)))
    prefers = PREFERENCES[seed % 3]
    together = dice.choice((0, 0, 1, 3))
    cooks = dice.choice((1, 1, 2))
    jobs = [_draw_job(dice, places) for _ in range(dice.choice((2, 3, 3, 4)))]
    starts = [dice.choice(places), dice.choice(places)]
    speeds = [dice.choice((100, 100, 50)), dice.choice((100, 150))]
    room = dice.choice((1, 2, 4))
    return SmallTask(
        f"small-{seed}-{prefers}", ways, starts, speeds, room, cooks, jobs, prefers, together
    )


def _draw_job(dice: random.Random, places: List[str]) -> Job:
    kind = dice.choice(("visit", "carry", "carry", "cook", "load"))
    due = dice.randint(20, 150) if dice.random() < 0.6 else None
    weight = dice.choice((1, 1, 5))
    takes = {"put": dice.randint(1, 20)}
    spots = {"put": dice.choice(places)}
    if kind == "visit":
        return Job(takes, spots, due=due, weight=weight)
    takes["pick"], spots["pick"] = dice.randint(1, 20), dice.choice(places)
    carried = dice.randint(10, 90) if dice.random() < 0.3 else None
    if kind == "carry":
        return Job(takes, spots, carried=carried, due=due, weight=weight)
    takes[kind] = dice.randint(5, 40)
    if kind == "load":
        spots["load"] = spots["pick"]
    ready = dice.choice((0, 10, 40, 80))
    fresh = dice.randint(5, 60) if dice.random() < 0.6 else None
    return Job(takes, spots, ready, fresh, carried, due, weight)


def _sequences(task: SmallTask, units: Sequence[Sequence[Order]]) -> Iterator[Tuple[Order, ...]]:
    """Yields the orders in which a robot can do units, whose actions follow each other."""
    done: List[Order] = []
    positions = [0] * len(units)

    def extend(load: int) -> Iterator[Tuple[Order, ...]]:
        if all(position == len(unit) for position, unit in zip(positions, units)):
            yield tuple(done)
            return
        for number, unit in enumerate(units):
            if positions[number] == len(unit):
                continue
            order = unit[positions[number]]
            has_pick = "pick" in task.jobs[order.job].takes
            more = {"pick": 1, "put": -1 if has_pick else 0}.get(order.kind, 0)
            if load + more > task.room:
                continue
            positions[number] += 1
            done.append(order)
            yield from extend(load + more)
            done.pop()
            positions[number] -= 1

    return extend(0)


def _units(task: SmallTask) -> List[List[Order]]:
    """Returns what one robot does in a row, but for other things in between."""
    found = []
    for number, job in enumerate(task.jobs):
        if "load" in job.takes:
            found.append([Order("load", number)])
        found.append([Order(kind, number) for kind in ("pick", "put") if kind in job.takes])
    return found


def _shared(task: SmallTask) -> Iterator[List[List[Tuple[Order, ...]]]]:
    """Yields the sequences of each robot, for each way to share the units among them."""
    units = _units(task)
    for doers in itertools.product(range(len(task.starts)), repeat=len(units)):
        yield [
            list(_sequences(task, [unit for unit, doer in zip(units, doers) if doer == robot]))
            for robot in range(len(task.starts))
        ]


def _cookings(task: SmallTask) -> List[List[Tuple[Order, ...]]]:
    """Returns the sequences of all cooks."""
    orders = [Order("cook", number) for number, job in enumerate(task.jobs) if "cook" in job.takes]
    found: Set[Tuple[Tuple[Order, ...], ...]] = set()
    for order in itertools.permutations(orders):
        for cut in range(len(order) + 1 if task.cooks == 2 else 1):
            found.add(tuple(sorted((order[:cut], order[cut:]))))
    return [list(sequences) for sequences in sorted(found)]


def _count(task: SmallTask) -> int:
    """Returns how many orders there are, if not too many."""
    cookings = len(_cookings(task))
    count = 0
    for of_robots in _shared(task):
        count += len(of_robots[0]) * len(of_robots[1]) * cookings
        if count > MOST_ORDERS:
            break
    return count


Arc = Tuple[Order, Order, int]
"""The second action begins so many seconds after the first one has begun, or later."""


def optimum(task: SmallTask) -> Optional[Optimum]:
    """Returns the value of the best plan, None if there is no plan."""
    fixed = list(_arcs_of_jobs(task))
    cookings = []
    for sequences in _cookings(task):
        pairs = [pair for order in sequences for pair in zip(order, order[1:])]
        cookings.append([(one, two, task.jobs[one.job].takes["cook"]) for one, two in pairs])
    orders = [Order(kind, number) for number, job in enumerate(task.jobs) for kind in job.takes]
    best: Optional[Optimum] = None
    for of_robots in _shared(task):
        for chosen in itertools.product(*of_robots):
            arcs, releases, length = _arcs_of_robots(task, chosen)
            for cooking in cookings:
                begins = _earliest(orders, releases, [*arcs, *fixed, *cooking])
                if begins is not None:
                    ends = [
                        begins[Order("put", number)] + job.takes["put"]
                        for number, job in enumerate(task.jobs)
                    ]
                    value = task.value(ends, length)
                    best = value if best is None else min(best, value)
    return best


def _arcs_of_jobs(task: SmallTask) -> Iterator[Arc]:
    for number, job in enumerate(task.jobs):
        pick, put = Order("pick", number), Order("put", number)
        if job.preparing:
            prepared = Order(job.preparing, number)
            until = job.takes[job.preparing] + job.ready
            yield prepared, pick, until
            if job.fresh is not None:
                yield pick, prepared, -until - job.fresh
        if "pick" in job.takes:
            yield pick, put, job.takes["pick"]
            if job.carried is not None:
                yield put, pick, -job.takes["pick"] - job.carried


def _arcs_of_robots(
    task: SmallTask, chosen: Iterable[Tuple[Order, ...]]
) -> Tuple[List[Arc], Dict[Order, int], int]:
    """Returns what sequences mean: arcs, when the first actions can begin, and all lengths."""
    arcs: List[Arc] = []
    releases: Dict[Order, int] = {}
    total = 0
    for robot, sequence in enumerate(chosen):
        place = task.starts[robot]
        before: Optional[Order] = None
        for order in sequence:
            job = task.jobs[order.job]
            there = job.spots[order.kind]
            seconds = task.seconds(robot, place, there)
            total += task.lengths[place, there]
            if before is None:
                releases[order] = seconds
            else:
                arcs.append((before, order, task.jobs[before.job].takes[before.kind] + seconds))
            before, place = order, there
    return arcs, releases, total


def _earliest(
    orders: Sequence[Order], releases: Dict[Order, int], arcs: Sequence[Arc]
) -> Optional[Dict[Order, int]]:
    """Returns when each action begins at the earliest, None if they contradict each other.

    All are as early as possible at once, so any value that grows with the ends is the least.
    """
    begins = dict.fromkeys(orders, 0)
    begins.update(releases)
    for _ in range(len(orders) + 1):
        is_changed = False
        for first, second, seconds in arcs:
            if begins[first] + seconds > begins[second]:
                begins[second] = begins[first] + seconds
                is_changed = True
        if not is_changed:
            return begins
    return None


def judge(task: SmallTask, plan: Sequence[Act]) -> Optimum:
    """Returns the value of a plan.

    Raises:
        ValueError: It breaks a rule.
    """
    begins: Dict[Order, int] = {}
    doers: Dict[Order, str] = {}
    by_actor: Dict[str, List[Order]] = {}
    for act in sorted(plan, key=lambda one: one.begin):
        order = Order(act.kind, act.errand)
        _require(order not in begins, "twice", order)
        begins[order], doers[order] = act.begin, act.actor
        by_actor.setdefault(act.actor, []).append(order)
    length = 0
    for actor, orders in by_actor.items():
        robot = task.robots.index(actor) if actor in task.robots else -1
        place = task.starts[robot] if robot >= 0 else ""
        free = load = 0
        for order in orders:
            job = task.jobs[order.job]
            _require((order.kind == "cook") == (robot < 0), "another actor", order)
            if robot >= 0:
                there = job.spots[order.kind]
                free += task.seconds(robot, place, there)
                length += task.lengths[place, there]
                place = there
            _require(begins[order] >= free, "too early", order)
            free = begins[order] + job.takes[order.kind]
            if "pick" in job.takes:
                load += {"pick": 1, "put": -1}.get(order.kind, 0)
            _require(load <= task.room, "too full", order)
    for first, second, seconds in _arcs_of_jobs(task):
        _require(begins[second] >= begins[first] + seconds, "order", (first, second))
    for number, job in enumerate(task.jobs):
        is_carried = "pick" in job.takes
        _require(not is_carried or doers[Order("pick", number)] == doers[Order("put", number)],
                 "another carrier", number)  # fmt: skip
    ends = [begins[Order("put", n)] + job.takes["put"] for n, job in enumerate(task.jobs)]
    return task.value(ends, length)


def _require(is_so: bool, rule: str, what: object) -> None:
    if not is_so:
        raise ValueError(f"{rule}: {what}")
