"""Simulated localisation: knows where the robot is until it is lost, then goes by odometry."""

from __future__ import annotations

import math
from typing import Optional

from rosoclingo_simulator.physics.faulty import FaultyPhysics
from rosoclingo_simulator.physics.physics import Pose, compose, normal_angle, relative

NEAR_METRES, NEAR_RADIANS = 1.0, 0.5
"""How wrong an initial pose may be from which it finds the true one: two standard deviations of
what rviz sends."""

_ORIGIN = Pose(0.0, 0.0, 0.0)
_FULL_TURN = 2 * math.pi


class PoseEstimator:
    """A robot's estimate of its pose. One thread uses it.

    Attributes:
        physics: Moves the robot.
        unsure: Whether it knows that it is lost.
    """

    def __init__(self, physics: FaultyPhysics) -> None:
        """Starts with the true pose.

        Args:
            physics: Moves the robot.
        """
        self.physics = physics
        self.unsure = False
        self._frame: Optional[Pose] = None  # of the odometry on the map, while it is lost
        self._to_turn: Optional[float] = None  # radians until a search finds it; None for no search
        self._heading = 0.0  # by odometry, when the search has last looked

    @property
    def lost(self) -> bool:
        """True while it goes by odometry, from a place where the robot may never have been."""
        return self._frame is not None

    @property
    def pose(self) -> Pose:
        """The estimated pose."""
        if self._frame is None:
            return self.physics.pose
        return compose(self._frame, self.physics.odometry)

    @property
    def odometry_frame(self) -> Pose:
        """Where the frame of the odometry is on the map, by the estimate."""
        return self._frame or self._frame_for(self.physics.pose)

    def lose(self, pose: Pose, *, unsure: bool = False) -> None:
        """Gets lost.

        Args:
            pose: Where it takes the robot to be from now on.
            unsure: Whether it knows that this may be wrong.
        """
        self._frame = self._frame_for(pose)
        self.unsure = unsure
        self._to_turn = None

    def search(self) -> None:
        """Takes the robot to be anywhere, until it has turned once around and so seen everything.

        A localisation by particles does so when these are spread over the whole map.
        """
        self.lose(self.pose, unsure=True)
        self._to_turn, self._heading = _FULL_TURN, self.physics.odometry.theta

    def update(self) -> None:
        """Looks after a step how far a search is."""
        if self._to_turn is None:
            return
        heading = self.physics.odometry.theta
        self._to_turn -= abs(normal_angle(heading - self._heading))
        self._heading = heading
        if self._to_turn <= 0:
            self.find()

    def find(self) -> None:
        """Knows where the robot is again."""
        self._frame = None
        self.unsure = False
        self._to_turn = None

    def relocalise(self, pose: Pose) -> bool:
        """Begins anew from an initial pose.

        Args:
            pose: The announced pose of the robot.

        Returns:
            Whether the pose is near the true one, so that it knows that now; else it is lost.
        """
        true = self.physics.pose
        aside = abs(normal_angle(pose.theta - true.theta))
        if pose.distance(true) <= NEAR_METRES and aside <= NEAR_RADIANS:
            self.find()
        else:
            self.lose(pose)
        return not self.lost

    def _frame_for(self, pose: Pose) -> Pose:
        return compose(pose, relative(self.physics.odometry, _ORIGIN))
