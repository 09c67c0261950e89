"""Tasks that count seconds: how their times are read, and what a plan is worth."""

from __future__ import annotations

import itertools
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, Tuple

import engine_judge as judge
import pytest

from rosoclingo.engine import kinds
from rosoclingo.engine.flat import FlatAction, FlatEffects, FlatRequest, FlatTask
from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.improving import Improver
from rosoclingo.engine.insertion import inserter_of
from rosoclingo.engine.process import SearchProcess
from rosoclingo.engine.reading import TaskReader
from rosoclingo.engine.scheduling import Scheduler
from rosoclingo.engine.standing import Standing
from rosoclingo.engine.task import PlanningTask
from rosoclingo.engine.timing import Timetable
from rosoclingo.loop.planner import task_search

SHOP = [
    "base_moves(r)", 'base_way(a,"|",b,"|",7)', 'base_way(b,"|",a,"|",7)',
    "base_action(r,take)", 'base_needs(r,take,"|",at(r),"|",b)', 'base_needs(r,take,"|",box,"|",b)',
    'base_sets(r,take,"|",box,"|",r)',
    "base_action(r,put)", 'base_needs(r,put,"|",at(r),"|",a)', 'base_needs(r,put,"|",box,"|",r)',
    'base_sets(r,put,"|",box,"|",a)',
]  # fmt: skip
NOW = ['task_is(at(r),"|",a)', 'task_is(box,"|",b)', 'task_wish(1,"|",box,"|",a)']


def read(*rows: str) -> PlanningTask:
    reader = TaskReader()
    reader.read_facts([*SHOP, *(row for row in rows if row.startswith("base_"))])
    return reader.read([*NOW, *(row for row in rows if row.startswith("task_"))])


def seconds(task: PlanningTask) -> List[int]:
    return [action.seconds for action in task.actions]


def value(task: FlatTask, plan: List[int]) -> object:
    return Improver(tuple(task), lambda: False).value(plan)


def test_a_task_without_a_word_of_time_counts_no_seconds() -> None:
    task = read('base_costs(r,take,"|",4)')
    assert task.times is None
    assert flatten(task).durations == []


def test_durations_and_speeds_are_read() -> None:
    task = read(
        'base_duration(r,take,"|",5)', 'task_duration(r,take,"|",9)', 'base_speed(r,"|",150)'
    )
    assert sorted(map(str, task.actions)) == ["r: a -> b", "r: b -> a", "r: put", "r: take"]
    assert dict(zip(map(str, task.actions), seconds(task))) == {
        "r: take": 9, "r: put": 1, "r: a -> b": 11, "r: b -> a": 11,
    }  # fmt: skip
    assert [action.cost for action in task.actions] == [1, 1, 7, 7]
    assert sorted(seconds(read('task_due(1,"|",5)'))) == [1, 1, 7, 7]
    assert not read('base_duration(r,take,"|",soon)').requests


def test_deadlines_count_from_when_a_request_has_come() -> None:
    reader = TaskReader()
    reader.read_facts(SHOP)
    rows = [*NOW, 'task_limit_since(1,"|",100)', 'task_due(1,"|",90)']
    for age, due in ((0.0, 90), (30.6, 70), (150.0, -50)):
        times = reader.read(rows, ages={"1": age}).times
        assert times is not None
        assert times.due == {"1": due}


def test_what_meets_a_request_that_has_waited_too_long_is_improved_as_all_else() -> None:
    """Its wait counts more; before, the plan up to there was kept as it was."""
    task = read('base_duration(r,take,"|",5)', 'task_overdue(1,"|",3)')
    assert flatten(task).due == [(0, 0, 10)]
    number = {str(action): index for index, action in enumerate(task.actions)}
    there, back = number["r: a -> b"], number["r: b -> a"]
    plan = [there, back, there, number["r: take"], back, number["r: put"]]
    better = task_search._improved(task, plan, lambda: False, rest=[], work=0.1)
    assert better == [there, number["r: take"], back, number["r: put"]]


