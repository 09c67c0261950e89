"""Condition of observers on a way: a laser scan or a costmap shows that it is closed.

Needs no ROS. A strip around the straight way between two waypoints is divided into cells. The way
is closed if no path leads from one end to the other but through cells that are occupied, or nearer
to them than the robot's radius. It is open if there is a path of cells that are seen to be free. As
long as neither is known, what was read before counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Tuple

import numpy as np
from scipy import ndimage

from rosoclingo_interfaces.errors import EntryError, ReadingError
from rosoclingo_interfaces.navigation.cross_track import PathPoint
from rosoclingo_interfaces.observation.conditions import HOLDS, Reading
from rosoclingo_interfaces.observation.fields import Slots
from rosoclingo_interfaces.observation.transforms import TransformTree, plain, to_matrix

SCAN, GRID = "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid"

_CELL = 0.05  # metres
_AHEAD = 0.05  # metres before its end up to which a beam shows free space
_FARTHEST = 1000.0  # metres; no way is farther away
_WIDEST = 4 * math.pi  # radians; no scanner begins with a greater angle
Cells = Any  # arrays of NumPy's, by the cells' rows along the way


@dataclass(frozen=True)
class ClosedWay:
    """Holds if a way is closed.

    Attributes:
        begin: The waypoint where the way begins, in metres.
        end: The one where it ends.
        frame: The waypoints' frame.
        width: Of the strip, in metres.
        radius: The robot's, in metres.
        occupied: From which value on a cell of a costmap is occupied, in percent.
        transforms: By which scans and costmaps are taken to the waypoints' frame.
    """

    begin: PathPoint
    end: PathPoint
    frame: str
    width: float
    radius: float
    occupied: float
    transforms: TransformTree

    def check(self, message: str, _: Slots) -> None:
        """Checks that messages are scans or costmaps.

        Raises:
            EntryError: They are not.
        """
        if message not in (SCAN, GRID):
            raise EntryError(f"closed needs a topic of {SCAN} or {GRID}, not {message}")

    def read(self, message: Any, before: Reading) -> Reading:
        """Returns whether the way is closed.

        Raises:
            ReadingError: The message makes no sense, or it is not known where it is from.
        """
        margin = math.ceil(self.radius / _CELL)  # cells around the strip
        to_sensor = self._to_sensor(message.header.frame_id) @ self._to_frame(margin)
        rows = math.ceil(math.dist(self.begin, self.end) / _CELL)
        shape = rows + 2 * margin, math.ceil(self.width / _CELL) + 2 * margin
        look = self._look_at_scan if message._type == SCAN else self._look_at_grid
        occupied, seen = look(message, to_sensor, shape)
        if occupied.any():
            occupied = ndimage.distance_transform_edt(~occupied) * _CELL <= self.radius
        strip = (slice(margin, shape[0] - margin), slice(margin, shape[1] - margin))
        occupied, seen = occupied[strip], seen[strip]
        if _has_path(seen & ~occupied):
            return None
        return before if _has_path(~occupied) else HOLDS

    def _to_sensor(self, frame: str) -> Any:
        if not frame or plain(frame) == plain(self.frame):
            return np.eye(4)
        return self.transforms.find(frame, self.frame)

    def _to_frame(self, margin: int) -> Any:
        """Returns the matrix that takes indices of cells to the waypoints' frame."""
        ahead = np.subtract(self.end, self.begin) / math.dist(self.begin, self.end)
        left = np.array([-ahead[1], ahead[0]])
        matrix = np.eye(4)
        matrix[:2, 0], matrix[:2, 1] = ahead * _CELL, left * _CELL
        corner = self.begin - left * self.width / 2
        matrix[:2, 3] = corner + (ahead + left) * (0.5 - margin) * _CELL
        return matrix

    def _look_at_scan(
        self, scan: Any, to_sensor: Any, shape: Tuple[int, int]
    ) -> Tuple[Cells, Cells]:
        """Returns the cells with an obstacle, and the cells that a beam has passed."""
        first, step, least, most = (
            float(one)
            for one in (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
        )
        ranges = np.asarray(scan.ranges, dtype=float)
        has_angles = 0 < abs(step) <= _WIDEST and abs(first) <= _WIDEST
        if not (has_angles and math.isfinite(least) and most > 0 and ranges.size):
            raise ReadingError("the scan has no ranges, or no angles, or no limits")
        most = min(most, _FARTHEST)
        ranges = np.where(np.isnan(ranges), -1.0, ranges)
        hits = np.flatnonzero((ranges >= max(0.0, least)) & (ranges <= most))
        angles = first + hits * step
        points = np.zeros((4, hits.size))
        points[0], points[1] = np.cos(angles) * ranges[hits], np.sin(angles) * ranges[hits]
        points[3] = 1.0
        occupied = np.zeros(shape, dtype=bool)
        row, column = np.rint((np.linalg.inv(to_sensor) @ points)[:2]).astype(int)
        inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
        occupied[row[inside], column[inside]] = True
        x, y = _positions(to_sensor, shape)
        turns = np.mod((np.arctan2(y, x) - first) * math.copysign(1.0, step), 2 * math.pi)
        index = np.rint(turns / abs(step))
        far = np.where(ranges >= max(0.0, least), np.minimum(ranges, most), 0.0)
        reach = np.append(far, 0.0)[np.minimum(index, ranges.size).astype(int)]
        return occupied, np.hypot(x, y) < reach - _AHEAD

    def _look_at_grid(
        self, grid: Any, to_sensor: Any, shape: Tuple[int, int]
    ) -> Tuple[Cells, Cells]:
        """Returns the occupied cells of a costmap, and its known cells."""
        info = grid.info
        size, width, height = float(info.resolution), int(info.width), int(info.height)
        if not math.isfinite(size) or size <= 0 or width * height != len(grid.data):
            raise ReadingError(
                f"a costmap of {width} x {height} cells of {size:g} m has {len(grid.data)} values"
            )
        origin = np.linalg.inv(to_matrix(info.origin.position, info.origin.orientation))
        x, y = _positions(origin @ to_sensor, shape)
        column, row = np.floor(x / size), np.floor(y / size)
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        index = (row[inside] * width + column[inside]).astype(int)
        values = np.full(shape, -1)
        values[inside] = [grid.data[one] for one in index.tolist()]
        return values >= self.occupied, values >= 0


def _positions(to_sensor: Any, shape: Tuple[int, int]) -> Tuple[Cells, Cells]:
    """Returns the positions of the cells' centres in the sensor's frame, x and y in metres."""
    row, column = np.indices(shape)
    x = to_sensor[0, 0] * row + to_sensor[0, 1] * column + to_sensor[0, 3]
    y = to_sensor[1, 0] * row + to_sensor[1, 1] * column + to_sensor[1, 3]
    return x, y


def _has_path(free: Cells) -> bool:
    """Returns whether free cells lead from the first row to the last."""
    areas, _ = ndimage.label(free)
    return bool(np.intersect1d(areas[0][areas[0] > 0], areas[-1]).size)
