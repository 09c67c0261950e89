"""Replays the bags of the folder ``bags`` through the running nodes; nothing may be different.

REPEAT=10 in the environment replays each so many times. Needs a sourced workspace, in devel or
install space.
"""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent / "bags"
BAGS = sorted(FOLDER.glob("*.bag"))
TIMEOUT = 300.0  # seconds; no more than a bound for what never comes


@pytest.mark.parametrize("turn", range(int(os.environ.get("REPEAT", "1"))))
@pytest.mark.parametrize("bag", BAGS, ids=lambda bag: bag.stem)
def test_replay(bag: Path, turn: int) -> None:
    replay = subprocess.run(
        ["rosrun", "rosoclingo", "replay.py", str(bag)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert replay.returncode == 0, replay.stdout
    assert "no difference at level exact" in replay.stdout


def test_each_bag_has_a_line() -> None:
    lines = re.findall(r"^\| `([\w.]+)\.bag` \|", (FOLDER / "README.md").read_text(), re.MULTILINE)
    assert lines == [bag.stem for bag in BAGS]


def test_the_bags_are_small() -> None:
    assert sum(bag.stat().st_size for bag in BAGS) < 5 * 2**20
