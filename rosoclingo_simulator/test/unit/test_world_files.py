"""The committed files are those that the description gives, and fit each other."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, Tuple
from xml.etree import ElementTree

import clingo
import mujoco
import numpy as np
import pytest
import yaml
from office import DESCRIPTION, INSTANCE, MARKERS, PACKAGE, WAYPOINTS, OfficeMap

from rosoclingo_simulator.world.generate import generate, main
from rosoclingo_simulator.world.reader import read_world

Box = Tuple[float, float, float, float, float]  # x, y, size in x, size in y, height


@pytest.fixture(scope="module")
def office() -> OfficeMap:
    return OfficeMap()


def covered(office: OfficeMap, boxes: Iterator[Box]) -> np.ndarray:
    """Draws boxes; no two of them overlap."""
    drawn = np.zeros_like(office.wall)
    for x, y, size_x, size_y, height in boxes:
        cells = office.box(x, y, size_x, size_y)
        assert drawn[cells].size
        assert not drawn[cells].any()
        assert height > 1
        drawn[cells] = True
    return drawn


def test_the_committed_files_are_what_the_description_gives() -> None:
    contents = generate(read_world(DESCRIPTION))
    assert {path.resolve() for path in contents} == {
        INSTANCE,
        WAYPOINTS,
        MARKERS,
        PACKAGE / "maps" / "office.yaml",
        PACKAGE / "maps" / "office.pgm",
        PACKAGE / "worlds" / "office.world",
        PACKAGE / "worlds" / "office.xml",
    }
    different = [str(path) for path, content in contents.items() if path.read_bytes() != content]
    assert not different, "generate_world.py office.yaml makes them anew"


def test_the_command_writes_all_files_into_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "a" / "b"
    monkeypatch.setattr(
        "sys.argv", ["generate_world.py", str(DESCRIPTION), "--output", str(folder)]
    )
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    written = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert sorted(capsys.readouterr().out.split()) == sorted(str(folder / name) for name in written)
    for path in generate(read_world(DESCRIPTION)):
        assert written.pop(path.name) == path.read_bytes()
    assert not written


def test_the_command_says_what_is_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["generate_world.py", str(tmp_path / "none.yaml")])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "none.yaml: No such file or directory; check the path" in capsys.readouterr().err


def test_the_map_is_that_of_the_gazebo_world(office: OfficeMap) -> None:
    root = ElementTree.parse(PACKAGE / "worlds" / "office.world").getroot()
    for element in ("collision", "visual"):

        def boxes(element: str = element) -> Iterator[Box]:
            for shape in root.iterfind(f".//model[@name='office building']//{element}"):
                if shape.attrib["name"].startswith("wall"):
                    pose = [float(word) for word in shape.findtext("pose", "").split()]
                    size = [float(word) for word in shape.findtext(".//size", "").split()]
                    assert pose[2] == size[2] / 2  # it stands on the ground
                    yield pose[0], pose[1], size[0], size[1], size[2]

        assert np.array_equal(covered(office, boxes()), office.wall)
    names = [shape.attrib["name"] for shape in root.iter() if shape.tag in ("collision", "visual")]
    assert len(names) < 300


def test_the_map_is_that_of_the_mujoco_model(office: OfficeMap) -> None:
    model = mujoco.MjModel.from_xml_path(str(PACKAGE / "worlds" / "office.xml"))

    def boxes() -> Iterator[Box]:
        for index in range(model.ngeom):
            if model.geom(index).name.startswith("wall"):
                (x, y, z), half = model.geom_pos[index], model.geom_size[index]
                assert z == half[2]
                assert model.geom_contype[index] == model.geom_conaffinity[index] == 1
                yield x, y, 2 * half[0], 2 * half[1], 2 * half[2]
            elif model.geom(index).name != "ground":
                assert model.geom_contype[index] == model.geom_conaffinity[index] == 0

    assert np.array_equal(covered(office, boxes()), office.wall)


def test_the_instance_says_where_the_waypoints_are() -> None:
    solver = clingo.Control()
    solver.load(str(INSTANCE))
    solver.ground([("base", [])])
    positions = {
        str(atom.symbol.arguments[0]): tuple(a.number / 10 for a in atom.symbol.arguments[1:])
        for atom in solver.symbolic_atoms.by_signature("position", 3)
    }
    document = yaml.safe_load(WAYPOINTS.read_text())
    assert document["frame"] == "map"
    waypoints = document["waypoints"]
    assert {name: (point["x"], point["y"]) for name, point in waypoints.items()} == positions
    assert positions["open1"] == (7, -8)  # from the manual
    kinds = {
        kind: {
            str(atom.symbol.arguments[0]) for atom in solver.symbolic_atoms.by_signature(kind, 1)
        }
        for kind in ("corridor", "open", "office")
    }
    assert kinds["office"] == {f"o{number}" for number in range(1, 15)}
    assert set().union(*kinds.values()) == set(positions)


@pytest.mark.costly
def test_the_markers_are_the_walls_and_the_names_of_the_rooms(office: OfficeMap) -> None:
    document = yaml.safe_load(MARKERS.read_text())
    markers = document["markers"]
    assert len({(marker["ns"], marker["id"]) for marker in markers}) == len(markers)

    def boxes() -> Iterator[Box]:
        for marker in markers:
            if marker["ns"] == "walls":
                place, size = marker["pose"]["position"], marker["scale"]
                yield place["x"], place["y"], size["x"], size["y"], 2

    assert np.array_equal(covered(office, boxes()), office.wall)
    names = [marker["text"] for marker in markers if marker["ns"] == "rooms"]
    assert names == [room.name for room in read_world(DESCRIPTION).rooms]
