"""Waypoint files: what they mean, and what an error in one says."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosoclingo_interfaces.errors import WaypointError
from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints, read_waypoints

GOOD = "frame: map\nwaypoints:\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "places.yaml"


def read(file: Path, text: str) -> Waypoints:
    file.write_text(text, encoding="utf-8")
    return read_waypoints(file)


def test_names_and_numbers(file: Path) -> None:
    waypoints = read(
        file,
        GOOD + '  c3: {x: 1, y: -2.5, theta: 1e-1}\n  "c( 1, 2)": {theta: 0, y: 0, x: 0}\n'
        "  7: {x: 0, y: 0, theta: 0}\n  no: {x: 0, y: 0, theta: 0}\n",
    )
    assert waypoints.frame == "map"
    assert waypoints.find("c3") == Waypoint(1.0, -2.5, 0.1)
    assert list(waypoints.places) == ["c3", "c(1,2)", "7", "no"]


def test_a_waypoint_that_is_not_there(file: Path) -> None:
    waypoints = read(file, GOOD + "  c3: {x: 1, y: 2, theta: 0}\n  c4: {x: 1, y: 2, theta: 0}\n")
    with pytest.raises(WaypointError) as raised:
        waypoints.find("c5")
    assert str(raised.value) == f"there is no waypoint c5 in {file}; there are c3, c4"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected the keys frame and waypoints"),
        ("[1]", "expected the keys frame and waypoints"),
        ("frame: map\n", "expected the keys frame and waypoints"),
        (GOOD + "  c3: {x: 1, y: 2, theta: 0}\nscale: 2\n", "and no others"),
        ("frame: [map]\nwaypoints: {c3: {x: 1, y: 2, theta: 0}}", "frame: expected the name"),
        ("frame: ''\nwaypoints: {c3: {x: 1, y: 2, theta: 0}}", "frame: expected the name"),
        ("frame: map\nwaypoints: [c3]", "waypoints: expected name: {x: 1.0"),
        (GOOD, "waypoints: expected name: {x: 1.0"),
        (GOOD + "  C3: {x: 1, y: 2, theta: 0}", "has to be a term such as c3"),
        (GOOD + "  [c, 3]: {x: 1, y: 2, theta: 0}", "places.yaml"),
        (
            GOOD + "  'c(1)': {x: 1, y: 2, theta: 0}\n  'c( 1)': {x: 1, y: 2, theta: 0}",
            "'c(1)' is there twice",
        ),
        (GOOD + "  c3: {x: 1, y: 2}", "waypoint c3: expected x, y and theta"),
        (GOOD + "  c3: {x: 1, y: 2, theta: 0, z: 1}", "waypoint c3: expected x, y and theta"),
        (GOOD + "  c3: 1 2 0", "waypoint c3: expected x, y and theta"),
        (GOOD + "  c3: {x: far, y: 2, theta: 0}", "waypoint c3: x: expected a number of metres"),
        (GOOD + "  c3: {x: 1, y: -1e308, theta: 0}", "waypoint c3: y: expected at most 1e+06 m"),
        (GOOD + "  c3: {x: 1, y: [2], theta: 0}", "waypoint c3: y: expected a number of metres"),
        (GOOD + "  c3: {x: 1, y: inf, theta: 0}", "waypoint c3: y: expected a number of metres"),
        (GOOD + "  c3: {x: 1, y: 2, theta: nan}", "theta: expected a number of radians: nan"),
        (GOOD + "  c3: {x: 1", "is no YAML"),
        (
            GOOD + "  c3: {x: 1, y: 2, theta: 0}\n  c3: {x: 1, y: 2, theta: 0}",
            "c3 is there twice; remove or rename one",
        ),
        (GOOD + "  c3: {x: 1, x: 1, y: 2, theta: 0}", "x is there twice"),
        ("[" * 5000, "nested too deeply"),
        (
            GOOD + f"  ? {'c' * 9000}\n  : {{x: 1, y: 2}}",
            "ccc... (9000 characters): expected x, y and",
        ),
    ],
)
def test_wrong_files(file: Path, text: str, message: str) -> None:
    with pytest.raises(WaypointError) as raised:
        read(file, text)
    assert message in str(raised.value)
    assert str(file) in str(raised.value)
    assert len(str(raised.value)) < 1000


def test_files_that_cannot_be_read(file: Path) -> None:
    with pytest.raises(WaypointError, match=r"cannot read the waypoint file .*No such file"):
        read_waypoints(file)
    with pytest.raises(WaypointError, match=r"cannot read the waypoint file .*directory"):
        read_waypoints(file.parent)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(WaypointError, match="cannot read the waypoint file"):
        read_waypoints(file)
