"""A description that is wrong gets an error that names file, entry and remedy."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any, Dict

import pytest
import yaml

from rosoclingo_simulator.errors import WorldError
from rosoclingo_simulator.world.generate import generate, write
from rosoclingo_simulator.world.reader import read_world

HOUSE: Dict[str, Any] = {
    "name": "house",
    "floor": [0, 0, 12, 6],
    "waypoints": {
        "hall": {"kind": "corridor", "at": [3, 3]},
        "study": {"kind": "office", "at": [9, 3]},
    },
    "connections": [["hall", "study"]],
    "start": {"mailbot": "hall"},
    "rooms": {
        "the hall": {"kind": "corridor", "areas": [[0.2, 0.2, 5.8, 5.8]]},
        "the study": {
            "kind": "office",
            "areas": [[6, 0.2, 11.8, 5.8]],
            "doors": [[5.8, 2.4, 6, 3.6]],
        },
    },
}


def save(folder: Path, description: Any) -> Path:
    path = folder / "house.yaml"
    path.write_text(yaml.safe_dump(description, sort_keys=False))
    return path


def test_what_is_optional_may_be_left_out(tmp_path: Path) -> None:
    world = read_world(save(tmp_path, HOUSE))
    contents = generate(world)
    assert sorted(path.name for path in contents) == [
        "house.lp",
        "house.world",
        "house.xml",
        "house_map.pgm",
        "house_map.yaml",
        "house_markers.yaml",
        "house_waypoints.yaml",
    ]
    assert {path.parent for path in contents} == {tmp_path}
    assert world.waypoints["study"].theta == 0  # from the hall into the study, to the east
    instance = contents[tmp_path / "house.lp"].decode()
    for fact in ("connection(hall,study).", "start(mailbot,hall).", "position(study,90,30)."):
        assert fact in instance


def test_a_robot_looks_where_the_description_says(tmp_path: Path) -> None:
    description = copy.deepcopy(HOUSE)
    description["waypoints"]["study"]["theta"] = 1.5
    assert read_world(save(tmp_path, description)).waypoints["study"].theta == 1.5


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        ("rooms", None, "the description: rooms is missing; add it"),
        ("colour", "red", "the description: there is no entry 'colour'; there are name, "),
        ("name", 3, "name: expected a text, not 3"),
        ("floor", [0, 0, 12], "floor: expected a list of 4 numbers"),
        ("floor", [12, 0, 0, 6], "the order is [west, south, east, north]"),
        ("floor", [0, 0, 12.01, 6], "floor: 12.01 is no multiple of 0.05 m; round it"),
        ("floor", [1, 0, 12, 6], "and its walls of 0.2 m do not fit on the floor [1, 0, 12, 6]"),
        ("resolution", 0, "resolution: expected a number above 0, not 0"),
        ("resolution", 27483645, "floor: 12 is no multiple of 2.74836e+07 m; round it"),
        ("resolution", True, "resolution: expected a number, not True"),
        ("clearance", float("nan"), "clearance: expected a number, not nan"),
        ("walls", {"thickness": 0.12}, "walls: thickness: 0.12 is no multiple of 0.05 m"),
        ("walls", {"colour": "red"}, "walls: there is no entry 'colour'"),
        ("files", {"picture": "a.png"}, "files: there is no entry 'picture'"),
        ("start", {"mailbot": "attic"}, "start of mailbot: there is no waypoint attic; add it"),
        ("start", ["hall"], "start: expected names with values"),
        (
            "connections",
            [["hall", "attic"]],
            "connection [hall, attic]: there is no waypoint attic",
        ),
        ("connections", [["hall", "hall"]], "a waypoint is not next to itself"),
        ("connections", [["hall", "study"], ["study", "hall"]], "is there twice; remove one"),
        ("connections", [["hall"]], "connections: expected pairs such as [c1, c2]"),
        ("waypoints/Hall", {"kind": "open", "at": [3, 3]}, "waypoints: 'Hall' is no name"),
        ("waypoints/study/kind", "lab", "waypoint study: there is no kind 'lab'; there are open, "),
        ("waypoints/study/kind", "open", "has the kind open, and the study, where it is, has the"),
        ("waypoints/study/kind", None, "waypoint study: kind is missing; add it"),
        ("waypoints/study/at", [5.9, 1], "[5.9, 1] is in no room, but in a wall or outside"),
        ("waypoints/study/at", [90, 3], "waypoint study at [90, 3] is in no room"),
        ("waypoints/study/at", [9.12, 3], "waypoint study: at: 9.12 is no multiple of 0.1 m"),
        ("waypoints/study/at", [6.3, 1], "waypoint study is 0.30 m from the wall"),
        ("waypoints/study/at", [9, 4], "the straight way is 0.10 m from the wall"),
        ("waypoints/study/at", [8, 5.4], "[hall, study]: the straight way crosses the wall"),
        ("waypoints/study/theta", "north", "waypoint study: theta: expected a number, not 'north'"),
        ("rooms/the study/doors", [], "crosses the wall [5.8, 0.2, 6, 6] outside of a door; move"),
        ("rooms/the study/doors", [[5.8, 2.4, 5.9, 3.6]], "does not touch this room; a door"),
        ("rooms/the study/doors", [[5.9, 2.4, 6, 3.6]], "does not touch any other room; a door"),
        ("rooms/the study/doors", [[5.8, 2.4, 6, 3.62]], "1.22 is no multiple of 0.05 m"),
        ("rooms/the study/areas", [], "room the study: it has no area; give at least one"),
        ("rooms/the study/areas", 3, "room the study: expected a list, not 3"),
        ("rooms/the study/areas", [[5.9, 0.2, 11.8, 5.8]], "leaves no room for a wall to"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, place: str, value: Any, message: str) -> None:
    description = copy.deepcopy(HOUSE)
    *path, last = place.split("/")
    entry = description
    for name in path:
        entry = entry[name]
    if value is None:
        del entry[last]
    else:
        entry[last] = value
    file = save(tmp_path, description)
    with pytest.raises(WorldError) as raised:
        read_world(file)
    assert str(raised.value).startswith(f"{file}: ")
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: a\nname: b\n", "line 2: name is there twice; remove or rename one"),
        ("rooms:\n  a: {}\n  b: {}\n  a: {}\n", "line 4: a is there twice"),
        ("[" * 5000, "nested too deeply"),
        ("name: [", "is not YAML: "),
        ("", "the description: expected names with values (NAME: VALUE), not None"),
        ("? [a]\n: b\n", "is not YAML: "),
        (f"? {'a' * 9000}\n: b\n", "the description: "),
    ],
)
def test_a_text_that_is_no_description(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "house.yaml"
    path.write_text(text)
    with pytest.raises(WorldError, match=str(path)) as raised:
        read_world(path)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    "changes",
    [{"floor": [0, -2147483648, 9, 6]}, {"resolution": 1e-320}, {"resolution": 1e-6}],
)
def test_a_floor_that_fills_the_memory(tmp_path: Path, changes: Dict[str, Any]) -> None:
    with pytest.raises(WorldError, match=r"floor: .* has more than 20000000 cells of"):
        read_world(save(tmp_path, {**HOUSE, **changes}))


@pytest.mark.parametrize("thickness", [1e308, 10**400])
def test_a_number_that_is_too_large(tmp_path: Path, thickness: float) -> None:
    with pytest.raises(WorldError, match=r"thickness: .* is no multiple of|is too large a number"):
        read_world(save(tmp_path, {**HOUSE, "walls": {"thickness": thickness}}))


def test_a_file_that_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "house.yaml"
    path.write_bytes(b"name: \xff")
    with pytest.raises(WorldError, match="is not UTF-8 text"):
        read_world(path)


def test_two_files_need_two_paths(tmp_path: Path) -> None:
    description = {**HOUSE, "files": {"gazebo": "a.xml", "mujoco": "a.xml"}}
    with pytest.raises(WorldError, match=r"files: two of them have the same path; rename one"):
        generate(read_world(save(tmp_path, description)))


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    world = read_world(save(tmp_path, HOUSE))
    with pytest.raises(WorldError, match=r"cannot write .*: .*; --output FOLDER writes elsewhere"):
        write(generate(world, tmp_path / "house.yaml"))
