"""Plans in seconds: as quick as the best one of an exhaustive search, which is written apart."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import partial
from itertools import permutations, product
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Sequence, Tuple

import pytest
from draws import draws
from episode import MAILBOT, OFFICE
from instance_map import InstanceMap

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.arrivals import arrival_lines, expected_arrivals, planned_spans
from rosoclingo.loop.values.atoms import Plan
from rosoclingo_aspprograms.validator import Edge, arguments

Job = Tuple[str, str]
Cost = Callable[[Sequence[int]], Sequence[int]]
"""What comes first counts first."""


def draw_map(pick: random.Random, robots: int) -> InstanceMap:
    """Returns a random map in which all places can be reached, with offices and corridors."""
    corridors = [f"c{number}" for number in range(pick.randint(2, 6))]
    offices = [f"o{number}" for number in range(pick.randint(2, 5))]
    graph = InstanceMap(offices=set(offices))
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


def ends(
    graph: InstanceMap, start: str, jobs: Sequence[Job], blocked: Sequence[Edge]
) -> Iterator[int]:
    """Returns when a robot is through with each job, if it does them in this order."""
    here, clock = start, 0
    for origin, destination in jobs:
        clock += graph.distances(here, blocked)[origin] + graph.durations["pickup"]
        clock += graph.distances(origin, blocked)[destination] + graph.durations["deliver"]
        here = destination
        yield clock


def agendas(
    graph: InstanceMap, jobs: Sequence[Job], blocked: Sequence[Edge]
) -> Iterator[List[int]]:
    """Returns when each job is done, for all who may do it, in all orders."""
    numbers = range(len(jobs))
    for who in product(graph.starts, repeat=len(jobs)):
        orders = [permutations([n for n in numbers if who[n] == robot]) for robot in graph.starts]
        for chosen in product(*orders):
            done = [0 for _ in numbers]
            for start, order in zip(graph.starts.values(), chosen):
                times = ends(graph, start, [jobs[number] for number in order], blocked)
                for number, time in zip(order, times):
                    done[number] = time
            yield done


def replay(graph: InstanceMap, plan: Plan, blocked: Sequence[Edge]) -> Dict[str, int]:
    """Checks the steps of a plan, and returns when each action but ``go`` is through.

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
            through[name] = clock
            for target in arguments(name, "go"):
                edge = frozenset((places[robot], target))
                assert edge in graph.edges.difference(blocked), (step, robot, name)
                places[robot] = target


def plan_for(graph: InstanceMap, events: Sequence[str], folder: Path, *options: str) -> Plan:
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


def feedback(plan: Plan) -> List[str]:
    """Returns what clients are told of a plan for what has come just now."""
    spans = planned_spans(plan, 1, [], set(), 0.0)
    times = sorted(expected_arrivals(plan, spans).items())
    return [
        f"{slot} {line}"
        for slot, time in times
        for line in arrival_lines(time, 0.0, 0.0, plan.limits.get(slot))
    ]


class Draw:
    """A random map, with requests and blocked ways.

    Attributes:
        graph: The map.
        jobs: The requests, by their slots from 1 on.
        events: What happens in step 0, without the requests.
        blocked: The ways that are blocked; all offices can still be reached.
    """

    def __init__(self, seed: str, robots: int) -> None:
        self.pick = pick = random.Random(seed)
        self.graph = graph = draw_map(pick, robots)
        self.jobs = [self._job() for _ in range(pick.randint(1, 4))]
        self.blocked = [edge for edge in sorted(graph.edges, key=sorted) if pick.random() < 0.2]
        while len(graph.distances("c0", self.blocked)) < len(graph.distances("c0")):
            self.blocked.pop()
        ways = (pick.sample(sorted(edge), 2) for edge in self.blocked)
        self.events = ["info,blocked({},{})".format(*way) for way in ways]

    def _job(self) -> Job:
        origin, destination = self.pick.sample(sorted(self.graph.offices), 2)
        return origin, destination

    def check(self, words: Sequence[str], cost: Cost, folder: Path, *options: str) -> None:
        """Checks that no agenda costs less than the plan.

        Args:
            words: What each request says of its time: nothing, or a term after a comma.
            cost: Returns what it costs that the jobs are done at certain times.
            folder: Where the instance is written.
            options: Of the planner.
        """
        jobs = zip(self.jobs, words)
        events = [f"{slot},bring({o},{d}{w})" for slot, ((o, d), w) in enumerate(jobs, 1)]
        plan = plan_for(self.graph, [*events, *self.events], folder, *options)
        through = replay(self.graph, plan, self.blocked)
        done = [through[f"deliver({slot})"] for slot, _ in enumerate(self.jobs, 1)]
        times = agendas(self.graph, self.jobs, self.blocked)
        assert cost(done) == min(map(cost, times)), (events, done)
        told = {f"{slot} expected in {time} s" for slot, time in enumerate(done, 1)}
        assert told <= {*feedback(plan)}