def test_the_strictest_deadline_and_the_largest_weight_count() -> None:
    task = read(
        'task_due(1,"|",20)', 'task_due(1,"|",12)', 'task_due(2,"|",1)', 'task_weight(1,"|",3)'
    )
    flat = flatten(task)
    assert flat.due == [(0, 12, 3)]
    plan = [[str(one) for one in task.actions].index(name)
            for name in ("r: a -> b", "r: take", "r: b -> a", "r: put")]  # fmt: skip
    assert value(flat, plan) == (0, 3 * (16 - 12), 16, 1 + 1 + 7 + 7)


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["base_prefers(makespan)"], (0, 0, 16, 16)),
        (["base_prefers(cost)", 'base_costs(r,put,"|",5)'], (0, 0, 20, 16)),
        (['base_prefers(waits,"|",2)', 'task_due(1,"|",6)'], (0, 10 + 2 * 16, 16)),
    ],
)
def test_what_is_preferred(rows: List[str], expected: object) -> None:
    task = read(*rows)
    names = [str(one) for one in task.actions]
    order = [names.index(name) for name in ("r: a -> b", "r: take", "r: b -> a", "r: put")]
    assert value(flatten(task), order) == expected


def cold(most: int) -> FlatTask:
    """Returns a task in which a waiter takes a dish, and puts it when another has opened a door.

    The dish gets cold after some seconds.
    """
    actions: List[FlatAction] = [
        ([(0, 0)], [], [([], 0, 1)], [], 1, 0),  # takes the dish, for 5 s
        ([], [], [([], 1, 1)], [], 1, 1),  # opens the door, for 30 s
        ([(0, 1), (1, 1)], [], [([], 0, 2)], [], 1, 0),  # puts the dish, for 2 s
    ]
    return FlatTask(
        [3, 2], [0, 0], [], [], [([(0, 2)], [])], actions,
        durations=[5, 30, 2], keeps=[(0, 1, most)], aim=(kinds.MAKESPAN, 0),
    )  # fmt: skip


def test_what_would_be_kept_for_too_long_begins_later() -> None:
    """The dish is taken when the door will be open in time, which delays nothing else."""
    task = cold(10)
    assert value(task, [0, 1, 2]) == (0, 0, 32, 3)
    scheduler = Scheduler(tuple(task), Timetable(tuple(task), {}))
    assert scheduler.run([0, 1, 2])
    assert scheduler.value() == (0, 0, 32, 3)
    assert scheduler.when_met(0) == 32


def test_what_cannot_begin_later_is_kept_for_too_long() -> None:
    """The dish has been taken already."""
    task = cold(10)._replace(initial=[1, 0])
    assert value(task, [1, 2]) == (20, 0, 32, 2)
    assert value(task._replace(since=[(0, -25)]), [1, 2]) == (45, 0, 32, 2)
    assert value(task._replace(since=[(0, 15)]), [1, 2]) == (5, 0, 32, 2)


def errands() -> FlatTask:
    """Returns a task of one robot with two requests, each of which takes 5 s."""
    actions: List[FlatAction] = [([], [], [([], n, 1)], [], 1, 0) for n in range(2)]
    requests: List[FlatRequest] = [([(n, 1)], []) for n in range(2)]
    return FlatTask([2, 2], [0, 0], [], [], requests, actions, durations=[5, 5])


def test_a_request_is_not_met_before_its_time() -> None:
    task = errands()._replace(earliest=[(0, 100)])
    assert value(task, [0, 1]) == (0, 0, 100 + 105, 2)
    assert value(task, [1, 0]) == (0, 0, 5 + 100, 2)
    scheduler = Scheduler(tuple(task), Timetable(tuple(task), {}))
    assert scheduler.run([0, 1])
    assert [scheduler.when_met(request) for request in range(2)] == [100, 105]
    assert inserter_of(tuple(task)).first(lambda: False) == [1, 0]


def test_each_deadline_of_a_request_counts() -> None:
    task = errands()._replace(due=[(0, 7, 1), (0, 9, 100), (1, 7, 1)])
    assert value(task, [0, 1]) == (0, 3, 5 + 10, 2)
    assert value(task, [1, 0]) == (0, 3 + 100, 5 + 10, 2)


def test_windows_and_learned_durations_are_read() -> None:
    task = read(
        'base_duration(r,take,"|",5)', 'task_learned(r,take,"|",9)', 'task_earliest(1,"|",20)',
        'task_latest(1,"|",70)', 'task_limit_since(1,"|",60)',
    )  # fmt: skip
    assert max(seconds(task)) == 9
    flat = flatten(task)
    assert flat.earliest == [(0, 20)]
    assert flat.due == [(0, 60, 1), (0, 70, 100)]


