"""Physics of a disc that rolls over the map and stops at what it touches."""

from __future__ import annotations

import math
from typing import Dict, Tuple, Union

import numpy as np

from rosoclingo_gazebo.simulator.occupancy import OccupancyMap
from rosoclingo_gazebo.simulator.physics import (
    ROBOT_RADIUS,
    Box,
    Pose,
    next_velocity,
    normal_angle,
)

_Bound = Union[float, np.ndarray]

_LONGEST_MOVE = 0.05  # metres between two looks for contact, far less than the robot's width
_HALVINGS = 12  # of that, which finds the contact to a few hundredths of a millimetre
_TOUCHING = 0.001  # metres; nearer is touching
_SHORTEST_STEP = 0.4  # cells that a beam goes on at least; shorter finds no more


class KinematicPhysics:
    """Physics on the map: wheels that do not slip, and a base that does not bounce."""

    def __init__(self, world: OccupancyMap, pose: Pose) -> None:
        """Puts a robot into a world.

        Args:
            world: What is solid.
            pose: Where the robot is.
        """
        self._world = world
        self._boxes: Dict[str, Box] = {}
        # How far a beam may go on from each cell without a wall in between; 0 inside of one.
        resolution = world.grid.resolution
        steps = world.distances - math.sqrt(2) * resolution
        self._steps = np.where(world.solid, 0.0, np.maximum(steps, _SHORTEST_STEP * resolution))
        self.reset(pose)

    @property
    def pose(self) -> Pose:
        """Where the robot really is, in the map."""
        return self._pose

    @property
    def velocity(self) -> Tuple[float, float]:
        """What the wheels really do, in m/s and rad/s."""
        return self._velocity

    @property
    def touches(self) -> bool:
        """Whether the robot touches a wall or a box now."""
        return self._clearance(self._pose) < ROBOT_RADIUS + _TOUCHING

    def reset(self, pose: Pose) -> None:
        """Puts the robot somewhere, standing still; boxes stay."""
        self._pose = pose
        self._velocity = (0.0, 0.0)

    def step(self, linear: float, angular: float, seconds: float) -> None:
        """Lets time pass; see :class:`.physics.Physics`."""
        self._velocity = next_velocity(self._velocity, linear, angular, seconds)
        speed, turning = self._velocity
        if not (speed or turning):
            return
        moves = max(1, math.ceil(abs(speed) * seconds / _LONGEST_MOVE))
        for _ in range(moves):
            end = _moved(self._pose, speed, turning, seconds / moves)
            if self._may_be(end):
                self._pose = end
            else:
                self._pose = self._last_before(end, speed, turning, seconds / moves)
                speed = 0.0
        self._velocity = (speed, turning)

    def _last_before(self, end: Pose, speed: float, turning: float, seconds: float) -> Pose:
        """Returns the place where a move meets something, with the direction of its end."""
        free, met = 0.0, 1.0
        for _ in range(_HALVINGS):
            part = (free + met) / 2
            if self._may_be(_moved(self._pose, speed, turning, seconds * part)):
                free = part
            else:
                met = part
        last = _moved(self._pose, speed, turning, seconds * free)
        return Pose(last.x, last.y, end.theta)

    def _may_be(self, pose: Pose) -> bool:
        """Whether the robot may get to a pose; one that is inside of something may get out."""
        clearance = self._clearance(pose)
        return clearance >= ROBOT_RADIUS or clearance > self._clearance(self._pose)

    def _clearance(self, pose: Pose) -> float:
        """Returns how far the robot's centre is from what is solid, in metres."""
        distances = [box.distance(pose.x, pose.y) for box in self._boxes.values()]
        return min([self._world.clearance(pose.x, pose.y), *distances])

    def put(self, name: str, box: Box) -> None:
        """Puts a box into the world, in place of the one of the same name if there is one."""
        self._boxes[name] = box

    def remove(self, name: str) -> None:
        """Takes a box away; does nothing if there is none of the name."""
        self._boxes.pop(name, None)

    def ranges(self, angles: np.ndarray, longest: float) -> np.ndarray:
        """Returns what a laser measures; see :class:`.physics.Physics`."""
        directions = np.stack(
            (np.cos(angles + self._pose.theta), np.sin(angles + self._pose.theta))
        )
        ranges = self._ranges_of_walls(directions, longest)
        for box in self._boxes.values():
            near, far = _through(box, self._pose, directions)
            hit = (near <= far) & (far >= 0)
            ranges = np.where(hit, np.minimum(ranges, np.maximum(near, 0.0)), ranges)
        return np.where(ranges <= longest, ranges, np.inf)

    def _ranges_of_walls(self, directions: np.ndarray, longest: float) -> np.ndarray:
        """Follows the beams, each as far as nothing can be in its way, until it is in a wall."""
        grid = self._world.framed
        steps = self._steps.ravel()
        resolution = grid.resolution
        # All in cells, because each beam takes dozens of steps.
        x, y = (self._pose.x - grid.x) / resolution, (self._pose.y - grid.y) / resolution
        ranges = np.zeros(directions.shape[1])
        places = np.zeros(directions.shape[1], np.intp)
        rest = np.arange(directions.shape[1])
        dx, dy, gone = directions[0], directions[1], ranges.copy()
        while len(rest):
            columns = np.clip((x + gone * dx).astype(np.intp), 0, grid.columns - 1)
            rows = np.clip((y + gone * dy).astype(np.intp), 0, grid.rows - 1)
            cells = rows * grid.columns + columns
            step = steps[cells] / resolution
            on = (step > 0) & (gone * resolution < longest)
            if not on.all():
                ended = ~on
                ranges[rest[ended]] = gone[ended]
                places[rest[ended]] = cells[ended]
                rest, dx, dy, gone, step = rest[on], dx[on], dy[on], gone[on], step[on]
            gone = gone + step
        walls = steps[places] == 0
        entered = _into_cells(places // grid.columns - y, places % grid.columns - x, directions)
        # A beam that cuts a corner may be in the next cell: then it is where it was found.
        ranges = np.where(walls, np.minimum(ranges, np.maximum(entered, 0.0)), np.inf)
        return ranges * resolution


def _moved(pose: Pose, speed: float, turning: float, seconds: float) -> Pose:
    """Returns where a robot gets to; the way is an arc, of which it takes the chord."""
    turned = turning * seconds
    half = turned / 2
    chord = speed * seconds * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return Pose(
        pose.x + chord * math.cos(pose.theta + half),
        pose.y + chord * math.sin(pose.theta + half),
        normal_angle(pose.theta + turned),
    )


def _through(box: Box, pose: Pose, directions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Returns where lines get into a box and out of it; out comes first if they miss it."""
    along, across = box.local(pose.x, pose.y)
    cosine, sine = math.cos(box.theta), math.sin(box.theta)
    dx = cosine * directions[0] + sine * directions[1]
    dy = cosine * directions[1] - sine * directions[0]
    x_in, x_out = _between_planes(along, dx, -box.length / 2, box.length / 2)
    y_in, y_out = _between_planes(across, dy, -box.width / 2, box.width / 2)
    return np.maximum(x_in, y_in), np.minimum(x_out, y_out)


def _into_cells(rows: np.ndarray, columns: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Returns where lines from the origin get into a cell each; its lower left corner is given."""
    x_in, _ = _between_planes(0.0, directions[0], columns, columns + 1)
    y_in, _ = _between_planes(0.0, directions[1], rows, rows + 1)
    return np.maximum(x_in, y_in)


def _between_planes(
    start: float, slope: np.ndarray, low: _Bound, high: _Bound
) -> Tuple[np.ndarray, np.ndarray]:
    """Returns where lines get between two planes and out again, along one axis."""
    slope = np.where(np.abs(slope) < 1e-12, 1e-12, slope)
    first, second = (low - start) / slope, (high - start) / slope
    return np.minimum(first, second), np.maximum(first, second)
