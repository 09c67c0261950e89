"""Cross-track error: how far a robot is from its way. Needs no ROS."""

from __future__ import annotations

import math
from typing import Optional, Tuple

PathPoint = Tuple[float, float]


class Way:
    """The way to a waypoint, as a planner sees it: straight.

    A robot that begins between two waypoints, because it got no farther before, may also go back to
    the one where it was last, and from there straight on.

    Attributes:
        length: Of the longest of these ways, in metres.
    """

    def __init__(self, begin: PathPoint, end: PathPoint, last: Optional[PathPoint] = None) -> None:
        """Lays out the way.

        Args:
            begin: Where the robot is at the beginning, in metres.
            end: The waypoint.
            last: The waypoint where it was last.
        """
        self._legs = [(begin, end)]
        self.length = math.dist(begin, end)
        if last is not None:
            self._legs += [(begin, last), (last, end)]
            self.length = math.dist(begin, last) + math.dist(last, end)

    def distance(self, point: PathPoint) -> float:
        """Returns how far a point is from the way, in metres."""
        return min(_distance(point, *leg) for leg in self._legs)


def _distance(point: PathPoint, begin: PathPoint, end: PathPoint) -> float:
    """Returns the distance of a point from the line between two others."""
    along = (end[0] - begin[0], end[1] - begin[1])
    there = (point[0] - begin[0], point[1] - begin[1])
    square = along[0] ** 2 + along[1] ** 2
    part = 0.0 if square == 0 else (there[0] * along[0] + there[1] * along[1]) / square
    part = min(1.0, max(0.0, part))
    return math.hypot(there[0] - part * along[0], there[1] - part * along[1])
