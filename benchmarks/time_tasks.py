"""Tasks with time for several robots, as encodings for actions.lp, and a judge of their plans.

Robots pick things up and put them down elsewhere, several at a time. In a restaurant, dishes are
cooked before, and get cold; in a hospital, blood has to be quick; in a warehouse, many orders go to
two gates. The same domain, numbers and seed give the same task each time.
"""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from mailbot import ROOT

LATE_WEIGHT = 5  # of a second of lateness, to a second of the makespan
_LIBRARY = ROOT / "rosoclingo_aspprograms" / "lib" / "actions.lp"
_ENCODING = """
moves(R) :- robot(R).
actuator(C) :- cook(C).
initially(at(R),V) :- start(R,V).
number(room(R),N) :- robot(R), room(N).
request(carry(I)) :- thing(I,V,W,S).
prefers(makespan,1).

#program present(k,t).
% job(ID,I,K): the request in slot ID is to carry thing I.
job(ID,I,k) :- asked(ID,carry(I),k).
own(ID,where(ID),there,k) :- job(ID,I,k).
wants(ID,where(ID),done,k) :- job(ID,I,k).
due(ID,N,k) :- job(ID,I,k), due_in(I,N).
weight(ID,P,k) :- job(ID,I,k), late_weight(P).

own(ID,food(ID),raw,k) :- job(ID,I,k), cooking(I,N).
action(C,cook(I),k) :- job(ID,I,k), cooking(I,N), cook(C).
needs(C,cook(I),food(ID),raw,k) :- job(ID,I,k), cooking(I,N), cook(C).
sets(C,cook(I),food(ID),cooked,k) :- job(ID,I,k), cooking(I,N), cook(C).
duration(C,cook(I),N,k) :- job(ID,I,k), cooking(I,N), cook(C).
needs(R,pick(I),food(ID),cooked,k) :- job(ID,I,k), cooking(I,N), robot(R).

action(R,(pick(I);put(I)),k) :- job(ID,I,k), robot(R).
needs(R,pick(I),at(R),V,k) :- job(ID,I,k), thing(I,V,W,S), robot(R).
needs(R,pick(I),where(ID),there,k) :- job(ID,I,k), robot(R).
sets(R,pick(I),where(ID),R,k) :- job(ID,I,k), robot(R).
uses(R,pick(I),room(R),S,k) :- job(ID,I,k), thing(I,V,W,S), robot(R).
duration(R,pick(I),N,k) :- job(ID,I,k), handling(I,N,M), robot(R).
at_most(where(ID),R,N,k) :- job(ID,I,k), carried_at_most(I,N), robot(R).
needs(R,put(I),at(R),W,k) :- job(ID,I,k), thing(I,V,W,S), robot(R).
needs(R,put(I),where(ID),R,k) :- job(ID,I,k), robot(R).
sets(R,put(I),where(ID),done,k) :- job(ID,I,k), robot(R).
gives(R,put(I),room(R),S,k) :- job(ID,I,k), thing(I,V,W,S), robot(R).
duration(R,put(I),M,k) :- job(ID,I,k), handling(I,N,M), robot(R).
"""


def write_task(folder: Path, name: str, facts: Iterable[str], rules: str) -> List[str]:
    """Writes an encoding for actions.lp; returns the planner's files."""
    file = folder / f"{name}.lp"
    file.write_text("\n".join(["#program base.", *facts, rules]))
    return [str(_LIBRARY), str(file)]


@dataclass
class Errand:
    """A thing that one robot takes from one place to another.

    Attributes:
        origin: Where it is.
        target: Where it is to be.
        handling: The seconds that it takes to pick it up and to put it down.
        size: The room that it needs.
        cooking: The seconds for which some cook is at it before; 0 if that is not needed.
        carried_at_most: The seconds after which it may not be carried any more.
        due: The second after which it is late.
    """

    origin: str
    target: str
    handling: Tuple[int, int]
    size: int = 1
    cooking: int = 0
    carried_at_most: Optional[int] = None
    due: Optional[int] = None


