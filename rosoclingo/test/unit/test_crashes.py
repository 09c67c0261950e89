"""Whatever is written or sent when the process dies, the run goes on as if it had not."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import List

import pytest
from crashes import Runs, World, outcome

from rosoclingo.desk.parts import SINGLE

REQUESTS = ["visit(2)", "visit(99)", "visit(1)"]
ENDS = {"1": ["succeeded"], "2": ["rejected"], "3": ["canceled"]}
RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
LONG = [(RECORDING, "line_demand.lp"), (DYN_RESET, "line.lp"), (SINGLE, "line_1.0.lp")]
SEEDS, KILLS = 3, 30


def world() -> World:
    return World(REQUESTS, cancel=[3])


@pytest.mark.parametrize(
    ("mode", "encoding"),
    [
        (DYN_RESET, "line_demand.lp"),
        *(pytest.param(*case, marks=pytest.mark.long) for case in LONG),
    ],
)
def test_every_point(mode: str, encoding: str, tmp_path: Path) -> None:
    """The process dies before each write and publication; that is after the one before, too.

    In between nothing changes that outlives it.
    """
    runs, calm = Runs(tmp_path, mode, encoding), world()
    points = list(runs.run(calm))
    assert outcome(calm)[1] == ENDS
    wrong: List[object] = []
    for number, point in enumerate(points, 1):
        if not point.startswith("before") and number < len(points):
            continue
        disturbed = world()
        runs.run(disturbed, [number])
        if outcome(disturbed) != outcome(calm):
            wrong.append((number, point, outcome(disturbed)))
    print(f"{mode}, {encoding}: {len(points)} points")
    assert not wrong, outcome(calm)


@pytest.mark.long
def test_a_second_crash_in_the_recovery(tmp_path: Path) -> None:
    runs, calm = Runs(tmp_path, DYN_RESET), world()
    points = list(runs.run(calm))
    for first in range(3, len(points), 15):
        for second in range(1, 8):
            disturbed = world()
            runs.run(disturbed, [first, second])
            assert outcome(disturbed) == outcome(calm), (first, second)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(SEEDS))
def test_random_kills(seed: int, tmp_path: Path) -> None:
    runs, calm, chance = Runs(tmp_path, DYN_RESET), world(), Random(seed)
    runs.run(calm)
    kills = [chance.randrange(1, 40) for _ in range(KILLS)]
    disturbed = world()
    runs.run(disturbed, kills)
    assert outcome(disturbed) == outcome(calm)
