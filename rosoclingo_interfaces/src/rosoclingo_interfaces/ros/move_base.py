"""The action go of a robot that drives: move_base takes it to the waypoint."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import Callable, Dict, NoReturn, Optional, Tuple, Union

import rospy

from rosclingo.ros import parameters
from rosclingo.ros.low_latency import publisher
from rosoclingo.loop.words import INFO
from rosoclingo.msg import ROSoClingoIn
from rosoclingo_interfaces.errors import CanceledError, DriveError, GoneError
from rosoclingo_interfaces.execution import ActionExecution
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way
from rosoclingo_interfaces.navigation.watch import DriveTimeLimit, DriveWatch
from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints, read_waypoints
from rosoclingo_interfaces.ros.move_base_client import Base
from rosoclingo_interfaces.ros.node import run
from rosoclingo_interfaces.ros.topics import topic

_POLL_SECONDS = 0.2  # of wall time: how often it is seen whether a server is there again


class MoveBase(ActionInterface):
    """Drives to the waypoint of each go with move_base; leaves other actions to other nodes.

    See the package's README for the parameters.
    """

    leaves_unknown = True
    messages = (INFO,)

    def __init__(self) -> None:
        self._waypoints = read_waypoints(Path(parameters.text("waypoints")))
        self._max_stray = parameters.number("max_stray", 3.0)
        self._limit = _time_limit()
        self._last = _start(self._waypoints)  # the waypoint where the robot was last
        self._in = publisher(topic("in"), ROSoClingoIn)
        self._base = Base()
        # Ways that only the server's absence has closed: whether the answer is sent, and whether
        # the server is still gone.
        self._blamed: Dict[Tuple[str, str], Tuple[threading.Event, Callable[[], bool]]] = {}
        self._lock = threading.Lock()  # guards the blamed ways

    def go(self, waypoint: Union[int, str]) -> bool:
        """Drives to a waypoint."""
        name = str(waypoint)
        place = self._waypoints.find(name)
        execution = self.execution
        try:
            limit = self._limit
            patience = self.timeout if limit is None else limit.seconds(self._guess(place))
            self._base.wait(patience, execution.canceled)
            watch = self._watch(name, place, execution)
            self._base.drive(self._waypoints.frame, place, watch, execution.canceled)
        except (CanceledError, DriveError) as err:
            if isinstance(err, GoneError) or not self._base.connected:
                self._remember(name, execution)
            # What blocked the way may be gone when the robot comes here again.
            self._base.clear_costmaps()
            raise
        self._last = name
        return True

    def _guess(self, place: Waypoint) -> float:
        """Returns how long a drive is at most if the robot is at a waypoint, in metres."""
        places = self._waypoints.places
        begins = places.values() if self._last is None else [places[self._last]]
        return max(math.dist(_point(begin), _point(place)) for begin in begins)

    def _watch(self, name: str, place: Waypoint, execution: ActionExecution) -> DriveWatch:
        """Returns the watchdog of a drive to a waypoint."""
        last = None if self._last is None else _point(self._waypoints.places[self._last])
        return DriveWatch(
            name,
            lambda begin: Way(begin, _point(place), last),
            self._guess(place),
            max_stray=self._max_stray,
            limit=self._limit,
            clock=lambda: execution.seconds,
        )

    def _remember(self, name: str, execution: ActionExecution) -> None:
        """Announces that a way is not blocked as soon as the server is there again.

        A planner takes the failure of a drive for a way that is blocked.
        """
        if self._last is None or self._last == name:
            return
        with self._lock:
            self._blamed[self._last, name] = (execution.ended, self._base.absence())
            if len(self._blamed) == 1:
                threading.Thread(target=self._announce, name="blamed ways", daemon=True).start()

    def _announce(self) -> None:
        """Announces all blamed ways at once, so that nobody plans as if only some were free."""
        pause = threading.Event()
        while not pause.wait(_POLL_SECONDS):
            with self._lock:
                blamed = self._blamed.values()
                # The answers come first.
                if all(ended.is_set() and not gone() for ended, gone in blamed):
                    ways = list(self._blamed)
                    self._blamed.clear()
                    break
        for last, name in ways:
            self._in.publish(INFO, f"unblocked({last},{name})")
        for last, name in ways:
            rospy.loginfo("%s is there again: %s to %s is not blocked", self._base.name, last, name)


def _point(waypoint: Waypoint) -> PathPoint:
    return waypoint.x, waypoint.y


def _time_limit() -> Optional[DriveTimeLimit]:
    """Returns how long drives may take by their lengths; None if ~timeout says it for all."""
    base, speed = parameters.number("timeout_base", 30.0), parameters.number("slowest_speed", 0.2)
    if speed == 0:
        raise parameters.wrong(
            "slowest_speed",
            "expected a number greater than 0, in m/s; for no time limit, set ~timeout to 0",
        )
    return DriveTimeLimit(base, speed) if rospy.get_param("~timeout", "") == "" else None


def _start(waypoints: Waypoints) -> Optional[str]:
    name = parameters.text("start", "")
    if name and name not in waypoints.places:
        raise parameters.wrong(
            "start",
            f"there is no waypoint {name} in {waypoints.file}; give the one where the robot is at "
            "first, or an empty text",
        )
    return name or None


def main() -> NoReturn:
    """Runs the node."""
    run(MoveBase, "move_base_interface")
