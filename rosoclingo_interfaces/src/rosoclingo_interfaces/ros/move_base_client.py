"""A client of move_base that neither a dead server nor a stopped clock blocks."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import Callable, Deque

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal
from std_srvs.srv import Empty

from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.reminder import Reminder
from rosoclingo_interfaces.errors import CanceledError, DriveError, GoneError
from rosoclingo_interfaces.navigation.cross_track import PathPoint
from rosoclingo_interfaces.navigation.watch import DriveWatch
from rosoclingo_interfaces.navigation.waypoints import Waypoint
from rosoclingo_interfaces.ros.clock import reason as clock_stands_still
from rosoclingo_interfaces.ros.limited_call import call_within
from rosoclingo_interfaces.watchdog import SILENCE_SECONDS, Watchdog

# All in wall time.
_POLL_SECONDS = 0.05  # how often a wait looks at its conditions
_SECONDS_TO_STOP = 0.5  # for the server to confirm that the robot stops
_SECONDS_TO_BE_FREE = 3.0  # for the server to say what it does, and to stop that
_SECONDS_TO_CLEAR = 0.5  # for the server to clear its costmaps

_UNDER_WAY = {
    GoalStatus.PENDING,
    GoalStatus.ACTIVE,
    GoalStatus.PREEMPTING,
    GoalStatus.RECALLING,
}

# What move_base says of a goal when it is told to end, by Ctrl-C or rosnode kill.
_NODE_ENDS = "because the node has been killed"


class Base:
    """Drives the robot with move_base. One thread at a time may use it.

    Make it after the node is initialised.
    """

    def __init__(self) -> None:
        """Opens the connections without waiting for the server."""
        self.name: str = rospy.resolve_name("move_base")
        self._client = LowLatencyActionClient("move_base", MoveBaseAction)
        self._clear = rospy.ServiceProxy(f"{self.name}/clear_costmaps", Empty)

    @property
    def connected(self) -> bool:
        """True if the server is connected to all topics of the action."""
        client = self._client
        topics = (
            client.pub_goal, client.pub_cancel,
            client.status_sub, client.result_sub, client.feedback_sub,
        )  # fmt: skip
        return all(topic.get_num_connections() for topic in topics)

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
        reminder = Reminder()
        while not self.connected:
            if 0 < seconds < time.monotonic() - begin:
                raise GoneError(f"{self.name} did not come within {round(seconds, 1):g} s")
            if reminder.due():
                rospy.loginfo(
                    "waiting for the action %s; is the robot's navigation or a simulator running?",
                    self.name,
                )
            if canceled.wait(_POLL_SECONDS):
                raise CanceledError("cancelled before the drive began")

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
        ended = threading.Event()
        positions: Deque[PathPoint] = deque()  # the newest on the right

        # Both are called in rospy's threads.
        def on_transition(goal: ClientGoalHandle) -> None:
            if goal.get_comm_state() == CommState.DONE:
                ended.set()

        def on_feedback(_: ClientGoalHandle, feedback: MoveBaseFeedback) -> None:
            position = feedback.base_position.pose.position
            positions.append((position.x, position.y))

        message = MoveBaseGoal(_pose(frame, waypoint))
        goal = self._client.send_goal(message, on_transition, on_feedback)
        statuses = Watchdog(lambda: self._client.last_status_msg)
        clock = Watchdog(rospy.get_rostime)
        try:
            while not ended.wait(_POLL_SECONDS):
                if canceled.is_set():
                    raise CanceledError("cancelled during the drive")
                while positions:
                    watch.moved(positions.popleft())
                watch.check()
                self._check(statuses, clock)
        finally:
            if not ended.is_set():
                goal.cancel()
                ended.wait(_SECONDS_TO_STOP)
        status = goal.get_terminal_state()
        if status != GoalStatus.SUCCEEDED:
            word = GoalStatus.to_string(status)
            text = goal.get_goal_status_text()
            # LOST is what the client makes of a server that does not know the goal any more.
            has_gone = status == GoalStatus.LOST or text.endswith(_NODE_ENDS)
            kind = GoneError if has_gone else DriveError
            raise kind(f"{self.name} ended the drive as {word}" + (text and f": {text}"))

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

    def _check(self, statuses: Watchdog, clock: Watchdog) -> None:
        if not self.connected:
            raise GoneError(f"{self.name} went away during the drive")
        if clock.still() > SILENCE_SECONDS:
            why = clock_stands_still()
            raise GoneError(f"the clock has stood still for {SILENCE_SECONDS:g} s: {why}")
        if statuses.still() > SILENCE_SECONDS:
            raise GoneError(f"{self.name} has sent no status for {SILENCE_SECONDS:g} s")


def _pose(frame: str, waypoint: Waypoint) -> PoseStamped:
    pose = PoseStamped()
    pose.header.frame_id = frame
    pose.header.stamp = rospy.Time.now()
    pose.pose.position.x = waypoint.x
    pose.pose.position.y = waypoint.y
    pose.pose.orientation.z = math.sin(waypoint.theta / 2)
    pose.pose.orientation.w = math.cos(waypoint.theta / 2)
    return pose
