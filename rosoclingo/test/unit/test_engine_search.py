from __future__ import annotations

import contextlib
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Callable, List

import engine_judge as judge
import pytest

from rosoclingo.engine.flat import FlatTask
from rosoclingo.engine.improving import Improver
from rosoclingo.engine.kinds import ADDS, BECOMES
from rosoclingo.engine.search import OutOfTimeError, Search

DRAWS = 1000 if os.environ.get("FULL") else 60
SOURCES = os.pathsep.join(map(str, Path(__file__).resolve().parents[3].glob("*/src")))


class Countdown:
    """Stops a search at its Nth look at the time, which is at the same state on every machine."""

    def __init__(self, looks: int) -> None:
        self._looks = looks

    def __call__(self) -> bool:
        self._looks -= 1
        return self._looks < 0


def found(task: FlatTask) -> List[int]:
    plan = Search(tuple(task), Countdown(10**6)).find()
    assert plan is not None
    return plan


def improved(task: FlatTask, looks: int) -> List[List[int]]:
    """Returns the first plan and better ones."""
    plans = [found(task)]
    with contextlib.suppress(OutOfTimeError):
        Improver(tuple(task), Countdown(looks)).improve(plans[0], plans.append)
    return plans


Draw = Callable[..., FlatTask]
DRAWN = [judge.random_task, judge.random_derived_task, judge.random_timed_task]


def solvable_tasks(
    number: int, actors: int, actions: int, drawn: Draw = judge.random_task
) -> List[FlatTask]:
    tasks: List[FlatTask] = []
    draw = random.Random(actors)
    while len(tasks) < number:
        task = drawn(draw, actors=actors, actions=actions)
        if judge.has_plan(task):
            tasks.append(task)
    return tasks


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("seed", range(DRAWS))
def test_a_plan_is_found_if_and_only_if_there_is_one(seed: int, drawn: Draw) -> None:
    task = drawn(random.Random(seed))
    plan = Search(tuple(task), Countdown(10**6)).find()
    assert (plan is not None) == judge.has_plan(task)
    assert plan is None or judge.run(task, plan)


def test_requests_are_searched_for_one_by_one_if_all_take_long() -> None:
    """A search for all requests can follow, whether all of them or only some were met."""
    number_whole = number_partial = 0
    for number, task in enumerate(solvable_tasks(2 * DRAWS, 2, 20)):
        search = Search(tuple(task), Countdown(10**6))
        plan, is_whole = search.find_soon(number % 4 + 1)
        moments = judge.execute(task, plan)
        assert moments
        assert is_whole == all(moments[-1].met) or len(task.requests) == 1
        number_whole += is_whole
        number_partial += bool(plan) and not is_whole
        assert judge.run(task, plan if is_whole else search.find())
    assert number_whole
    assert number_partial


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("actors", [1, 2, 3])
def test_improved_plans_are_valid_and_each_better_than_the_one_before(
    actors: int, drawn: Draw
) -> None:
    number_improved = 0
    for task in solvable_tasks(DRAWS // 2, actors, 20, drawn):
        plans = improved(task, 20)
        values = [judge.value_of(task, plan) for plan in plans]
        assert values == sorted(set(values), reverse=True)
        assert Improver(tuple(task), Countdown(0)).value(plans[-1]) == values[-1]
        number_improved += len(plans) > 1
    assert number_improved


@pytest.mark.costly
def test_tiny_tasks_reach_the_least_makespan() -> None:
    judged = 0
    for task in solvable_tasks(DRAWS // 3, 2, 8):
        plan = improved(task, 200)[-1]
        makespan, _ = judge.value_of(task, plan)
        if 2 <= len(plan) <= 4 and makespan <= 8:
            assert makespan == judge.least_makespan(task, makespan)
            judged += 1
    assert judged


@pytest.mark.parametrize("drawn", DRAWN)
def test_a_limit_cuts_the_plans_but_changes_none(drawn: Draw) -> None:
    for task in solvable_tasks(5, 2, 20, drawn):
        plans = improved(task, 100)
        for looks in (1, 5, 20):
            cut = improved(task, looks)
            assert cut == plans[: len(cut)]


def test_the_sources_find_the_plans_that_compiled_modules_find() -> None:
    tasks = [task for drawn in DRAWN for task in solvable_tasks(5, 2, 20, drawn)]
    program = (
        "import sys\n"
        "from test_engine_search import FlatTask, improved\n"
        "print([improved(FlatTask(*task), 20) for task in eval(sys.stdin.read())])\n"
    )
    paths = os.pathsep.join([SOURCES, str(Path(__file__).parent), str(Path(judge.__file__).parent)])
    ended = subprocess.run(
        [sys.executable, "-c", program],
        input=repr([tuple(task) for task in tasks]),
        env={**os.environ, "PYTHONPATH": paths, "PYTHONHASHSEED": "7"},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    assert ended.stdout.strip() == repr([improved(task, 20) for task in tasks])


def test_large_levels_and_costs() -> None:
    most = 999_999_999
    actions = [
        ([], [], [], [(ADDS, 0, most - 1)], most, 0),
        ([], [], [], [(ADDS, 0, 1)], most, 0),
        ([], [], [], [(BECOMES, 0, 3)], 0, 0),
    ]
    task = FlatTask([], [], [most], [0], [([], [(0, most, most)])], actions)
    for plan in improved(task, 100):
        assert sorted(plan) == [0, 1]
        assert judge.value_of(task, plan) == (2 * most, 2 * most)


def test_actuators_share_the_work() -> None:
    """Two robots can each do eight jobs; a plan that loads one of them takes twice as long."""
    actions = [
        ([(job, 0)], [], [([], job, 1)], [], 1, robot) for job in range(8) for robot in range(2)
    ]
    requests = [([(job, 1)], []) for job in range(8)]
    task = FlatTask([2] * 8, [0] * 8, [], [], requests, actions)
    assert judge.value_of(task, found(task)) == (4, 8)


def test_a_request_stays_met_when_its_wishes_hold_no_more() -> None:
    """A door cannot be open and locked, but each of that is requested once."""
    actions = [([(0, 0)], [], [([], 0, 1)], [], 1, 0), ([], [(0, 2)], [([], 0, 2)], [], 1, 0)]
    task = FlatTask([3], [0], [], [], [([(0, 1)], []), ([(0, 2)], [])], actions)
    assert found(task) == [0, 1]
    assert improved(task, 100) == [[0, 1]]
