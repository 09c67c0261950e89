#!/usr/bin/env python3
"""Times fleets that deliver ten packages, with steps that have a barrier and without.

For each seed, one robot and three of them without a barrier, and three with it, one drive after
the other in the simulated office; in the end a table and a picture. A drive takes up to two
minutes. In a sourced workspace. Exit status 1 says that a limit is missed, or that a drive went
wrong.
"""

from __future__ import annotations

import argparse
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, NamedTuple

import matplotlib as mpl

from rosclingo.errors import RosclingoError
from rosclingo.ros.local_master import LocalMaster

mpl.use("Agg")

from matplotlib import pyplot as plt

_SECONDS = 1200.0  # of wall time, for a drive
_MAKESPAN = re.compile(r"^\d+ packages delivered by .* in (\d+) s of simulated time", re.MULTILINE)


class Fleet(NamedTuple):
    """Robots, and how they are planned for.

    Attributes:
        name: For the table.
        robots: How many.
        seconds: Whether it is planned in seconds, and no robot waits for another.
    """

    name: str
    robots: int
    seconds: bool


ONE = Fleet("1 robot", 1, seconds=True)
THREE = Fleet("3 robots", 3, seconds=True)
BARRIER = Fleet("3 robots, barrier", 3, seconds=False)
LIMITS = {ONE: 0.45, BARRIER: 0.75}  # of the makespan of three without a barrier to that of these


def drive(fleet: Fleet, seed: int, speed: int, folder: Path) -> int:
    """Runs a fleet that delivers ten packages, and returns its simulated seconds.

    Raises:
        RosclingoError: Something went wrong.
    """
    with LocalMaster(folder) as master:
        words = [f"robots:={fleet.robots}", f"speed:={speed}"]
        words += [f"seconds:={str(fleet.seconds).lower()}"]
        master.start("office", ["roslaunch", "rosoclingo_gazebo", "mailbot_fleet.launch", *words])
        asked = [f"_robots:={fleet.robots}", f"_seed:={seed}", f"_output:={folder}"]
        demo = master.start("demo", ["rosrun", "rosoclingo_gazebo", "fleet_demo.py", *asked])
        try:
            status = demo.process.wait(_SECONDS)
        except subprocess.TimeoutExpired:
            status = 1
        found = _MAKESPAN.search(demo.output)
        if status or not found:
            raise RosclingoError(f"{fleet.name}, seed {seed}: {demo.last_lines}")
        return int(found.group(1))


def draw(makespans: Dict[Fleet, List[int]], seeds: range, file: Path) -> None:
    """Draws how long each fleet took for each seed."""
    figure, axes = plt.subplots(figsize=(8, 4.5))
    width = 0.8 / len(makespans)
    for number, (fleet, seconds) in enumerate(makespans.items()):
        places = [place + (number - 1) * width for place in range(len(seeds))]
        axes.bar(places, seconds, width, label=fleet.name)
    axes.set_xticks(range(len(seeds)))
    axes.set_xticklabels([str(seed) for seed in seeds])
    axes.set(xlabel="seed", ylabel="simulated time until the last delivery, s")
    axes.legend()
    figure.savefig(file, dpi=110, bbox_inches="tight")
    plt.close(figure)


def main() -> int:
    """Reads the command line, measures, prints, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="how many")
    parser.add_argument("--first", type=int, default=1, help="the first of them")
    parser.add_argument("--speed", type=int, default=10, help="simulated seconds in one")
    parser.add_argument("--output", type=Path, default=Path("fleets.png"), help="the picture")
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    makespans: Dict[Fleet, List[int]] = {ONE: [], THREE: [], BARRIER: []}
    print(f"| seed | {' | '.join(fleet.name for fleet in makespans)} |")
    print(f"|---|{'---|' * len(makespans)}", flush=True)
    for seed in seeds:
        for fleet, seconds in makespans.items():
            with tempfile.TemporaryDirectory(prefix="fleet_") as folder:
                seconds.append(drive(fleet, seed, arguments.speed, Path(folder)))
        row = " | ".join(f"{seconds[-1]} s" for seconds in makespans.values())
        print(f"| {seed} | {row} |", flush=True)
    draw(makespans, seeds, arguments.output)
    return judge(makespans)


def judge(makespans: Dict[Fleet, List[int]]) -> int:
    """Prints the ratios, and returns 1 if a limit is missed, else 0."""
    status = 0
    for fleet, limit in LIMITS.items():
        ratios = [ours / theirs for ours, theirs in zip(makespans[THREE], makespans[fleet])]
        ratio = sum(makespans[THREE]) / sum(makespans[fleet])
        missed = ratio > limit
        status |= missed
        print(
            f"{THREE.name} to {fleet.name}: {ratio:.2f} in all, {min(ratios):.2f} to "
            f"{max(ratios):.2f}, median {statistics.median(ratios):.2f}; limit {limit}"
            f"{', MISSED' if missed else ''}"
        )
    return status


if __name__ == "__main__":
    try:
        sys.exit(main())
    except RosclingoError as err:
        sys.exit(f"fleet.py: {err}")
