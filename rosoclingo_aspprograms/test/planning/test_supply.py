"""Agendas with something that runs out: as short as the best one that is found by trying all."""

from __future__ import annotations

import random
from itertools import permutations, product
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

import pytest
from draws import draws

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Plan

LIBRARY = Path(__file__).resolve().parents[2] / "lib"
SEEDS = draws([0, 4, 6, 8, 12, 15, 19, 23], 60)

# What the library takes, all at once, from an instance.
ENCODING = """
#include "{library}/supply.lp".
#program base.
rslot(none).
way((X,Y),(X+1,Y)) :- X = 0..{width}-2, Y = 0..1.
way((X,0),(X,1)) :- X = 0..{width}-1.
way(W,V) :- way(V,W), V < W.
#defined robot/3. #defined job/5. #defined source/3. #defined cut/2. #defined first/2.
#program event(s,c).
#program query(t).
#external query(t).
#program present(k,t).
stands(R,W,k) :- robot(R,W,N), surprise(k).
has(R,N,k) :- robot(R,W,N), surprise(k).
stop(J,1,V,begin(J),k) :- job(J,V,W,N,long), surprise(k).
stop(J,2,W,end(J),k) :- job(J,V,W,N,long), surprise(k).
stop(J,1,V,do(J),k) :- job(J,V,W,N,short), surprise(k).
takes(J,N,k) :- job(J,V,W,N,L), surprise(k).
refill(W,refill,N,k) :- source(W,N,_), surprise(k).
closed(V,W,k) :- cut(V,W), surprise(k).
closed(W,V,k) :- cut(V,W), surprise(k).
before(I,J,k) :- first(I,J), surprise(k).
#program follow(k).
"""

Place = Tuple[int, int]


class Job:
    """A task: from a place to a place, with units that it takes."""

    def __init__(self, pick: random.Random, places: Sequence[Place], most: int) -> None:
        self.origin = pick.choice(places)
        self.target = pick.choice(places) if pick.random() < 0.2 else None
        self.takes = pick.randint(1, most) if pick.random() < 0.85 else 0

    @property
    def end(self) -> Place:
        """Where a robot is after it."""
        return self.origin if self.target is None else self.target


class Draw:
    """A random instance.

    Attributes:
        width: The places are two rows of that length.
        robots: Where each robot is, and how many units it has.
        jobs: The tasks.
        sources: Where there are how many units.
        orders: Pairs of tasks that may be done in this order only.
        cuts: Ways that are closed.
    """

    def __init__(self, seed: int) -> None:
        pick = random.Random(seed)
        self.width = pick.randint(2, 5)
        places = list(product(range(self.width), range(2)))
        most = pick.choice([1, 1, 2])
        full = pick.randint(most, 4)
        count = pick.choice([1, 1, 2])
        self.robots = [(pick.choice(places), pick.randint(0, full)) for _ in range(count)]
        self.jobs = [Job(pick, places, most) for _ in range(pick.randint(1, 5 if count < 2 else 4))]
        chosen = pick.sample(places, pick.choice([1, 1, 2]))
        self.sources = {place: full if pick.random() < 0.7 else most for place in chosen}
        self.orders: List[Tuple[int, int]] = []
        if len(self.jobs) > 2 and pick.random() < 0.3:
            self.orders.append((0, 1))
        self.cuts: List[Tuple[Place, Place]] = []
        if self.width > 2 and pick.random() < 0.4:
            self.cuts.append(((1, 0), (2, 0)))
            if pick.random() < 0.4:
                self.cuts.append(((1, 1), (2, 1)))

    def facts(self) -> Iterator[str]:
        """Returns the instance."""
        for number, (place, units) in enumerate(self.robots):
            yield f"robot({number},{_text(place)},{units})."
        for number, job in enumerate(self.jobs):
            ends = f"{_text(job.origin)},{_text(job.end)}"
            kind = "short" if job.target is None else "long"
            yield f"job({number},{ends},{job.takes},{kind})."
        for place, units in self.sources.items():
            yield f"source({_text(place)},{units},none)."
        for first, second in self.orders:
            yield f"first({first},{second})."
        for one, other in self.cuts:
            yield f"cut({_text(one)},{_text(other)})."

    def distances(self) -> Dict[Tuple[Place, Place], int]:
        """Returns how far it is from one place to another that can be reached."""
        places = list(product(range(self.width), range(2)))
        cut = {frozenset(pair) for pair in self.cuts}
        found: Dict[Tuple[Place, Place], int] = {}
        for start in places:
            ring: Set[Place] = {start}
            length = 0
            while ring:
                for place in ring:
                    found[start, place] = length
                ring = {
                    near
                    for x, y in ring
                    for near in ((x + 1, y), (x - 1, y), (x, 1 - y))
                    if near in places
                    and frozenset(((x, y), near)) not in cut
                    and (start, near) not in found
                }
                length += 1
        return found

    def best(self) -> Tuple[int, int]:
        """Returns how many tasks can be done, negated, and by when, by trying all agendas."""
        distances = self.distances()
        results = []
        for owners in product([None, *range(len(self.robots))], repeat=len(self.jobs)):
            lengths: List[Optional[int]] = []
            for number in range(len(self.robots)):
                own = [job for job, owner in enumerate(owners) if owner == number]
                lengths.append(self._shortest(number, own, distances))
            done = {job for job, owner in enumerate(owners) if owner is not None}
            if all(length is not None for length in lengths):
                results.append((-len(done), max(length or 0 for length in lengths)))
        return min(results)

    def _shortest(
        self, robot: int, own: List[int], distances: Dict[Tuple[Place, Place], int]
    ) -> Optional[int]:
        lengths = [
            self._length(robot, order, distances)
            for order in permutations(own)
            if not any(
                second in order[: order.index(first)]
                for first, second in self.orders
                if first in order
            )
        ]
        return min((length for length in lengths if length is not None), default=None)

    def _length(
        self, robot: int, order: Sequence[int], distances: Dict[Tuple[Place, Place], int]
    ) -> Optional[int]:
        place, units = self.robots[robot]
        states = {units: 0}  # by units, how long it takes at least
        for number in order:
            job = self.jobs[number]
            between = 1 if job.target is None else distances.get((job.origin, job.target), -9) + 2
            after: Dict[int, int] = {}

            def add(units: int, length: int, after: Dict[int, int] = after) -> None:
                after[units] = min(length, after.get(units, length))

            for units, length in states.items():
                if (place, job.origin) in distances and units >= job.takes:
                    add(units - job.takes, length + distances[place, job.origin])
                for source, full in self.sources.items():
                    ways = [(place, source), (source, job.origin)]
                    if all(way in distances for way in ways) and full >= job.takes:
                        add(full - job.takes, length + 1 + sum(distances[way] for way in ways))
            if between < 0 or not after:
                return None
            states = {units: length + between for units, length in after.items()}
            place = job.end
        return min(states.values())