def test_times_of_what_is_under_way_are_read() -> None:
    task = read(
        'base_duration(r,take,"|",5)', 'task_free(r,"|",7)',
        'task_since(at(r),"|",7)', 'task_since(box,"|",-3)', 'task_since(box,"|",2)',
    )  # fmt: skip
    assert task.times is not None
    assert task.times.free == {"r": 7}
    assert task.times.since == {"at(r)": 7, "box": 2}
    flat = flatten(task)
    numbers = {f"{one.start}{one.name}": index for index, one in enumerate(task.actions)}
    plan = [numbers[name] for name in ("ab", "take", "ba", "put")]
    assert value(flat, plan) == (0, 0, 7 + 7 + 5 + 7 + 1, 16)


@pytest.mark.parametrize("busy", [0, 30, 60])
def test_who_is_busy_for_long_is_not_planned_for(busy: int) -> None:
    """One robot is near, and busy; the other one needs 40 s to get there."""
    actions: List[FlatAction] = []
    durations: List[int] = []
    for robot in range(2):
        actions.append(([(robot, 0)], [], [([], robot, 1)], [], 1, robot))
        actions.append(([(robot, 1)], [], [([], 2, 1)], [], 1, robot))
        durations += [(10, 50)[robot], 5]
    task = FlatTask([2] * 3, [0] * 3, [], [], [([(2, 1)], [])], actions, durations=durations,
                    free=[(0, busy)], since=[(0, busy)])  # fmt: skip
    inserter = inserter_of(tuple(task))
    inserted = inserter.first(lambda: False) if inserter else None
    process = SearchProcess(task, seconds=60, improve_seconds=1, bytes=1 << 31)
    assert process.wait(60)
    searched = process.latest()
    process.close()
    for plan in (searched, *([] if inserted is None else [inserted])):
        assert plan == ([2, 3] if busy == 60 else [0, 1])


def test_a_value_is_ready_some_time_after_the_action() -> None:
    """The waiter goes on meanwhile, and who needs the value waits for it."""
    actions: List[FlatAction] = [
        ([], [], [([], 0, 1)], [], 1, 0),  # puts the dish on the stove, for 5 s
        ([], [], [([], 1, 1)], [], 1, 0),  # cleans a table, for 20 s
        ([(0, 1)], [], [([], 0, 2)], [], 1, 0),  # takes the dish, for 1 s
    ]
    requests: List[FlatRequest] = [([(0, 2)], []), ([(1, 1)], [])]
    task = FlatTask([3, 2], [0, 0], [], [], requests, actions,
                    durations=[5, 20, 1], ready=[(0, 1, 100)])  # fmt: skip
    assert value(task, [0, 1, 2]) == (0, 0, 106 + 25, 3)


def couriers(draw: random.Random) -> FlatTask:
    """Draws a task for robots with batteries, which bring things along a corridor."""
    places, robots, things = draw.randint(3, 6), draw.randint(1, 3), draw.randint(1, 6)
    full = 2 * places
    domains = [places] * robots + [robots + 2] * things
    actions: List[FlatAction] = []
    durations: List[int] = []
    for robot in range(robots):
        for start, end in itertools.permutations(range(places), 2):
            way = abs(start - end)
            takes = [(kinds.TAKES, robot, way), (kinds.NEEDS_LEAST, robot, way + end)]
            actions.append(([(robot, start)], [], [([], robot, end)], takes, way, robot))
            durations.append(3 * way)
        actions.append(([(robot, 0)], [], [], [(kinds.BECOMES, robot, full)], 1, robot))
        durations.append(10)
    requests: List[FlatRequest] = []
    for thing in range(robots, robots + things):
        start, end = draw.sample(range(places), 2)
        for robot in range(robots):
            room = robots + robot
            picked: FlatEffects = [([], thing, robot + 1)]
            put: FlatEffects = [([], thing, robots + 1)]
            pick: FlatAction = (
                [(robot, start), (thing, 0)],
                [],
                picked,
                [(kinds.TAKES, room, 1)],
                1,
                robot,
            )
            actions += [
                pick,
                ([(robot, end), (thing, robot + 1)], [], put, [(kinds.ADDS, room, 1)], 1, robot),
            ]
            durations += [2, 4]
        requests.append(([(thing, robots + 1)], []))
    limits = [full] * robots + [2] * robots
    due = [(one, draw.randint(10, 60), draw.randint(1, 3)) for one in range(things)]
    return FlatTask(
        domains, [0] * len(domains), limits, limits, requests, actions,
        durations=durations, due=due, aim=(draw.randrange(3), draw.choice([0, 0, 1])),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(40))
