"""Right of way: how robots that know of each other pass, wait and make room. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import List, Optional, Sequence

import numpy as np

from rosoclingo_simulator.navigation.follower import STOP, Follower, Limits, VelocityCommand
from rosoclingo_simulator.navigation.planner import APART_METRES, PathPlanner, lengths
from rosoclingo_simulator.physics.kinematic import accelerated, rolled
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, STEP_SECONDS, Pose, Velocity

AWARE_METRES = 8.0
"""Robots that are farther apart than this do not matter to each other."""

_TOUCH_METRES = 2 * ROBOT_RADIUS  # between the centres of two robots that touch
_ROOM_METRES = 0.02  # that is left between two robots whatever happens
_CLAIM_METRES = 4.0  # how far ahead the way of who has right of way is kept free
_CLAIM_SECONDS = 8.0  # how far ahead meetings are foreseen
_DETOUR_METRES = 3.0  # a way around others may be so much longer; for more, it is waited
_LOOK_SECONDS = 0.5  # between two looks at who is in the way
_NEAR_METRES = 0.8  # between two robots; at more, both can stop in time

_TIMES = np.arange(0.0, _CLAIM_SECONDS, 0.25)
_SOON = 4  # of these; robots that are close to each other now may part until then


@dataclass(frozen=True)
class Neighbour:
    """Another robot, as it tells the others.

    Attributes:
        pose: Where it is.
        velocity: What its wheels do, in m/s and rad/s.
        path: The points it will drive along, in metres; None if it stands.
        first: Whether it has right of way.
        still: Whether it has not moved for a while.
    """

    pose: Pose
    velocity: Velocity
    path: Optional[np.ndarray]
    first: bool
    still: bool

    @property
    def claim(self) -> np.ndarray:
        """The points around which it wants to have room, in metres."""
        here = _points([self.pose])
        if self.path is None:
            return here
        way = np.concatenate((here, self.path))
        return way[lengths(way) <= _CLAIM_METRES]


@dataclass
class RightOfWay:
    """Gives way to robots that have right of way: waits, or drives around or aside.

    One thread uses it.

    Attributes:
        planner: Finds the paths.
        limits: How to drive.
        follower: Drives the robot around others, or aside; None if it does neither.
        waits: Whether the robot waits.
        since: When it began to give way, in seconds; None if it does not.
    """

    planner: PathPlanner
    limits: Limits
    follower: Optional[Follower] = None
    waits: bool = False
    since: Optional[float] = None
    _looked: float = -np.inf

    def update(
        self,
        pose: Pose,
        velocity: Velocity,
        route: Optional[Follower],
        neighbours: Sequence[Neighbour],
        *,
        marked: np.ndarray,
        time: float,
    ) -> None:
        """Looks for robots in the way, and decides what to do.

        Args:
            pose: Where the robot is.
            velocity: What its wheels do, in m/s and rad/s.
            route: Drives it to its goal; None if there is no goal.
            neighbours: The other robots around.
            marked: Cells with something in them that is not on the map.
            time: What time it is, in seconds.
        """
        if time - self._looked < _LOOK_SECONDS:
            return
        self._looked = time
        way = None if route is None else route.rest
        rivals = [
            robot for robot in neighbours if robot.first and self._meets(pose, velocity, way, robot)
        ]
        if not rivals:
            self.end()
            return
        if self.since is None:
            self.since = time
        claims = np.concatenate([robot.claim for robot in rivals])
        others = _points([robot.pose for robot in neighbours])
        self.follower, self.waits = None, True
        in_the_way = bool(_gaps(claims, _points([pose])).min() < APART_METRES)
        if route is not None and (in_the_way or not all(self._leaves(pose, one) for one in rivals)):
            closed = np.concatenate((claims, others))
            path = self.planner.plan(pose, route.goal, marked, closed=closed)
            if path is not None and lengths(path)[-1] <= lengths(route.rest)[-1] + _DETOUR_METRES:
                self.follower = Follower(self.limits, path, route.goal, route.near)
        if self.follower is None and in_the_way:
            path = self.planner.refuge(pose, marked, others, claims)
            if path is not None:
                limits = replace(self.limits, xy_tolerance=0.05, yaw_tolerance=np.pi)
                end = Pose(float(path[-1, 0]), float(path[-1, 1]), pose.theta)
                self.follower = Follower(limits, path, end)
        self.waits = self.follower is None

    def end(self) -> None:
        """Stops giving way."""
        self.follower, self.waits, self.since = None, False, None

    def _meets(
        self, pose: Pose, velocity: Velocity, way: Optional[np.ndarray], other: Neighbour
    ) -> bool:
        """Whether two robots will come too close if both drive as they want to."""
        if way is None and other.path is None:
            return False  # both stand
        gaps = _gaps(
            _foreseen(pose, way, self.limits.speed),
            _foreseen(other.pose, other.path, self.limits.speed),
        )
        # Robots that are close to each other part if they drive; if they cannot, they have met.
        drive = velocity[0] or other.velocity[0]
        return bool(gaps[_SOON if drive else 0 :].min() < APART_METRES)

    def _leaves(self, pose: Pose, other: Neighbour) -> bool:
        """Whether another robot drives away from here."""
        gaps = _gaps(_foreseen(other.pose, other.path, self.limits.speed), _points([pose]))
        return bool(gaps[_SOON] > gaps[0])


def careful(
    command: VelocityCommand, pose: Pose, velocity: Velocity, neighbours: Sequence[Neighbour]
) -> VelocityCommand:
    """Returns a command after which this robot and all others can still stop before they touch.

    Args:
        command: What the robot would do.
        pose: Where it is.
        velocity: What its wheels do, in m/s and rad/s.
        neighbours: The other robots around.
    """
    near = [robot for robot in neighbours if pose.distance(robot.pose) < _NEAR_METRES]
    if not near:
        return command
    taken = _points([place for robot in near for place in _stops(robot.pose, robot.velocity)])
    now = _gaps(_points([pose]), taken).min()
    speed, turning = command
    for told in (command, (speed / 2, turning / 2), (speed / 4, turning / 4), (0.0, turning)):
        after = accelerated(velocity, told, STEP_SECONDS)
        places = _stops(rolled(pose, after, STEP_SECONDS), after)
        gap = _gaps(_points(places)[:, None], taken).min()
        if gap >= min(now, _TOUCH_METRES + _ROOM_METRES):
            return told
    return STOP


def _stops(pose: Pose, velocity: Velocity) -> List[Pose]:
    """Returns where a robot gets to, from where it is, when it is told to stop."""
    places = [pose]
    while velocity[0]:
        velocity = accelerated(velocity, STOP, STEP_SECONDS)
        pose = rolled(pose, velocity, STEP_SECONDS)
        places.append(pose)
    return places


def _foreseen(pose: Pose, path: Optional[np.ndarray], speed: float) -> np.ndarray:
    """Returns where a robot will be, at times, if nothing holds it up."""
    here = _points([pose])
    if path is None:
        return np.repeat(here, len(_TIMES), axis=0)
    way = np.concatenate((here, path))
    gone = lengths(way)
    return np.stack([np.interp(_TIMES * speed, gone, way[:, axis]) for axis in (0, 1)], axis=-1)


def _gaps(places: np.ndarray, others: np.ndarray) -> np.ndarray:
    return np.hypot(*np.moveaxis(places - others, -1, 0))


def _points(poses: Sequence[Pose]) -> np.ndarray:
    return np.array([(pose.x, pose.y) for pose in poses])