@dataclass
class TimeTask:
    """A task.

    Attributes:
        name: Its domain and numbers.
        starts: Where each robot is at first.
        room: The room of each robot.
        cooks: How many cooks there are.
        ways: The seconds of each way, in both directions.
        errands: All errands, which are asked for at once.
    """

    name: str
    starts: List[str]
    room: int
    cooks: int
    ways: List[Tuple[str, str, int]]
    errands: List[Errand]
    goals: List[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.goals = [f"carry({number})" for number in range(len(self.errands))]

    def write(self, folder: Path) -> List[str]:
        """Writes the encoding into a folder, and returns the planner's files."""
        return write_task(folder, self.name, self._facts(), _ENCODING)

    def _facts(self) -> Iterable[str]:
        yield "#defined cooking/2. #defined carried_at_most/2. #defined due_in/2. #defined cook/1."
        yield f"room({self.room}). late_weight({LATE_WEIGHT})."
        if self.cooks:
            yield f"cook(cook(1..{self.cooks}))."
        for number, place in enumerate(self.starts):
            yield f"robot(r({number})). start(r({number}),{place})."
        for start, end, seconds in self.ways:
            yield f"way({start},{end}). way({end},{start}). length({start},{end},{seconds})."
        for number, errand in enumerate(self.errands):
            picking, putting = errand.handling
            yield f"thing({number},{errand.origin},{errand.target},{errand.size})."
            yield f"handling({number},{picking},{putting})."
            if errand.cooking:
                yield f"cooking({number},{errand.cooking})."
            if errand.carried_at_most is not None:
                yield f"carried_at_most({number},{errand.carried_at_most})."
            if errand.due is not None:
                yield f"due_in({number},{errand.due})."

    def distances(self) -> Dict[str, Dict[str, int]]:
        """Returns the seconds of the shortest ways between all places."""
        near: Dict[str, List[Tuple[str, int]]] = {}
        for start, end, seconds in self.ways:
            near.setdefault(start, []).append((end, seconds))
            near.setdefault(end, []).append((start, seconds))
        return {begin: shortest_ways(begin, near) for begin in near}


def shortest_ways(begin: str, near: Mapping[str, Sequence[Tuple[str, int]]]) -> Dict[str, int]:
    """Returns the seconds of the shortest ways from a place to all that it is connected with.

    Args:
        begin: The place.
        near: The ways from each place, each as ``(place, seconds)``.
    """
    reached: Dict[str, int] = {}
    waiting = [(0, begin)]
    while waiting:
        seconds, place = heapq.heappop(waiting)
        if place not in reached:
            reached[place] = seconds
            for other, more in near.get(place, ()):
                heapq.heappush(waiting, (seconds + more, other))
    return reached


def make(domain: str, robots: int, errands: int, seed: int = 1) -> TimeTask:
    """Returns a task of a domain: restaurant, hospital or warehouse."""
    dice = random.Random(f"{domain}{robots}{errands}{seed}")
    return _MAKERS[domain](dice, robots, errands)


def _restaurant(dice: random.Random, robots: int, number: int) -> TimeTask:
    ways = [("dock", "hall", 6), ("kitchen", "hall", 8), ("sink", "kitchen", 5), ("hall", "a1", 7)]
    for aisle in range(2, 7):  # two rows of three
        ways.append((f"a{max(1, aisle - (1 if aisle % 3 else 3))}", f"a{aisle}", 7))
    for number_of_table in range(1, 31):
        aisle = (number_of_table - 1) % 6 + 1
        ways.append((f"a{aisle}", f"t{number_of_table}", dice.randint(3, 8)))
    errands = []
    for _ in range(number):
        table = f"t{dice.randint(1, 30)}"
        if dice.random() < 0.6:
            cooking = dice.choice([20, 40, 60])
            due = dice.randint(120, 150 + 70 * number // robots)
            errands.append(Errand("kitchen", table, (5, 8), 1, cooking, 75, due))
        else:
            due = dice.randint(200, 200 + 90 * number // robots)
            errands.append(Errand(table, "sink", (8, 5), due=due))
    starts = ["dock" if robot % 2 else "kitchen" for robot in range(robots)]
    return TimeTask(f"restaurant-{robots}-{number}", starts, 2, max(2, robots), ways, errands)


def _hospital(dice: random.Random, robots: int, number: int) -> TimeTask:
    ways = [(f"c{place}", f"c{place + 1}", 12) for place in range(12)]
    for number_of_ward in range(24):
        corner = dice.randint(0, 12)
        ways.append((f"c{corner}", f"w{number_of_ward}", dice.randint(4, 15)))
    ways += [("c0", "lab", 8), ("c6", "store", 8), ("c12", "pharmacy", 8)]
    starts = [dice.choice(["lab", "store", "pharmacy"]) for _ in range(robots)]
    errands = []
    for _ in range(number):
        ward = f"w{dice.randint(0, 23)}"
        kind = dice.random()
        if kind < 0.4:
            due = dice.randint(200, 200 + 100 * number // robots)
            errands.append(Errand(ward, "lab", (10, 10), carried_at_most=150, due=due))
        elif kind < 0.7:
            due = dice.randint(200, 250 + 100 * number // robots)
            errands.append(Errand("pharmacy", ward, (10, 10), cooking=30, due=due))
        else:
            errands.append(Errand("store", ward, (15, 20), 2))
    return TimeTask(f"hospital-{robots}-{number}", starts, 3, 1, ways, errands)


def _warehouse(dice: random.Random, robots: int, number: int) -> TimeTask:
    ways = [(f"x{x}_{y}", f"x{x + 1}_{y}", 5) for x in range(5) for y in range(6)]
    ways += [(f"x{x}_{y}", f"x{x}_{y + 1}", 5) for x in range(6) for y in range(5)]
    errands = []
    for _ in range(number):
        shelf = f"x{dice.randint(1, 5)}_{dice.randint(0, 5)}"
        gate = f"x0_{dice.choice([0, 5])}"
        size = dice.choice([1, 1, 2])
        has_due = dice.random() >= 0.5
        due = dice.randint(150, 150 + 60 * number // robots) if has_due else None
        errands.append(Errand(shelf, gate, (6, 4), size, due=due))
    starts = [f"x0_{robot % 6}" for robot in range(robots)]
    return TimeTask(f"warehouse-{robots}-{number}", starts, 4, 1, ways, errands)


_MAKERS = {"restaurant": _restaurant, "hospital": _hospital, "warehouse": _warehouse}


class Act(NamedTuple):
    """An action of a plan: picking up, putting down or cooking for an errand."""

    actor: str
    kind: str
    errand: int
    begin: int


def judge(task: TimeTask, plan: Iterable[Act]) -> int:
    """Returns the makespan and the weighted lateness of a plan.

    Raises:
        ValueError: It breaks a rule of the domain.
    """
    by_actor: Dict[str, List[Act]] = {}
    begins: Dict[Tuple[str, int], int] = {}
    doers: Dict[Tuple[str, int], str] = {}
    for act in sorted(plan, key=lambda one: one.begin):
        by_actor.setdefault(act.actor, []).append(act)
        _require((act.kind, act.errand) not in begins, "twice", act)
        begins[act.kind, act.errand], doers[act.kind, act.errand] = act.begin, act.actor
    distances = task.distances()
    robots = {f"r({number})": place for number, place in enumerate(task.starts)}
    for actor, acts in by_actor.items():
        place, free, load = robots.get(actor, ""), 0, 0
        for act in acts:
            errand = task.errands[act.errand]
            _require((act.kind == "cook") == (actor not in robots), "another actor", act)
            if act.kind == "cook":
                _require(act.begin >= free, "too early", act)
                free = act.begin + errand.cooking
                continue
            is_pick = act.kind == "pick"
            there = errand.origin if is_pick else errand.target
            _require(act.begin >= free + distances[place][there], "too early", act)
            free, place = act.begin + errand.handling[not is_pick], there
            load += errand.size if is_pick else -errand.size
            _require(load <= task.room, "too full", act)
    ends = []
    late = 0
    for number, errand in enumerate(task.errands):
        picked = begins["pick", number] + errand.handling[0]
        put = begins["put", number]
        ends.append(put + errand.handling[1])
        _require(picked <= put and doers["pick", number] == doers["put", number], "order", number)
        if errand.carried_at_most is not None:
            _require(put - picked <= errand.carried_at_most, "carried too long", number)
        if errand.cooking:
            cooked = begins["cook", number] + errand.cooking
            _require(cooked <= begins["pick", number], "raw", number)
        if errand.due is not None:
            late += max(0, ends[-1] - errand.due)
    return max(ends, default=0) + LATE_WEIGHT * late


def _require(is_so: bool, rule: str, what: object) -> None:
    if not is_so:
        raise ValueError(f"{rule}: {what}")
