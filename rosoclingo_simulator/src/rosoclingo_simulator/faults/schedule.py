"""Fault schedule: when each fault of each robot is to begin, and when to end."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Mapping, Sequence, Tuple

from rosoclingo_simulator.errors import FaultError
from rosoclingo_simulator.faults.kinds import (
    AtPlace,
    AtTime,
    BatteryModel,
    ClosedDoor,
    Fault,
    FaultPlan,
    WrongPose,
)
from rosoclingo_simulator.physics.physics import Pose

_ROUNDING = 1e-6  # seconds, what times may be off
_RETRY_SECONDS = 1.0  # until a fault that could not begin is tried again


@dataclass(frozen=True)
class RobotCondition:
    """The state of a robot after a step, as far as faults depend on it.

    Attributes:
        pose: Where it really is.
        metres: How far it has driven in the step.
        lost: Whether its localisation is wrong.
        empty: Whether its battery is.
    """

    pose: Pose
    metres: float = 0.0
    lost: bool = False
    empty: bool = False


RobotConditions = Mapping[str, RobotCondition]
"""By the names of the robots."""


@dataclass
class FaultState:
    """A fault of a robot, or of the world, and when it was there.

    Attributes:
        fault: The entry of the file.
        robots: Those that can trigger it: the one that has it, or all if it is the world's.
        random: Its own random numbers.
        active: Whether it is there now.
        begun: When it began, in simulated seconds since the start.
        ended: When it ended, in simulated seconds since the start.
    """

    fault: Fault
    robots: Tuple[str, ...]
    random: random.Random
    active: bool = False
    begun: List[float] = field(default_factory=list)
    ended: List[float] = field(default_factory=list)
    _triggered: bool = False
    _not_before: float = 0.0
    _there: bool = False  # whether a robot was at the place in the last step

    def begin(self, time: float) -> None:
        """Begins: the effect is there."""
        self.active, self._triggered = True, False
        self.begun.append(time)

    def postpone(self, time: float) -> None:
        """Postpones the fault, because a robot is in the way."""
        self._not_before = time + _RETRY_SECONDS

    def end(self, time: float) -> None:
        """Ends the fault, and with it the effect."""
        self.active = False
        self.ended.append(time)

    def is_due(self, time: float, seconds: float, conditions: RobotConditions) -> bool:
        """Returns whether it is to begin after a step, and so until it has begun.

        Args:
            time: Since the start.
            seconds: Of the step.
            conditions: Of all robots.
        """
        robots = [conditions[name] for name in self.robots]
        there = self._there
        trigger = self.fault.trigger
        if isinstance(trigger, AtPlace):
            self._there = any(trigger.holds(robot.pose) for robot in robots)
        if self.active or len(self.begun) == self.fault.times:
            return False
        if self._triggered:
            return time >= self._not_before - _ROUNDING
        if trigger is None:
            self._triggered = any(robot.empty for robot in robots)
        elif isinstance(trigger, AtTime):
            self._triggered = time >= trigger.seconds - _ROUNDING
        elif isinstance(trigger, AtPlace):
            self._triggered = self._there and not there
        else:
            passed = sum(robot.metres for robot in robots) if trigger.per_metre else seconds
            part = 1 - (1 - trigger.probability) ** passed if passed else 0.0
            self._triggered = self.random.random() < part
        return self._triggered

    def is_over(self, time: float, conditions: RobotConditions) -> bool:
        """Returns whether it is to end after a step."""
        if not self.active:
            return False
        fault, robots = self.fault, [conditions[name] for name in self.robots]
        if fault.lasts is not None and time >= self.begun[-1] + fault.lasts - _ROUNDING:
            return True
        if isinstance(fault.effect, WrongPose):
            return not any(robot.lost for robot in robots)
        if isinstance(fault.effect, BatteryModel):
            return not any(robot.empty for robot in robots)
        return False


def fault_states(plan: FaultPlan, robots: Sequence[str]) -> List[FaultState]:
    """Returns a state for each fault of each robot, in the order of the file.

    Each has its own random numbers: another entry in the file does not change them.

    Args:
        plan: The faults.
        robots: Their names; the only one's may be empty.

    Raises:
        FaultError: A fault is that of a robot that does not exist.
    """
    states: List[FaultState] = []
    for fault in plan.faults:
        if fault.robot is not None and fault.robot not in robots:
            known = ", ".join(name for name in robots if name)
            raise FaultError(
                f"{fault.where}: robot: there is no robot {fault.robot!r}; "
                + (f"there are {known} (~fleet)" if known else "leave it out, as there is one")
            )
        names = tuple(robots) if fault.robot is None else (fault.robot,)
        of_world = isinstance(fault.effect, ClosedDoor)
        for group in [names] if of_world else [(name,) for name in names]:
            seed = f"{plan.seed} {fault.number} {' '.join(group)}"
            # No secret depends on them.
            states.append(FaultState(fault, group, random.Random(seed)))  # noqa: S311
    return states


def report_faults(states: Iterable[FaultState]) -> List[Dict[str, object]]:
    """Returns all faults that have begun, with their times, for others to read."""
    return [
        {
            "fault": one.fault.kind,
            "number": one.fault.number,
            "robot": one.robots[0] if len(one.robots) == 1 else "",
            "active": one.active,
            "begun": [round(time, 3) for time in one.begun],
            "ended": [round(time, 3) for time in one.ended],
        }
        for one in states
        if one.begun
    ]
