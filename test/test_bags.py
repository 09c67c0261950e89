"""Replays the bags of the folder ``bags`` through the running nodes; nothing may be different.

Those in ``bags/old`` are of encodings before grounding on demand, which they hold. They are
replayed with today's, too: all goals end as they did, and no plan is longer.

REPEAT=10 in the environment replays each so many times. Needs a sourced workspace, in devel or
install space.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest
from terminals import executable, package

FOLDER = Path(__file__).resolve().parent / "bags"
BAGS = sorted(FOLDER.glob("*.bag"))
OLD = sorted((FOLDER / "old").glob("*.bag"))
CASES = [*BAGS, *(pytest.param(bag, marks=pytest.mark.costly) for bag in OLD)]
TIMEOUT = 300.0  # seconds; no more than a bound for what never comes


def replay(bag: Path, level: str, *options: str) -> None:
    """Replays a bag; nothing may be different at a level."""
    run = subprocess.run(
        [executable("rosoclingo", "replay.py"), str(bag), "--level", level, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert run.returncode == 0, run.stdout
    assert f"no difference at level {level}" in run.stdout


@pytest.mark.parametrize("turn", range(int(os.environ.get("REPEAT", "1"))))
@pytest.mark.parametrize("bag", CASES, ids=lambda bag: f"{bag.parent.name}-{bag.stem}")
def test_replay(bag: Path, turn: int) -> None:
    replay(bag, "exact")


@pytest.mark.costly
@pytest.mark.parametrize("bag", OLD, ids=lambda bag: bag.stem)
def test_replay_with_todays_encoding(bag: Path) -> None:
    mailbot, modes = package("rosoclingo_aspprograms") / "mailbot", package("rosoclingo") / "modes"
    graph, constants = ("wg", "slots=3") if "scenario" in bag.stem else ("bench", "slots=2 x=2 y=2")
    files = f"-f {mailbot}/instances/graph_{graph}.lp -f {mailbot}/mailbot.lp"
    planner = files + "".join(f" -c {constant}" for constant in constants.split())
    if bag.stem.endswith("single"):
        replay(bag, "equivalent", "--single", planner)
    else:
        mode = "recording" if bag.stem.endswith("recording") else "dyn_reset"
        controller = f"-f {modes}/dynamic.incremental.{mode}.lp -c steps=100"
        replay(bag, "equivalent", "--planner", planner, "--controller", controller)


def test_each_bag_has_a_line() -> None:
    lines = re.findall(r"^\| `([\w.]+)\.bag` \|", (FOLDER / "README.md").read_text(), re.MULTILINE)
    assert lines == [bag.stem for bag in BAGS]


def test_the_bags_are_small() -> None:
    assert sum(bag.stat().st_size for bag in BAGS + OLD) < 5 * 2**20
