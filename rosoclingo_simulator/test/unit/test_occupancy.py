"""Maps as map_server has them, and distances in them."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Optional

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import WALLS, box_of, gap, room
from scipy.ndimage import distance_transform_edt

from rosoclingo_simulator.errors import MapError
from rosoclingo_simulator.physics import occupancy
from rosoclingo_simulator.physics.occupancy import FREE, OCCUPIED, UNKNOWN, read_map

ABOUT = {
    "image": "floor.pgm",
    "resolution": "0.5",
    "origin": "[1.0, -2.0, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}
# White is free, black is occupied, grey is neither; the first row is in the north.
PLAIN = b"P2\n# made by hand\n3 2\n255\n254 0 205 # north\n254 254 0\n"
BINARY = b"P5\n# made by hand\n3 2\n255\n" + bytes((254, 0, 205, 254, 254, 0))
CELLS = [[FREE, FREE, OCCUPIED], [FREE, OCCUPIED, UNKNOWN]]


def write(folder: Path, picture: bytes, **changes: Optional[str]) -> Path:
    about: Dict[str, Optional[str]] = {**ABOUT, **changes}
    file = folder / "floor.yaml"
    lines = (f"{key}: {value}\n" for key, value in about.items() if value is not None)
    file.write_text("".join(lines))
    (folder / "floor.pgm").write_bytes(picture)
    return file


@pytest.mark.parametrize("picture", [PLAIN, BINARY])
def test_both_kinds_of_pgm_are_read(tmp_path: Path, picture: bytes) -> None:
    floor = read_map(write(tmp_path, picture))
    assert floor.cells.tolist() == CELLS
    assert (floor.grid.x, floor.grid.y, floor.grid.resolution) == (1.0, -2.0, 0.5)


def test_other_numbers_of_greys(tmp_path: Path) -> None:
    floor = read_map(write(tmp_path, b"P2 3 2 10  10 0 8  10 10 0"))
    assert floor.cells.tolist() == CELLS
    large = b"P5 3 2 65535 " + np.array([65000, 0, 52000, 65535, 65000, 9], ">u2").tobytes()
    assert read_map(write(tmp_path, large)).cells.tolist() == CELLS


def test_negate_and_thresholds(tmp_path: Path) -> None:
    inverse = b"P2 3 2 255  1 255 50  1 1 255"
    assert read_map(write(tmp_path, inverse, negate="1")).cells.tolist() == CELLS
    bold = read_map(write(tmp_path, PLAIN, occupied_thresh="0.195", free_thresh="0.19"))
    assert bold.cells[1, 2] == OCCUPIED
    shy = read_map(write(tmp_path, PLAIN, free_thresh="0.2"))
    assert shy.cells[1, 2] == FREE


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image": None}, "image: expected the name of a picture: None"),
        ({"image": "elsewhere.pgm"}, r"elsewhere\.pgm.*No such file"),
        ({"resolution": None}, "resolution: expected a number: None"),
        ({"resolution": "0"}, "resolution: expected metres per pixel"),
        ({"resolution": "1.0e-9"}, "resolution: expected metres per pixel, from 0.001 on: 1e-09"),
        ({"resolution": "wide"}, "resolution: expected a number: wide"),
        ({"resolution": ".nan"}, "resolution: expected a number: nan"),
        ({"occupied_thresh": "true"}, "occupied_thresh: expected a number: True"),
        ({"occupied_thresh": "0.1"}, "expected 0 <= free_thresh <= occupied_thresh <= 1"),
        ({"negate": "2"}, "negate: expected 0 or 1: 2"),
        ({"mode": "raw"}, "mode: expected trinary: raw"),
        ({"origin": "[1, 2]"}, r"origin: expected \[x, y, yaw\]"),
        ({"resolution": "9" * 400}, "line .*: 9+.* is too large a number"),
        ({"image": "[a, " * 40 + "]" * 40}, "image: expected the name of a picture: .{,80}$"),
        ({"origin": "[1, 2, 0.5]"}, r"origin: expected a yaw of 0: 0\.5"),
    ],
)
def test_what_is_wrong_is_named(
    tmp_path: Path, changes: Dict[str, Optional[str]], message: str
) -> None:
    with pytest.raises(MapError, match=message):
        read_map(write(tmp_path, PLAIN, **changes))


# With a fraction for its width.
TIFF = bytes.fromhex(
    "49 49 2a 00 08 00 00 00 09 00 00 01 04 00 01 00 "
    "00 00 03 00 00 00 01 01 04 00 01 00 00 00 02 00 "
    "00 00 02 01 03 00 01 00 00 00 08 00 00 00 03 01 "
    "03 00 01 00 00 00 01 00 00 00 06 01 03 00 01 00 "
    "00 00 01 00 00 00 11 01 04 00 01 00 00 00 7a 00 "
    "30 00 16 01 0c 00 01 00 00 00 02 00 00 00 "
)


@pytest.mark.parametrize(
    "picture",
    [
        *(TIFF, b"P2\n2 2\n257\n-1 5 0 3"),
        *(b"", b"nonsense", b"P5\n3 2\n255\nabc", b"P2\n3 2\n255\n1 2 3", b"P5\n3"),
        # Of so many pixels that Pillow refuses or warns, or that they take much memory.
        *(b"P5\n99999 99999\n255\n", b"P5\n9999 9999\n255\n", b"P5\n7000 7000\n255\n"),
    ],
)
def test_broken_pictures_are_named(tmp_path: Path, picture: bytes) -> None:
    with pytest.raises(MapError, match=r"floor\.pgm"):
        read_map(write(tmp_path, picture))


@pytest.mark.parametrize("text", ["", "- a list", "a: [", "\x00", "a: !!float b", "[" * 5000])
def test_what_is_no_map_is_named(tmp_path: Path, text: str) -> None:
    file = tmp_path / "floor.yaml"
    file.write_text(text)
    with pytest.raises(MapError, match=r"floor\.yaml"):
        read_map(file)
    with pytest.raises(MapError, match=r"nowhere\.yaml.*No such file"):
        read_map(tmp_path / "nowhere.yaml")


FLOOR = room()
SOLID = [box_of(wall) for wall in WALLS]


@pytest.mark.costly
@settings(max_examples=300, deadline=None)
@given(st.floats(-0.99, 6.99), st.floats(-1.99, 3.99))
def test_clearance_is_exact_near_walls_and_never_too_much(x: float, y: float) -> None:
    true, found = gap(x, y, SOLID), FLOOR.clearance(x, y)
    assert found <= true + 1e-6
    assert found >= true - (1e-6 if true < 0.3 else 0.2)


def test_distances_are_those_of_scipy() -> None:
    solid = np.random.default_rng(1).random((40, 70)) < 0.05
    expected = distance_transform_edt(~solid).astype(np.float32)
    assert np.array_equal(occupancy._distances(solid), expected)


def test_outside_of_the_map_all_is_solid() -> None:
    for x, y in ((-1.01, 0), (7.01, 0), (0, -2.01), (0, 4.01), (1e6, 0), (-1e6, -1e6)):
        assert FLOOR.clearance(x, y) == 0
        assert FLOOR.distances_at(np.array((x, y))) == 0
