#!/usr/bin/env python3
"""A node that sends many goals at once to a planning node, for flood_bench.py.

usage: burst.py NODE COUNT

It prints ``ready`` when it is connected, begins when a line comes on its standard input, and prints
then how many seconds it took until all goals were in a list of statuses, or had ended.
"""

from __future__ import annotations

import sys
import threading
import time
from typing import List, Set

import rospy
from actionlib_msgs.msg import GoalStatusArray

from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoActionResult, ROSoClingoGoal

REQUESTS = ("visit(6)", "visit(1)")
POLL_SECONDS = 0.02
LONGEST_WAIT = 600.0  # seconds


class Burst:
    """Goals that are sent at once, and which of them are acknowledged."""

    def __init__(self, node: str, count: int) -> None:
        """Opens the connections."""
        self._goals = [goal(f"burst {n}", REQUESTS[n % 2]) for n in range(count)]
        self._open: Set[str] = {one.goal_id.id for one in self._goals}
        self._list: List[rospy.AnyMsg] = []  # the last one, which is long, is read when it is time
        self._ended: Set[str] = set()
        self._lock = threading.Lock()
        self._topic = rospy.Publisher(f"{node}/goal", ROSoClingoActionGoal, queue_size=count)
        self._subscribers = [
            rospy.Subscriber(f"{node}/status", rospy.AnyMsg, self._on_statuses),
            rospy.Subscriber(f"{node}/result", ROSoClingoActionResult, self._on_result),
        ]
        while not all(one.get_num_connections() for one in (self._topic, *self._subscribers)):
            time.sleep(POLL_SECONDS)

    def run(self) -> float:
        """Sends all, and returns the seconds until all are acknowledged."""
        begin = time.monotonic()
        for one in self._goals:
            self._topic.publish(one)
        while self._open and time.monotonic() < begin + LONGEST_WAIT:
            time.sleep(POLL_SECONDS)
            with self._lock:
                lists, self._list = self._list, []
                self._open -= self._ended
                self._ended.clear()
            for raw in lists:
                message = GoalStatusArray()
                message.deserialize(raw._buff)
                self._open.difference_update(one.goal_id.id for one in message.status_list)
        if self._open:
            sys.exit(f"{len(self._open)} goals are not acknowledged after {LONGEST_WAIT:.0f} s")
        return time.monotonic() - begin

    def _on_statuses(self, message: rospy.AnyMsg) -> None:
        with self._lock:
            self._list = [message]

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        with self._lock:
            self._ended.add(message.status.goal_id.id)


def goal(identifier: str, request: str) -> ROSoClingoActionGoal:
    """Returns the message of a goal."""
    made = ROSoClingoActionGoal(goal=ROSoClingoGoal(request, []))
    made.goal_id.id = identifier
    return made


def main() -> None:
    """Sends one burst."""
    node, count = rospy.myargv(sys.argv)[1:]
    rospy.init_node("burst", disable_signals=True)
    burst = Burst(node, int(count))
    print("ready", flush=True)
    sys.stdin.readline()
    print(burst.run(), flush=True)
    rospy.signal_shutdown("all are acknowledged")


if __name__ == "__main__":
    main()
