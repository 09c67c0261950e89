#!/usr/bin/env python3
"""A client for kills.py: has each pair of packages brought that it is told, and counts on nothing.

usage: mortal_client.py

On the topic ``asked`` comes the name of a round, and where there are packages. The goals of a round
have ids of their own, so that a client which is started again sees in the list of statuses which of
them are to be sent. On ``heard`` it says which results it has got.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import Optional, Set

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from std_msgs.msg import String

from rosclingo.ros.init import init_node, spin
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoGoal

REQUESTS = {"a": "bring(a,b)", "b": "bring(b,a)"}
"""What is asked for in a round, by the office where the package is."""

_AGAIN_SECONDS = 0.05  # after which an unacknowledged goal is sent again


class Client:
    """Sends goals until they are acknowledged."""

    def __init__(self) -> None:
        """Opens the topics."""
        self._known: Optional[Set[str]] = None  # until there is a list
        self._changed = threading.Condition()  # guards what is known
        self._goals = publisher("rosoclingo/goal", ROSoClingoActionGoal)
        self._statuses = subscriber("rosoclingo/status", GoalStatusArray, self._on_statuses)
        self._heard = publisher("heard", String)
        self._results = subscriber("rosoclingo/result", ROSoClingoActionResult, self._on_result)
        self._asked = subscriber("asked", String, self._on_asked)

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        self._heard.publish(message.status.goal_id.id)

    def _on_statuses(self, message: GoalStatusArray) -> None:
        with self._changed:
            self._known = {status.goal_id.id for status in message.status_list}
            self._changed.notify_all()

    def _on_asked(self, message: String) -> None:
        name, _, places = message.data.partition(": ")
        for place in places.split():
            identifier = f"{name} {place}"
            goal_id = GoalID(rospy.Time.now(), identifier)
            goal = ROSoClingoActionGoal(goal_id=goal_id, goal=ROSoClingoGoal(REQUESTS[place], []))
            with self._changed:
                self._changed.wait_for(lambda: self._known is not None)
                while not self._changed.wait_for(
                    partial(self._is_known, identifier), _AGAIN_SECONDS
                ):
                    self._goals.publish(goal)

    def _is_known(self, identifier: str) -> bool:
        return self._known is not None and identifier in self._known


def main() -> None:
    """Runs until it is shut down."""
    init_node("client")
    _client = Client()
    spin()


if __name__ == "__main__":
    main()
