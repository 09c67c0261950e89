#!/usr/bin/env python3
"""Times plans for many requests, and compares them with those of OR-Tools.

Over ROS, three nodes, with the default ``~patience``: from the moment at which the first goal is
sent until the first action is heard, and what the plan costs two seconds later, beside what
OR-Tools (vehicle routing, guided local search) finds in two seconds as a process. Then, with ten
robots, how long replanning takes after a failure, a new request and a cancel. At last, requests
are doubled until it takes more than ten seconds, or breaks: where that is, is information.

Run by scripts/bench. Exit status 1 says that a limit is missed. ``--draws N`` says how often each
is measured.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple

from harness import HarnessError, Report, RosSystem, Row, Samples, measure
from mailbot import ENCODING, FOLDER, Grid, Nodes, Request, Run, bring, deliveries
from rosoclingo.msg import ROSoClingoOut

DRAWS = 10
LATER = 2  # s
ONE_ROBOT = {12: 300.0, 20: 300.0, 40: 300.0, 80: 1000.0}
"""Milliseconds until the first action, by the number of requests on 20 x 20."""
COST, FLEET_COST = 1.02, 1.05  # to that of OR-Tools
FLEETS = ((20, 5), (30, 10))  # requests and robots on 20 x 20
LARGE_FIRST, LARGE_AGAIN = 1000.0, 300.0  # ms, with 50 requests and 10 robots on 32 x 32
STEPS = 100_000  # more than any plan has
SLOW = 10_000.0  # ms, at which it is not made larger any more
_STEP = re.compile(r",([0-9]+)\)$")
_DEPOT = Path(__file__).with_name("encodings") / "depot.lp"
_ROUTING = Path(__file__).with_name("routing.py")


class Depot(Grid):
    """A grid whose robots all begin at the same place."""

    @property
    def files(self) -> Tuple[str, ...]:
        """The encodings for the planner."""
        return (str(FOLDER / "instances" / "graph_bench.lp"), str(_DEPOT), str(ENCODING))


@dataclass(frozen=True)
class Played:
    """The outcome of a run with some requests.

    Attributes:
        first: Milliseconds until the first action.
        steps: Steps of the plan that stood later.
    """

    first: float
    steps: int


def last_step(actions: Sequence[str]) -> int:
    """Returns the last step of a plan."""
    found = [_STEP.search(action) for action in actions if action.startswith("do(")]
    return max(int(match[1]) for match in found if match)


def play(nodes: Nodes, requests: Sequence[Request]) -> Played:
    """Sends requests to a fresh node, whose first robot answers after two seconds."""
    run = nodes.start()
    first = run.begin(*map(bring, requests))
    acts = time.perf_counter()
    _, plan = run.plan(lambda actions: deliveries(actions) == len(requests))
    time.sleep(max(0.0, LATER - (time.perf_counter() - acts)))
    plan = run.latest_plan() or plan
    nodes.end(run)
    return Played(first, last_step(plan))


def routed(grid: Grid, requests: Sequence[Request]) -> int:
    """Returns the steps of OR-Tools' plan."""
    words = [str(grid.size), str(grid.robots), str(LATER), json.dumps(requests)]
    command = [sys.executable, str(_ROUTING), *words]
    return int(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def measure_plans(
    system: RosSystem,
    report: Report,
    grid: Grid,
    *,
    draws: int,
    first: Optional[float],
    cost: float,
) -> None:
    """Adds the rows of an instance.

    Args:
        system: The ROS system.
        report: Gets the rows.
        grid: The instance.
        draws: How often it is measured.
        first: How many milliseconds the first action may take.
        cost: How many times OR-Tools' steps the plan may have.
    """
    nodes = Nodes(system, grid, together=False, steps=STEPS)
    firsts, ratios = [], []
    for seed in range(draws):
        requests = grid.draw(seed)
        played = play(nodes, requests)
        firsts.append(played.first)
        ratios.append(played.steps / routed(grid, requests))
    nodes.close()
    name = f"{grid.requests} requests, {grid.robots} robots, {grid.size} x {grid.size}"
    samples = Samples("ms", tuple(firsts))
    report.add(Row(f"{name}: first action", None, samples, "median", samples.median, "ms", first))
    ratio = Samples("x", tuple(ratios))
    report.add(Row(f"{name}: steps to OR-Tools", None, ratio, "median", ratio.median, "x", cost))


def again(run: Run, requests: int, happens: Callable[[], object]) -> float:
    """Returns how many milliseconds it takes until there is a plan with so many deliveries.

    Args:
        run: The node.
        requests: How many deliveries.
        happens: Does what the plan is made for.
    """
    run.latest_plan()
    start = time.perf_counter()
    happens()
    when, _ = run.plan(lambda plan: deliveries(plan) == requests)
    return (when - start) * 1e3


def fail(run: Run, actions: Sequence[ROSoClingoOut]) -> float:
    """Answers actions, of which only the last one has failed, which ends the step.

    Returns:
        How many milliseconds it takes until the robots are told what to do.
    """
    *others, last = actions
    start = time.perf_counter()
    for action in others:
        run.say(action.id, "success")
    run.say(last.id, "failure")
    when, _ = run.action()
    return (when - start) * 1e3


def measure_large(system: RosSystem, report: Report, draws: int) -> None:
    """Adds the rows of ten robots with fifty requests: the first action, and what changes."""
    grid = Depot(32, 51, 10)
    nodes = Nodes(system, grid, together=False, steps=STEPS)
    names = ("first action", "a failure", "a new request", "a cancel")
    times: List[List[float]] = [[] for _ in names]
    for seed in range(draws):
        *requests, another = grid.draw(seed)
        run = nodes.start()
        start = time.perf_counter()
        goals = [run.send(request) for request in requests]
        when, action = run.action()
        times[0].append((when - start) * 1e3)
        run.plan(lambda actions: deliveries(actions) == 50)
        time.sleep(LATER)
        times[1].append(fail(run, [action, *run.actions()]))
        time.sleep(LATER)
        left = deliveries(run.latest_plan())  # a failure closes a way, which may be the only one
        times[2].append(again(run, left + 1, partial(run.send, another)))
        time.sleep(LATER)
        times[3].append(again(run, left, goals[-1].cancel))
        nodes.end(run)
    nodes.close()
    for name, values in zip(names, times):
        samples = Samples("ms", tuple(values))
        limit = LARGE_FIRST if name == "first action" else LARGE_AGAIN
        title = f"50 requests, 10 robots, 32 x 32: {name}"
        report.add(Row(title, None, samples, "median", samples.median, "ms", limit))


def measure_until_it_breaks(system: RosSystem, report: Report) -> None:
    """Adds a row for each doubling of the requests of one robot, until it takes too long."""
    requests, duration = 160, 0.0
    while duration < SLOW:
        grid = Depot(20, requests, 1)
        nodes = Nodes(system, grid, together=False, steps=STEPS)
        run = nodes.start()
        name = f"{requests} requests, 1 robot, 20 x 20: first action"
        try:
            duration = run.begin(*map(bring, grid.draw(0)))
        except HarnessError as err:
            print(f"{name}: {err}")
            duration = SLOW
        else:
            report.add(Row(name, None, Samples("ms", (duration,))))
        nodes.end(run)
        nodes.close()
        requests *= 2


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of each instance")
    draws = parser.parse_args().draws

    def run(system: RosSystem, _: Path, report: Report) -> None:
        for requests, limit in ONE_ROBOT.items():
            measure_plans(system, report, Depot(20, requests), draws=draws, first=limit, cost=COST)
        for requests, robots in FLEETS:
            grid = Depot(20, requests, robots)
            measure_plans(system, report, grid, draws=draws, first=None, cost=FLEET_COST)
        measure_large(system, report, draws)
        measure_until_it_breaks(system, report)

    return measure("agenda", run)


if __name__ == "__main__":
    sys.exit(main())
