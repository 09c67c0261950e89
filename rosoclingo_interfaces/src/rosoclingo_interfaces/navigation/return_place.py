"""Chooses the waypoint to return to after a look around. Needs no ROS.

>>> from rosoclingo_interfaces.navigation.waypoints import Waypoint
>>> places = {"a": Waypoint(0, 0, 0), "b": Waypoint(9, 0, 0), "c": Waypoint(9, 9, 0)}
>>> choose(places, believed=(4, 0), here=(4.1, 0), last="a", missed="b")
ReturnPlace(name='a', missed='b')
>>> choose(places, believed=(4, 0), here=(8, 7), last="a", missed="b")
ReturnPlace(name='c', missed=None)
"""

from __future__ import annotations

import math
from typing import Mapping, NamedTuple, Optional

from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way
from rosoclingo_interfaces.navigation.waypoints import Waypoint

CARRIED_METRES = 1.0
"""A robot that is found farther from where it was believed to be was carried."""

STRAY_METRES = 4.0
"""A robot that is farther from its last way has not come here by it: drives end before."""


class ReturnPlace(NamedTuple):
    """A waypoint to return to, and the one that was missed.

    Attributes:
        name: Of the waypoint.
        missed: The waypoint on the way to which the last drive from there has failed; None if no
            drive has, or if the robot was carried elsewhere.
    """

    name: str
    missed: Optional[str]


def choose(
    places: Mapping[str, Waypoint],
    believed: PathPoint,
    here: PathPoint,
    last: Optional[str],
    missed: Optional[str],
) -> ReturnPlace:
    """Returns the start of the last drive, or else the nearest waypoint.

    Args:
        places: The waypoints.
        believed: Where the robot was believed to be, in metres.
        here: Where it is.
        last: The waypoint where it was last, as far as the caller knows.
        missed: The waypoint on the way to which the last drive has failed.
    """
    if last is not None and math.dist(believed, here) <= CARRIED_METRES:
        begin = to_point(places[last])
        end = begin if missed is None else to_point(places[missed])
        if Way(begin, end).distance(here) <= STRAY_METRES:
            return ReturnPlace(last, None if missed == last else missed)
    return ReturnPlace(min(places, key=lambda name: math.dist(here, to_point(places[name]))), None)


def to_point(waypoint: Waypoint) -> PathPoint:
    """Returns a waypoint's position, in metres."""
    return waypoint.x, waypoint.y
