"""Hears the topics of a planning system, and passes on what they say."""

from __future__ import annotations

import time
from typing import Any, Callable

import rospy
from std_msgs.msg import String

from rosclingo.ros.low_latency import subscriber
from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.loop.journal import Entry, decode
from rosoclingo.msg import (
    ROSoClingoActionFeedback,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoHeartbeat,
    ROSoClingoHeld,
    ROSoClingoPlan,
    ROSoClingoToken,
)
from rosoclingo_console.model.values import TokenRow, read_quality
from rosoclingo_console.web.hub import Heard


class Listener:
    """Subscribes to a system's topics, be it there or not; rospy's threads convert and post."""

    def __init__(self, name: str, post: Callable[[Heard], None]) -> None:
        """Subscribes.

        Args:
            name: Resolved name of the planning node.
            post: Called with each message as what it does to the model; thread-safe.
        """
        self._post = post
        hear: Any = self._subscribe
        self._journal = subscriber(f"{name}/journal", ROSoClingoEvent, self._on_event)
        self._others = [
            hear(f"{name}/plan", ROSoClingoPlan, _plan),
            hear(f"{name}/dispatch", ROSoClingoDispatch, _tokens),
            hear(f"{name}/heartbeat", ROSoClingoHeartbeat, _progress),
            hear(f"{name}/held", ROSoClingoHeld, _decisions),
            hear(f"{name}/plan_quality", String, _quality),
            hear(f"{name}/feedback", ROSoClingoActionFeedback, _feedback),
        ]

    def look(self) -> None:
        """Passes on whether there is a connection from the planning node."""
        is_there = self._journal.get_num_connections() > 0
        now = time.time()
        self._post(lambda model: model.connect(is_there, now))

    def _subscribe(self, topic: str, kind: Any, read: Callable[[Any], Heard]) -> rospy.Subscriber:
        return subscriber(topic, kind, lambda message: self._post(read(message)))

    def _on_event(self, message: ROSoClingoEvent) -> None:
        record = Entry(
            decode(message), message.step, message.horizon, message.number, message.stamp.to_sec()
        )
        self._post(lambda model: model.hear(record))


def _plan(message: ROSoClingoPlan) -> Heard:
    return lambda model: model.set_plan(message.step, message.horizon, message.actions)


def _tokens(message: ROSoClingoDispatch) -> Heard:
    tokens = [
        TokenRow(
            one.number,
            one.step,
            one.id,
            one.action,
            one.state != ROSoClingoToken.ANSWERED,
            one.state == ROSoClingoToken.ABORTED,
        )
        for one in message.actions
    ]
    return lambda model: model.actuators.set_tokens(tokens, message.run)


def _progress(message: ROSoClingoHeartbeat) -> Heard:
    return lambda model: model.actuators.set_progress(message.run, message.number, message.progress)


def _decisions(message: ROSoClingoHeld) -> Heard:
    decisions = OperatorDecisions.of_message(message)
    now = time.time()
    return lambda model: model.decide(decisions, now)


def _quality(message: String) -> Heard:
    text = ""
    try:
        text = read_quality(message.data)
    except ValueError:
        rospy.logwarn_throttle(60.0, "a message of plan_quality is not understood")
    return lambda model: model.set_quality(text)


def _feedback(message: ROSoClingoActionFeedback) -> Heard:
    identifier, line = message.status.goal_id.id, message.feedback.status
    return lambda model: model.tell_goal(identifier, line)