def _text(place: Place) -> str:
    return f"({place[0]},{place[1]})"


def plan(draw: Draw, folder: Path) -> Plan:
    """Plans for an instance."""
    file = folder / "draw.lp"
    facts = " ".join(draw.facts())
    file.write_text(ENCODING.format(library=LIBRARY, width=draw.width) + "#program base. " + facts)
    planner = Planner(Engine(Options((str(file),), ())))
    planner.begin()
    outcome = planner.search(0, 1000, lambda: False)
    assert outcome.result is Result.SAT
    return Plan(outcome.symbols)


def replay(draw: Draw, plan: Plan) -> Tuple[int, int]:
    """Does what is planned, and returns how many tasks that does, negated, and by when."""
    cut = {frozenset(pair) for pair in draw.cuts}
    done: Set[int] = set()
    last = 0
    for number, (start, amount) in enumerate(draw.robots):
        place, units, own = start, amount, _own(plan, str(number))
        assert len({step for step, _ in own}) == len(own)
        for step, action in own:
            name, _, rest = action.partition("(")
            last = max(last, step)
            if name == "go":
                x, y = (int(part) for part in rest.strip("()").split(","))
                assert abs(x - place[0]) + abs(y - place[1]) == 1
                assert frozenset((place, (x, y))) not in cut
                place = (x, y)
            elif name == "refill":
                units = draw.sources[place]
            else:
                job = draw.jobs[int(rest.strip(")"))]
                assert place == (job.end if name == "end" else job.origin)
                if name != "end":
                    units -= job.takes
                    assert units >= 0
                if name != "begin":
                    assert int(rest.strip(")")) not in done
                    done.add(int(rest.strip(")")))
    return -len(done), last


def _own(plan: Plan, robot: str) -> List[Tuple[int, str]]:
    actions: Iterable[Tuple[int, str]] = (
        (action.step, action.name) for action in plan.actions_from(1) if action.actuator == robot
    )
    return sorted(actions)


@pytest.mark.parametrize("seed", SEEDS)
def test_an_agenda_is_as_good_as_the_best_of_all(seed: int, tmp_path: Path) -> None:
    draw = Draw(seed)
    assert replay(draw, plan(draw, tmp_path)) == draw.best(), list(draw.facts())
