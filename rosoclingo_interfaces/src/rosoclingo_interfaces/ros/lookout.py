"""Perception of a robot that looks around: its pose on the map, and obstacles on its way."""

from __future__ import annotations

import contextlib
import math
import threading
from dataclasses import dataclass
from typing import Any, Optional

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_interfaces.errors import DriveError, ReadingError
from rosoclingo_interfaces.execution import ActionExecution
from rosoclingo_interfaces.navigation.cross_track import PathPoint
from rosoclingo_interfaces.observation.closed_way import ClosedWay
from rosoclingo_interfaces.observation.conditions import CovarianceCondition, Reading
from rosoclingo_interfaces.observation.fields import FieldPath
from rosoclingo_interfaces.observation.transforms import TransformTree, plain
from rosoclingo_interfaces.ros.clock import reason as clock_stands_still
from rosoclingo_interfaces.ros.limited_call import call_within
from rosoclingo_interfaces.watchdog import SILENCE_SECONDS, Watchdog

_POLL_SECONDS = 0.02  # of wall time: how often wheels are told, which forget it soon
_SECONDS_TO_SPREAD = 2.0  # of wall time, for the localisation to begin anew
_SECONDS_TO_SETTLE = 0.3  # of wall time, in which comes what was sent before
_NEAR_METRES = 1.0  # so near to the robot is its laser; else a transform is wrong
# All of the node's clock.
_SECONDS_FOR_A_POSE = 10.0  # until a localisation says where the robot is
_SECONDS_FOR_SCANS = 3.0  # in which a way is looked at
_SECONDS_TO_CALM = 0.5  # after which scans and transforms of a robot that has stopped agree
_TURNS = 2  # so many times around, and a localisation that is not sure by then will never be
_FACING = 0.15  # radians; it looks at something that is not farther aside
_STRIP_METRES, _ROBOT_METRES, _OCCUPIED_PERCENT = 1.0, 0.2, 65.0  # as observers have them
_SURE = CovarianceCondition(FieldPath.parse("pose.covariance"), above=0.25)
_UNKNOWN: Reading = "unknown"  # no waypoint's name is read of a way


