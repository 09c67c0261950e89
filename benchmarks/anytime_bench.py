#!/usr/bin/env python3
"""Times the first plan of several mailbots, and looks what becomes of it while they drive.

In process, on a grid of 10 x 10 offices with ten requests, which are all told at once. The first
plan for five robots, with a patience of 1 ms, is compared with any plan, by clingo without
optimisation (``--opt-mode=ignore``). For two robots it is then looked for a better plan, with one
interruption after the other, until that is proven the best: it may never cost more than before, and
in the end has to cost what the plan of a search costs that was carried through.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import sys
import time
from itertools import count
from typing import List, Tuple

from harness import HarnessError, Report, Row, Samples, milliseconds
from mailbot import Grid, Request, bring
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import event

SIZE, REQUESTS, DRAWS = 10, 10, 10
AT_ONCE = 0.001  # s
FIRST = 1.2  # of the time for any plan
SLICE = 0.02  # s that a search for a better plan has at first, and each time this much more

Cost = Tuple[int, ...]


def make(grid: Grid, requests: List[Request], patience: float, *options: str) -> Planner:
    """Returns a planner that is told the requests with its next search."""
    planner = Planner(Engine(Options(grid.files, (*grid.options, *options))), patience)
    planner.begin()
    if planner.tell([event(str(n), bring(pair), 0) for n, pair in enumerate(requests, 1)]):
        raise HarnessError("the encoding does not know the requests")
    return planner


def search(planner: Planner) -> float:
    """Returns how many milliseconds a planner needs for its plan."""
    duration, outcome = milliseconds(lambda: planner.search(0, 10_000, lambda: False))
    if outcome.result is not Result.SAT:
        raise HarnessError("there is no plan")
    return duration


def cost(planner: Planner) -> Cost:
    """Returns what its plan costs."""
    if planner.quality is None:
        raise HarnessError("nobody knows what the plan costs")
    return planner.quality.cost


def measure_first(report: Report) -> None:
    """Adds a row: how much longer the first plan takes than any."""
    grid = Grid(SIZE, REQUESTS, 5)
    any_plan, first, ratios = [], [], []
    for seed in range(DRAWS):
        requests = grid.draw(seed)
        for _ in range(2):  # the second time counts
            plain = search(make(grid, requests, 0.0, "--opt-mode=ignore"))
            timed = search(make(grid, requests, AT_ONCE))
        any_plan.append(plain)
        first.append(timed)
        ratios.append(timed / plain)
    report.add(Row("5 robots, any plan", Samples("ms", tuple(any_plan)), None))
    samples = Samples("ms", tuple(first))
    ratio = Samples("", tuple(ratios)).median
    report.add(Row("5 robots, first plan", samples, None, "first / any", ratio, "x", FIRST))


def improve(planner: Planner) -> List[Cost]:
    """Looks for better plans until one is proven the best, and returns what each one costs."""
    costs = [cost(planner)]
    for number in count(1):
        end = time.monotonic() + number * SLICE
        planner.improve(0, lambda end=end: time.monotonic() > end)  # type: ignore[misc]
        costs.append(cost(planner))
        if planner.quality is not None and planner.quality.is_best:
            break
    return costs


def measure_better(report: Report) -> None:
    """Adds rows: how often a plan becomes worse, and whether the last one is the best."""
    grid = Grid(SIZE, REQUESTS, 2)
    worse, missed, looks, times = 0, 0, [], []
    for seed in range(DRAWS):
        best = make(grid, grid.draw(seed), 0.0)
        search(best)
        planner = make(grid, grid.draw(seed), AT_ONCE)
        search(planner)
        duration, costs = milliseconds(lambda planner=planner: improve(planner))  # type: ignore[misc]
        times.append(duration)
        looks.append(len(costs) - 1.0)
        worse += sum(later > before for before, later in zip(costs, costs[1:]))
        missed += costs[-1] != cost(best)
    samples = Samples("ms", tuple(times))
    report.add(Row("2 robots, until proven best", samples, None, "worse", worse, "", 0))
    report.add(Row("searches for that", Samples("", tuple(looks)), None, "not best", missed, "", 0))


if __name__ == "__main__":
    RESULT = Report("anytime")
    measure_first(RESULT)
    measure_better(RESULT)
    sys.exit(RESULT.finish())
