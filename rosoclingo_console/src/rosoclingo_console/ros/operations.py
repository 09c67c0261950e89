"""Has operators' requests carried out by systems: calls their services, sends them goals."""

from __future__ import annotations

import itertools
import os
import time
from dataclasses import replace
from typing import Any, Callable, Dict, Optional, Tuple

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from std_srvs.srv import Trigger

from rosclingo.errors import shorten
from rosclingo.ros.low_latency import publisher
from rosclingo.ros.presence import Presence, presence
from rosoclingo.loop.journal import Control, Status
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoGoal, ROSoClingoIn
from rosoclingo.srv import ControlActuator, Why, WhyResponse
from rosoclingo_console.model.goals import GoalFate
from rosoclingo_console.model.messages import MessageFate
from rosoclingo_console.ros.recordings import Recordings
from rosoclingo_console.web.hub import Hub
from rosoclingo_console.web.operations import OperationReply, Operations

_SECONDS_TO_FIND = 2.0  # a service, or who takes goals and messages
_SECONDS_TO_TAKE = 3.0  # until it is known what has become of one that was sent
_SECONDS_TO_DECIDE = 5.0  # the same for a goal, which the planner may have to search for
_POLL_SECONDS = 0.02
_OPEN = (
    GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.RECALLING, GoalStatus.PREEMPTING,
)  # fmt: skip
_OF_RUN = (Control.PAUSE, Control.HALT, Control.STEP, Control.RESUME)


