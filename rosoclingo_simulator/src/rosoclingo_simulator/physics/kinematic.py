"""Kinematic physics: discs that roll over the map and stop at obstacles."""

from __future__ import annotations

import copy
import math
from typing import Dict, List, Tuple

import numpy as np

from rosoclingo_simulator.physics import physics
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import (
    Box,
    Pose,
    Velocity,
    between,
    local,
    normal_angle,
)
from rosoclingo_simulator.physics.walls import Walls, without_zeros

_LONGEST_MOVE = 0.05  # metres between two looks for contact, far less than the robot's width
_HALVINGS = 12  # of that, which finds the contact to a few hundredths of a millimetre
_TOUCHING = 0.001  # metres; nearer is touching


class KinematicPhysics:
    """Physics on the map: wheels that do not slip, and a base that does not bounce.

    Attributes:
        pose: Where the robot really is, in the map.
        velocity: What the wheels really do, in m/s and rad/s.
    """

    def __init__(self, world: OccupancyMap, pose: Pose) -> None:
        """Puts a robot into a world.

        Args:
            world: What is solid.
            pose: Where the robot is.
        """
        self._world = world
        # Shared by all robots in the world.
        self._boxes: Dict[str, Box] = {}
        self._all: List[KinematicPhysics] = [self]
        self._walls = Walls(world.solid, world.framed)
        self.reset(pose)

    def join(self, pose: Pose) -> KinematicPhysics:
        """Returns the physics of one more robot in the same world; they do not pass each other."""
        other = copy.copy(self)
        other.reset(pose)
        self._all.append(other)
        return other

    @property
    def robots(self) -> Tuple[Pose, ...]:
        """The poses of all robots of the world."""
        return tuple(robot.pose for robot in self._all)

    @property
    def touches(self) -> bool:
        """True if the robot touches a wall, a box or another robot now."""
        return self._clearance(self.pose) < physics.ROBOT_RADIUS + _TOUCHING

    def reset(self, pose: Pose) -> None:
        """Puts the robot somewhere, standing still; boxes stay."""
        self.pose = pose
        self.velocity = (0.0, 0.0)

    def step(self, linear: float, angular: float, seconds: float) -> None:
        """Lets time pass; see :class:`.physics.Physics`."""
        self.velocity = speed, turning = accelerated(self.velocity, (linear, angular), seconds)
        if not (speed or turning):
            return
        moves = max(1, math.ceil(abs(speed) * seconds / _LONGEST_MOVE))
        for _ in range(moves):
            end = rolled(self.pose, (speed, turning), seconds / moves)
            if self._may_be(end):
                self.pose = end
            else:
                self.pose = self._last_before(end, speed, turning, seconds / moves)
                speed = 0.0
        self.velocity = (speed, turning)

    def _last_before(self, end: Pose, speed: float, turning: float, seconds: float) -> Pose:
        """Returns the place where a move meets something, with the direction of its end."""
        free, met = 0.0, 1.0
        for _ in range(_HALVINGS):
            part = (free + met) / 2
            if self._may_be(rolled(self.pose, (speed, turning), seconds * part)):
                free = part
            else:
                met = part
        last = rolled(self.pose, (speed, turning), seconds * free)
        return Pose(last.x, last.y, end.theta)

    def _may_be(self, pose: Pose) -> bool:
        """Returns whether the robot may move to a pose; it may leave an obstacle it is in."""
        clearance = self._clearance(pose)
        return clearance >= physics.ROBOT_RADIUS or clearance > self._clearance(self.pose)

    def _clearance(self, pose: Pose) -> float:
        """Returns how far the robot's centre is from what is solid, in metres."""
        distances = [box.distance(pose.x, pose.y) for box in self._boxes.values()]
        discs = [pose.distance(other.pose) - physics.ROBOT_RADIUS for other in self._others()]
        return min([self._world.clearance(pose.x, pose.y), *distances, *discs])

    def _others(self) -> List[KinematicPhysics]:
        return [robot for robot in self._all if robot is not self]

    def put(self, name: str, box: Box) -> None:
        """Puts a box into the world, in place of the one of the same name if there is one."""
        self._boxes[name] = box

    def remove(self, name: str) -> None:
        """Takes a box away; does nothing if there is none of the name."""
        self._boxes.pop(name, None)

    def ranges(self, angles: np.ndarray, longest: float) -> np.ndarray:
        """Returns the ranges of a laser; see :class:`.physics.Physics`."""
        if self._world.clearance(self.pose.x, self.pose.y) == 0:
            return np.zeros(len(angles))
        directions = np.stack((np.cos(angles + self.pose.theta), np.sin(angles + self.pose.theta)))
        ranges = self._walls.ranges(self.pose.x, self.pose.y, directions, longest)
        for box in self._boxes.values():
            near, far = _through(box, self.pose, directions)
            hit = (near <= far) & (far >= 0)
            ranges = np.where(hit, np.minimum(ranges, np.maximum(near, 0.0)), ranges)
        for other in self._others():
            near = _to_disc(other.pose, self.pose, directions)
            ranges = np.minimum(ranges, near)
        return np.where(ranges <= longest, ranges, np.inf)


def accelerated(velocity: Velocity, wanted: Velocity, seconds: float) -> Velocity:
    """Returns the velocity after some time of acceleration, in m/s and rad/s.

    Args:
        velocity: What they do now.
        wanted: What they are told.
        seconds: How much time passes.
    """
    (speed, turning), (linear, angular) = velocity, wanted
    faster = physics.LINEAR_ACCELERATION * seconds
    quicker = physics.ANGULAR_ACCELERATION * seconds
    linear = between(linear, -physics.LINEAR_SPEED, physics.LINEAR_SPEED)
    angular = between(angular, -physics.ANGULAR_SPEED, physics.ANGULAR_SPEED)
    return (
        between(linear, speed - faster, speed + faster),
        between(angular, turning - quicker, turning + quicker),
    )


def rolled(pose: Pose, velocity: Velocity, seconds: float) -> Pose:
    """Returns the next pose: the way is an arc, approximated by its chord."""
    speed, turning = velocity
    turned = turning * seconds
    half = turned / 2
    chord = speed * seconds * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return Pose(
        pose.x + chord * math.cos(pose.theta + half),
        pose.y + chord * math.sin(pose.theta + half),
        normal_angle(pose.theta + turned),
    )


def _to_disc(disc: Pose, pose: Pose, directions: np.ndarray) -> np.ndarray:
    """Returns how far it is along lines to a robot at another place; infinity if they miss it."""
    place = np.array((disc.x - pose.x, disc.y - pose.y))
    ahead = place @ directions
    squares = physics.ROBOT_RADIUS**2 - (place @ place - ahead**2)
    near = ahead - np.sqrt(np.maximum(squares, 0.0))
    return np.where((squares >= 0) & (ahead > 0), np.maximum(near, 0.0), np.inf)


def _through(box: Box, pose: Pose, directions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Returns where lines get into a box and out of it; out comes first if they miss it."""
    # Along the box's length and along its width.
    start = np.array(local(box, pose.x, pose.y))[:, None]
    half = np.array([[box.length / 2], [box.width / 2]])
    slopes = without_zeros(np.stack(local(Pose(0.0, 0.0, box.theta), *directions)))
    first, second = (-half - start) / slopes, (half - start) / slopes
    return np.maximum(*np.minimum(first, second)), np.minimum(*np.maximum(first, second))
