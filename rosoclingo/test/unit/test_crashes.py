"""Whatever is written or sent when the process dies, the run goes on as if it had not."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest
from crashes import Runs, World, outcome

from rosoclingo.desk.parts import SINGLE

REQUESTS = ["visit(2)", "visit(99)", "visit(1)"]
MODES = [
    ("dynamic.incremental.recording", "line.lp"),
    ("dynamic.incremental.dyn_reset", "line.lp"),
    ("dynamic.incremental.dyn_reset", "line_demand.lp"),
    (SINGLE, "line_1.0.lp"),
]


def world() -> World:
    return World(REQUESTS, cancel=[3])


@pytest.mark.parametrize(("mode", "encoding"), MODES)
def test_every_point(mode: str, encoding: str, tmp_path: Path) -> None:
    runs = Runs(tmp_path, mode, encoding)
    calm = world()
    points = list(runs.run(calm))
    assert [len(client.end()) for client in calm.clients.values()] == [1] * len(REQUESTS)
    wrong: List[Tuple[int, str, object]] = []
    number = 0
    for number in range(1, len(points) + 1):
        disturbed = world()
        runs.run(disturbed, [number])
        if outcome(disturbed) != outcome(calm):
            wrong.append((number, points[number - 1], outcome(disturbed)))
    print(f"{mode}, {encoding}: {number} points")
    assert not wrong, outcome(calm)
