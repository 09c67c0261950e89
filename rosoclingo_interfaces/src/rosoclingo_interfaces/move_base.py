"""The action go of a robot that drives: move_base takes it to the waypoint."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn, Optional, Union

from rosoclingo_interfaces import parameters
from rosoclingo_interfaces.base import Base
from rosoclingo_interfaces.errors import CanceledError, DriveError
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.node import run
from rosoclingo_interfaces.stray import Point, Way
from rosoclingo_interfaces.waypoints import read_waypoints


class MoveBase(ActionInterface):
    """Drives to the waypoint of each go with move_base; leaves other actions to other nodes.

    See the package's README for the parameters.
    """

    leaves_unknown = True
    timeout = 60.0

    def __init__(self) -> None:
        self._waypoints = read_waypoints(Path(parameters.text("waypoints")))
        self._max_stray = parameters.number("max_stray", 0.0)
        self._base = Base()
        self._last: Optional[Point] = None  # the waypoint where the robot was last

    def go(self, waypoint: Union[int, str]) -> bool:
        """Drives to a waypoint."""
        name = str(waypoint)
        place = self._waypoints.find(name)
        end = (place.x, place.y)
        way: Optional[Way] = None

        def moved(position: Point) -> None:
            nonlocal way
            if way is None:
                way = Way(position, end, self._last)
            stray = way.distance(position)
            if 0 < self._max_stray < stray:
                raise DriveError(
                    f"the robot is {stray:.1f} m off the way to {name}, more than "
                    f"{self._max_stray:g} m (~max_stray): the way is blocked"
                )

        canceled = self.execution.canceled
        try:
            self._base.wait(self.timeout, canceled)
            self._base.drive(self._waypoints.frame, place, moved, canceled)
        except (CanceledError, DriveError):
            # What blocked the way may be gone when the robot comes here again.
            self._base.clear_costmaps()
            raise
        self._last = end
        return True


def main() -> NoReturn:
    """Runs the node."""
    run(MoveBase, "move_base_interface")
