"""Laser scanner."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Optional

import numpy as np

from rosoclingo_simulator.physics.physics import Physics, Pose

LEAST_METRES, MOST_METRES = 0.12, 10.0
"""The laser's range."""

ANGLES = np.arange(360) * (2 * np.pi / 360) - np.pi  # one for each degree
"""Directions of the beams from the robot's own, counter-clockwise from behind, in radians."""


@dataclass(frozen=True)
class Scan:
    """A laser scan.

    Attributes:
        time: When, in seconds.
        pose: Where the robot was, or took itself to be.
        ranges: Of each beam in metres, infinity if there was nothing within the range.
    """

    time: float
    pose: Pose
    ranges: np.ndarray

    @cached_property
    def origin(self) -> np.ndarray:
        """Position of the laser, as x and y in metres."""
        return np.array((self.pose.x, self.pose.y))

    @cached_property
    def directions(self) -> np.ndarray:
        """Unit vectors of the beams in the map."""
        angles = ANGLES + self.pose.theta
        return np.stack((np.cos(angles), np.sin(angles)), axis=-1)

    @cached_property
    def points(self) -> np.ndarray:
        """End points of the beams in the map, in metres; of beams without an end, far away."""
        ranges = np.where(np.isfinite(self.ranges), self.ranges, 10 * MOST_METRES)
        return self.origin + ranges[:, None] * self.directions


def look(physics: Physics, time: float, pose: Optional[Pose] = None) -> Scan:
    """Returns a scan of the laser now.

    Args:
        physics: What the robot is in.
        time: What time it is, in seconds.
        pose: Where the robot takes itself to be; None if it knows where it is.
    """
    return Scan(time, pose or physics.pose, physics.ranges(ANGLES, MOST_METRES))
