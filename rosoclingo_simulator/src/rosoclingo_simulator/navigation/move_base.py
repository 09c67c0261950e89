"""Simulates move_base: plans a path to a goal, drives, replans, and gives up."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Optional, Sequence, Tuple

import numpy as np
from scipy.spatial import cKDTree

from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import STOP, Follower, Limits, VelocityCommand
from rosoclingo_simulator.navigation.planner import CLEARANCE, PathPlanner
from rosoclingo_simulator.navigation.right_of_way import Neighbour, RightOfWay, careful
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.physics.physics import Pose

_PLAN_SECONDS = 1.0  # between two plans, unless something is in the way
_PROGRESS_METRES = 0.2  # moving less is no progress
_PATIENCE_SECONDS = 60.0  # how long others may have the right of way without a break


class End(enum.Enum):
    """The terminal statuses of a goal."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    PREEMPTED = "preempted"


@dataclass(frozen=True)
class DriveOutcome:
    """The end of a goal.

    Attributes:
        end: How it ended.
        text: Why, for a person.
    """

    end: End
    text: str


@dataclass
class MoveBaseDriver:
    """Drives the robot to a goal. One thread uses it.

    Attributes:
        planner: Finds the paths.
        costmap: What the laser has seen that is not on the map, and what to drive around.
        limits: How to drive.
        progress_timeout: After how many seconds without progress to give up.
        goal: Where to drive; None if there is none.
        outcome: How the last goal ended; None while there is one, or before the first.
        manners: What it does about other robots.
    """

    planner: PathPlanner
    costmap: Costmap
    limits: Limits
    progress_timeout: float
    goal: Optional[Pose] = None
    outcome: Optional[DriveOutcome] = None
    manners: RightOfWay = field(init=False)
    _follower: Optional[Follower] = None
    _reached: Optional[Pose] = None  # the last place that counts as progress, and when
    _reached_at: float = 0.0
    _planned: float = 0.0
    _known: object = None  # what the path knows of the costmap, and of robots that stand

    def __post_init__(self) -> None:
        self.manners = RightOfWay(self.planner, self.limits)

    @property
    def active(self) -> bool:
        """Whether it drives, to a goal or out of another robot's way."""
        return self.goal is not None or self.manners.follower is not None

    @property
    def path(self) -> Optional[np.ndarray]:
        """The points that the robot drives along, in metres; a new array for each plan."""
        follower = self.manners.follower or self._follower
        return None if follower is None else follower.path

    @property
    def ahead(self) -> Optional[np.ndarray]:
        """The points of the path that are still ahead; None while the robot is to stand."""
        follower = self.manners.follower or self._follower
        return None if follower is None or self.manners.waits else follower.rest

    def start(self, goal: Pose) -> None:
        """Begins to drive to a goal, in place of the one before."""
        self.goal = goal
        self._follower = None
        self.outcome = None
        self._reached = None
        self.manners.since = None  # it may have given way before

    def cancel(self, text: str = "canceled on request") -> None:
        """Ends the goal if there is one; the robot stops."""
        if self.goal is not None:
            self._finish(End.PREEMPTED, text)

    def update(
        self,
        pose: Pose,
        velocity: VelocityCommand,
        scan: Scan,
        time: float,
        neighbours: Sequence[Neighbour] = (),
    ) -> VelocityCommand:
        """Returns the next command for the wheels; ``outcome`` tells if the goal has ended.

        Args:
            pose: Where the robot is.
            velocity: What its wheels do, in m/s and rad/s.
            scan: What the laser has measured last.
            time: What time it is, in seconds.
            neighbours: The other robots around.
        """
        standing = _standing(neighbours)
        if (
            self.goal is not None
            and self._must_plan(time, standing)
            and not self._plan(self.goal, pose, time, standing)
        ):
            return STOP
        marked = self.costmap.marked
        self.manners.update(pose, velocity, self._follower, neighbours, marked=marked, time=time)
        follower = self.manners.follower or self._follower
        command = STOP
        if follower is not None and not self.manners.waits:
            command = follower.command(pose, velocity, scan.points)
            if follower.arrived and follower.goal is self.goal:
                self._finish(End.SUCCEEDED, "Goal reached.")
                return STOP
        if self.goal is not None and not self._advances(self.goal, pose, time):
            return STOP
        return careful(command, pose, velocity, neighbours)

    def _advances(self, goal: Pose, pose: Pose, time: float) -> bool:
        """Gives the goal up if the robot has been at the same place for too long."""
        since = self.manners.since
        if since is not None:
            self._reached = None
            if time - since >= _PATIENCE_SECONDS:
                text = f"gave way to other robots for {_PATIENCE_SECONDS:g} s"
                self._finish(End.ABORTED, f"no progress to {_place(goal)}: {text}")
        elif self._reached is None or pose.distance(self._reached) > _PROGRESS_METRES:
            self._reached, self._reached_at = pose, time
        elif time - self._reached_at >= self.progress_timeout:
            text = f"within {self.progress_timeout:g} s"
            self._finish(End.ABORTED, f"no progress to {_place(goal)} {text}")
        return self.active

    def _must_plan(self, time: float, standing: Tuple[Pose, ...]) -> bool:
        if self._follower is None:
            return True
        strays = self.manners.follower is not None  # where the path does not lead
        if not strays and self._known == (self.costmap.changes, standing):
            return False
        return time - self._planned >= _PLAN_SECONDS or self._blocked(self._follower.rest)

    def _blocked(self, path: np.ndarray) -> bool:
        """Whether an obstacle is on the path that the path was not planned around."""
        rows, columns = np.nonzero(self.costmap.marked)
        if not len(rows):
            return False
        marks = cKDTree(self.planner.grid.points(rows, columns))
        nearest, _ = marks.query(path, distance_upper_bound=CLEARANCE)
        return bool(np.isfinite(nearest).any())

    def _plan(self, goal: Pose, pose: Pose, time: float, standing: Tuple[Pose, ...]) -> bool:
        dear = np.array([(robot.x, robot.y) for robot in standing]) if standing else None
        path = self.planner.plan(pose, goal, self.costmap.marked, dear=dear)
        if path is None:
            self._finish(End.ABORTED, f"no path to {_place(goal)} from {_place(pose)}")
            return False
        near = self._follower is not None and self._follower.near
        self._follower = Follower(self.limits, path, goal, near)
        self._planned = time
        self._known = (self.costmap.changes, standing)
        return True

    def _finish(self, end: End, text: str) -> None:
        self.goal = None
        self._follower = None
        self.manners.end()
        self.outcome = DriveOutcome(end, text)


def _standing(neighbours: Sequence[Neighbour]) -> Tuple[Pose, ...]:
    """Returns where robots stand that will make room if there is no way around them."""
    return tuple(robot.pose for robot in neighbours if robot.still and not robot.first)


def _place(pose: Pose) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"
