"""A robot can drive on the map what the instance says, and nothing else.

Only the map, the instance and the waypoints are looked at, not how they were made.
"""

from __future__ import annotations

import re
from typing import Dict, FrozenSet, List, Set, Tuple

import numpy as np
import pytest
import yaml
from office import INSTANCE, WAYPOINTS, OfficeMap
from scipy import ndimage
from skimage.draw import line
from skimage.graph import MCP_Connect

ROBOT = 0.18  # m, its radius
INFLATION = 0.30  # m, what a planner may add to walls
CLEARANCE = 0.4  # m
WIDTH = 2.0  # m, of corridors
NARROWEST_DOOR = 1.0  # m

Edge = FrozenSet[str]
Cell = Tuple[int, int]
Cells = Dict[str, Cell]


def facts(name: str) -> List[List[str]]:
    """Returns the arguments of the instance's facts of a name."""
    text = re.sub(r"%.*", "", INSTANCE.read_text())
    return [inside.split(",") for inside in re.findall(rf"\b{name}\(([^()]*)\)\.", text)]


CONNECTIONS = [(first, second) for first, second in facts("connection")]
OFFICES = [name for (name,) in facts("office")]
CORRIDORS = {name for (name,) in facts("corridor")}


@pytest.fixture(scope="module")
def office() -> OfficeMap:
    return OfficeMap()


@pytest.fixture(scope="module")
def gap(office: OfficeMap) -> np.ndarray:
    """Returns for each cell how far its edge is from what is not free, in m."""
    distances = ndimage.distance_transform_edt(office.free) * office.resolution
    return np.maximum(distances - office.resolution, 0)


@pytest.fixture(scope="module")
def cells(office: OfficeMap) -> Cells:
    waypoints = yaml.safe_load(WAYPOINTS.read_text())["waypoints"]
    return {name: office.cell(point["x"], point["y"]) for name, point in waypoints.items()}


def way(cells: Cells, first: str, second: str) -> Tuple[np.ndarray, np.ndarray]:
    rows, columns = line(*cells[first], *cells[second])
    return rows, columns


def door(cells: Cells, office: OfficeMap, name: str) -> np.ndarray:
    """Returns the cells between the two posts where the way to an office is narrowest."""
    (point,) = [a if b == name else b for a, b in CONNECTIONS if name in (a, b)]
    rows, columns = way(cells, point, name)
    widths = [
        min((run(office.free[row], column), run(office.free[:, column], row)), key=len)
        for row, column in zip(rows, columns)
    ]
    inner = slice(10, -10)  # not at the waypoints themselves
    best = min(range(len(rows))[inner], key=lambda index: len(widths[index]))
    mask = np.zeros_like(office.free)
    if len(run(office.free[rows[best]], columns[best])) == len(widths[best]):
        mask[rows[best], widths[best]] = True
    else:
        mask[widths[best], columns[best]] = True
    return mask


def run(free: np.ndarray, index: int) -> range:
    """Returns the range of free cells around one in a row of cells."""
    walls = np.flatnonzero(~free)
    place = int(np.searchsorted(walls, index))
    return range(walls[place - 1] + 1, walls[place])


def test_the_floor_is_as_large_as_it_should_be(office: OfficeMap) -> None:
    rows, columns = office.free.shape
    assert (columns * office.resolution, rows * office.resolution) == (40, 25)
    assert office.origin == (0, -25)


def test_the_map_is_closed(office: OfficeMap) -> None:
    assert not (ndimage.binary_dilation(office.free) & ~office.free & ~office.wall).any()
    border = np.ones_like(office.free)
    border[1:-1, 1:-1] = False
    assert not (office.free & border).any()


def test_all_that_is_free_can_be_reached(office: OfficeMap) -> None:
    assert ndimage.label(office.free)[1] == 1


@pytest.mark.parametrize(
    ("first", "second"), [pair for pair in CONNECTIONS if CORRIDORS.issuperset(pair)]
)
def test_corridors_are_two_metres_wide(
    office: OfficeMap, cells: Cells, first: str, second: str
) -> None:
    rows, columns = way(cells, first, second)
    across = office.free if rows[0] != rows[-1] else office.free.T
    along = zip(rows, columns) if rows[0] != rows[-1] else zip(columns, rows)
    widths = np.array([len(run(across[a], b)) for a, b in along]) * office.resolution
    # It is wider only at doors, where corridors meet, and at their ends.
    assert np.median(widths) == pytest.approx(WIDTH)
    assert widths.min() == pytest.approx(WIDTH)


@pytest.mark.parametrize("name", sorted(facts("position"), key=str))
def test_waypoints_keep_clear_of_walls(gap: np.ndarray, cells: Cells, name: List[str]) -> None:
    assert gap[cells[name[0]]] >= CLEARANCE


@pytest.mark.parametrize(("first", "second"), CONNECTIONS)
def test_straight_ways_keep_clear_of_walls(
    gap: np.ndarray, office: OfficeMap, cells: Cells, first: str, second: str
) -> None:
    # A line of pixels leaves the straight way by up to half a pixel.
    assert gap[way(cells, first, second)].min() >= CLEARANCE - office.resolution


@pytest.mark.parametrize("name", OFFICES)
def test_doors_are_wide_enough(office: OfficeMap, cells: Cells, name: str) -> None:
    width = door(cells, office, name).sum() * office.resolution
    assert NARROWEST_DOOR <= width < WIDTH


@pytest.mark.parametrize("radius", [ROBOT, INFLATION])
def test_inflated_walls_leave_a_way_to_every_waypoint(
    gap: np.ndarray, cells: Cells, radius: float
) -> None:
    regions, _ = ndimage.label(gap >= radius)
    assert {int(regions[cell]) for cell in cells.values()} == {int(regions[cells["open1"]])} != {0}


@pytest.mark.parametrize("name", OFFICES)
def test_an_office_has_one_door_and_no_other_way_in(
    office: OfficeMap, cells: Cells, name: str
) -> None:
    closed = office.free & ~door(cells, office, name)
    regions, count = ndimage.label(closed)
    assert count == 2
    inside = regions == regions[cells[name]]
    assert [other for other, cell in cells.items() if inside[cell]] == [name]


class Fronts(MCP_Connect):  # type: ignore[misc] (scikit-image has no types)
    """Floods the free floor from all waypoints at the same speed, and notes which fronts meet."""

    def __init__(self, free: np.ndarray, names: List[str]) -> None:
        super().__init__(np.where(free, 1.0, -1.0))
        self._names = names
        self.met: Set[Edge] = set()

    def create_connection(self, first: int, second: int, *_: object) -> None:
        self.met.add(frozenset((self._names[first], self._names[second])))


@pytest.mark.parametrize("radius", [0, ROBOT])
def test_what_meets_in_a_flood_is_connected_and_nothing_else(
    gap: np.ndarray, office: OfficeMap, cells: Cells, radius: float
) -> None:
    free = office.free if radius == 0 else gap >= radius
    fronts = Fronts(free, list(cells))
    fronts.find_costs(list(cells.values()))
    assert fronts.met == {frozenset(pair) for pair in CONNECTIONS}
