"""Robots of which nobody knows how they are: what clients are told, and what the others do."""

from __future__ import annotations

from pathlib import Path

import pytest
from episode import INCREMENTAL, MAILBOT, OFFICE, RESET, Episode

from rosoclingo_aspprograms.validator import Map

INSTANCES = Path(OFFICE).parent
WITH_IT = "waits for mailbot2 which has the package"


def _fleet(mode: str, in_seconds: bool = False) -> Episode:
    """Returns the office with mailbot at open1 and mailbot2 at c5."""
    graph = Map.read(Path(OFFICE))
    graph.starts["mailbot2"] = "c5"
    files = [str(INSTANCES / "fleet_2.lp"), MAILBOT]
    if in_seconds:
        graph.durations = {"pickup": 5, "deliver": 5}
        files.insert(1, str(INSTANCES / "lengths.lp"))
    options = ["-c", "steps=99", *(["-c", "r=1"] if mode == RESET else [])]
    return Episode(mode, graph, files, options)


@pytest.mark.parametrize("in_seconds", [False, True])
@pytest.mark.parametrize("mode", INCREMENTAL)
def test_a_client_is_told_which_lost_robot_has_its_package(mode: str, in_seconds: bool) -> None:
    """Also while others work; once, and not those whose packages are elsewhere."""
    fleet = _fleet(mode, in_seconds)
    with_it, other = fleet.request("bring(o9,o12)"), fleet.request("bring(o1,o3)")
    lost = []

    def turn() -> bool:
        if fleet.acting.get("mailbot2") == "go(c5)" and not lost:
            lost.append(fleet.answer("mailbot2", "unknown"))
        for robot in sorted(fleet.acting):
            fleet.answer(robot)
        if not fleet._items and fleet.validator.lost:
            assert other.words == ["accepted", "succeeded"]
            assert with_it.words == ["accepted"]
            fleet.announce("at(mailbot2,o9)")
        return bool(fleet._items)

    assert fleet.play(turn) is None
    assert fleet.validator.finish() == []
    assert with_it.words == ["accepted", "succeeded"]
    assert [line for line in with_it.lines if line.startswith("waits")] == [WITH_IT]
    assert not any(line.startswith("waits") for line in other.lines)
    told = with_it.lines.index(WITH_IT)
    assert any(line.startswith("step ") for line in with_it.lines[told:])
