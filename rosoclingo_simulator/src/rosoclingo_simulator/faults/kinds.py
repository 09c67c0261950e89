"""The faults of a file, as values. Lengths are in metres, angles in radians, times in seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple, Union

from rosoclingo_simulator.physics.faulty import Disturbance
from rosoclingo_simulator.physics.obstacles import PassageEnd
from rosoclingo_simulator.physics.physics import Pose


@dataclass(frozen=True)
class AtTime:
    """Trigger: simulated time since the start."""

    seconds: float


@dataclass(frozen=True)
class AtPlace:
    """Trigger: the robot is within a radius of a place."""

    place: Pose
    within: float

    def holds(self, pose: Pose) -> bool:
        """Returns whether a robot at a pose is there."""
        return pose.distance(self.place) <= self.within


@dataclass(frozen=True)
class ByChance:
    """Trigger: a probability.

    Attributes:
        probability: That it begins within one unit of ``per``.
        per_metre: Whether the unit is a metre that the robot drives; else a second.
    """

    probability: float
    per_metre: bool


FaultTrigger = Union[AtTime, AtPlace, ByChance]


@dataclass(frozen=True)
class WrongPose:
    """The robot is not where its localisation takes it to be.

    Attributes:
        by: How far the estimate jumps along the axes of the map, and turns; None if it stays.
        carried_to: Where the robot is carried; None if it stays.
        lost: Whether the localisation knows that it is wrong.
    """

    by: Optional[Pose]
    carried_to: Optional[Pose]
    lost: bool


@dataclass(frozen=True)
class ClosedDoor:
    """A box stands between two places, where the way is narrowest.

    Attributes:
        ends: The places.
    """

    ends: Tuple[PassageEnd, PassageEnd]


@dataclass(frozen=True)
class BatteryModel:
    """A battery that runs down; the robot stops when it is empty.

    Attributes:
        capacity: In Ah.
        level: How full it is at first, as a part of the capacity, like what follows.
        per_second: What is drained in a second.
        per_metre: What is drained in a metre.
        charging_place: Where it is charged; None for nowhere.
        charging: What is charged in a second.
    """

    capacity: float
    level: float
    per_second: float
    per_metre: float
    charging_place: Optional[AtPlace]
    charging: float


FaultEffect = Union[Disturbance, WrongPose, ClosedDoor, BatteryModel]


@dataclass(frozen=True)
class Fault:
    """An entry of a file of faults.

    Attributes:
        number: The first one has 1.
        kind: Its name in the file, such as ``slip``.
        where: The place in the file, for messages.
        robot: The robot that has it; None for each of them.
        trigger: When it begins; None for a battery, which begins to matter when it is empty.
        times: How often it begins at most.
        lasts: When it ends, after its begin; None for never.
        effect: What it does.
    """

    number: int
    kind: str
    where: str
    robot: Optional[str]
    trigger: Optional[FaultTrigger]
    times: int
    lasts: Optional[float]
    effect: FaultEffect


@dataclass(frozen=True)
class FaultPlan:
    """The content of a file of faults.

    Attributes:
        seed: Of all that is random.
        faults: In the order of the file.
    """

    seed: int
    faults: Tuple[Fault, ...]
