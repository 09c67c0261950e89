#!/usr/bin/env python3
"""Measures plans in domains of a user's own: kitchens, airports, warehouses and restaurants.

A planner in a process of its own has loaded the encoding. The goals come at once, and the processor
time of all its processes until the first action goes out is measured, the least of some runs.
Limits are for a machine on which clingo proves a fixed task in a certain time; the time is scaled
by what it takes for that in the same run. Then the last step of the plan is measured, at first and
after it was improved for ten seconds, beside that of the best plan by clingo in layers.

Then the tasks grow until there is no plan in time: where that is, is information. Exit status 1
says that a limit is missed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import clingo

from harness import Report, Row, Samples
from own_domains import DOMAINS, OwnTask, growing
from tasks_bench import DRAWS, LENGTH_SECONDS, SECONDS, Planned, plan_with_library

TO_LAYERS = 1.05  # of the last step of the plan in layers, after ten seconds
TO_FIRST = 0.8  # of the last step of the first plan, after ten seconds
_LIMIT = 300.0  # seconds for a process, also on a busy machine
_MEASURE_SECONDS = 0.3  # that the fixed task takes on the machine of the limits
_MEASURE = """
1 { in(P,H) : H = 1..8 } 1 :- P = 1..9.
:- in(P,H), in(Q,H), P < Q.
"""


class Limit(NamedTuple):
    """The limits of a task.

    Attributes:
        seconds: The processor time until the first action; None for information only.
        layers: The last step of the plan that clingo found in layers; None if it found none.
    """

    seconds: Optional[float]
    layers: Optional[int] = None


LIMITS: Dict[Tuple[str, int], Limit] = {
    ("kitchen", 16): Limit(0.4, 37),
    ("kitchen", 24): Limit(1.2),
    ("tugs", 6): Limit(0.7, 33),
    ("tugs", 8): Limit(1.3),
    ("tugs", 10): Limit(2.5),
    ("warehouse", 16): Limit(0.2, 77),
    ("warehouse", 24): Limit(0.5, 95),
    ("restaurant", 20): Limit(None),
}


def speed() -> float:
    """Returns clingo's time for the fixed task, to that on the machine of the limits."""
    control = clingo.Control(["0"])
    control.add("base", [], _MEASURE)
    began = time.process_time()
    control.ground([("base", [])])
    assert control.solve().unsatisfiable
    return (time.process_time() - began) / _MEASURE_SECONDS


def plan(task: OwnTask, limit: float, seconds: float = 0) -> Optional[Planned]:
    """Plans; returns None if there is no plan in time."""
    with tempfile.TemporaryDirectory() as place:
        return plan_with_library(task.write(Path(place)), limit, seconds, task.goals)


def measure(task: OwnTask, limit: Limit, draws: int, report: Report) -> None:
    """Adds the rows of a task."""
    scaled: List[float] = []
    raw: List[float] = []
    first: Optional[Planned] = None
    for _ in range(draws):
        before = speed()
        first = plan(task, _LIMIT)
        if first is None or first.seconds > SECONDS:
            report.add(Row(f"{task.name}: no plan", Samples("s", (SECONDS,)), None, "least, scaled",
                           SECONDS, "s", limit.seconds))  # fmt: skip
            return
        raw.append(first.seconds)
        scaled.append(first.seconds / min(before, speed()))
    report.add(Row(f"{task.name}: first action", Samples("s", tuple(raw)), None, "least, scaled",
                   min(scaled), "s", limit.seconds))  # fmt: skip
    assert first is not None
    better = plan(task, _LIMIT, LENGTH_SECONDS)
    last = float(better.last if better else first.last)
    steps = Samples("steps", (last,))
    name = f"{task.name}: last step after {LENGTH_SECONDS} s"
    report.add(Row(name, steps, None, f"to the first plan's {first.last}", last / first.last, "x",
                   None if limit.seconds is None else TO_FIRST))  # fmt: skip
    if limit.layers:
        report.add(Row(name, steps, None, f"to the layers' {limit.layers}", last / limit.layers,
                       "x", TO_LAYERS))  # fmt: skip


def measure_until_it_breaks(name: str, size: int, report: Report) -> None:
    """Adds a row for each larger task, until there is no plan in time, or the planner fails."""
    for task in growing(name, size):
        try:
            first = plan(task, _LIMIT)
        except subprocess.CalledProcessError as err:
            print(f"{task.name} breaks: {err.stderr.splitlines()[-1:]}")
            return
        if first is None or first.seconds > SECONDS:
            print(f"{task.name} breaks: no plan in {SECONDS:g} s")
            return
        report.add(Row(f"{task.name}: first action, last step {first.last}",
                       Samples("s", (first.seconds,)), None))  # fmt: skip


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of each task")
    parser.add_argument("--domain", choices=DOMAINS, help="only this one")
    chosen = parser.parse_args()
    report = Report("domains")
    names = [chosen.domain] if chosen.domain else list(DOMAINS)
    for (name, size), limit in LIMITS.items():
        if name in names:
            measure(DOMAINS[name](size), limit, chosen.draws, report)
    for name in names:
        measure_until_it_breaks(name, max(n for one, n in LIMITS if one == name), report)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
