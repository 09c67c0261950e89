"""Simulates a robot's battery."""

from __future__ import annotations

from dataclasses import dataclass, field

from rosoclingo_simulator.faults.kinds import BatteryModel
from rosoclingo_simulator.physics.physics import Pose, between

_ENOUGH = 0.05  # of the capacity; with less, a robot that has stopped does not drive again


@dataclass
class Battery:
    """The charge of a robot's battery. One thread uses it.

    Attributes:
        model: How it is drained and charged.
        level: How full it is, from 0 to 1.
        charging: Whether it is charged now.
        empty: Whether the robot has stopped, because there is no or not yet enough charge.
    """

    model: BatteryModel
    level: float = field(init=False)
    charging: bool = False
    empty: bool = False

    def __post_init__(self) -> None:
        self.level = self.model.level
        self.empty = self.level == 0

    def update(self, seconds: float, metres: float, pose: Pose) -> None:
        """Lets time pass.

        Args:
            seconds: How much.
            metres: How far the robot has driven meanwhile.
            pose: Where it is.
        """
        place = self.model.charging_place
        self.charging = place is not None and place.holds(pose)
        change = -self.model.per_second * seconds - self.model.per_metre * metres
        if self.charging:
            change = self.model.charging * seconds
        self.level = between(self.level + change, 0.0, 1.0)
        self.empty = self.level == 0 or (self.empty and self.level < _ENOUGH)
