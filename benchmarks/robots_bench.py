#!/usr/bin/env python3
"""Times how long several mailbots plan: ten requests on a grid of 10 x 10 offices, three nodes.

From the moment at which the first goal is sent until the plan for all of them is heard. With two
and three robots it is proven the best; with five, a search ends after ``~patience``.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import List

from harness import Report, RosSystem, Row, Samples, measure
from mailbot import Grid, Nodes, ask_all

SIZE, REQUESTS, DRAWS = 10, 10, 10
PROVEN = 3000.0  # ms
FIRST = 300.0  # ms, for the first plan of five robots
PATIENCE = 1.0
AT_ONCE = 0.001  # a search that ends as soon as it has a plan


def measure_robots(
    system: RosSystem, report: Report, robots: int, limit: float, patience: float
) -> List[int]:
    """Adds a row, and returns the lengths of the plans."""
    grid = Grid(SIZE, REQUESTS, robots)
    nodes = Nodes(system, grid, f"_patience:={patience}", together=False)
    times: List[float] = []
    lengths: List[int] = []
    for seed in range(DRAWS):
        run = nodes.start()
        duration, actions = ask_all(run, grid.draw(seed))
        nodes.end(run)
        times.append(duration)
        lengths.append(1 + max(int(action.rpartition(",")[2][:-1]) for action in actions))
    nodes.close()
    samples = Samples("ms", tuple(times))
    kinds = {0.0: "proven best", AT_ONCE: "first plan"}
    kind = kinds.get(patience, f"best after {patience:g} s")
    name = f"{robots} robots, {kind}, {min(lengths)} to {max(lengths)} steps"
    report.add(Row(name, None, samples, "median", samples.median, "ms", limit))
    return lengths


def run(system: RosSystem, _: Path, report: Report) -> None:
    """Measures everything."""
    for robots in (2, 3):
        measure_robots(system, report, robots, PROVEN, 0.0)
    first = measure_robots(system, report, 5, FIRST, AT_ONCE)
    best = measure_robots(system, report, 5, FIRST + PATIENCE * 1e3, PATIENCE)
    shorter = Samples("%", tuple(100 * b / f for b, f in zip(best, first)))
    report.add(Row("5 robots, length to that of the first plan", None, shorter))


if __name__ == "__main__":
    sys.exit(measure("robots", run))
