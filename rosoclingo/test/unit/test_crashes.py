"""Whatever is written or sent when the process dies, the run goes on as if it had not."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Iterator, List

import pytest
from crashes import Runs, World, outcome

from rosoclingo.desk.parts import SINGLE

REQUESTS = ["visit(2)", "visit(99)", "visit(4)", "visit(1)"]
ENDS = {"1": ["succeeded"], "2": ["rejected"], "3": ["canceled"], "4": ["canceled"]}
RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
CASES = [(DYN_RESET, "line_demand.lp"), (RECORDING, "line.lp"), (SINGLE, "line_1.0.lp")]
SEEDS, KILLS = 2, 30


def world() -> World:
    return World(REQUESTS, {"3": "accepted", "4": ""})


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder in memory, if there is any: no power fails here."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=str(memory if memory.is_dir() else tmp_path)) as made:
        yield Path(made)


@pytest.mark.long
@pytest.mark.parametrize(("mode", "encoding"), CASES)
def test_every_point(mode: str, encoding: str, folder: Path) -> None:
    """The process dies before each write and publication; that is after the one before, too.

    In between nothing changes that outlives it.
    """
    runs, calm = Runs(folder, mode, encoding), world()
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
def test_a_second_crash_in_the_recovery(folder: Path) -> None:
    runs, calm = Runs(folder, DYN_RESET), world()
    points = list(runs.run(calm))
    for first in range(3, len(points), 25):
        for second in range(1, 6):
            disturbed = world()
            runs.run(disturbed, [first, second])
            assert outcome(disturbed) == outcome(calm), (first, second)


@pytest.mark.parametrize("seed", range(SEEDS))
def test_random_kills(seed: int, folder: Path) -> None:
    runs, calm, chance = Runs(folder, DYN_RESET), world(), Random(seed)
    runs.run(calm)
    kills = [chance.randrange(1, 40) for _ in range(KILLS)]
    disturbed = world()
    runs.run(disturbed, kills)
    assert outcome(disturbed) == outcome(calm)
