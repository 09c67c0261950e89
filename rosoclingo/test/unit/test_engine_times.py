"""Tasks that count seconds: how their times are read, and what a plan is worth."""

from __future__ import annotations

from typing import List

import pytest

from rosoclingo.engine import kinds
from rosoclingo.engine.flat import FlatAction, FlatRequest, FlatTask
from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.improving import Improver
from rosoclingo.engine.reading import TaskReader
from rosoclingo.engine.scheduling import Scheduler
from rosoclingo.engine.task import PlanningTask
from rosoclingo.engine.timing import Timetable

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
