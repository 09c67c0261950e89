"""Files of faults: what is read, and the line of each mistake."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List

import pytest
from office import PACKAGE
from office import WAYPOINTS as OFFICE_WAYPOINTS

from rosclingo import strict_yaml
from rosoclingo_interfaces.navigation.waypoints import Waypoint, read_waypoints
from rosoclingo_simulator.errors import FaultError
from rosoclingo_simulator.faults.kinds import (
    AtPlace,
    AtTime,
    BatteryModel,
    ByChance,
    ClosedDoor,
    WrongPose,
)
from rosoclingo_simulator.faults.reader import read_faults
from rosoclingo_simulator.physics.faulty import Disturbance
from rosoclingo_simulator.physics.obstacles import PassageEnd
from rosoclingo_simulator.physics.physics import Pose

OFFICE = read_waypoints(OFFICE_WAYPOINTS)


def test_the_example_has_each_kind() -> None:
    plan = read_faults(PACKAGE / "config" / "faults.yaml", OFFICE)
    assert plan.seed == 1
    assert {fault.kind for fault in plan.faults} == {
        "slip", "wrong_pose", "stuck_wheel", "laser_noise", "odometry_noise", "door_closes",
        "battery",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("entry", "effect"),
    [
        ({"fault": "slip"}, Disturbance(slip=0.5)),
        ({"fault": "slip", "loss": 1}, Disturbance(slip=1.0)),
        ({"fault": "stuck_wheel", "wheel": "left"}, Disturbance(left_stuck=True)),
        ({"fault": "stuck_wheel", "wheel": "right"}, Disturbance(right_stuck=True)),
        (
            {"fault": "stuck_wheel", "wheel": "both"},
            Disturbance(left_stuck=True, right_stuck=True),
        ),
        (
            {"fault": "laser_noise", "sigma": 0.1, "dropout": 0.2},
            Disturbance(laser_sigma=0.1, dropout=0.2),
        ),
        ({"fault": "odometry_noise"}, Disturbance(odometry_sigma=0.05)),
        (
            {"fault": "wrong_pose", "by": {"x": 1, "theta": 0.5}},
            WrongPose(Pose(1, 0, 0.5), None, lost=False),
        ),
        (
            {"fault": "wrong_pose", "carried_to": "c5", "lost": True},
            WrongPose(None, Pose(23, -17, 0), lost=True),
        ),
        (
            {"fault": "wrong_pose", "carried_to": {"x": 1, "y": -2}},
            WrongPose(None, Pose(1, -2, 0), lost=False),
        ),
        (
            {"fault": "door_closes", "between": ["c1", {"x": 16, "y": -4}]},
            ClosedDoor(
                (
                    PassageEnd("c1", Waypoint(16, -8, 0)),
                    PassageEnd("(16, -4)", Waypoint(16, -4, 0)),
                )
            ),
        ),
        (
            {"fault": "battery", "charging_place": "open1", "within": 2, "level": 0.5},
            BatteryModel(2.2, 0.5, 0.0001, 0.0005, AtPlace(Pose(7, -8, 0), 2), 0.005),
        ),
    ],
)
def test_effects(entry: Dict[str, Any], effect: object) -> None:
    (fault,) = read_faults({"faults": [entry]}, OFFICE).faults
    assert fault.effect == effect
    assert fault.kind == entry["fault"]
    assert fault.robot is None


@pytest.mark.parametrize(
    ("when", "trigger", "times"),
    [
        (None, AtTime(0), 1),
        ({"time": 7.5}, AtTime(7.5), 1),
        ({"place": "c2"}, AtPlace(Pose(23, -8, 0), 1), 1),
        ({"place": {"x": 1, "y": 2}, "within": 3, "times": 4}, AtPlace(Pose(1, 2, 0), 3), 4),
        ({"probability": 0.1}, ByChance(0.1, per_metre=False), 1),
        ({"probability": 1, "per": "metre", "times": 2}, ByChance(1, per_metre=True), 2),
    ],
)
def test_triggers(when: Any, trigger: object, times: int) -> None:
    entry: Dict[str, Any] = {"fault": "slip", "robot": "robot1", "lasts": 3}
    if when is not None:
        entry["when"] = when
    (fault,) = read_faults({"seed": 5, "faults": [entry]}, OFFICE).faults
    assert (fault.trigger, fault.times, fault.robot, fault.lasts) == (trigger, times, "robot1", 3)


GOOD = """\
seed: 3
faults:
  - fault: slip
    when: {time: 20}
    lasts: 10
  - fault: wrong_pose
    carried_to: c5
  - fault: battery
    charging_place: open1
  - fault: door_closes
    between:
      - c1
      - o1
  - fault: stuck_wheel
    when:
      probability: 0.1
    wheel: left
