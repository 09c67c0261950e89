"""A soak's client: sends goals until they are acknowledged, and tells what it hears."""

from __future__ import annotations

import itertools
import time
from typing import Dict, List

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.loop.journal import Status, decode
from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoActionResult,
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoGoal,
    ROSoClingoToken,
)
from soak_alarms import Alarm, Order
from soak_watch import SoakWatch

_AGAIN_SECONDS = 2.0  # of wall time, after which unacknowledged goals are sent again

_WORDS = {
    GoalStatus.SUCCEEDED: Status.SUCCEEDED.value,
    GoalStatus.PREEMPTED: Status.CANCELED.value,
    GoalStatus.RECALLED: Status.CANCELED.value,
    GoalStatus.ABORTED: Status.ABORTED.value,
    GoalStatus.REJECTED: Status.REJECTED.value,
}


class SoakClient:
    """Sends goals, until they are acknowledged, and hears how they end."""

    def __init__(self, watch: SoakWatch) -> None:
        """Opens the topics.

        Args:
            watch: Is told of all.
        """
        self._watch = watch
        self._asked: Dict[str, ROSoClingoActionGoal] = {}  # those without a result
        self._cancelled: List[str] = []
        self._listed: Dict[str, int] = {}  # the last list of statuses
        self._again = 0.0
        self._numbers = itertools.count(1)
        self._goal = publisher("rosoclingo/goal", ROSoClingoActionGoal)
        self._cancel = publisher("rosoclingo/cancel", GoalID)
        self._topics = [
            subscriber("rosoclingo/status", GoalStatusArray, self._on_statuses),
            subscriber("rosoclingo/result", ROSoClingoActionResult, self._on_result),
            subscriber("rosoclingo/journal", ROSoClingoEvent, self._on_event),
            subscriber("rosoclingo/dispatch", ROSoClingoDispatch, self._on_dispatch),
            subscriber("rosoclingo/answer", ROSoClingoAnswer, self._on_answer),
            subscriber("/rosout", Log, self._on_log),
            subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
        ]

    def ask(self, request: str, is_sent_twice: bool, *, finds_slot: bool) -> str:
        """Sends a goal, and returns its id."""
        goal = f"goal {next(self._numbers)}"
        stamp = rospy.Time.now()
        message = ROSoClingoActionGoal(
            goal_id=GoalID(stamp, goal), goal=ROSoClingoGoal(request, [])
        )
        now, wall = stamp.to_sec(), time.monotonic()
        self._watch.sends(goal, request, now, wall, finds_slot=finds_slot)
        self._asked[goal] = message
        self._goal.publish(message)
        if is_sent_twice:
            self._watch.sends_again(goal)
            self._goal.publish(message)
        return goal

    def cancel(self, goal: str) -> None:
        """Asks to cancel a goal, if it has not ended."""
        if self._watch.is_open(goal):
            self._cancelled.append(goal)
            self._watch.cancels(goal)
            self._cancel.publish(GoalID(id=goal))

    def insist(self) -> None:
        """Sends again what is not acknowledged, and asks for results that did not come."""
        if time.monotonic() - self._again < _AGAIN_SECONDS:
            return
        self._again = time.monotonic()
        self._asked = {goal: one for goal, one in self._asked.items() if self._watch.is_open(goal)}
        self._cancelled = [goal for goal in self._cancelled if goal in self._asked]
        listed = self._listed
        for goal, message in self._asked.items():
            if listed.get(goal) not in (GoalStatus.PENDING, GoalStatus.ACTIVE):
                self._watch.sends_again(goal)
                self._goal.publish(message)
        for goal in self._cancelled:
            if listed.get(goal) in (GoalStatus.PENDING, GoalStatus.ACTIVE):
                self._cancel.publish(GoalID(id=goal))

    def _on_statuses(self, message: GoalStatusArray) -> None:
        now, wall = rospy.Time.now().to_sec(), time.monotonic()
        self._listed = {status.goal_id.id: status.status for status in message.status_list}
        for goal in self._listed:
            self._watch.acknowledges(goal, now, wall)

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        word = _WORDS.get(message.status.status, f"of status {message.status.status}")
        now, wall = rospy.Time.now().to_sec(), time.monotonic()
        self._watch.hears(message.status.goal_id.id, word, now, wall)

    def _on_event(self, message: ROSoClingoEvent) -> None:
        now = rospy.Time.now().to_sec()  # the message has wall time
        self._watch.learns(message.number, decode(message), now, time.monotonic())

    def _on_dispatch(self, message: ROSoClingoDispatch) -> None:
        orders = [
            Order(one.number, one.id, one.action, one.state != ROSoClingoToken.ANSWERED)
            for one in message.actions
        ]
        self._watch.tells(message.run, orders, rospy.Time.now().to_sec(), time.monotonic())

    def _on_answer(self, message: ROSoClingoAnswer) -> None:
        self._watch.answers(message.run, message.number, message.value, time.monotonic())

    def _on_log(self, message: Log) -> None:
        if message.level >= Log.WARN and message.name != rospy.get_name():
            now, wall = rospy.Time.now().to_sec(), time.monotonic()
            self._watch.warns(Alarm(message.name, message.msg, now, wall))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        now, wall = rospy.Time.now().to_sec(), time.monotonic()
        for status in message.status:
            alarm = Alarm(status.name, status.message, now, wall)
            self._watch.reports(alarm, is_well=status.level == DiagnosticStatus.OK)
