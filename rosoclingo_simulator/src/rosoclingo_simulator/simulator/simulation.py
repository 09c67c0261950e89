"""Robot, laser and navigation, step by step. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from rosoclingo_simulator.simulator.follower import STOP, Command
from rosoclingo_simulator.simulator.laser import Scan, look
from rosoclingo_simulator.simulator.move_base import MoveBase
from rosoclingo_simulator.simulator.physics import Physics

STEP_SECONDS = 0.05
"""How long a step is in simulated time."""

SCAN_SECONDS = 0.2
"""From one scan to the next, in simulated time."""

_COMMAND_SECONDS = 0.5  # how long a command counts


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
        watched: Whether somebody wants scans also while there is no goal.
    """

    physics: Physics
    move_base: Optional[MoveBase] = None
    begin: float = 0.0
    steps: int = 0
    scan: Optional[Scan] = None
    command: Command = STOP
    watched: bool = False
    _told: Command = STOP
    _told_until: float = 0.0

    @property
    def time(self) -> float:
        """Simulated time since the start, in seconds; never jumps."""
        return self.steps * STEP_SECONDS

    @property
    def now(self) -> float:
        """What the clock says, in seconds."""
        return self.begin + self.time

    def drive(self, command: Command) -> bool:
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
        if self.move_base is not None and self.move_base.active:
            scan = self._look()
            pose, velocity = self.physics.pose, self.physics.velocity
            self.command = self.move_base.update(pose, velocity, scan, self.time)
            self._told = STOP
        else:
            if self.watched:
                self._look()
            self.command = self._told if self.time < self._told_until else STOP
        self.physics.step(*self.command, STEP_SECONDS)
        self.steps += 1

    def _look(self) -> Scan:
        """Returns a scan that is recent enough."""
        if self.scan is None or self.time - self.scan.time > SCAN_SECONDS - STEP_SECONDS / 2:
            self.scan = look(self.physics, self.time)
            if self.move_base is not None:
                self.move_base.costmap.update(self.scan)
        return self.scan
