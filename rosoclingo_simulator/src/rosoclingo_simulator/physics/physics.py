"""The simulator's port to its physics, of either kind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Protocol, Sequence, Tuple, Union

import numpy as np

from rosoclingo_interfaces.navigation.waypoints import Waypoint

ROBOT_RADIUS = 0.18
"""The robot is a disc of this radius, in metres."""

LASER_HEIGHT = 0.3
"""Of the laser above the floor, in metres."""

WHEEL_DISTANCE = 0.23
"""Between the two wheels, in metres."""

STEP_SECONDS = 0.05
"""How long a step is in simulated time."""

LINEAR_SPEED = 0.5
"""How fast the robot drives at most, in m/s."""

ANGULAR_SPEED = 1.5
"""How fast the robot turns at most, in rad/s."""

LINEAR_ACCELERATION = 1.0
"""How fast the robot's speed changes at most, in m/s²."""

ANGULAR_ACCELERATION = 3.0
"""How fast the robot's turning changes at most, in rad/s²."""


Velocity = Tuple[float, float]
"""Speed and speed of turning, in m/s and rad/s."""


Pose = Waypoint
"""A place on the floor, and a direction."""


@dataclass(frozen=True)
class Box:
    """A box that stands on the floor.

    Attributes:
        x: Of the centre, in metres.
        y: Of the centre, in metres.
        theta: Direction of its length, in radians.
        length: In metres.
        width: In metres.
        height: In metres.
    """

    x: float
    y: float
    theta: float
    length: float
    width: float
    height: float = 0.6

    def distance(self, x: float, y: float) -> float:
        """Returns how far a point is from the box's outline, in metres; 0 inside."""
        along, across = local(self, x, y)
        return math.hypot(
            max(0.0, abs(along) - self.length / 2), max(0.0, abs(across) - self.width / 2)
        )


class SharedSpace(Protocol):
    """The world of all robots of a kind of physics, and boxes in it. One thread uses it."""

    @property
    def robots(self) -> Sequence[Pose]:
        """The poses of all robots of the world."""

    def put(self, name: str, box: Box) -> None:
        """Puts a box into the world, in place of the one of the same name if there is one."""

    def remove(self, name: str) -> None:
        """Takes a box away; does nothing if there is none of the name."""


class Physics(Protocol):
    """The physics of a robot in a world. One thread uses it."""

    def reset(self, pose: Pose) -> None:
        """Puts the robot somewhere, standing still; boxes stay."""

    def step(self, linear: float, angular: float, seconds: float) -> None:
        """Lets time pass.

        Args:
            linear: Wanted speed, in m/s.
            angular: Wanted speed of turning, in rad/s.
            seconds: How much time passes.
        """

    @property
    def pose(self) -> Pose:
        """The true pose of the robot in the map."""

    @property
    def velocity(self) -> Velocity:
        """The true velocity of the robot by its wheels, in m/s and rad/s."""

    @property
    def touches(self) -> bool:
        """The contact of the robot with a wall, a box or another robot, now or in the last step."""

    def ranges(self, angles: np.ndarray, longest: float) -> np.ndarray:
        """Returns the ranges of a laser in the robot's centre.

        Args:
            angles: Directions of the beams from the robot's own, in radians.
            longest: The laser's range, in metres.

        Returns:
            Distances in metres, infinity where there is nothing within the range.
        """


def local(origin: Union[Pose, Box], x: Any, y: Any) -> Tuple[Any, Any]:
    """Returns how far a point, or each one of arrays, is ahead and to the left of a place."""
    dx, dy = x - origin.x, y - origin.y
    cosine, sine = math.cos(origin.theta), math.sin(origin.theta)
    return cosine * dx + sine * dy, cosine * dy - sine * dx


def compose(origin: Pose, pose: Pose) -> Pose:
    """Returns a pose that is given as it is seen from a place."""
    cosine, sine = math.cos(origin.theta), math.sin(origin.theta)
    return Pose(
        origin.x + cosine * pose.x - sine * pose.y,
        origin.y + sine * pose.x + cosine * pose.y,
        normal_angle(origin.theta + pose.theta),
    )


def relative(origin: Pose, pose: Pose) -> Pose:
    """Returns a pose as it is seen from a place, the inverse of :func:`compose`."""
    return Pose(*local(origin, pose.x, pose.y), normal_angle(pose.theta - origin.theta))


def between(value: float, least: float, most: float) -> float:
    """Returns the value, or the nearer of two bounds."""
    return max(least, min(most, value))


def normal_angle(angle: float) -> float:
    """Returns an angle between -pi and pi that is the same direction."""
    return math.remainder(angle, 2 * math.pi)
