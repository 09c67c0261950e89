#!/usr/bin/env python3
"""Times first plans by the library for actions in general: hospitals of all sizes, and blocks.

Over ROS, three nodes, with the default ``~patience``: from the moment at which the first goal is
sent until the first action is heard. A hospital has two floors with one lift, and robots with
batteries bring bags of linen to its wards. Then the places are doubled until it takes more than ten
seconds, or breaks: where that is, is information.

Run by scripts/bench. Exit status 1 says that a limit is missed. ``--draws N`` says how often each
is measured.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from pathlib import Path
from typing import Iterator, List, Optional, Tuple, Union

from harness import HarnessError, Report, RosSystem, Row, Samples, measure
from mailbot import ROOT, Grid, Nodes

DRAWS = 10
PLACES, REQUESTS, ROBOTS = (10, 20, 40, 80), (1, 2, 6), (1, 3)
FIRST, LARGE_FIRST, BLOCKS_FIRST = 500.0, 2000.0, 800.0  # ms
STEPS = 100_000  # more than any plan has
SLOW = 10_000.0  # ms, at which it is not made larger any more
_ASP = ROOT / "rosoclingo_aspprograms"
_BAGS = 3  # that a robot carries


class Hospital(Grid):
    """A hospital of ``size`` places on two floors."""

    folder: Path

    @property
    def files(self) -> Tuple[str, ...]:
        """The encodings for the planner; that of the places is written into the folder."""
        places = self.folder / f"places_{self.size}_{self.robots}.lp"
        places.write_text("\n".join(self._facts()))
        return (str(_ASP / "hospital" / "hospital.lp"), str(places))

    @property
    def options(self) -> Tuple[str, ...]:
        """The planner's options: a battery lasts for all corridors and back."""
        full = max(20, 2 * self.size)
        return ("-c", f"slots={max(3, self.requests)}", "-c", f"full={full}")

    @property
    def wards(self) -> List[str]:
        """The wards: every other place along the corridors."""
        number = max(1, self.size // 4 - 1)
        return [f"ward{floor}_{i}" for floor in (1, 2) for i in range(1, number + 1)]

    def texts(self, seed: int) -> List[str]:
        """Returns random requests."""
        dice = random.Random(f"{self.size} {self.requests} {seed}")
        wards = self.wards
        return [
            f"linen({dice.choice(wards)},bags({dice.randint(1, _BAGS)}))"
            for _ in range(self.requests)
        ]

    def _facts(self) -> Iterator[str]:
        yield "#program base."
        for i in range(1, self.robots + 1):
            yield f"robot(linen{i}). start(linen{i},dock)."
        yield "lift_start(1). stop(1,hall1_0). stop(2,hall2_0)."
        yield "corridor(dock,laundry). corridor(laundry,hall1_0)."
        for floor in (1, 2):
            for i in range(1, len(self.wards) // 2 + 1):
                hall = f"hall{floor}_{i}"
                yield f"corridor(hall{floor}_{i - 1},{hall}). corridor({hall},ward{floor}_{i})."
                yield f"ward(ward{floor}_{i})."


class Blocks(Grid):
    """Eight blocks, one arm, and a tower."""

    @property
    def files(self) -> Tuple[str, ...]:
        """The encoding for the planner."""
        return (str(_ASP / "test" / "planning" / "blocks.lp"),)

    @property
    def options(self) -> Tuple[str, ...]:
        """None."""
        return ()

    def texts(self, _: int) -> List[str]:
        """Returns the only request."""
        return ["tower"]


def first(system: RosSystem, grid: Union[Hospital, Blocks], draws: int) -> Samples:
    """Returns the milliseconds until the first action, for random requests."""
    nodes = Nodes(system, grid, together=False, steps=STEPS)
    times = []
    for seed in range(draws):
        run = nodes.start()
        times.append(run.begin(*grid.texts(seed)))
        nodes.end(run)
    nodes.close()
    return Samples("ms", tuple(times))


def add(report: Report, name: str, samples: Samples, limit: Optional[float]) -> None:
    """Adds a row."""
    report.add(Row(name, None, samples, "median", samples.median, "ms", limit))


def measure_until_it_breaks(system: RosSystem, report: Report) -> None:
    """Adds a row for each doubling of the places and requests, until it takes too long."""
    places, requests, duration = 160, 12, 0.0
    while duration < SLOW:
        name = f"{places} places, {requests} requests, 3 robots: first action"
        try:
            samples = first(system, Hospital(places, requests, 3), 1)
        except HarnessError as err:
            print(f"{name}: {err}")
            return
        duration = samples.median
        report.add(Row(name, None, samples))
        places, requests = 2 * places, 2 * requests


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of each instance")
    draws = parser.parse_args().draws

    def run(system: RosSystem, _: Path, report: Report) -> None:
        with tempfile.TemporaryDirectory() as folder:
            Hospital.folder = Path(folder)
            add(report, "eight blocks", first(system, Blocks(8, 1), draws), BLOCKS_FIRST)
            for places in PLACES:
                for requests in REQUESTS:
                    for robots in ROBOTS:
                        is_large = (places, requests) == (PLACES[-1], REQUESTS[-1])
                        hospital = Hospital(places, requests, robots)
                        name = f"{places} places, {requests} requests, {robots} robots"
                        limit = LARGE_FIRST if is_large else FIRST
                        add(report, name, first(system, hospital, draws), limit)
            measure_until_it_breaks(system, report)

    return measure("hospital", run)


if __name__ == "__main__":
    sys.exit(main())