"""


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("seed: 3", "seed: -1", 1, "seed: expected a number from 0, not -1"),
        ("seed: 3", "seed: 1.5", 1, "seed: expected an integer, not 1.5"),
        ("seed: 3", "sead: 3", 1, "there is no entry 'sead'; there are seed, faults"),
        ("fault: slip", "fault: slide", 3, "fault 1: there is no fault 'slide'; there are slip,"),
        ("fault: slip", "robot: a", 3, "fault 1: expected an entry such as {fault: slip"),
        ("    lasts: 10", "    last: 10", 5, "fault 1 (slip): there is no entry 'last'; there are"),
        ("lasts: 10", "lasts: 0", 5, "fault 1 (slip): lasts: expected a number greater than 0"),
        ("lasts: 10", "lasts: long", 5, "lasts: expected a number from 0, not 'long'"),
        ("lasts: 10", "lasts: .inf", 5, "lasts: expected a number from 0, not inf"),
        ("lasts: 10", "loss: 1.1", 5, "loss: expected a number from 0 to 1, not 1.1"),
        ("lasts: 10", "loss: true", 5, "loss: expected a number from 0 to 1, not True"),
        ("lasts: 10", "robot: 3", 5, "robot: expected a name, not 3"),
        ("{time: 20}", "20", 4, "when: expected names with values (NAME: VALUE), not 20"),
        ("{time: 20}", "{}", 4, "when: expected one of time, place and probability, not 0"),
        ("{time: 20}", "{time: 1, place: c1}", 4, "one of time, place and probability, not 2"),
        ("{time: 20}", "{time: -1}", 4, "time: expected a number from 0, not -1"),
        ("{time: 20}", "{time: 1, times: 2}", 4, "times: a time comes once; leave it out"),
        ("{time: 20}", "{time: 1, within: 2}", 4, "within: goes with place only; leave it out"),
        ("{time: 20}", "{place: c1, per: metre}", 4, "per: goes with probability only"),
        ("{time: 20}", "{place: c9}", 4, "place: there is no waypoint c9 in"),
        ("{time: 20}", "{place: C9}", 4, "place: 'C9' is no waypoint"),
        ("{time: 20}", "{place: {x: 1}}", 4, "place: y is missing; add it"),
        ("{time: 20}", "{place: c1, times: 0}", 4, "times: expected a number from 1, not 0"),
        ("{time: 20}", "{place: c1, within: 0}", 4, "within: expected a number greater than 0"),
        ("carried_to: c5", "lost: true", 6, "expected one of by, such as {x: 1}, and carried_to"),
        (
            "carried_to: c5",
            "carried_to: {x: 1, y: a}",
            7,
            "y: expected a number from -1e+06 to 1e+06, not 'a'",
        ),
        ("carried_to: c5", "by: {z: 1}", 7, "there is no entry 'z'; there are x, y, theta"),
        (
            "carried_to: c5",
            "carried_to: c5\n    lost: 1",
            8,
            "fault 2 (wrong_pose): lost: expected true or false, not 1",
        ),
        ("charging_place: open1", "when: {time: 1}", 9, "(battery): there is no entry 'when'"),
        ("charging_place: open1", "level: 2", 9, "level: expected a number from 0 to 1, not 2"),
        ("charging_place: open1", "within: 2", 9, "within: goes with charging_place only"),
        ("charging_place: open1", "capacity: 0", 9, "capacity: expected a number greater than 0"),
        ("      - o1\n", "", 11, "between: expected two places, not 1"),
        ("- o1\n", "- 7\n", 13, "fault 4 (door_closes): expected a name, not 7"),
        ("- o1\n", "- oo\n", 13, "fault 4 (door_closes): there is no waypoint oo"),
        ("probability: 0.1", "probability: 1.5", 16, "probability: expected a number from 0 to 1"),
        ("0.1\n", "0.1\n      per: hour\n", 17, "per: expected second or metre, not 'hour'"),
        ("wheel: left", "wheel: front", 17, "wheel: expected left or right or both, not 'front'"),
        ("    wheel: left", "", 14, "fault 5 (stuck_wheel): wheel is missing; add left, right"),
    ],
)
def test_mistakes_are_named_by_line(
    tmp_path: Path, old: str, new: str, line: int, message: str
) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text(GOOD)
    assert len(read_faults(file, OFFICE).faults) == 5
    assert old in GOOD
    file.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(FaultError) as caught:
        read_faults(file, OFFICE)
    said = str(caught.value)
    assert said.startswith(f"{file}, line {line}: ")
    assert message in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: expected names with values (NAME: VALUE), not None"),
        ("seed: 1", "line 1: faults is missing; add a list"),
        ("faults: 7", "line 1: faults: expected a list, not 7"),
        ("faults: [", "faults.yaml is not YAML"),
        ("seed: 1\nseed: 2\n", "is not YAML: line 2: seed is there twice"),
        ("\0", "faults.yaml is not YAML"),
        ("[" * 5000, "is not YAML: line 1: it is nested too deeply"),
        ("faults: &a\n- *a\n", "is not YAML: line 1: it holds itself by an alias"),
        (f"seed: {'9' * 400}\nfaults: []", "is not YAML: line 1: 9999"),
        (f"? {'a' * 9000}\n: 1", "line 1: there is no entry 'aaa"),
        (f"faults: [{{fault: {'a' * 9000}}}]", "there is no fault 'aaa"),
    ],
)
def test_files_that_are_no_faults(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "faults.yaml"
    file.write_text(text)
    with pytest.raises(FaultError) as caught:
        read_faults(file, OFFICE)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 1000


def test_the_text_is_parsed_once_for_the_places_of_all_faults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: List[str] = []
    compose = strict_yaml.compose

    def counted(text: str) -> Any:
        calls.append(text)
        return compose(text)

    monkeypatch.setattr(strict_yaml, "compose", counted)
    file = tmp_path / "faults.yaml"
    file.write_text("faults:\n" + "- {fault: slip}\n" * 100)
    assert read_faults(file, OFFICE).faults[-1].where.startswith(f"{file}, line 101: ")
    assert len(calls) == 1


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(FaultError, match=r"no\.yaml: No such file or directory; check the path"):
        read_faults(tmp_path / "no.yaml", OFFICE)
    (tmp_path / "latin.yaml").write_bytes(b"\xe4")
    with pytest.raises(FaultError, match=r"latin\.yaml is not UTF-8 text"):
        read_faults(tmp_path / "latin.yaml", OFFICE)


def test_a_mistake_in_a_parameter_is_named_by_its_entry() -> None:
    with pytest.raises(FaultError, match=r"^~faults: fault 1 \(slip\): loss: expected a number"):
        read_faults({"faults": [{"fault": "slip", "loss": "much"}]}, OFFICE)
