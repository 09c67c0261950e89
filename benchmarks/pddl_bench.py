#!/usr/bin/env python3
"""Times how long the mailbot plans, against Fast Downward on the same instances.

Over ROS: from the moment at which the first goal is sent until the first action is heard, with
three nodes and with one. In process: from telling all requests until there is a plan. Fast
Downward: its whole process, with its translator. All in turn, draw by draw; one node is compared
with three in each draw, and the median of that is shown.

Run by scripts/bench. Exit status 1 says that a limit is missed. Instead, ``--check 100`` compares
the lengths of the plans of so many random instances, in process.
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import matplotlib as mpl

from harness import RESULTS, HarnessError, Report, RosSystem, Row, Samples, measure, milliseconds
from mailbot import Grid, InProcess, Nodes, Request, bring, deliveries
from pddl import fast_downward

INSTANCES = {
    Grid(6, 3): 1.0,
    Grid(10, 1): 1.0,
    Grid(10, 3): 1.0,
    Grid(20, 3): 1.0,
    Grid(10, 10): 0.5,
    Grid(20, 10): 0.5,
}
"""What three nodes may need of the other's time."""
ONE_TO_THREE = 0.7  # what one node may need of the time of three
DRAWS = 10
OTHER, THREE, ONE, IN_PROCESS = "Fast Downward", "three nodes", "one node", "in process"


def plan_over_ros(nodes: Nodes, requests: Sequence[Request]) -> Tuple[float, int]:
    """Plans in a fresh node.

    Returns:
        The milliseconds until the first action, and the steps of the plan for all requests.
    """
    run = nodes.start()
    first = run.begin(*map(bring, requests))
    _, actions = run.plan(lambda plan: deliveries(plan) == len(requests))
    nodes.end(run)
    return first, len(actions)


def plan_in_process(grid: Grid, requests: Sequence[Request]) -> Tuple[float, int]:
    """Plans with a fresh solver; returns the same."""
    planner = InProcess(grid)
    duration, plan = milliseconds(partial(planner.plan, requests))
    return duration, len(plan.actions_from(0))


def measure_instance(
    system: RosSystem, folder: Path, report: Report, grid: Grid
) -> Dict[str, float]:
    """Adds the rows of an instance, and returns the medians in milliseconds."""
    nodes = {name: Nodes(system, grid, together=name == ONE) for name in (THREE, ONE)}
    times: Dict[str, List[float]] = {name: [] for name in (OTHER, THREE, ONE, IN_PROCESS)}
    for seed in range(DRAWS):
        requests = grid.draw(seed)
        seconds, length = fast_downward(grid.size, requests, folder)
        ours = {name: plan_over_ros(those, requests) for name, those in nodes.items()}
        ours[IN_PROCESS] = plan_in_process(grid, requests)
        times[OTHER].append(seconds * 1e3)
        for name, (duration, steps) in ours.items():
            if steps != length:
                raise HarnessError(f"{requests}, {name}: {steps} steps instead of {length}")
            times[name].append(duration)
    for those in nodes.values():
        those.close()
    samples = {name: Samples("ms", tuple(values)) for name, values in times.items()}
    medians = {name: those.median for name, those in samples.items()}
    name = f"plan {grid.requests} of {grid.size**2} offices"
    for how, limit in ((THREE, INSTANCES[grid]), (ONE, None)):
        ratio = medians[how] / medians[OTHER]
        report.add(
            Row(f"{name}, {how}", samples[OTHER], samples[how], f"to {OTHER}", ratio, "x", limit)
        )
    ratio = statistics.median(one / three for one, three in zip(times[ONE], times[THREE]))
    report.add(Row(name, None, samples[ONE], "one node to three", ratio, "x", ONE_TO_THREE))
    ratio = medians[IN_PROCESS] / medians[OTHER]
    report.add(Row(f"{name}, in process", samples[IN_PROCESS], None, f"to {OTHER}", ratio, "x"))
    return medians


def plot(medians: Dict[Grid, Dict[str, float]]) -> Path:
    """Draws the medians over the size, and returns the picture's file."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 (the backend has to be set first)

    figure, axes = plt.subplots(figsize=(9, 4.5))
    offices = sorted({grid.size**2 for grid in medians})
    styles = {1: ("^", ":"), 3: ("o", "-"), 10: ("s", "--")}
    for color, name in enumerate((OTHER, THREE, ONE, IN_PROCESS)):
        for requests, (marker, line) in styles.items():
            points = {g.size**2: of[name] for g, of in medians.items() if g.requests == requests}
            label = f"{name}, {requests} request{'s' * (requests > 1)}"
            axes.plot(
                list(points), list(points.values()), marker + line, color=f"C{color}", label=label
            )
    axes.set(xlabel="offices", ylabel="time to the first action (ms)", xscale="log", yscale="log")
    axes.set_xticks(offices, [str(number) for number in offices])
    axes.set_xticks([], minor=True)
    axes.set_title(f"Shortest plan of the mailbot, median of {DRAWS} random draws")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize="small", loc="center left", bbox_to_anchor=(1, 0.5))
    figure.tight_layout()
    RESULTS.mkdir(exist_ok=True)
    file = RESULTS / "pddl.png"
    figure.savefig(file, dpi=120)
    return file


def run(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures all instances."""
    medians = {grid: measure_instance(system, folder, report, grid) for grid in INSTANCES}
    print(f"\nplot: {plot(medians)}")


def check(instances: int) -> int:
    """Compares the plans' lengths with the shortest ones.

    Returns:
        The exit status: 1 says that there is a difference.
    """
    different = 0
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(instances):
            dice = random.Random(f"check {number}")
            grid = Grid(dice.randint(2, 12), dice.randint(1, 6))
            requests = grid.draw(f"check {number}")
            seconds, shortest = fast_downward(grid.size, requests, Path(folder))
            duration, steps = plan_in_process(grid, requests)
            ratios.append(duration / seconds / 1e3)
            if steps != shortest:
                different += 1
                print(f"{grid}, {requests}: {steps} steps, the shortest plan has {shortest}")
    print(
        f"{instances - different} of {instances} plans are as short as those of {OTHER}; found in "
        f"{statistics.median(ratios):.3f} times the time, {max(ratios):.3f} at worst"
    )
    return 1 if different else 0


def main() -> int:
    """Measures or checks, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", type=int, metavar="N", help="compare N random plans only")
    instances = parser.parse_args().check
    return measure("pddl", run) if instances is None else check(instances)


if __name__ == "__main__":
    sys.exit(main())
