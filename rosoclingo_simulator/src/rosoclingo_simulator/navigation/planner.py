"""Path planner over the floor, away from walls."""

from __future__ import annotations

import math
from typing import Any, Optional, Tuple

import numpy as np
from scipy.ndimage import distance_transform_edt, uniform_filter1d

from rosoclingo_simulator.physics.grid import CellGrid
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, Pose

CLEARANCE = ROBOT_RADIUS + 0.04
"""How far a path keeps from all that is known to be there, in metres."""

APART_METRES = 2 * ROBOT_RADIUS + 0.1
"""Between the centres of robots that pass each other; less is a meeting."""

_CELL_METRES = 0.1
_WIDE_METRES = 1.0  # a place so far from walls costs no more than any other
_NARROW_COST = 6.0  # how many metres around a metre next to a wall is worth
_MARGIN_METRES = 0.1  # that a robot which makes room leaves besides
_DEAR_COST = 5.0  # how many metres around a metre through a robot that stands is worth
_REFUGE_METRES = 5.0  # how far a robot goes to make room for another, along each axis
_SMOOTH_CELLS = 7  # of a path that are averaged
_SMOOTH_TIMES = 2
_ESCAPE_METRES = 0.5  # how far the robot may be from where a path can begin


class PathPlanner:
    """Finds cheapest paths, where driving next to a wall costs more. Thread-safe.

    Attributes:
        grid: The cells that paths go through.
    """

    def __init__(self, world: OccupancyMap) -> None:
        """Prepares the map.

        Args:
            world: What is known to be solid.
        """
        fine = world.grid
        factor = max(1, round(_CELL_METRES / fine.resolution))
        rows, columns = -(-fine.rows // factor), -(-fine.columns // factor)
        self.grid = CellGrid(fine.x, fine.y, fine.resolution * factor, rows, columns)
        self._distances = _coarse_distances(world, factor, self.grid)

    def plan(
        self,
        start: Pose,
        goal: Pose,
        obstacles: Optional[np.ndarray] = None,
        tolerance: float = 0.0,
        *,
        closed: Optional[np.ndarray] = None,
        dear: Optional[np.ndarray] = None,
    ) -> Optional[np.ndarray]:
        """Returns the cheapest path.

        Args:
            start: Where it begins.
            goal: Where it ends.
            obstacles: Which cells have something in them that is not on the map.
            tolerance: How far from the goal the path may end if it cannot end there, in metres.
            closed: Points that the path keeps as far from as robots do from each other, in metres.
            dear: Points where it would rather do so.

        Returns:
            Points on the way, an array of x and y in metres, a cell apart; None if there is no
            path.
        """
        distances = self._free_distances(obstacles, closed)
        free = distances >= CLEARANCE
        begin = self._nearest(free, start, _ESCAPE_METRES)
        end = self._nearest(free, goal, tolerance)
        if begin is None or end is None:
            return None
        prices = _prices(distances)
        if dear is not None:
            prices[self._around(dear)] += _DEAR_COST
        search = _search(prices)
        costs, _ = search.find_costs([begin], [end])
        if not math.isfinite(costs[end]):
            return None
        cells = np.array(search.traceback(end))
        if begin == end and start.distance(goal) > 0:  # a path has a beginning, too
            cells = np.repeat(cells, 2, axis=0)
        path = self._smooth(self.grid.points(cells[:, 0], cells[:, 1]), distances)
        # The cells of start and goal are where these are, but for less than a cell.
        if begin == self._cell(start):
            path[0] = start.x, start.y
        if end == self._cell(goal):
            path[-1] = goal.x, goal.y
        return path

    def refuge(
        self, start: Pose, obstacles: np.ndarray, closed: np.ndarray, claimed: np.ndarray
    ) -> Optional[np.ndarray]:
        """Returns the cheapest path to a place that is out of the way of other robots.

        Args:
            start: Where it begins.
            obstacles: Which cells have something in them that is not on the map.
            closed: Points that the path keeps as far from as robots do from each other, in metres.
            claimed: Points of which the path's end does so.

        Returns:
            As :meth:`plan`; None if there is no such place around.
        """
        distances = self._free_distances(obstacles, closed)
        begin = self._nearest(distances >= CLEARANCE, start, _ESCAPE_METRES)
        if begin is None:
            return None
        reach = int(_REFUGE_METRES / self.grid.resolution)
        corner = np.maximum(0, np.array(begin) - reach)
        window = tuple(slice(low, cell + reach + 1) for low, cell in zip(corner, begin))
        search = _search(_prices(distances[window]))
        costs, _ = search.find_costs([tuple(begin - corner)])
        ends = np.full(self.grid.shape, np.inf)
        ends[window] = costs
        ends[self._around(claimed, _MARGIN_METRES)] = np.inf
        end = np.unravel_index(int(ends.argmin()), ends.shape)
        if not np.isfinite(ends[end]):
            return None
        cells = np.array(search.traceback(tuple(end - corner))) + corner
        cells = np.repeat(cells, 2, axis=0) if len(cells) == 1 else cells
        return self._smooth(self.grid.points(cells[:, 0], cells[:, 1]), distances)

    def _free_distances(
        self, obstacles: Optional[np.ndarray], closed: Optional[np.ndarray]
    ) -> np.ndarray:
        """Returns how far cells are from what is there, in metres; 0 where another robot is."""
        distances = self._distances
        if obstacles is not None and obstacles.any():
            around = distance_transform_edt(~obstacles) - 0.5  # it may be anywhere in its cell
            distances = np.minimum(distances, around * self.grid.resolution)
        if closed is not None:
            distances = distances.copy()
            distances[self._around(closed)] = 0.0
        return distances

    def _around(self, points: np.ndarray, margin: float = 0.0) -> Tuple[np.ndarray, np.ndarray]:
        """Returns the rows and columns of the cells that are too near to points for a robot."""
        radius = APART_METRES + margin
        offsets = np.arange(-radius, radius, self.grid.resolution)
        along, across = np.meshgrid(offsets, offsets)
        inside = np.hypot(along, across) < radius
        disc = np.stack((along[inside], across[inside]), axis=-1)
        return self.grid.cells(points[:, None] + disc)

    def _smooth(self, path: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Returns a path without the corners of cells, which keeps the same distance."""
        smooth = path
        for _ in range(_SMOOTH_TIMES):
            smooth = uniform_filter1d(smooth, _SMOOTH_CELLS, axis=0, mode="nearest")
        smooth[0], smooth[-1] = path[0], path[-1]
        safe = distances[self.grid.cells(smooth)] >= CLEARANCE
        return np.where(safe[:, None], smooth, path)

    def _cell(self, pose: Pose) -> Tuple[int, int]:
        row, column = self.grid.cells(np.array((pose.x, pose.y)))
        return int(row), int(column)

    def _nearest(self, free: np.ndarray, pose: Pose, radius: float) -> Optional[Tuple[int, int]]:
        """Returns the cell of a pose, or else the nearest free one within the radius."""
        row, column = self._cell(pose)
        if free[row, column]:
            return row, column
        reach = int(radius / self.grid.resolution)
        top, left = max(0, row - reach), max(0, column - reach)
        window = free[top : row + reach + 1, left : column + reach + 1]
        around = np.argwhere(window) + np.array((top, left))
        if not len(around):
            return None
        points = self.grid.points(around[:, 0], around[:, 1])
        away = np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y)
        nearest = int(away.argmin())
        if away[nearest] > radius:
            return None
        return int(around[nearest, 0]), int(around[nearest, 1])


def _search(prices: np.ndarray) -> Any:
    """Returns a search for the cheapest paths over cells with these prices."""
    # It takes as long as all other modules of the node, and a robot that only stands needs it not.
    from skimage.graph import MCP_Geometric  # noqa: PLC0415

    return MCP_Geometric(prices)


def _prices(distances: np.ndarray) -> np.ndarray:
    """Returns what a metre costs in cells so far from what is there; infinity for too near."""
    narrow = np.maximum(0.0, 1.0 - distances / _WIDE_METRES)
    return np.where(distances >= CLEARANCE, 1.0 + _NARROW_COST * narrow**2, np.inf)


def lengths(path: np.ndarray) -> np.ndarray:
    """Returns how far each point of a path is from its begin along the path, in metres."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    return np.concatenate(([0.0], np.cumsum(steps)))


def _coarse_distances(world: OccupancyMap, factor: int, grid: CellGrid) -> np.ndarray:
    """Returns how far the cells' centres are from what is solid: the least of the map's cells."""
    rows, columns = grid.rows * factor, grid.columns * factor
    fine = np.zeros((rows, columns), np.float32)  # what is outside of the map is solid
    fine[: world.grid.rows, : world.grid.columns] = world.distances[1:-1, 1:-1]
    least = fine.reshape(grid.rows, factor, grid.columns, factor).min(axis=(1, 3))
    # Distances are between centres: half a cell is of the solid one, and from the cell's own
    # centre to that of its corner it is some more.
    return np.asarray(least + (factor / 2 - 1) * world.grid.resolution)
