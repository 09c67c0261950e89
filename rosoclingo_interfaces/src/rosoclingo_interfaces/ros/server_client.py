"""A client of an action server that neither a dead server nor a stopped clock blocks."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any, Callable

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus

from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.reminder import Reminder
from rosoclingo_interfaces.errors import CanceledError, GoneError
from rosoclingo_interfaces.ros.clock import reason as clock_stands_still
from rosoclingo_interfaces.watchdog import SILENCE_SECONDS, Watchdog

# All in wall time.
_POLL_SECONDS = 0.05  # how often a wait looks at its conditions
_SECONDS_TO_STOP = 0.5  # for the server to confirm that it stops

# What a server says of a goal when it is told to end, by Ctrl-C or rosnode kill.
_NODE_ENDS = "because the node has been killed"


@dataclass(frozen=True)
class GoalEnd:
    """The end of a goal.

    Attributes:
        state: The terminal state, a constant of ``actionlib_msgs/GoalStatus``.
        text: What the server says of it.
        result: The result's message; None if there is none.
    """

    state: int
    text: str
    result: Any

    @property
    def word(self) -> str:
        """The state's name, such as ``SUCCEEDED``."""
        return str(GoalStatus.to_string(self.state))


class ServerClient:
    """Has an action server reach goals. Several threads may use it, each for a goal of its own.

    Make it after the node is initialised.

    Attributes:
        name: The action's resolved name.
        client: The client of actionlib.
    """

    def __init__(self, name: str, spec: Any, *, activity: str = "the goal") -> None:
        """Opens the connections without waiting for the server.

        Args:
            name: Name of the action.
            spec: Its type, such as ``MoveBaseAction``.
            activity: What a goal is called in errors.
        """
        self.name: str = rospy.resolve_name(name)
        self.client = LowLatencyActionClient(name, spec)
        self._activity = activity

    @property
    def connected(self) -> bool:
        """True if the server is connected to all topics of the action."""
        client = self.client
        topics = (
            client.pub_goal, client.pub_cancel,
            client.status_sub, client.result_sub, client.feedback_sub,
        )  # fmt: skip
        return all(topic.get_num_connections() for topic in topics)

    def wait(self, check: Callable[[], None], canceled: threading.Event, hint: str) -> None:
        """Waits for the server, and logs that every five seconds.

        Args:
            check: Called now and then; raises an error if the wait takes too long.
            canceled: Ends the wait.
            hint: What may be missing, for the log.

        Raises:
            CanceledError: The wait was cancelled.
        """
        reminder = Reminder()
        while not self.connected:
            check()
            if reminder.due():
                rospy.loginfo("waiting for the action %s; %s", self.name, hint)
            if canceled.wait(_POLL_SECONDS):
                raise CanceledError(f"cancelled before {self._activity} began")

    def reach(
        self,
        goal: Any,
        check: Callable[[], None],
        canceled: threading.Event,
        on_feedback: Callable[[Any], None] = lambda _: None,
    ) -> GoalEnd:
        """Sends a goal and waits for its end; cancels it if the wait ends before.

        Args:
            goal: The goal's message.
            check: Called now and then; what it raises ends the wait.
            canceled: Ends the wait.
            on_feedback: Called with each feedback, in a thread of rospy's.

        Raises:
            CanceledError: The wait was cancelled.
            GoneError: Server or clock went away; the message says which.
        """
        ended = threading.Event()

        def on_transition(handle: ClientGoalHandle) -> None:  # in a thread of rospy's
            if handle.get_comm_state() == CommState.DONE:
                ended.set()

        statuses = Watchdog(lambda: self.client.last_status_msg)
        clock = Watchdog(rospy.get_rostime)
        handle = self.client.send_goal(
            goal, on_transition, lambda _, feedback: on_feedback(feedback)
        )
        try:
            while not ended.wait(_POLL_SECONDS):
                if canceled.is_set():
                    raise CanceledError(f"cancelled during {self._activity}")
                check()
                self._check_alive(statuses, clock)
        finally:
            if not ended.is_set():
                handle.cancel()
                ended.wait(_SECONDS_TO_STOP)
        end = GoalEnd(
            handle.get_terminal_state(), handle.get_goal_status_text(), handle.get_result()
        )
        # LOST is what the client makes of a server that does not know the goal any more.
        if end.state == GoalStatus.LOST or end.text.endswith(_NODE_ENDS):
            text = end.text and f": {end.text}"
            raise GoneError(f"{self.name} ended {self._activity} as {end.word}{text}")
        return end

    def _check_alive(self, statuses: Watchdog, clock: Watchdog) -> None:
        if not self.connected:
            raise GoneError(f"{self.name} went away during {self._activity}")
        if clock.still() > SILENCE_SECONDS:
            why = clock_stands_still()
            raise GoneError(f"the clock has stood still for {SILENCE_SECONDS:g} s: {why}")
        if statuses.still() > SILENCE_SECONDS:
            raise GoneError(f"{self.name} has sent no status for {SILENCE_SECONDS:g} s")