class RosOperations(Operations):
    """The systems on the ROS master. Make it after the node is initialised."""

    def __init__(self, systems: Tuple[str, ...], hub: Hub, recordings: Recordings) -> None:
        """Opens topics to the systems.

        Args:
            systems: Resolved names of the planning nodes.
            hub: Knows what has become of goals and messages.
            recordings: Starts and stops recorders.
        """
        self._recordings = recordings
        self._hub = hub
        self._numbers = itertools.count(1)  # thread-safe as CPython has it
        self._begun = f"{rospy.get_name()}-{os.getpid()}-{time.time():.3f}"
        self._goals: Dict[str, rospy.Publisher] = {}
        self._cancels: Dict[str, rospy.Publisher] = {}
        self._messages: Dict[str, rospy.Publisher] = {}
        for name in systems:
            self._goals[name] = publisher(f"{name}/goal", ROSoClingoActionGoal)
            self._cancels[name] = publisher(f"{name}/cancel", GoalID)
            self._messages[name] = publisher(f"{name}/in", ROSoClingoIn)

    def control(
        self, system: str, control: Control, actuator: str, action: str, token: int
    ) -> OperationReply:
        """Calls a service such as ``~pause``, which answers what has become of the request."""
        if control in _OF_RUN:
            return self._call(f"{system}/{control}", Trigger)
        return self._call(f"{system}/{control}", ControlActuator, actuator, action, token)

    def ask(self, system: str, question: str, arguments: Tuple[str, ...]) -> OperationReply:
        """Calls ``~why``."""
        return self._call(f"{system}/why", Why, question, arguments)

    def send_goal(self, system: str, request: str, information: Tuple[str, ...]) -> OperationReply:
        """Sends a goal, and waits until it is accepted, queued or rejected, but not for long."""
        identifier = f"{self._begun}-{next(self._numbers)}"
        now = rospy.Time.now()
        message = ROSoClingoActionGoal(
            goal_id=GoalID(now, identifier), goal=ROSoClingoGoal(request, list(information))
        )
        message.header.stamp = now

        def fate() -> Optional[GoalFate]:
            return self._hub.goal_fate(system, identifier)

        def is_decided() -> bool:
            found = fate()
            return found is not None and bool(found.text)

        reply = _send(system, self._goals[system], message, lambda: fate() is not None)
        if reply.done and fate() is not None:
            _wait_for(is_decided, _SECONDS_TO_DECIDE)
        found = fate()
        if found is None:
            return replace(reply, goal=identifier)
        text = found.text or "taken, and not decided on yet: that comes with the next plan"
        return OperationReply(not found.is_refused, text, identifier)

    def send_message(self, system: str, source: str, value: str) -> OperationReply:
        """Sends a message, and waits until the system has told its planner, or has dropped it."""
        before = self._hub.message_fate(system, source, value)

        def fate() -> Optional[MessageFate]:
            now = self._hub.message_fate(system, source, value)
            is_old = before is not None and now is not None and now.number == before.number
            return None if is_old else now

        def is_taken() -> bool:
            now = fate()
            return now is not None and now.dropped is not None

        reply = _send(system, self._messages[system], ROSoClingoIn(source, value), is_taken)
        found = fate()
        if found is None or not reply.done:
            return reply
        if found.dropped is None:
            text = (
                f"{system} has taken it; its planner knows it already, or is told later; in a "
                "static mode it is told nothing"
            )
            return OperationReply(True, text)
        return OperationReply(False, f"dropped: {found.dropped}") if found.dropped else reply

    def cancel(self, system: str, goal: str) -> OperationReply:
        """Sends a cancel request for an open goal, and waits until it is taken."""

        def fate() -> Optional[GoalFate]:
            return self._hub.goal_fate(system, goal)

        def is_taken() -> bool:
            found = fate()
            return found is not None and (found.canceling or found.status.is_terminal)

        before = fate()
        if before is None and not _has_open_goal(system, goal):
            return OperationReply(False, f"{system} has no open goal {shorten(goal)}")
        if before is not None and before.status.is_terminal:
            return OperationReply(False, f"the goal has ended already: {before.text}")
        reply = _send(system, self._cancels[system], GoalID(id=goal), is_taken)
        found = fate()
        if not reply.done or found is None:
            return reply
        if found.status.is_terminal:
            return OperationReply(found.status is Status.CANCELED, found.text)
        if found.canceling:
            return OperationReply(True, "it is to be cancelled, once what has begun has ended")
        return reply

    def record(self, system: str, is_on: bool) -> OperationReply:
        """Starts or stops a recorder."""
        return self._recordings.start(system) if is_on else self._recordings.stop(system)

    def _call(self, service: str, kind: Any, *arguments: Any) -> OperationReply:
        try:
            rospy.wait_for_service(service, _SECONDS_TO_FIND)
            response = rospy.ServiceProxy(service, kind)(*arguments)
        except rospy.ServiceException as err:
            return OperationReply(False, f"{service}: {err}")
        except rospy.ROSException:
            return OperationReply(False, _no_connection(service.rpartition("/")[0]))
        if kind is Why:
            return OperationReply(response.status == WhyResponse.ANSWERED, response.text)
        return OperationReply(response.success, response.message)


def _send(
    system: str, topic: rospy.Publisher, message: Any, is_taken: Callable[[], bool]
) -> OperationReply:
    """Sends a message to a system, and waits until it is taken, but not for long."""
    if not _wait_for(lambda: topic.impl.has_connection(system), _SECONDS_TO_FIND):
        return OperationReply(False, _no_connection(system))
    topic.publish(message)
    if _wait_for(is_taken, _SECONDS_TO_TAKE):
        return OperationReply(True, f"sent to {system}")
    # rospy notices late that a subscriber is gone.
    if presence(system) is not Presence.RUNNING:
        return OperationReply(False, _no_connection(system))
    return OperationReply(
        True, f"sent; {system} has not taken it yet: it searches, grounds or waits"
    )


def _has_open_goal(system: str, identifier: str) -> bool:
    """Asks a system for its open goals, of which the journal may be too short to have all."""
    try:
        found = rospy.wait_for_message(f"{system}/status", GoalStatusArray, _SECONDS_TO_FIND)
    except rospy.ROSException:
        return False
    goals = {one.goal_id.id: one.status for one in found.status_list}
    return goals.get(identifier) in _OPEN


def _wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Waits until a condition holds, so long at most, and returns whether it does."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end or rospy.is_shutdown():
            return False
        time.sleep(_POLL_SECONDS)
    return True


def _no_connection(system: str) -> str:
    return f"there is no connection to {system}: {presence(system).value}"
