"""A solver node as seen by a client: the same calls as :class:`rosclingo.engine.Engine`."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from typing import Callable, List, Optional, Sequence, Tuple

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus

from rosclingo.commands import Answer, Assumption, Command, Reply
from rosclingo.engine import Improvement, Outcome, Result
from rosclingo.errors import ServiceError, XmlError
from rosclingo.low_latency import LowLatencyActionClient
from rosclingo.msg import ROSClingoAction, ROSClingoFeedback, ROSClingoGoal
from rosclingo.srv import ROSClingoControl
from rosclingo.xml_codec import decode_reply, encode_assumptions, encode_commands

_POLL_SECONDS = 0.01  # how often a waiting call looks whether it is to stop
_REMINDER_SECONDS = 5.0  # how often it is said what is waited for


class Client:
    """Drives a solver node over its service and its action.

    Make it after the node is initialised. One thread at a time may use it; the callbacks run in
    rospy's threads.
    """

    def __init__(self, name: str = "rosclingo") -> None:
        """Opens the connections without waiting for the node.

        Args:
            name: Name of the node, resolved like any other name.
        """
        self.name = rospy.resolve_name(name)
        self._service_name = f"{self.name}/control"
        self._service: Optional[rospy.ServiceProxy] = None
        self._service_lock = threading.Lock()  # a connection carries one request at a time
        self._action = LowLatencyActionClient(self.name, ROSClingoAction)
        rospy.on_shutdown(self._abandon)

    def wait(self, timeout: Optional[float] = None) -> None:
        """Waits until the node is there, and says every five seconds what it waits for.

        Args:
            timeout: Longest time to wait, in seconds of the wall clock; None for ever.

        Raises:
            ServiceError: The node did not come, or this process is shutting down.
        """
        namespace, _, name = self.name.rpartition("/")
        begin = time.monotonic()
        reminder = begin + 1.0
        while not self._there():
            now = time.monotonic()
            if rospy.is_shutdown():
                raise ServiceError(f"shut down while waiting for {self.name}")
            if timeout is not None and now - begin > timeout:
                raise ServiceError(
                    f"there is no solver {self.name}; start one with: "
                    f"ROS_NAMESPACE={namespace or '/'} rosrun rosclingo run.py __name:={name} "
                    "-f FILE"
                )
            if now > reminder:
                rospy.loginfo("waiting for the solver %s", self.name)
                reminder = now + _REMINDER_SECONDS
            time.sleep(_POLL_SECONDS)

    def control(self, *commands: Command) -> Tuple[Answer, ...]:
        """Runs commands in order, which ends a solve call that is open.

        Returns:
            The answers of those commands that have one.

        Raises:
            ServiceError: A command failed, or the node is not there.
            XmlError: A command holds a character that XML cannot carry.
        """
        reply = self.run(commands)
        if reply.failure is not None:
            failure = reply.failure
            raise ServiceError(
                f"{self.name} refused command {failure.index} (<{failure.command}>): "
                f"{failure.message}"
            )
        return reply.answers

    def run(self, commands: Sequence[Command]) -> Reply:
        """Runs commands in order until one fails, which ends a solve call that is open.

        Returns:
            The answers, and the failure if there was one.

        Raises:
            ServiceError: The node is not there.
            XmlError: A command holds a character that XML cannot carry.
        """
        text = encode_commands(commands)
        with self._service_lock:
            return self._call(text)

    def _call(self, text: str) -> Reply:
        try:
            if self._service is None:
                self._service = rospy.ServiceProxy(
                    self._service_name, ROSClingoControl, persistent=True
                )
            return decode_reply(self._service(text).result)
        except (rospy.ServiceException, rospy.ROSException, OSError, XmlError) as err:
            # A persistent connection is of no use after an error.
            if self._service is not None:
                self._service.close()
                self._service = None
            raise ServiceError(
                f"the connection to {self._service_name} was lost ({err}): its node ended or was "
                "restarted; the commands may have run or not, so begin with a restart"
            ) from err

    def _abandon(self) -> None:
        """Ends a call that waits for its reply, because the process is shutting down."""
        transport = getattr(self._service, "transport", None)
        connection = getattr(transport, "socket", None)
        if connection is not None:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def solve(
        self,
        assumptions: Sequence[Assumption] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches for answer sets.

        Args:
            assumptions: What to assume.
            stopped: Asked every 10 ms; the search ends when it says True.
            improved: Called with each better model while optimising, in a thread of rospy's.

        Raises:
            ServiceError: The node is not there, went away, or rejected or aborted the goal.
        """
        if not self._there():
            raise ServiceError(f"there is no solver {self.name}; is its node running?")
        ended = threading.Event()

        def on_transition(handle: ClientGoalHandle) -> None:
            if handle.get_comm_state() == CommState.DONE:
                ended.set()

        def on_feedback(_: ClientGoalHandle, message: ROSClingoFeedback) -> None:
            improved(Improvement(message.number, tuple(message.cost), tuple(message.answerset)))

        goal = ROSClingoGoal(encode_assumptions(assumptions))
        handle = self._action.send_goal(goal, on_transition, on_feedback)
        canceled = False
        while not ended.wait(_POLL_SECONDS):
            if not canceled and ((stopped is not None and stopped()) or rospy.is_shutdown()):
                handle.cancel()
                canceled = True
            if not self._connected():
                raise ServiceError(f"the solver {self.name} went away while solving")
        return self._outcome(handle, canceled)

    def _outcome(self, handle: ClientGoalHandle, canceled: bool) -> Outcome:
        status = handle.get_terminal_state()
        result = handle.get_result()
        if canceled and (result is None or not result.result):
            return Outcome(Result.UNKNOWN, True)
        if status == GoalStatus.SUCCEEDED or (
            canceled and status in (GoalStatus.PREEMPTED, GoalStatus.RECALLED)
        ):
            return Outcome(Result(result.result), result.interrupted, tuple(result.answerset))
        word = GoalStatus.to_string(status)
        raise ServiceError(f"{self.name} ended the goal as {word}: {handle.get_goal_status_text()}")

    def _there(self) -> bool:
        return self._connected() and self._action.wait_for_server(rospy.Duration(nsecs=1))

    def _connected(self) -> bool:
        connections: List[int] = [
            self._action.status_sub.get_num_connections(),
            self._action.result_sub.get_num_connections(),
        ]
        return all(connections)
