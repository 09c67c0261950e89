"""Watchdog that ends a drive that leaves its way or takes too long. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

from rosoclingo_interfaces.errors import DriveError
from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way


@dataclass(frozen=True)
class DriveTimeLimit:
    """The time limit of a drive, by its length.

    Attributes:
        base: For a drive of no length, in seconds.
        speed: How fast the robot is at least, on average, in m/s.
    """

    base: float
    speed: float

    def seconds(self, metres: float) -> float:
        """Returns the time limit of a drive with some length, in seconds."""
        return self.base + metres / self.speed


@dataclass
class DriveWatch:
    """Watches one drive, from now on. One thread uses it.

    Attributes:
        name: Of the waypoint.
        way: Returns the way there from where the robot is at the beginning.
        metres: How long the drive is; a guess, as long as it is not known where it began.
        max_stray: How far the robot may be off its way, in metres; 0 for no limit.
        limit: How long the drive may take; None for no limit.
        clock: The time in seconds.
    """

    name: str
    way: Callable[[PathPoint], Way]
    metres: float
    max_stray: float
    limit: Optional[DriveTimeLimit]
    clock: Callable[[], float]

    def __post_init__(self) -> None:
        self._way: Optional[Way] = None
        self._begin = self.clock()

    def moved(self, position: PathPoint) -> None:
        """Checks the cross-track error at a position.

        Raises:
            DriveError: It is too far off its way.
        """
        if self._way is None:
            self._way = self.way(position)
            self.metres = self._way.length
        cross_track = self._way.distance(position)
        if 0 < self.max_stray < cross_track:
            raise DriveError(
                f"the robot is {cross_track:.1f} m off the way to {self.name}, more than "
                f"{self.max_stray:g} m (~max_stray): the way is blocked"
            )

    def check(self) -> None:
        """Checks the time limit.

        Raises:
            DriveError: The drive has taken too long.
        """
        if self.limit is None:
            return
        seconds = self.limit.seconds(self.metres)
        if self.clock() - self._begin > seconds:
            raise DriveError(
                f"the {self.metres:.1f} m to {self.name} have taken more than {seconds:.0f} s: "
                f"{self.limit.base:g} s (~timeout_base) and the way at {self.limit.speed:g} m/s "
                "(~slowest_speed)"
            )
