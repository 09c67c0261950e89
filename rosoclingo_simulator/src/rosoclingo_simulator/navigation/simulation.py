"""Robot, laser and navigation, step by step. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable, Optional, Sequence

from rosoclingo_simulator.navigation.estimator import PoseEstimator
from rosoclingo_simulator.navigation.follower import STOP, VelocityCommand
from rosoclingo_simulator.navigation.move_base import MoveBaseDriver
from rosoclingo_simulator.navigation.right_of_way import AWARE_METRES, Neighbour
from rosoclingo_simulator.physics.laser import Scan, look
from rosoclingo_simulator.physics.physics import STEP_SECONDS, Physics, Pose, relative

SCAN_SECONDS = 0.2
"""From one scan to the next, in simulated time."""

_COMMAND_SECONDS = 0.5  # how long a command counts
_STILL_SECONDS = 1.0  # without moving, after which a robot stands still


@dataclass
class Simulation:
    """A robot that drives to goals, or as it is told. One thread uses it.

    Attributes:
        physics: Moves the robot.
        move_base: Drives it to goals; None for a robot that only does as it is told.
        begin: What the clock said at the start, in seconds; changes when the clock jumps.
        steps: How many there were.
        scan: What the laser has measured last; None before the first time.
        command: What the wheels are told in this step.
        is_watched: Tells whether scans have a subscriber, also while there is no goal.
        neighbours: The other robots around.
        estimator: Its localisation, which may be wrong; None if it knows where it is.
    """

    physics: Physics
    move_base: Optional[MoveBaseDriver] = None
    begin: float = 0.0
    steps: int = 0
    scan: Optional[Scan] = None
    command: VelocityCommand = STOP
    is_watched: Callable[[], bool] = lambda: False
    neighbours: Sequence[Neighbour] = ()
    estimator: Optional[PoseEstimator] = None
    _start: Pose = field(init=False)
    _told: VelocityCommand = STOP
    _told_until: float = 0.0
    _moved: float = 0.0

    def __post_init__(self) -> None:
        self._start = self.physics.pose

    @property
    def estimate(self) -> Pose:
        """Where the robot takes itself to be, by which it drives."""
        return self.physics.pose if self.estimator is None else self.estimator.pose

    @property
    def odometry(self) -> Pose:
        """The pose by wheel odometry, relative to the first pose."""
        if self.estimator is None:
            return relative(self._start, self.physics.pose)
        return self.estimator.physics.odometry

    @property
    def true_velocity(self) -> VelocityCommand:
        """How it really moves, in m/s and rad/s; its wheels may slip."""
        physics = self.physics if self.estimator is None else self.estimator.physics.body
        return physics.velocity

    @property
    def time(self) -> float:
        """Simulated time since the start, in seconds; never jumps."""
        return self.steps * STEP_SECONDS

    @property
    def now(self) -> float:
        """The time of the simulated clock, in seconds."""
        return self.begin + self.time

    def drive(self, command: VelocityCommand) -> bool:
        """Drives as told, for half a second.

        Returns:
            Whether that is done; not while there is a goal.
        """
        if self.move_base is not None and self.move_base.active:
            return False
        self._told = command
        self._told_until = self.time + _COMMAND_SECONDS
        return True

    def step(self) -> None:
        """Lets one step of time pass."""
        pose, velocity = self.estimate, self.physics.velocity
        others, is_told = self.neighbours, self.time < self._told_until
        # Without a goal it makes room for others, unless a program drives it.
        may_make_room = not is_told and any(robot.path is not None for robot in others)
        if self.move_base is not None and (self.move_base.active or may_make_room):
            scan = self._look()
            self.command = self.move_base.update(pose, velocity, scan, self.time, others)
            self._told = STOP
        else:
            if self.is_watched():
                self._look()
            self.command = self._told if is_told else STOP
        self.physics.step(*self.command, STEP_SECONDS)
        if self.estimator is not None:
            self.estimator.update()
        self.steps += 1
        if self.physics.velocity[0]:
            self._moved = self.time

    def seen(self, first: bool) -> Neighbour:
        """Returns the robot as its neighbours see it.

        Args:
            first: Whether it has right of way.
        """
        path = None if self.move_base is None else self.move_base.ahead
        still = self.time - self._moved >= _STILL_SECONDS
        return Neighbour(self.estimate, self.physics.velocity, path, first, still)

    def _look(self) -> Scan:
        """Returns a scan that is recent enough."""
        if self.scan is None or self.time - self.scan.time > SCAN_SECONDS - STEP_SECONDS / 2:
            self.scan = look(self.physics, self.time, self.estimate)
            if self.move_base is not None:
                self.move_base.costmap.update(self.scan, [robot.pose for robot in self.neighbours])
        return self.scan


@dataclass
class Fleet:
    """Robots in one world that know of each other. One thread uses it.

    Who has a goal has right of way before who has none, and then who is named first.

    Attributes:
        robots: They are in the same world.
    """

    robots: Sequence[Simulation]

    def step(self) -> None:
        """Lets one step of time pass."""
        order = sorted(self.robots, key=_waits_for_goals)
        for place, robot in enumerate(order):
            here = robot.physics.pose
            robot.neighbours = [
                other.seen(rank < place)
                for rank, other in enumerate(order)
                if rank != place and here.distance(other.physics.pose) < AWARE_METRES
            ]
            robot.step()


def _waits_for_goals(robot: Simulation) -> bool:
    return robot.move_base is None or robot.move_base.goal is None
