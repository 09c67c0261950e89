"""Physics with disturbances: wheels that slip or stick, and noise of laser and odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence, Tuple

import numpy as np

from rosoclingo_simulator.physics.kinematic import accelerated, rolled
from rosoclingo_simulator.physics.physics import (
    ANGULAR_SPEED,
    LINEAR_SPEED,
    WHEEL_DISTANCE,
    Physics,
    Pose,
    Velocity,
    between,
    compose,
    relative,
)

_ORIGIN = Pose(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Disturbance:
    """Errors of wheels and sensors; by default none.

    Attributes:
        slip: Part of the commanded motion that is lost, from 0 to 1; odometry does not notice.
        left_stuck: Whether the left wheel does not turn.
        right_stuck: Whether the right wheel does not turn.
        laser_sigma: Standard deviation of the laser's ranges, in metres.
        dropout: Probability that a beam measures nothing.
        odometry_sigma: Standard deviation of the odometry after a metre, in metres, and after a
            radian, in radians; grows with the root of the way.
    """

    slip: float = 0.0
    left_stuck: bool = False
    right_stuck: bool = False
    laser_sigma: float = 0.0
    dropout: float = 0.0
    odometry_sigma: float = 0.0

    def __add__(self, other: Disturbance) -> Disturbance:
        """Returns both together: errors are independent of each other."""
        return Disturbance(
            slip=1 - (1 - self.slip) * (1 - other.slip),
            left_stuck=self.left_stuck or other.left_stuck,
            right_stuck=self.right_stuck or other.right_stuck,
            laser_sigma=math.hypot(self.laser_sigma, other.laser_sigma),
            dropout=1 - (1 - self.dropout) * (1 - other.dropout),
            odometry_sigma=math.hypot(self.odometry_sigma, other.odometry_sigma),
        )

    def wheels(self, linear: float, angular: float) -> Velocity:
        """Returns the velocity that wheels have which are told another, in m/s and rad/s."""
        linear = between(linear, -LINEAR_SPEED, LINEAR_SPEED)
        angular = between(angular, -ANGULAR_SPEED, ANGULAR_SPEED)
        if not (self.left_stuck or self.right_stuck):
            return linear, angular
        left = 0.0 if self.left_stuck else linear - angular * WHEEL_DISTANCE / 2
        right = 0.0 if self.right_stuck else linear + angular * WHEEL_DISTANCE / 2
        turning = (right - left) / WHEEL_DISTANCE
        # Slower as a whole, so that the robot turns around the wheel that sticks.
        part = min(1.0, ANGULAR_SPEED / abs(turning)) if turning else 1.0
        return part * (left + right) / 2, part * turning


class FaultyPhysics:
    """Decorator of any physics that disturbs it; one thread uses it.

    Attributes:
        body: The physics without disturbances, which knows what is true.
        disturbance: The errors now.
        odometry: Where the wheels say that the robot is, seen from where it was at first.
        metres: How far the robot has really driven.
    """

    def __init__(self, body: Physics, seed: Sequence[int]) -> None:
        """Starts without a disturbance.

        Args:
            body: The physics to disturb.
            seed: Of the noise.
        """
        self.body = body
        self.disturbance = Disturbance()
        self.odometry = _ORIGIN
        self.metres = 0.0
        self._wheels: Velocity = body.velocity
        self._random = np.random.default_rng(seed)

    def reset(self, pose: Pose) -> None:
        """Carries the robot somewhere, which odometry does not notice; boxes stay."""
        self.body.reset(pose)
        self._wheels = (0.0, 0.0)

    def step(self, linear: float, angular: float, seconds: float) -> None:
        """Lets time pass; see :class:`.physics.Physics`."""
        wrong, before = self.disturbance, self.body.pose
        linear, angular = wrong.wheels(linear, angular)
        self.body.step((1 - wrong.slip) * linear, (1 - wrong.slip) * angular, seconds)
        self.metres += before.distance(self.body.pose)
        if wrong.slip:
            self._wheels = accelerated(self._wheels, (linear, angular), seconds)
            measured = rolled(_ORIGIN, self._wheels, seconds)
        else:
            self._wheels = self.body.velocity
            measured = relative(before, self.body.pose)
        if wrong.odometry_sigma:
            measured = self._noisy(measured, wrong.odometry_sigma)
        self.odometry = compose(self.odometry, measured)

    def _noisy(self, moved: Pose, sigma: float) -> Pose:
        """Returns a movement with an error whose variance is proportional to its length."""
        along, turning = self._random.normal(size=2)
        metres, radians = math.hypot(moved.x, moved.y), abs(moved.theta)
        theta = moved.theta + sigma * math.sqrt(radians) * float(turning)
        return Pose(moved.x + sigma * math.sqrt(metres) * float(along), moved.y, theta)

    @property
    def pose(self) -> Pose:
        """The true pose of the robot in the map."""
        return self.body.pose

    @property
    def velocity(self) -> Tuple[float, float]:
        """The velocity of the robot by its wheels, which may slip, in m/s and rad/s."""
        return self._wheels

    @property
    def touches(self) -> bool:
        """The contact of the robot, as of the body."""
        return self.body.touches

    def ranges(self, angles: np.ndarray, longest: float) -> np.ndarray:
        """Returns the ranges of a laser with noise; see :class:`.physics.Physics`."""
        ranges, wrong = self.body.ranges(angles, longest), self.disturbance
        if wrong.laser_sigma:
            noise = self._random.normal(0.0, wrong.laser_sigma, len(ranges))
            ranges = np.maximum(0.0, ranges + noise)
        if wrong.dropout:
            ranges = np.where(self._random.random(len(ranges)) < wrong.dropout, np.inf, ranges)
        return np.where(ranges <= longest, ranges, np.inf)
