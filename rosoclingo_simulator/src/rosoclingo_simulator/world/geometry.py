"""Computes walls from areas, exactly: everything lies on the map's grid."""

from __future__ import annotations

from typing import List, Tuple

import numpy as np
from shapely.geometry import LineString, box

from rosoclingo_simulator.world.description import Area, World

Point = Tuple[float, float]


class Grid:
    """The cells of a world's floor; row 0 is in the south, column 0 in the west.

    Attributes:
        free: Whether a cell belongs to an area or a door.
        wall: Whether a cell belongs to a wall; a cell that is neither is unknown.
    """

    def __init__(self, world: World) -> None:
        """Draws the areas and the walls around them."""
        self._world = world
        width, height = (round(length / world.resolution) for length in world.floor.size)
        self.free = np.zeros((height, width), dtype=bool)
        self.wall = np.zeros_like(self.free)
        margin = round(world.thickness / world.resolution)
        for area in world.free:
            self.free[self._cells(area, 0)] = True
            self.wall[self._cells(area, margin)] = True
        self.wall &= ~self.free

    def boxes(self) -> Tuple[Area, ...]:
        """Returns the walls as few areas that do not overlap, from south to north."""
        rest = self.wall.copy()
        found: List[Area] = []
        while rest.any():
            row, column = (int(index) for index in np.unravel_index(rest.argmax(), rest.shape))
            wide = _grow(rest[row:, column:])
            high = _grow(rest[row:, column:].T)[::-1]
            rows, columns = max(wide, high, key=lambda size: size[0] * size[1])
            rest[row : row + rows, column : column + columns] = False
            found.append(self._area(row, column, rows, columns))
        return tuple(found)

    def _cells(self, area: Area, margin: int) -> Tuple[slice, slice]:
        floor, unit = self._world.floor, self._world.resolution
        west, east = (round((x - floor.west) / unit) for x in (area.west, area.east))
        south, north = (round((y - floor.south) / unit) for y in (area.south, area.north))
        rows = slice(max(south - margin, 0), north + margin)
        return rows, slice(max(west - margin, 0), east + margin)

    def _area(self, row: int, column: int, rows: int, columns: int) -> Area:
        floor, unit = self._world.floor, self._world.resolution
        # Rounded, so that the files show 0.2 and not 0.20000000000000001.
        edges = (
            floor.west + column * unit,
            floor.south + row * unit,
            floor.west + (column + columns) * unit,
            floor.south + (row + rows) * unit,
        )
        return Area(*(round(edge, 6) for edge in edges))


def _grow(cells: np.ndarray) -> Tuple[int, int]:
    """Returns the size of a full rectangle at the corner: first as wide, then as high as can be."""
    columns = _run(cells[0])
    rows = _run(np.logical_and.reduce(cells[:, :columns], axis=1))
    return rows, columns


def _run(cells: np.ndarray) -> int:
    """Returns how many cells are set before the first that is not."""
    return len(cells) if cells.all() else int(cells.argmin())


def distance(begin: Point, end: Point, area: Area) -> float:
    """Returns the shortest distance between a straight way and an area; 0 if they meet."""
    return LineString((begin, end)).distance(box(area.west, area.south, area.east, area.north))
