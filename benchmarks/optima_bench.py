#!/usr/bin/env python3
"""Compares plans in seconds with optima: small random tasks with durations, deadlines and the like.

The optimum of each task is found by enumeration. The first plan of the search, and its best one
after 2 s of processor time, are judged by the same program, which shares no code with the search. A
row says, for each preference, how many optima are missed, and by how much: the difference in the
first part of the value that differs, lateness or what is preferred, to the optimum.

``--first N`` takes other tasks, such as those on which nothing was tuned.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Dict, List

from harness import Report, Row, Samples
from small_tasks import PREFERENCES, Optimum, SmallTask, draw, judge
from time_bench import find_plans

TASKS = 200
SECONDS = 2.0
MARKS = ("first plan", f"after {SECONDS:g} s")
_BAR_SECONDS = 30.0


def miss(found: Optimum, best: Optimum) -> float:
    """Returns by how much a plan is worse than the best one, to the value of that."""
    gap = next((mine - other for mine, other in zip(found, best) if mine != other), 0)
    assert gap >= 0, f"better than the optimum: {found}, {best}"
    return gap / max(1, sum(best))


def name_of(task: SmallTask) -> str:
    """Returns the row of a task."""
    return f"{task.prefers}, with lateness" if task.together else f"{task.prefers}, after lateness"


def measure(seeds: range, report: Report, *, tells: bool) -> None:
    """Adds the rows of some tasks.

    Args:
        seeds: Those of the tasks.
        report: Gets the rows.
        tells: Whether to print each task whose optimum is missed.
    """
    misses: Dict[str, List[List[float]]] = {}
    said = time.monotonic()
    for seed in seeds:
        task, best = draw(seed)
        _, plans = find_plans(task, (SECONDS,))
        values = [judge(task, plan) for plan in plans]
        for name in ("all", name_of(task)):
            of_marks = misses.setdefault(name, [[] for _ in MARKS])
            for mark, value in enumerate(values):
                of_marks[mark].append(miss(value, best))
        if tells and values[-1] != best:
            kinds = [job.preparing or "-" for job in task.jobs]
            print(f"{task.name}: {values} instead of {best}; {kinds}", flush=True)
        if time.monotonic() - said > _BAR_SECONDS:
            said = time.monotonic()
            print(f"{seed - seeds.start + 1} of {len(seeds)} tasks", file=sys.stderr, flush=True)
    rows = [f"{one}, {how} lateness" for one in PREFERENCES for how in ("after", "with")]
    for name in (*rows, "all"):
        for label, values_of in zip(MARKS, misses.get(name, ())):
            samples = Samples("%", tuple(100 * value for value in values_of))
            mean = sum(samples.values) / len(samples.values)
            met = sum(value == 0 for value in values_of)
            title = f"{name}: {label}, {met} of {len(values_of)} optimal"
            compared = f"worst {max(samples.values):.1f} %, mean"
            report.add(Row(title, samples, None, compared, mean, "%"))


def main() -> int:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=TASKS, metavar="N", help="how many")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="the seed of the first")
    parser.add_argument("--tell", action="store_true", help="print each one that is missed")
    chosen = parser.parse_args()
    report = Report("optima")
    measure(range(chosen.first, chosen.first + chosen.tasks), report, tells=chosen.tell)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
