#!/usr/bin/env python3
"""Measures plans in seconds: restaurants, hospitals and warehouses with deadlines, beside CP-SAT.

Each task is an encoding for ``actions.lp``, and all of its requests come at once. The processor
time until the first action goes out is measured, and that of the search alone for its first plan.
Then the makespan, with five seconds for each second of lateness, is measured of the first plan, and
after 2 s and 10 s of the search's processor time, beside OR-Tools' CP-SAT with that first plan as a
hint, and beside a prototype of this search in Python, whose figures are fixed. A judge that shares
no code with the search executes each plan.

Some tasks have other sizes and seeds, on which nothing was tuned. Exit status 1 says that a limit
is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Protocol, Sequence, Tuple

from harness import Report, Row, Samples
from rosclingo.solver.options import Options
from rosclingo.wire.term_text import split_term
from rosoclingo.engine import worker
from rosoclingo.engine.flattening import flatten
from rosoclingo.engine.scheduling import Scheduler
from rosoclingo.engine.task import PlanningTask
from rosoclingo.engine.timing import Timetable
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from tasks_bench import plan_with_library
from time_model import best_values
from time_tasks import Act, TimeTask, judge, make

MARKS = (2.0, 10.0)  # seconds of processor time
TO_BEST = (1.03, 1.02)  # of the best value that is known then
FIRST_SECONDS = 0.3  # of the search for the first plan
GROUNDED_SECONDS = 1.5  # until the first action, with grounding
_LIMIT = 300.0  # seconds for a process, also on a busy machine
_MODE = "dynamic.incremental.dyn_reset"
Spec = Tuple[str, int, int, int]  # domain, robots, errands, seed

PROTOTYPE: Dict[Spec, Tuple[int, int]] = {
    ("restaurant", 2, 5, 1): (147, 147),
    ("restaurant", 3, 10, 1): (196, 196),
    ("restaurant", 6, 20, 1): (192, 170),
    ("restaurant", 6, 40, 1): (327, 310),
    ("hospital", 3, 10, 1): (451, 451),
    ("hospital", 4, 20, 1): (609, 601),
    ("warehouse", 4, 20, 1): (145, 135),
    ("warehouse", 6, 40, 1): (215, 205),
    ("hospital", 5, 30, 5): (617, 599),
    ("warehouse", 3, 25, 5): (250, 240),
    ("restaurant", 4, 15, 3): (213, 213),
}
"""The values of the prototype after each mark."""
UNTUNED: Tuple[Spec, ...] = (
    ("restaurant", 4, 15, 3), ("hospital", 5, 30, 5), ("warehouse", 3, 25, 5),
)  # fmt: skip


class Found(NamedTuple):
    """The plans of a search.

    Attributes:
        seconds: The processor time until the first one.
        values: Of the first one, and of the best one after each mark.
        plan: The first one.
    """

    seconds: float
    values: List[int]
    plan: List[Act]


class Written(Protocol):
    """A task that is written as an encoding for actions.lp."""

    goals: List[str]

    def write(self, folder: Path) -> List[str]:
        """Writes the encoding into a folder, and returns the planner's files."""


class _Asked(System):
    """Ends when the first action goes out."""

    def publish(self, actuator: str, action: str) -> None:
        self.close()

    def turn(self) -> bool:
        return False


def read_task(task: Written) -> PlanningTask:
    """Returns the planning task that a planner reads."""
    with tempfile.TemporaryDirectory() as place:
        constants = ("-c", f"slots={len(task.goals)}")
        files = tuple(task.write(Path(place)))
        system = _Asked(make_parts(_MODE, Options(files, constants)).loop, patience=0.0)
        found: List[PlanningTask] = []
        system.run()
        system.loop.state.planner.show_tasks(found.append)
        for goal in task.goals:
            system.request(goal)
        system.run()
    return found[0]


def search_here(task: TimeTask) -> Found:
    """Searches in this process, as the planner's process for it does."""
    seconds, plans = find_plans(task, MARKS)
    return Found(seconds, [judge(task, plan) for plan in plans], plans[0])


def find_plans(task: Written, marks: Sequence[float]) -> Tuple[float, List[List[Act]]]:
    """Searches in this process, as the planner's process for it does.

    Args:
        task: The task.
        marks: Seconds of processor time, in order.

    Returns:
        The processor time until the first plan, and that plan with the best one after each mark.
    """
    planning = read_task(task)
    flat = flatten(planning)
    found: List[Tuple[float, Sequence[int]]] = []
    worker.write = lambda record: found.append((time.process_time() - began, record))
    options = {"plan": None, "standing": None, "seconds": marks[-1], "moment": 0,
               "improve_seconds": marks[-1], "improve_evaluations": 10**9}  # fmt: skip
    began = time.process_time()
    worker.search(tuple(flat), options, os.getppid())
    seconds = found[0][0]
    scheduler = Scheduler(tuple(flat), Timetable(tuple(flat), {}))
    plans = [[plan for when, plan in found if when <= mark][-1] for mark in (seconds, *marks)]
    return seconds, [list(timed(planning, scheduler, plan)) for plan in plans]


def timed(task: PlanningTask, scheduler: Scheduler, plan: Sequence[int]) -> Iterator[Act]:
    """Yields the actions of a plan with the seconds at which they begin."""
    assert scheduler.run(list(plan))
    for index, begin in zip(scheduler.plan(), scheduler.begins_of(len(plan))):
        action = task.actions[index]
        if not action.start:
            kind, (number,) = split_term(action.name)
            yield Act(action.actuator, kind, int(number), begin)


def search(spec: Spec) -> Found:
    """Searches in a process of its own."""
    command = [sys.executable, __file__, "--one", json.dumps(spec)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=_LIMIT)
    seconds, values, plan = json.loads(ended.stdout.splitlines()[-1])
    return Found(seconds, values, [Act(*act) for act in plan])


def measure(spec: Spec, report: Report) -> None:
    """Adds the rows of a task."""
    task = make(*spec)
    is_tuned = spec not in UNTUNED
    name = task.name if is_tuned else f"{task.name}, seed {spec[-1]}, untuned"
    with tempfile.TemporaryDirectory() as place:
        planned = plan_with_library(task.write(Path(place)), _LIMIT, goals=task.goals)
    assert planned is not None
    grounded = Samples("s", (planned.seconds,))
    report.add(Row(f"{name}: first action", grounded, None, "with grounding", planned.seconds, "s",
                   GROUNDED_SECONDS))  # fmt: skip
    found = search(spec)
    first = Samples("s", (found.seconds,))
    report.add(Row(f"{name}: first plan, {found.values[0]}", first, None, "search", found.seconds,
                   "s", FIRST_SECONDS))  # fmt: skip
    solved = best_values(task, found.plan, MARKS)
    rows = zip(MARKS, found.values[1:], solved, PROTOTYPE.get(spec, solved), TO_BEST)
    for mark, value, other, prototype, limit in rows:
        best = min(other, prototype)
        compared = f"to {best:g}, CP-SAT {other:g}"
        report.add(Row(f"{name}: after {mark:g} s", Samples("s", (float(value),)), None, compared,
                       value / best, "x", limit))  # fmt: skip


def main() -> int:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", default="", help="only tasks with this in their name")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(search_here(make(*json.loads(arguments.one)))))
        return 0
    report = Report("time")
    for spec in PROTOTYPE:
        if arguments.tasks in f"{spec[0]}-{spec[1]}-{spec[2]}":
            measure(spec, report)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