def test_inserted_plans_are_valid_and_each_better_than_the_one_before(seed: int) -> None:
    """They recharge where that is needed, and each has the value that the judge finds."""
    task = couriers(random.Random(seed))
    inserter = inserter_of(tuple(task))
    assert inserter is not None
    plans = [inserter.first(lambda: False)]
    values = [inserter.best.value]
    for _ in range(60):
        plan = inserter.round()
        if plan is not None:
            plans.append(plan)
            values.append(inserter.best.value)
    assert [judge.value_of(task, plan) for plan in plans] == values
    assert values == sorted(set(values), reverse=True)
    again = inserter_of(tuple(task))
    assert again.begin_with(plans[-1])
    assert again.best.value == values[-1]


@pytest.mark.parametrize("seed", range(10))
def test_plans_without_seconds_are_inserted_too(seed: int) -> None:
    """Actions last as long as they cost, and better plans have less makespan, or cost less."""
    task = couriers(random.Random(seed))._replace(durations=[], due=[], aim=(0, 0))
    inserter = inserter_of(tuple(task))
    plans = [inserter.first(lambda: False)]
    improver = Improver(tuple(task), lambda: False, 4000, inserter=inserter)
    improver.improve(plans[0], plans.append)
    values = [judge.value_of(task, plan) for plan in plans]
    assert values == sorted(set(values), reverse=True)
    assert inserter.best.value[-2:] >= values[-1]


def test_some_plan_recharges() -> None:
    """The tasks of the test above need that, and it is inserted."""
    fills = 0
    for seed in range(40):
        task = couriers(random.Random(seed))
        plan = inserter_of(tuple(task)).first(lambda: False)
        fills += any(task.actions[index][3][:1] and not task.actions[index][2] for index in plan)
    assert fills


def test_a_request_for_two_actuators_is_left_to_the_search() -> None:
    """A door that one robot opens only for another one, which goes through."""
    actions: List[FlatAction] = [
        ([(0, 0)], [], [([], 0, 1)], [], 1, 0), ([(0, 1)], [], [([], 0, 0)], [], 1, 0),
        ([(1, 0)], [], [([], 1, 1)], [], 1, 1), ([(1, 1)], [], [([], 1, 0)], [], 1, 1),
        ([(0, 1)], [], [([], 2, 1)], [], 1, 0),  # opens
        ([(1, 1), (2, 1)], [], [([], 3, 1)], [], 1, 1),  # takes what is behind it
    ]  # fmt: skip
    task = FlatTask([2] * 4, [0] * 4, [], [], [([(3, 1)], [])], actions, durations=[5] * 6)
    assert inserter_of(tuple(task)) is None
    process = SearchProcess(task, seconds=60, improve_seconds=1, bytes=1 << 31)
    assert process.wait(60)
    plan = process.latest()
    process.close()
    assert plan is not None
    assert judge.run(task, plan)


def floors(top: int = 3) -> FlatTask:
    """Returns a task of a robot, which fetches a thing from the floor below, by lift.

    Places 0 and 1 are below, all others above; the lift is at 1 and 2.
    """
    actions: List[FlatAction] = []
    durations: List[int] = []
    pairs = [*itertools.permutations((0, 1), 2), *itertools.permutations(range(2, top + 1), 2)]
    for start, end in [*pairs, (1, 2), (2, 1)]:
        takes = [] if {start, end} == {1, 2} else [(kinds.TAKES, 0, 1)]
        actions.append(([(0, start)], [], [([], 0, end)], takes, 1, 0))
        durations.append(10)
    actions += [
        ([(0, 0), (1, 0)], [], [([], 1, 1)], [], 1, 0),  # takes
        ([(0, top), (1, 1)], [], [([], 1, 2)], [], 1, 0),  # puts
    ]
    requests: List[FlatRequest] = [([(1, 2)], [])]
    return FlatTask(
        [top + 1, 3], [top, 0], [9], [9], requests, actions, durations=[*durations, 1, 1]
    )


def test_paths_of_several_ways_are_inserted() -> None:
    task = floors()
    places = [(task.actions[one][0][0][1], task.actions[one][2][0][2]) for one in range(6)]
    plan = inserter_of(tuple(task)).first(lambda: False)
    assert [places[one] if one < 6 else one for one in plan] == [
        (3, 2), (2, 1), (1, 0), 6, (0, 1), (1, 2), (2, 3), 7,
    ]  # fmt: skip
    assert judge.run(task, plan)
    # On a lower battery it does not come back.
    assert inserter_of(tuple(task._replace(levels=[3]))).first(lambda: False) is None


