"""Costmap of obstacles that the laser has seen and the map does not have."""

from __future__ import annotations

from typing import Sequence

import numpy as np

from rosoclingo_simulator.physics.grid import CellGrid
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, Pose

_MARK_METRES = 4.0  # what is farther is not marked, because the beams are too far apart there
_CLEAR_METRES = 5.0  # how far beams clear what was marked
_ROBOT_METRES = ROBOT_RADIUS + 0.1  # what is nearer to another robot's centre is that
_MAP_METRES = 0.15  # what is nearer to something on the map is that


class Costmap:
    """A grid of obstacles: a beam marks the cell in which it ends, and clears those before.

    Attributes:
        marked: Which cells have something in them; a new array after each change.
        changes: How often ``marked`` has changed.
    """

    def __init__(self, world: OccupancyMap, grid: CellGrid) -> None:
        """Makes an empty costmap.

        Args:
            world: What is known to be there.
            grid: The cells to mark.
        """
        self._world = world
        self._grid = grid
        self.marked = np.zeros(grid.shape, bool)
        self.changes = 0

    def update(self, scan: Scan, robots: Sequence[Pose] = ()) -> None:
        """Updates the costmap by a scan.

        Args:
            scan: What it is.
            robots: Where other robots are; they move, so they are not marked.
        """
        marked = self.marked
        if marked.any():
            marked = marked.copy()
            marked[self._grid.cells(self._passed(scan))] = False
        near = scan.points[scan.ranges < _MARK_METRES]
        unknown = near[self._world.distances_at(near) > _MAP_METRES]
        for robot in robots:
            away = np.hypot(unknown[:, 0] - robot.x, unknown[:, 1] - robot.y)
            unknown = unknown[away > _ROBOT_METRES]
        if len(unknown):
            marked = marked.copy() if marked is self.marked else marked
            marked[self._grid.cells(unknown)] = True
        if marked is not self.marked and not np.array_equal(marked, self.marked):
            self.marked = marked
            self.changes += 1

    def clear(self) -> None:
        """Forgets all that was seen."""
        self.marked = np.zeros(self._grid.shape, bool)
        self.changes += 1

    def _passed(self, scan: Scan) -> np.ndarray:
        """Returns points on the beams, close to each other, up to a cell before their ends."""
        cell = self._grid.resolution
        gone = np.arange(0.0, _CLEAR_METRES, cell)
        beams, steps = np.nonzero(gone < scan.ranges[:, None] - cell)
        return scan.origin + gone[steps][:, None] * scan.directions[beams]
