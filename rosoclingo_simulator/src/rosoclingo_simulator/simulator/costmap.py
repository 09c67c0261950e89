"""What the laser has seen that is not on the map."""

from __future__ import annotations

import numpy as np

from rosoclingo_simulator.simulator.grid import Grid
from rosoclingo_simulator.simulator.laser import Scan
from rosoclingo_simulator.simulator.occupancy import OccupancyMap

_MARK_METRES = 4.0  # what is farther is not marked, because the beams are too far apart there
_CLEAR_METRES = 5.0  # how far beams clear what was marked
_MAP_METRES = 0.15  # what is nearer to something on the map is that


class Costmap:
    """Cells where something stands. Beams mark where they end and clear what they go through.

    Attributes:
        marked: Which cells have something in them; a new array after each change.
        changes: How often ``marked`` has changed.
    """

    def __init__(self, world: OccupancyMap, grid: Grid) -> None:
        """Makes a costmap with nothing marked.

        Args:
            world: What is known to be there.
            grid: The cells to mark.
        """
        self._world = world
        self._grid = grid
        self.marked = np.zeros(grid.shape, bool)
        self.changes = 0

    def update(self, scan: Scan) -> None:
        """Takes in what the laser has measured."""
        marked = self.marked
        if marked.any():
            marked = marked.copy()
            marked[self._grid.cells(self._passed(scan))] = False
        near = scan.points[scan.ranges < _MARK_METRES]
        unknown = near[self._world.distances_at(near) > _MAP_METRES]
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