def test_ways_that_are_there_are_taken_although_others_are_quicker() -> None:
    """Paths are for places that no way connects."""
    task = floors(top=5)
    assert judge.run(task, inserter_of(tuple(task)).first(lambda: False))
    durations = list(task.durations)
    direct = next(
        one
        for one, action in enumerate(task.actions)
        if action[0] == [(0, 2)] and action[2] == [([], 0, 5)]
    )
    durations[direct] = 500
    slow = task._replace(durations=durations)
    plan = inserter_of(tuple(slow)).first(lambda: False)
    assert direct in plan
    assert judge.run(slow, plan)


def ovens() -> FlatTask:
    """Returns a task for two robots: one fills an oven, and one fetches what is ready there."""
    actions: List[FlatAction] = []
    durations: List[int] = []
    for robot in range(2):
        for start, end in itertools.permutations(range(2), 2):
            actions.append(([(robot, start)], [], [([], robot, end)], [], 10, robot))
            durations.append(10)
        actions += [
            ([(robot, 0), (2, 0)], [], [([], 2, 1)], [], 1, robot),  # fills the oven
            ([(robot, 0), (2, 1)], [], [([], 2, 2 + robot)], [], 1, robot),  # fetches
            ([(robot, 1), (2, 2 + robot)], [], [([], 2, 4)], [], 1, robot),  # brings
        ]
        durations += [30, 1, 1]
    return FlatTask([2, 2, 5], [0, 0, 0], [], [], [([(2, 4)], [])], actions, durations=durations)


def test_one_robot_may_begin_what_another_one_ends() -> None:
    """No other robot brings what one has fetched."""
    chains = inserter_of(tuple(ovens())).chains
    assert chains.of_requests == [[(2, 3, 4), (7, 8, 9), (2, 8, 9), (7, 3, 4)]]
    task = couriers(random.Random(3))
    for chain in itertools.chain(*inserter_of(tuple(task)).chains.of_requests):
        assert len({task.actions[index][5] for index in chain}) == 1


def test_what_is_begun_stays_when_others_are_inserted_anew() -> None:
    """Without that, most better plans begin otherwise, and none of them could be used."""

    def rounds(task: FlatTask, *, holds: bool) -> Tuple[int, int]:
        """Returns how many better plans there are, and how many keep what is begun."""
        inserter = inserter_of(tuple(task))
        plan = inserter.first(lambda: False)
        actors = [action[5] for action in task.actions]
        begun: Dict[int, List[int]] = {}
        for index in plan:  # the first two actions of each robot
            if len(begun.setdefault(actors[index], [])) < 2:
                begun[actors[index]].append(index)
        standing = Standing(plan, actors, [-1] * len(actors), [*begun.values()])
        if holds:
            inserter.hold(standing)
        assert inserter.begin_with(plan)
        made = [inserter.round() for _ in range(300) if not inserter.is_stuck]
        found = [better for better in made if better is not None]
        return len(found), sum(standing.keeps(better) for better in found)

    tasks = [couriers(random.Random(seed)) for seed in range(40)]
    held = [rounds(task, holds=True) for task in tasks if inserter_of(tuple(task))]
    free = [rounds(task, holds=False) for task in tasks if inserter_of(tuple(task))]
    assert all(kept == found for found, kept in held)
    assert sum(found for found, _ in held) > 5
    assert any(kept < found for found, kept in free)


def test_the_sources_insert_as_compiled_modules_do() -> None:
    def inserted(task: FlatTask) -> List[List[int]]:
        inserter = inserter_of(tuple(task))
        plans = [inserter.first(lambda: False)]
        return plans + [plan for plan in [inserter.round() for _ in range(20)] if plan is not None]

    tasks = [ovens(), *(couriers(random.Random(seed)) for seed in range(4))]
    program = (
        "import sys\n"
        "from rosoclingo.engine.insertion import inserter_of\n"
        "for task in eval(sys.stdin.read()):\n"
        "    inserter = inserter_of(task)\n"
        "    print(inserter.first(lambda: False))\n"
        "    for plan in [inserter.round() for _ in range(20)]:\n"
        "        if plan is not None: print(plan)\n"
    )
    sources = os.pathsep.join(map(str, Path(__file__).resolve().parents[3].glob("*/src")))
    ended = subprocess.run(
        [sys.executable, "-c", program],
        input=repr([tuple(task) for task in tasks]),
        env={**os.environ, "PYTHONPATH": sources, "PYTHONHASHSEED": "7"},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    found = [plan for task in tasks for plan in inserted(task)]
    assert ended.stdout.split("\n")[:-1] == [str(plan) for plan in found]
