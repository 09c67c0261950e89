"""Robots of which nobody knows how they are: what clients are told, and what the others do."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Callable, List

import pytest
from draws import variants
from episode import (
    DYN_RESET,
    INCREMENTAL,
    MAILBOT,
    OFFICE,
    RECORDING,
    RESET,
    SINGLE,
    Episode,
)
from instance_map import InstanceMap

from rosoclingo_aspprograms.validator import arguments

INSTANCES = Path(OFFICE).parent
WITH_IT = "waits for mailbot2 which has the package"
# The past is kept, and forgotten while somebody is lost; in one node, all begins in step 1.
KEPT = variants(
    [(RECORDING, True), (RESET, False), (SINGLE, True)], product(INCREMENTAL, [False, True])
)
ANSWERS = variants(
    [
        (RECORDING, "success"),
        (RESET, "failure"),
        (DYN_RESET, "unknown"),
        (DYN_RESET, "success"),
        (SINGLE, "unknown"),
    ],
    product(INCREMENTAL, ["success", "failure", "unknown"]),
)


def _fleet(mode: str, in_seconds: bool = False) -> Episode:
    """Returns the office with mailbot at open1 and mailbot2 at c5."""
    graph = InstanceMap.read(Path(OFFICE))
    graph.starts["mailbot2"] = "c5"
    files = [str(INSTANCES / "fleet_2.lp"), MAILBOT]
    if in_seconds:
        graph.durations = {"pickup": 5, "deliver": 5}
        files.insert(1, str(INSTANCES / "lengths.lp"))
    options = ["-c", "steps=99", *(["-c", "r=1"] if mode == RESET else [])]
    return Episode(mode, graph, files, options)


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "in_seconds"), KEPT)
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


def _drive(fleet: Episode, fails: Callable[[str, str, str], bool]) -> None:
    """Has all actions succeed, but drives that fail with a robot, from a place to another one."""

    def turn() -> bool:
        for robot, action in sorted(fleet.acting.items()):
            targets = arguments(action, "go")
            here = fleet.validator.positions[robot]
            failed = bool(targets) and fails(robot, here, targets[0])
            fleet.answer(robot, "failure" if failed else "success")
        return bool(fleet._items)

    assert fleet.play(turn) is None
    assert fleet.validator.violations == []


def _driven(fleet: Episode, robot: str) -> List[str]:
    actions = [action for actuator, action in fleet.published if actuator == robot]
    return [target for action in actions for target in arguments(action, "go")]


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "in_seconds"), KEPT)
def test_a_robot_that_is_stuck_closes_no_ways(mode: str, in_seconds: bool) -> None:
    """It cannot leave c5, through which the other one has to go."""
    fleet = _fleet(mode, in_seconds)
    goals = [fleet.request("bring(o8,o11)"), fleet.request("bring(o9,o12)")]
    _drive(fleet, lambda robot, here, there: robot == "mailbot2")
    assert [goal.words for goal in goals] == [["accepted", "succeeded"]] * 2
    assert sorted(_driven(fleet, "mailbot2")) == ["o8", "o9"]
    assert fleet.validator.lost == {"mailbot2"}
    assert fleet.validator.believed() == set()
    assert fleet.validator.finish() == []


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "in_seconds"), KEPT)
def test_a_robot_that_is_stuck_has_a_package(mode: str, in_seconds: bool) -> None:
    """It waits with it, until somebody has seen to the robot."""
    fleet = _fleet(mode, in_seconds)
    with_it, other = fleet.request("bring(o9,o2)"), fleet.request("bring(o1,o3)")
    is_stuck = [True]

    def fails(robot: str, here: str, there: str) -> bool:
        loaded = robot in fleet.validator.loads
        return is_stuck[0] and robot == "mailbot2" and here == "c5" and loaded

    _drive(fleet, fails)
    assert with_it.words == ["accepted"]
    assert other.words == ["accepted", "succeeded"]
    assert [line for line in with_it.lines if line.startswith("waits")] == [WITH_IT]
    assert fleet.validator.lost == {"mailbot2"}
    is_stuck.clear()
    is_stuck.append(False)
    fleet.announce("at(mailbot2,c5)")
    _drive(fleet, fails)
    assert with_it.words == ["accepted", "succeeded"]
    assert fleet.validator.finish() == []


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "in_seconds"), KEPT)
def test_a_robot_of_a_fleet_turns_round_at_a_box(mode: str, in_seconds: bool) -> None:
    """One failure, and then a success: it was the way, and that of the second box is another."""
    fleet = _fleet(mode, in_seconds)
    goal = fleet.request("bring(o9,o11)")
    boxes = [{"c5", "c4"}, {"c1", "c2"}]
    _drive(fleet, lambda robot, here, there: {here, there} in boxes and robot == "mailbot2")
    assert goal.words == ["accepted"]
    assert fleet.validator.lost == set()
    assert _driven(fleet, "mailbot2")[:3] == ["o9", "c5", "c4"]
    assert {frozenset(box) for box in boxes} <= fleet.validator.believed()


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "in_seconds"), KEPT)
def test_what_others_have_found_stays_blocked(mode: str, in_seconds: bool, tmp_path: Path) -> None:
    """Two in a hall fail at the same door, and then one of them at the next one, too."""
    hall = InstanceMap({"a", "b", "c"}, {frozenset(("hall", office)) for office in "abc"})
    hall.starts = {"one": "hall", "other": "hall"}
    hall.durations = {"pickup": 2} if in_seconds else {}
    instance = tmp_path / "hall.lp"
    instance.write_text(hall.facts())
    options = ["-c", "steps=99", *(["-c", "r=1"] if mode == RESET else [])]
    fleet = Episode(mode, hall, [str(instance), MAILBOT], options)
    behind = [fleet.request("bring(a,b)"), fleet.request("bring(a,c)")]
    failed: List[str] = []

    def fails(robot: str, here: str, there: str) -> bool:
        if there != "a" and failed[2:]:
            return False
        failed.append(there)
        return True

    _drive(fleet, fails)
    assert failed == ["a", "a"]
    goal = fleet.request("bring(b,c)")
    _drive(fleet, fails)
    assert failed == ["a", "a", "b"]
    assert len(fleet.validator.lost) == 1
    assert goal.words == ["accepted", "succeeded"]
    assert [one.words for one in behind] == [["accepted"]] * 2
    assert fleet.validator.believed() == {frozenset(("hall", "a"))}


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "answer"), ANSWERS)
def test_a_robot_acts_in_the_step_in_which_it_is_found(mode: str, answer: str) -> None:
    """Another one is on its way meanwhile, and nobody waits for it."""
    fleet = _fleet(mode, in_seconds=True)
    goals = [fleet.request("bring(o9,o12)"), fleet.request("bring(o1,o3)")]
    told: List[str] = []

    def turn() -> bool:
        assert len(fleet.published) < 40
        if not told:
            told.append(fleet.answer("mailbot2", "unknown"))
        elif len(told) == 1:
            told.append("found")
            fleet.announce("at(mailbot2,c5)")
        elif len(told) == 2:
            assert set(fleet.acting) == {"mailbot", "mailbot2"}
            told.append(fleet.answer("mailbot2", answer))
            assert told[0] == told[2] == "go(o9)"
        elif fleet.acting:
            fleet.answer(sorted(fleet.acting)[0])
        return bool(fleet._items)

    assert fleet.play(turn) is None
    assert fleet.validator.violations == []
    assert goals[1].words == ["accepted", "succeeded"]
    assert fleet.validator.lost == ({"mailbot2"} if answer == "unknown" else set())
    assert fleet.validator.believed() == (
        {frozenset(("c5", "o9"))} if answer == "failure" else set()
    )
    ended = goals[0].words[-1:] == ["succeeded"]
    assert ended == (answer != "failure")