@dataclass
class Lookout:
    """Looks around by localisation, laser and transforms, and turns the robot for that.

    It listens as long as it is entered as a context, since scans are much to listen to. One thread
    uses it.

    Attributes:
        frame: The frame of the map, such as ``map``.
        turn_speed: How fast the robot turns, in rad/s.
    """

    frame: str
    turn_speed: float

    def __post_init__(self) -> None:
        """Opens the connections."""
        self._lock = threading.Lock()  # guards the transforms
        self._transforms = TransformTree()
        self._clock = Watchdog(rospy.get_rostime)
        self._estimate: Optional[PoseWithCovarianceStamped] = None
        self._scan: Optional[LaserScan] = None
        self._spread = rospy.ServiceProxy("global_localization", Empty)
        self._wheels = publisher("cmd_vel", Twist)
        self._topics = [
            subscriber("amcl_pose", PoseWithCovarianceStamped, self._on_estimate),
            subscriber("scan", LaserScan, self._on_scan),
            subscriber("/tf", TFMessage, self._on_transforms),
            subscriber("/tf_static", TFMessage, self._on_transforms),
        ]

    def __enter__(self) -> Lookout:
        return self

    def __exit__(self, *_: object) -> None:
        for one in (*self._topics, self._wheels):
            one.unregister()

    def wait_for_estimate(self, execution: ActionExecution) -> PathPoint:
        """Returns the estimated pose's position, in metres.

        Raises:
            CanceledError: The action is to stop.
            DriveError: There is no localisation.
        """
        end = execution.seconds + _SECONDS_FOR_A_POSE
        while self._estimate is None:
            if execution.seconds > end:
                name = self._topics[0].resolved_name
                raise DriveError(f"nobody says on {name} where the robot is")
            self._pause(execution)
        return _position(self._estimate)

    def find_itself(self, execution: ActionExecution) -> PathPoint:
        """Localises the robot anew, wherever it may be: turns until the localisation is sure.

        Without the service ``global_localization``, what the localisation believes counts.

        Returns:
            Where the robot is, in metres.

        Raises:
            CanceledError: The action is to stop.
            DriveError: There is no localisation, or it does not become sure.
        """
        fault = call_within(self._spread, _SECONDS_TO_SPREAD)
        if fault is not None:
            rospy.loginfo("what the localisation says counts, as it cannot begin anew: %s", fault)
            return self.wait_for_estimate(execution)
        # What was said before is on its way. Stamps do not tell, as they are those of scans, and
        # localisations speak only of robots that move.
        execution.canceled.wait(_SECONDS_TO_SETTLE)
        self._estimate = None
        end = execution.seconds + _SECONDS_FOR_A_POSE + _TURNS * 2 * math.pi / self.turn_speed
        try:
            while execution.seconds < end:
                self._pause(execution)
                estimate = self._estimate
                if estimate is not None and self._is_sure(estimate):
                    return _position(estimate)
                self._turn(self.turn_speed)
        finally:
            self._turn(0.0)
        raise DriveError("the localisation is not sure where the robot is, though it has turned")

    def is_closed(
        self, here: PathPoint, goal: PathPoint, execution: ActionExecution
    ) -> Optional[bool]:
        """Returns whether the straight way from the robot to a place is closed, by its laser.

        Args:
            here: Where the robot is, in metres.
            goal: The place.
            execution: Of the action that looks.

        Returns:
            None if the laser does not see enough.

        Raises:
            CanceledError: The action is to stop.
        """
        if not self._face(here, goal, execution):
            return None
        execution.sleep(_SECONDS_TO_CALM)
        since, end = rospy.get_rostime(), execution.seconds + _SECONDS_FOR_SCANS
        seen = None
        while execution.seconds < end:
            self._pause(execution)
            scan = self._scan
            if scan is not None and scan is not seen and scan.header.stamp >= since:
                seen = scan
                reading = self._read(scan, here, goal)
                if reading != _UNKNOWN:
                    return reading is not None
        return None

    def _read(self, scan: LaserScan, here: PathPoint, goal: PathPoint) -> Reading:
        laser = self._laser(here)
        if laser is None:
            return _UNKNOWN
        begin = float(laser[0, 3]), float(laser[1, 3])
        with self._lock, contextlib.suppress(ReadingError):
            way = ClosedWay(
                begin,
                goal,
                self.frame,
                width=_STRIP_METRES,
                radius=_ROBOT_METRES,
                occupied=_OCCUPIED_PERCENT,
                transforms=self._transforms,
            )
            return way.read(scan, _UNKNOWN)
        return _UNKNOWN

    def _face(self, here: PathPoint, goal: PathPoint, execution: ActionExecution) -> bool:
        """Turns the laser to a place; returns whether it faces that."""
        end = execution.seconds + 2 * math.pi / self.turn_speed + _SECONDS_FOR_SCANS
        try:
            while execution.seconds < end:
                self._pause(execution)
                laser = self._laser(here)
                if laser is None:
                    continue
                bearing = math.atan2(goal[1] - laser[1, 3], goal[0] - laser[0, 3])
                heading = math.atan2(laser[1, 0], laser[0, 0])
                aside = math.remainder(bearing - heading, 2 * math.pi)
                if abs(aside) < _FACING:
                    return True
                self._turn(math.copysign(min(self.turn_speed, abs(aside)), aside))
        finally:
            self._turn(0.0)
        return False

    def _laser(self, here: PathPoint) -> Any:
        """Returns the transform of the laser to the map; None if none is known that makes sense."""
        if self._scan is None:
            return None
        with self._lock, contextlib.suppress(ReadingError):
            laser = self._transforms.find(self.frame, self._scan.header.frame_id)
            if math.dist(laser[:2, 3], here) <= _NEAR_METRES:
                return laser
        return None

    def _pause(self, execution: ActionExecution) -> None:
        """Waits a moment.

        Raises:
            CanceledError: The action is to stop.
            DriveError: The clock stands still, so that no time limit would end the wait.
        """
        execution.sleep(0)
        execution.canceled.wait(_POLL_SECONDS)
        if self._clock.still() > SILENCE_SECONDS:
            why = clock_stands_still()
            raise DriveError(f"the clock has stood still for {SILENCE_SECONDS:g} s: {why}")

    def _turn(self, speed: float) -> None:
        twist = Twist()
        twist.angular.z = speed
        self._wheels.publish(twist)

    def _is_sure(self, estimate: PoseWithCovarianceStamped) -> bool:
        try:
            return _SURE.read(estimate, None) is None
        except ReadingError:
            return False

    def _on_estimate(self, message: PoseWithCovarianceStamped) -> None:
        place = message.pose.pose.position
        if plain(message.header.frame_id) != plain(self.frame):
            rospy.logwarn_throttle(
                30.0, f"amcl_pose is not in the waypoints' frame {self.frame}: it does not count"
            )
        elif math.isfinite(place.x + place.y):
            self._estimate = message

    def _on_scan(self, message: LaserScan) -> None:
        self._scan = message

    def _on_transforms(self, message: TFMessage) -> None:
        for transform in message.transforms:
            with self._lock, contextlib.suppress(ReadingError):
                self._transforms.add(transform)


def _position(estimate: PoseWithCovarianceStamped) -> PathPoint:
    place = estimate.pose.pose.position
    return place.x, place.y
