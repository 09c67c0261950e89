"""Plans in seconds: as quick as the best one of an exhaustive search, which is written apart."""

from __future__ import annotations

import random
from itertools import permutations, product
from pathlib import Path
from typing import Dict, Iterator, List, Sequence, Tuple

import pytest
from episode import MAILBOT

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.atoms import Plan
from rosoclingo.loop.solver import Planner
from rosoclingo_aspprograms.validator import Edge, Map, arguments

Job = Tuple[str, str]


def draw_map(pick: random.Random, robots: int) -> Map:
    """Returns a random map in which all places can be reached, with offices and corridors."""
    corridors = [f"c{number}" for number in range(pick.randint(2, 6))]
    offices = [f"o{number}" for number in range(pick.randint(2, 5))]
    graph = Map(offices=set(offices))
    for number, place in enumerate(corridors[1:]):
        graph.edges.add(frozenset((place, pick.choice(corridors[: number + 1]))))
    for _ in range(pick.randint(0, 4)):
        graph.edges.add(frozenset(pick.sample(corridors, 2)))
    for office in offices:
        graph.edges.add(frozenset((office, pick.choice(corridors))))
    if pick.random() < 0.3:  # an office that is a way, too
        graph.edges.add(frozenset((offices[0], pick.choice(corridors))))
    graph.lengths = {edge: pick.randint(1, 30) for edge in graph.edges if pick.random() < 0.9}
    graph.durations = {"pickup": pick.randint(1, 10), "deliver": pick.randint(1, 10)}
    graph.starts = {f"r{number}": pick.choice(corridors + offices) for number in range(robots)}
    return graph


def ends(graph: Map, start: str, jobs: Sequence[Job], blocked: Sequence[Edge]) -> Iterator[int]:
    """Returns when a robot is through with each job, if it does them in this order."""
    here, clock = start, 0
    for origin, destination in jobs:
        clock += graph.distances(here, blocked)[origin] + graph.durations["pickup"]
        clock += graph.distances(origin, blocked)[destination] + graph.durations["deliver"]
        here = destination
        yield clock


def quickest(graph: Map, jobs: Sequence[Job], blocked: Sequence[Edge]) -> int:
    """Returns when the last job is done at the earliest: all who may do it, in all orders."""
    robots = list(graph.starts)
    lasts = []
    for who in product(robots, repeat=len(jobs)):
        last = 0
        for robot, start in graph.starts.items():
            own = [job for job, one in zip(jobs, who) if one == robot]
            orders = (list(ends(graph, start, order, blocked)) for order in permutations(own))
            last = max(last, min(max(times, default=0) for times in orders))
        lasts.append(last)
    return min(lasts)


def replay(graph: Map, plan: Plan, blocked: Sequence[Edge]) -> Dict[str, int]:
    """Checks the steps of a plan, and returns when each robot is through with its part.

    A step ends when an action does, and who is still at its own repeats that in the next one.
    """
    places = dict(graph.starts)
    acting: Dict[str, Tuple[str, int]] = {}  # what each does, and when that ends
    through: Dict[str, int] = {}
    clock = step = 0
    while True:
        step += 1
        actions = {action.actuator: action.name for action in plan.actions(step)}
        assert len(actions) == len(plan.actions(step))
        for robot, (name, _) in acting.items():
            assert actions.get(robot) == name, (step, robot)
        for robot in actions.keys() - acting.keys():
            acting[robot] = actions[robot], clock + graph.seconds(places[robot], actions[robot])
        if not acting:
            assert not plan.actions_from(step)
            return through
        clock = min(end for _, end in acting.values())
        for robot in [robot for robot, (_, end) in acting.items() if end == clock]:
            name, _ = acting.pop(robot)
            through[robot] = clock
            for target in arguments(name, "go"):
                edge = frozenset((places[robot], target))
                assert edge in graph.edges.difference(blocked), (step, robot, name)
                places[robot] = target


def plan_for(graph: Map, events: Sequence[str], folder: Path, *options: str) -> Plan:
    """Returns the plan for what has happened in step 0."""
    instance = folder / "instance.lp"
    instance.write_text(graph.facts())
    messages: List[str] = []
    files = (str(instance), MAILBOT)
    planner = Planner(Engine(Options(files, ("-c", "slots=6", *options)), log=messages.append))
    planner.begin()
    assert planner.tell([f"event({text},0)" for text in events]) == []
    outcome = planner.search(0, 10_000, lambda: False)
    assert outcome.result is Result.SAT
    assert messages == []
    return Plan(outcome.symbols)


@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize("seed", range(30))
def test_the_last_delivery_is_as_early_as_possible(robots: int, seed: int, tmp_path: Path) -> None:
    pick = random.Random(f"{seed} {robots}")
    graph = draw_map(pick, robots)
    jobs = [tuple(pick.sample(sorted(graph.offices), 2)) for _ in range(pick.randint(1, 4))]
    blocked = [edge for edge in sorted(graph.edges, key=sorted) if pick.random() < 0.2]
    while len(graph.distances("c0", blocked)) < len(graph.distances("c0")):
        blocked.pop()
    events = ["{},bring({},{})".format(slot, *job) for slot, job in enumerate(jobs, 1)]
    events += ["info,blocked({},{})".format(*pick.sample(sorted(edge), 2)) for edge in blocked]
    plan = plan_for(graph, events, tmp_path)
    through = replay(graph, plan, blocked)
    assert max(through.values()) == quickest(graph, jobs, blocked)
    served = [action.name for action in plan.actions_from(1) if "deliver" in action.name]
    assert {arguments(name, "deliver")[0] for name in served} == {
        str(slot) for slot, _ in enumerate(jobs, 1)
    }
