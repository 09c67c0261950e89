"""The trace of a drive: the robot's path, and events on it. Needs no ROS."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field
from typing import List, Optional, Tuple

TracePoint = Tuple[float, float]

JUMP_METRES = 1.0
"""A robot that is so far from where it was a moment ago has not driven there."""


class DriveEventKind(enum.Enum):
    """The kinds of events of a drive."""

    OBSTACLE = "obstacle"
    REQUEST = "request"
    PICKUP = "pickup"
    DELIVERY = "delivery"
    FAILURE = "failure"
    KILL = "kill"
    CARRIED = "carried"
    SIGHT = "sight"


@dataclass(frozen=True)
class DriveEvent:
    """An event of a drive.

    Attributes:
        kind: What it was.
        text: More about it.
        place: Where it was, in metres.
        seconds: When, in seconds of simulated time since the beginning.
    """

    kind: DriveEventKind
    text: str
    place: TracePoint
    seconds: float


@dataclass
class DriveTrace:
    """The trace of a drive. One thread adds to it.

    Attributes:
        path: Where the robot's centre was, in metres.
        times: When it was there, in seconds of simulated time.
        events: What happened, in order.
    """

    path: List[TracePoint] = field(default_factory=list)
    times: List[float] = field(default_factory=list)
    events: List[DriveEvent] = field(default_factory=list)

    def move(self, seconds: float, place: TracePoint) -> None:
        """The robot is at a place."""
        self.times.append(seconds)
        self.path.append(place)

    def happen(self, kind: DriveEventKind, text: str, place: Optional[TracePoint] = None) -> None:
        """Something happens at a place, or where the robot is now, as soon as that is known."""
        if self.path:
            self.events.append(DriveEvent(kind, text, place or self.path[-1], self.seconds))

    @property
    def seconds(self) -> float:
        """The duration of the drive, in seconds of simulated time."""
        return self.times[-1] - self.times[0] if self.times else 0.0

    @property
    def metres(self) -> float:
        """The distance driven, in metres."""
        return sum(step for step in map(math.dist, self.path, self.path[1:]) if _is_driven(step))

    @property
    def drives(self) -> List[slice]:
        """The parts of the path on which it has driven, between which it was carried."""
        steps = enumerate(map(math.dist, self.path, self.path[1:]), 1)
        cuts = [0, *(index for index, step in steps if not _is_driven(step)), len(self.path)]
        return [slice(*both) for both in zip(cuts, cuts[1:])]

    def distance(self, place: TracePoint) -> float:
        """Returns how far from a place the robot is now, in metres."""
        return math.dist(self.path[-1], place) if self.path else math.inf


def _is_driven(metres: float) -> bool:
    return metres <= JUMP_METRES
