"""What ends a drive: how far it strays, and how long it takes for its length."""

from __future__ import annotations

from typing import List, Optional

import pytest

from rosoclingo_interfaces.errors import DriveError
from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way
from rosoclingo_interfaces.navigation.watch import DriveTimeLimit, DriveWatch

LIMIT = DriveTimeLimit(base=30.0, speed=0.2)


class Drive:
    """A drive to (12, 0), of which nobody knows yet where it began."""

    def __init__(
        self,
        limit: Optional[DriveTimeLimit] = LIMIT,
        max_stray: float = 3.0,
        last: Optional[PathPoint] = None,
    ) -> None:
        self.now = 1000.0
        self.ways: List[PathPoint] = []
        self.watch = DriveWatch(
            "c3", self._way, 4.0, max_stray=max_stray, limit=limit, clock=lambda: self.now
        )
        self._last = last

    def _way(self, begin: PathPoint) -> Way:
        self.ways.append(begin)
        return Way(begin, (12.0, 0.0), self._last)

    def lasts(self, seconds: float) -> None:
        """Looks at the time when the drive has taken so long."""
        self.now = 1000.0 + seconds
        self.watch.check()


@pytest.mark.parametrize(("metres", "seconds"), [(0.0, 30.0), (1.0, 35.0), (12.0, 90.0)])
def test_the_limit_grows_with_the_length(metres: float, seconds: float) -> None:
    assert LIMIT.seconds(metres) == pytest.approx(seconds)


def test_a_drive_may_take_what_its_length_allows() -> None:
    drive = Drive()
    drive.watch.moved((0.0, 0.0))
    drive.watch.moved((3.0, 0.0))  # the length is that from the beginning
    assert drive.ways == [(0.0, 0.0)]
    drive.lasts(89.9)
    with pytest.raises(DriveError, match=r"the 12.0 m to c3 have taken more than 90 s: 30 s"):
        drive.lasts(90.1)


def test_before_the_robot_has_said_where_it_is() -> None:
    drive = Drive()
    drive.lasts(49.9)
    with pytest.raises(DriveError, match=r"the 4.0 m to c3 .* 0.2 m/s \(~slowest_speed\)"):
        drive.lasts(50.1)


def test_the_way_back_to_the_last_waypoint_counts() -> None:
    drive = Drive(last=(-4.0, 0.0))
    drive.watch.moved((0.0, 0.0))
    drive.lasts(30.0 + 19.9 / 0.2)
    with pytest.raises(DriveError, match=r"the 20.0 m"):
        drive.lasts(30.0 + 20.1 / 0.2)


def test_without_a_time_limit() -> None:
    drive = Drive(limit=None)
    drive.watch.moved((0.0, 0.0))
    drive.lasts(1e6)


def test_a_robot_that_strays() -> None:
    drive = Drive()
    drive.watch.moved((0.0, 0.0))
    drive.watch.moved((6.0, 2.9))
    with pytest.raises(DriveError, match=r"3.1 m off the way to c3, more than 3 m \(~max_stray\)"):
        drive.watch.moved((6.0, 3.1))


def test_a_robot_that_may_go_anywhere() -> None:
    drive = Drive(max_stray=0.0)
    drive.watch.moved((0.0, 0.0))
    drive.watch.moved((6.0, 50.0))
