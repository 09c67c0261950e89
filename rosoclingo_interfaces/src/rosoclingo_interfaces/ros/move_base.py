"""The actions go and look of a robot that drives with move_base."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from functools import partial
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Callable,
    Dict,
    Mapping,
    NoReturn,
    Optional,
    Sequence,
    Tuple,
    Union,
)

import clingo
import rospy

from rosclingo.ros import parameters
from rosclingo.ros.low_latency import publisher
from rosoclingo.loop.words import INFO
from rosoclingo.msg import ROSoClingoIn
from rosoclingo_interfaces.announcements import has_come
from rosoclingo_interfaces.errors import CanceledError, DriveError, GoneError
from rosoclingo_interfaces.execution import ActionExecution
from rosoclingo_interfaces.interface import AGAIN, ActionInterface
from rosoclingo_interfaces.navigation.cross_track import PathPoint, Way
from rosoclingo_interfaces.navigation.return_place import choose, to_point
from rosoclingo_interfaces.navigation.watch import DriveTimeLimit, DriveWatch
from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints, read_waypoints
from rosoclingo_interfaces.ros.journal import JournalReader
from rosoclingo_interfaces.ros.move_base_client import Base
from rosoclingo_interfaces.ros.node import run
from rosoclingo_interfaces.ros.topics import topic

if TYPE_CHECKING:
    from rosoclingo_interfaces.ros.lookout import Lookout

# Both in wall time.
_POLL_SECONDS = 0.2  # how often it is seen whether a server is there again
_SECONDS_TO_HEAR = 2.0  # for rosoclingo to confirm an announcement
_THERE_METRES = 0.5  # so near to a waypoint, it is there
_ON_WAY_METRES = 0.75  # so near to a straight way, its laser sees along it


class MoveBase(ActionInterface):
    """Drives to the waypoint of each go with move_base, and looks around at each look.

    Leaves other actions to other nodes, and ``look`` too, unless ``~look`` is set. See the
    package's README for the parameters.
    """

    leaves_unknown = True
    messages = (INFO,)
    after_crash: Mapping[str, str] = {"look": AGAIN}

    def __init__(self) -> None:
        self._waypoints = read_waypoints(Path(parameters.text("waypoints")))
        self._max_stray = parameters.number("max_stray", 3.0)
        self._limit = _time_limit()
        self._last = _start(self._waypoints)  # the waypoint where the robot was last
        self._missed: Optional[str] = None  # the one where it should have come from there
        self._looks = parameters.flag("look", False)
        self._turn_speed = parameters.positive("turn_speed", 0.8)
        self._in = publisher(topic("in"), ROSoClingoIn)
        self._base = Base()
        # Ways that only the server's absence has closed: whether the answer is sent, and whether
        # the server is still gone.
        self._blamed: Dict[Tuple[str, str], Tuple[threading.Event, Callable[[], bool]]] = {}
        self._lock = threading.Lock()  # guards the blamed ways

    def go(self, waypoint: Union[int, str]) -> bool:
        """Drives to a waypoint."""
        name, execution = str(waypoint), self.execution
        try:
            self._drive(name, execution, max_stray=self._max_stray)
        except (CanceledError, DriveError, GoneError) as err:
            if isinstance(err, GoneError) or not self._base.connected:
                self._remember(name, execution)
            # What blocked the way may be gone when the robot comes here again.
            self._base.clear_costmaps()
            if not isinstance(err, CanceledError):
                self._missed = name
            raise
        self._last, self._missed = name, None
        return True

    def look(self) -> bool:
        """Localises the robot, goes to a waypoint, and announces that it is there.

        If a drive has failed before, and the robot was not carried elsewhere meanwhile, it goes
        back to where that began, and announces whether the way is closed.
        """
        # SciPy takes a while to load, and most robots never look.
        from rosoclingo_interfaces.ros.lookout import Lookout  # noqa: PLC0415

        execution, places = self.execution, self._waypoints.places
        with contextlib.ExitStack() as stack:
            lookout = stack.enter_context(Lookout(self._waypoints.frame, self._turn_speed))
            journal = stack.enter_context(contextlib.closing(JournalReader()))
            self._base.wait(self._patience(0.0), execution.canceled)
            self._base.stop(execution.canceled)
            believed = lookout.wait_for_estimate(execution)
            here = lookout.find_itself(execution)
            self._base.clear_costmaps()  # they were filled for a wrong pose
            name, missed = choose(places, believed, here, self._last, self._missed)
            if name != self._last:
                self._last = self._missed = None
            is_closed = self._is_closed(lookout, here, missed, execution)
            if math.dist(here, to_point(places[name])) > _THERE_METRES:
                self._drive(name, execution, max_stray=0.0)  # which is no way of a planner's
                if is_closed is None:
                    is_closed = self._is_closed(lookout, to_point(places[name]), missed, execution)
            seen = [f"at({execution.actuator},{name})"]
            if is_closed is not None:
                seen.append(f"{'' if is_closed else 'un'}blocked({name},{missed})")
            self._tell(seen, journal, execution)
            self._last, self._missed = name, None
        return True

    def knows(self, action: clingo.Symbol) -> bool:
        """Returns whether this interface does an action."""
        is_look = action.match("look", 0)
        return super().knows(action) and (self._looks or not is_look)

    def _tell(
        self, seen: Sequence[str], journal: JournalReader, execution: ActionExecution
    ) -> None:
        """Announces what it has seen, and waits until rosoclingo has it: the answer comes later.

        Answers and announcements are on two topics, between which there is no order.

        Raises:
            CanceledError: The action is to stop.
        """
        wait_for = partial(_wait_for, execution)
        has_journal = journal.begin(wait_for)
        for value in seen:
            self._in.publish(INFO, value)
        if has_journal:
            wait_for(lambda: has_come(journal.events(), seen[-1]), _SECONDS_TO_HEAR)

    def _is_closed(
        self, lookout: Lookout, here: PathPoint, missed: Optional[str], execution: ActionExecution
    ) -> Optional[bool]:
        """Returns whether the way of a failed drive is closed; None if that is not seen."""
        if missed is None or self._last is None:
            return None
        places = self._waypoints.places
        end = to_point(places[missed])
        off_way = Way(to_point(places[self._last]), end).distance(here)
        if off_way > _ON_WAY_METRES or math.dist(here, end) < _THERE_METRES:
            return None
        return lookout.is_closed(here, end, execution)

    def _drive(self, name: str, execution: ActionExecution, *, max_stray: float) -> None:
        """Drives the robot to a waypoint, once there is a server."""
        place = self._waypoints.find(name)
        self._base.wait(self._patience(self._guess(place)), execution.canceled)
        watch = self._watch(name, place, execution, max_stray)
        self._base.drive(self._waypoints.frame, place, watch, execution.canceled)

    def _patience(self, metres: float) -> float:
        """Returns how long to wait for the server of a drive, in seconds; 0 for ever."""
        return self.timeout if self._limit is None else self._limit.seconds(metres)

    def _guess(self, place: Waypoint) -> float:
        """Returns an upper bound of a drive's length, in metres, if the robot is at a waypoint."""
        places = self._waypoints.places
        begins = places.values() if self._last is None else [places[self._last]]
        return max(math.dist(to_point(begin), to_point(place)) for begin in begins)

    def _watch(
        self, name: str, place: Waypoint, execution: ActionExecution, max_stray: float
    ) -> DriveWatch:
        """Returns the watchdog of a drive to a waypoint."""
        last = None if self._last is None else to_point(self._waypoints.places[self._last])
        return DriveWatch(
            name,
            lambda begin: Way(begin, to_point(place), last),
            self._guess(place),
            max_stray=max_stray,
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
        """Announces all blamed ways at once, so that no plan sees only some of them free."""
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


def _wait_for(execution: ActionExecution, holds: Callable[[], bool], seconds: float) -> bool:
    """Waits for a condition, at most for some seconds of wall time.

    Raises:
        CanceledError: The action is to stop.
    """
    end = time.monotonic() + seconds
    execution.sleep(0)
    while not holds():
        if time.monotonic() > end:
            return False
        execution.canceled.wait(_POLL_SECONDS)
        execution.sleep(0)
    return True


def _time_limit() -> Optional[DriveTimeLimit]:
    """Returns the time limits of drives by their lengths; None if ~timeout holds for all."""
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