@pytest.mark.costly
@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize("seed", draws(range(0, 30, 4), 30))
def test_the_last_delivery_is_as_early_as_possible(robots: int, seed: int, tmp_path: Path) -> None:
    draw = Draw(f"{seed} {robots}", robots)
    draw.check([""] * 4, lambda done: [max(done)], tmp_path)


@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize("seed", draws([0, 1, 5, 8], 10))
def test_the_sum_of_the_waits_is_as_small_as_possible(
    robots: int, seed: int, tmp_path: Path
) -> None:
    draw = Draw(f"waits {seed} {robots}", robots)
    draw.check([""] * 4, lambda done: [sum(done)], tmp_path, "-c", "minimise=waits")


@pytest.mark.costly
@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize("seed", draws([0, 1, 3, 5, 8], 10))
def test_what_is_urgent_comes_first_and_then_what_is_due(
    robots: int, seed: int, tmp_path: Path
) -> None:
    """Of two that are urgent and came together, the one in the first slot comes first."""
    draw = Draw(f"due {seed} {robots}", robots)
    words = [draw.pick.choice(["", ",urgent", ",by"]) for _ in draw.jobs]
    limits = [draw.pick.randint(1, 150) for _ in draw.jobs]

    def cost(done: Sequence[int]) -> Sequence[int]:
        urgent = [time for time, word in zip(done, words) if word == ",urgent"]
        delays = [max(0, t - n) for t, n, w in zip(done, limits, words) if w == ",by"]
        return [*urgent, sum(delays), max(done)]

    said = [f",by({n})" if word == ",by" else word for n, word in zip(limits, words)]
    draw.check(said, cost, tmp_path)


HALL = InstanceMap.read(Path(OFFICE).with_name("graph_hall.lp"))


def test_what_has_happened_is_known_without_a_search() -> None:
    """A search may be interrupted before it begins: what it was told is facts nevertheless."""
    engine = Engine(Options((str(Path(OFFICE).with_name("graph_hall.lp")), MAILBOT)))
    planner = Planner(engine)
    planner.begin()
    planner.tell(["event(1,bring(c,d),0)"])
    assert planner.search(0, 10_000, lambda: False).result is Result.SAT
    for step, answer in enumerate(["busy", "success"], 1):
        planner.tell([f"event(commit,do(left,go(hall)),{step})", f"event(left,{answer},{step})"])
        calls = iter([False, True])
        assert planner.search(step, 10_000, partial(next, calls)).interrupted
    atoms = engine._control.symbolic_atoms
    found = [*atoms.by_signature("surprise", 1), *atoms.by_signature("plan_of", 2)]
    assert len(found) >= 4
    assert [str(atom.symbol) for atom in found if atom.literal and not atom.is_fact] == []


def test_a_letter_that_is_due_goes_first(tmp_path: Path) -> None:
    alone = replace(HALL, starts={"left": "a"})
    plan = plan_for(alone, ["1,bring(c,a)", "2,bring(b,d)"], tmp_path)
    assert feedback(plan) == ["1 expected in 22 s", "2 expected in 61 s"]
    plan = plan_for(alone, ["1,bring(c,a)", "2,bring(b,d,by(40))"], tmp_path)
    assert feedback(plan) == ["1 expected in 68 s", "2 expected in 39 s", "2 late by 0 s"]


def test_what_cannot_be_in_time_is_said(tmp_path: Path) -> None:
    alone = replace(HALL, starts={"left": "a"})
    plan = plan_for(alone, ["1,bring(c,a,by(20))", "2,bring(b,d,by(40))"], tmp_path)
    assert [line for line in feedback(plan) if "late" in line] == [
        "1 late by 2 s",
        "2 late by 21 s",
    ]
