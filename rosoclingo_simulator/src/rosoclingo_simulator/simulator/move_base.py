"""What move_base does with a goal: plans, drives, plans again, gives up."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.spatial import cKDTree

from rosoclingo_simulator.simulator.costmap import Costmap
from rosoclingo_simulator.simulator.follower import STOP, Command, Follower, Limits
from rosoclingo_simulator.simulator.laser import Scan
from rosoclingo_simulator.simulator.physics import Pose
from rosoclingo_simulator.simulator.planner import CLEARANCE, Planner

_PLAN_SECONDS = 1.0  # between two plans, unless something is in the way
_PROGRESS_METRES = 0.2  # moving less is no progress


class End(enum.Enum):
    """How a goal ended."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    PREEMPTED = "preempted"


@dataclass(frozen=True)
class Outcome:
    """The end of a goal.

    Attributes:
        end: How it ended.
        text: Why, for a person.
    """

    end: End
    text: str


@dataclass
class MoveBase:
    """Drives the robot to a goal. One thread uses it.

    Attributes:
        planner: Finds the paths.
        costmap: What the laser has seen that is not on the map, and what to drive around.
        limits: How to drive.
        progress_timeout: After how many seconds without progress to give up.
        goal: Where to drive; None if there is none.
        outcome: How the last goal ended; None while there is one, or before the first.
    """

    planner: Planner
    costmap: Costmap
    limits: Limits
    progress_timeout: float
    goal: Optional[Pose] = None
    outcome: Optional[Outcome] = None
    _follower: Optional[Follower] = None
    _reached: Optional[Pose] = None  # the last place that counts as progress, and when
    _reached_at: float = 0.0
    _planned: float = 0.0
    _changes: int = -1  # of the costmap that the path knows

    @property
    def active(self) -> bool:
        """Whether there is a goal."""
        return self.goal is not None

    @property
    def path(self) -> Optional[np.ndarray]:
        """The points that the robot drives along, in metres; a new array for each plan."""
        return None if self._follower is None else self._follower.path

    def start(self, goal: Pose) -> None:
        """Begins to drive to a goal, in place of the one before."""
        self.goal = goal
        self._follower = None
        self.outcome = None
        self._reached = None

    def cancel(self, text: str = "canceled on request") -> None:
        """Ends the goal if there is one; the robot stops."""
        if self.goal is not None:
            self._finish(End.PREEMPTED, text)

    def update(self, pose: Pose, velocity: Command, scan: Scan, time: float) -> Command:
        """Returns what to do next; :attr:`outcome` tells if the goal has ended with that.

        Args:
            pose: Where the robot is.
            velocity: What its wheels do, in m/s and rad/s.
            scan: What the laser has measured last.
            time: What time it is, in seconds.
        """
        if self.goal is None:
            return STOP
        if self._must_plan(time) and not self._plan(self.goal, pose, time):
            return STOP
        assert self._follower is not None
        command = self._follower.command(pose, velocity, scan.points)
        if self._follower.arrived:
            self._finish(End.SUCCEEDED, "Goal reached.")
            return STOP
        if self._reached is None or pose.distance(self._reached) > _PROGRESS_METRES:
            self._reached, self._reached_at = pose, time
        elif time - self._reached_at >= self.progress_timeout:
            place = _place(self.goal)
            self._finish(End.ABORTED, f"no progress to {place} within {self.progress_timeout:g} s")
            return STOP
        return command

    def _must_plan(self, time: float) -> bool:
        if self._follower is None:
            return True
        if self._changes == self.costmap.changes:
            return False
        return time - self._planned >= _PLAN_SECONDS or self._blocked(self._follower.rest)

    def _blocked(self, path: np.ndarray) -> bool:
        """Whether something is in the way that the path does not know."""
        rows, columns = np.nonzero(self.costmap.marked)
        if not len(rows):
            return False
        marks = cKDTree(self.planner.grid.points(rows, columns))
        nearest, _ = marks.query(path, distance_upper_bound=CLEARANCE)
        return bool(np.isfinite(nearest).any())

    def _plan(self, goal: Pose, pose: Pose, time: float) -> bool:
        path = self.planner.plan(pose, goal, self.costmap.marked)
        if path is None:
            self._finish(End.ABORTED, f"no path to {_place(goal)} from {_place(pose)}")
            return False
        near = self._follower is not None and self._follower.near
        self._follower = Follower(self.limits, path, goal, near)
        self._planned = time
        self._changes = self.costmap.changes
        return True

    def _finish(self, end: End, text: str) -> None:
        self.goal = None
        self._follower = None
        self.outcome = Outcome(end, text)


def _place(pose: Pose) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f})"
