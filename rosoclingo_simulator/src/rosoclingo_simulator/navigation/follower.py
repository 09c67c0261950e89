"""Path follower: drives along a path by pure pursuit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple

import numpy as np

from rosoclingo_simulator.navigation.planner import lengths
from rosoclingo_simulator.physics import physics
from rosoclingo_simulator.physics.physics import Pose, between, local, normal_angle

VelocityCommand = Tuple[float, float]
"""Wanted speed and speed of turning, in m/s and rad/s."""

STOP: VelocityCommand = (0.0, 0.0)

_AHEAD_METRES = 0.45  # how far ahead the point on the path is that the robot drives to
_BLOCKED_METRES = 0.02  # less room ahead is none
_BLOCKED_AHEAD_METRES = 0.15  # the same, if something is in the way to that point
_SEARCH_POINTS = 20  # how many points of the path ahead may be the nearest one
_TURN_ANGLE = 0.9  # radians; a robot that looks so far aside turns first
_TURNED_ANGLE = 0.2  # and until it looks no farther aside than this
_SIDE_METRES = physics.ROBOT_RADIUS + 0.03  # what is so far aside at most is in the way
_GAP_METRES = 0.06  # how far from what the laser sees the robot stays
_BRAKING = 0.7  # part of the acceleration that is counted on
_SLOWEST = 0.06  # m/s
_STANDING = 0.05  # m/s and rad/s; slower is standing


@dataclass(frozen=True)
class Limits:
    """Speed limit and goal tolerances.

    Attributes:
        speed: The fastest, in m/s.
        xy_tolerance: How far from the goal it is reached, in metres.
        yaw_tolerance: How far from the goal's direction it is reached, in radians.
    """

    speed: float = physics.LINEAR_SPEED
    xy_tolerance: float = 0.15
    yaw_tolerance: float = 0.3


@dataclass
class Follower:
    """Pure pursuit of a path; turns on the spot where the path leads aside, and at its end.

    Attributes:
        limits: How to drive.
        path: The points to drive along.
        goal: The pose at its end.
        near: Whether the robot has been near enough to the goal before.
        arrived: Whether the robot stands at the goal and looks as the goal does.
    """

    limits: Limits
    path: np.ndarray
    goal: Pose
    near: bool = False
    arrived: bool = False
    _nearest: int = 0
    _turns: bool = False

    def __post_init__(self) -> None:
        self._lengths = lengths(self.path)

    @property
    def rest(self) -> np.ndarray:
        """The points of the path that are still ahead."""
        return self.path[self._nearest :]

    def command(self, pose: Pose, velocity: VelocityCommand, points: np.ndarray) -> VelocityCommand:
        """Returns the next command for the wheels.

        Args:
            pose: Where the robot is.
            velocity: What its wheels do, in m/s and rad/s.
            points: What the laser has seen last, in the map, in metres.
        """
        if self.near or pose.distance(self.goal) <= self.limits.xy_tolerance:
            self.near = True  # and stays so: it does not drive again for a hand's breadth
            aside = normal_angle(self.goal.theta - pose.theta)
            if abs(aside) > self.limits.yaw_tolerance:
                return 0.0, _turn(aside)
            self.arrived = abs(velocity[0]) < _STANDING and abs(velocity[1]) < _STANDING
            return STOP
        target = self._target(pose, _AHEAD_METRES)
        aside = _aside(pose, target)
        self._turns = abs(aside) > (_TURNED_ANGLE if self._turns else _TURN_ANGLE)
        if self._turns:
            return 0.0, _turn(aside)
        curvature = (
            2 * math.sin(aside) / max(math.hypot(target[0] - pose.x, target[1] - pose.y), 0.1)
        )
        rest = self._lengths[-1] - self._lengths[self._nearest]
        speed = min(
            self.limits.speed,
            _until(max(rest, pose.distance(self.goal))),
            0.7 * physics.ANGULAR_SPEED / max(abs(curvature), 1e-6),
        )
        speed = max(speed, _SLOWEST)
        free = free_ahead(pose, points)
        if free <= _BLOCKED_METRES:
            # Turning is safe, and shows what else there is. The path cuts no corners.
            aside = _aside(pose, self._target(pose, _BLOCKED_AHEAD_METRES))
            return 0.0, _turn(aside) if abs(aside) > _TURNED_ANGLE / 2 else 0.0
        speed = min(speed, _until(free))
        return speed, speed * curvature

    def _target(self, pose: Pose, metres: float) -> np.ndarray:
        """Returns the point of the path to drive to, so far ahead."""
        ahead = self.path[self._nearest : self._nearest + _SEARCH_POINTS]
        squares = (ahead[:, 0] - pose.x) ** 2 + (ahead[:, 1] - pose.y) ** 2
        self._nearest += int(squares.argmin())
        wanted = self._lengths[self._nearest] + metres
        index = min(int(np.searchsorted(self._lengths, wanted)), len(self.path) - 1)
        return np.asarray(self.path[index])


def free_ahead(pose: Pose, points: np.ndarray) -> float:
    """Returns how far the robot may drive straight on, in metres.

    Args:
        pose: Where it is.
        points: What there is, in metres in the map.
    """
    ahead, left = local(pose, points[:, 0], points[:, 1])
    aside = np.abs(left)
    beside = (aside > physics.ROBOT_RADIUS) & (ahead < _GAP_METRES)
    in_the_way = (ahead > 0) & (aside < _SIDE_METRES) & ~beside
    if not in_the_way.any():
        return math.inf
    ahead, aside = ahead[in_the_way], aside[in_the_way]
    reach = np.sqrt(np.maximum(0.0, physics.ROBOT_RADIUS**2 - aside**2))
    return float((ahead - reach).min()) - _GAP_METRES


def _aside(pose: Pose, target: np.ndarray) -> float:
    """Returns how far to turn to look at a point, in radians."""
    return normal_angle(math.atan2(target[1] - pose.y, target[0] - pose.x) - pose.theta)


def _turn(aside: float) -> float:
    """Returns how fast to turn, so that it ends where it should."""
    fastest = math.sqrt(2 * _BRAKING * physics.ANGULAR_ACCELERATION * abs(aside))
    return math.copysign(between(fastest, 0.15, physics.ANGULAR_SPEED), aside)


def _until(metres: float) -> float:
    """Returns how fast to be so far before the place to stop."""
    return math.sqrt(2 * _BRAKING * physics.LINEAR_ACCELERATION * max(0.0, metres))
