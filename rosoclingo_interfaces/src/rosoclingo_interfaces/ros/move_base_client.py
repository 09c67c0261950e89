"""A client of move_base."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import Callable, Deque

import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal
from std_srvs.srv import Empty

from rosoclingo_interfaces.errors import DriveError, GoneError
from rosoclingo_interfaces.navigation.cross_track import PathPoint
from rosoclingo_interfaces.navigation.watch import DriveWatch
from rosoclingo_interfaces.navigation.waypoints import Waypoint
from rosoclingo_interfaces.ros.limited_call import call_within
from rosoclingo_interfaces.ros.server_client import ServerClient

# All in wall time.
_POLL_SECONDS = 0.05  # how often a wait looks at its conditions
_SECONDS_TO_BE_FREE = 3.0  # for the server to say what it does, and to stop that
_SECONDS_TO_CLEAR = 0.5  # for the server to clear its costmaps

_UNDER_WAY = {
    GoalStatus.PENDING,
    GoalStatus.ACTIVE,
    GoalStatus.PREEMPTING,
    GoalStatus.RECALLING,
}


class Base:
    """Drives the robot with move_base. One thread at a time may use it.

    Make it after the node is initialised.
    """

    def __init__(self) -> None:
        """Opens the connections without waiting for the server."""
        self._server = ServerClient("move_base", MoveBaseAction, activity="the drive")
        self.name = self._server.name
        self._client = self._server.client
        self._clear = rospy.ServiceProxy(f"{self.name}/clear_costmaps", Empty)

    @property
    def connected(self) -> bool:
        """True if the server is connected to all topics of the action."""
        return self._server.connected

    def wait(self, seconds: float, canceled: threading.Event) -> None:
        """Waits for the server, and logs that every five seconds.

        Args:
            seconds: Longest time to wait; 0 for ever.
            canceled: Ends the wait.

        Raises:
            CanceledError: The wait was cancelled.
            GoneError: The server did not come.
        """
        begin = time.monotonic()

        def check() -> None:
            if 0 < seconds < time.monotonic() - begin:
                raise GoneError(f"{self.name} did not come within {round(seconds, 1):g} s")

        self._server.wait(check, canceled, "is the robot's navigation or a simulator running?")

    def drive(
        self, frame: str, waypoint: Waypoint, watch: DriveWatch, canceled: threading.Event
    ) -> None:
        """Drives to a waypoint, and stops the robot if it does not arrive.

        Args:
            frame: The waypoint's frame.
            waypoint: Where to drive.
            watch: Is told each position of the robot; what it raises ends the drive.
            canceled: Ends the drive.

        Raises:
            CanceledError: The drive was cancelled.
            GoneError: Server or clock went away during the drive; the message says which.
            DriveError: The robot did not arrive for another reason; the message says why.
        """
        positions: Deque[PathPoint] = deque()  # the newest on the right

        def on_feedback(feedback: MoveBaseFeedback) -> None:  # in a thread of rospy's
            position = feedback.base_position.pose.position
            positions.append((position.x, position.y))

        def check() -> None:
            while positions:
                watch.moved(positions.popleft())
            watch.check()

        goal = MoveBaseGoal(_pose(frame, waypoint))
        end = self._server.reach(goal, check, canceled, on_feedback)
        if end.state != GoalStatus.SUCCEEDED:
            text = end.text and f": {end.text}"
            raise DriveError(f"{self.name} ended the drive as {end.word}{text}")

    def stop(self, canceled: threading.Event) -> None:
        """Cancels the server's goals, such as those of a process that has died.

        Args:
            canceled: Ends the wait for that, which takes some seconds at most.
        """
        end = time.monotonic() + _SECONDS_TO_BE_FREE
        while self._client.last_status_msg is None and time.monotonic() < end:
            if canceled.wait(_POLL_SECONDS):
                return
        if self._is_busy():
            self._client.cancel_all_goals()
        while self._is_busy() and time.monotonic() < end and not canceled.wait(_POLL_SECONDS):
            pass

    def _is_busy(self) -> bool:
        statuses = self._client.last_status_msg
        return statuses is not None and any(
            one.status in _UNDER_WAY for one in statuses.status_list
        )

    def absence(self) -> Callable[[], bool]:
        """Returns a function that says whether the server has gone since now.

        It is there again when it has sent a status and the clock has gone on.
        """
        status, now = self._client.last_status_msg, rospy.get_rostime()

        def gone() -> bool:
            silent = self._client.last_status_msg is status
            return silent or rospy.get_rostime() == now or not self.connected

        return gone

    def clear_costmaps(self) -> None:
        """Clears the server's costmaps, if it offers that; waits for a short time."""
        fault = call_within(self._clear, _SECONDS_TO_CLEAR)
        if fault is not None:
            rospy.loginfo("the costmaps are not known to be cleared: %s", fault)


def _pose(frame: str, waypoint: Waypoint) -> PoseStamped:
    pose = PoseStamped()
    pose.header.frame_id = frame
    pose.header.stamp = rospy.Time.now()
    pose.pose.position.x = waypoint.x
    pose.pose.position.y = waypoint.y
    pose.pose.orientation.z = math.sin(waypoint.theta / 2)
    pose.pose.orientation.w = math.cos(waypoint.theta / 2)
    return pose
