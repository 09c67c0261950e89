#!/usr/bin/env python3
"""A node that sends inputs to a planning node at a given rate, for flood_bench.py.

usage: flooder.py NODE RATE KIND...

NODE is the planning node's name, RATE the inputs in a second, of all kinds together. The node ends
when its standard input does. It prints then how much it has sent, and of its goals, how many it has
sent and how many have ended.
"""

from __future__ import annotations

import itertools
import sys
import threading
import time
from collections import deque
from typing import Callable, Deque, Dict, List, Set

import rospy
from actionlib_msgs.msg import GoalID

from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoActionResult,
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoGoal,
    ROSoClingoIn,
)

TICK_SECONDS = 0.005
GOAL_SECONDS = 0.05  # so soon a goal is cancelled
NOTES = 100  # values of the messages that are known
BUFFERED = 100_000  # inputs that wait for the connection
LONGEST_WAIT = 120.0  # seconds, for the ends of the goals


class Flooder:
    """Sends inputs of some kinds in turn."""

    def __init__(self, node: str) -> None:
        """Opens the connections."""
        self.goals: Set[str] = set()
        self._number = itertools.count()
        self._in = rospy.Publisher(f"{node}/in", ROSoClingoIn, queue_size=BUFFERED)
        self._answer = rospy.Publisher(f"{node}/answer", ROSoClingoAnswer, queue_size=BUFFERED)
        self._goal = rospy.Publisher(f"{node}/goal", ROSoClingoActionGoal, queue_size=BUFFERED)
        self._cancel = rospy.Publisher(f"{node}/cancel", GoalID, queue_size=BUFFERED)
        self._uncancelled: Deque[tuple[float, str]] = deque()
        self._ended: Set[str] = set()
        self._run = ""
        self._answered = 0
        rospy.Subscriber(f"{node}/result", ROSoClingoActionResult, self._on_result)
        rospy.Subscriber(f"{node}/dispatch", ROSoClingoDispatch, self._on_dispatch)
        self.kinds: Dict[str, Callable[[], None]] = {
            "equal": lambda: self._in.publish("info", "note(0)"),
            "different": lambda: self._in.publish("info", f"note({next(self._number) % NOTES})"),
            "unknown": lambda: self._in.publish("info", f"nonsense({next(self._number)})"),
            "goals": self._send_goal,
            "answers": lambda: self._answer.publish(self._run, self._answered, "success"),
        }
        topics = (self._in, self._answer, self._goal, self._cancel)
        while not all(topic.get_num_connections() for topic in topics):
            time.sleep(TICK_SECONDS)

    def flood(self, rate: float, kinds: List[str], is_over: Callable[[], bool]) -> int:
        """Sends until it is over, and returns how much was sent."""
        begin, sent = time.monotonic(), 0
        turns = itertools.cycle([self.kinds[kind] for kind in kinds])
        while not is_over():
            due = int((time.monotonic() - begin) * rate)
            for _ in range(due - sent):
                next(turns)()
            sent = max(sent, due)
            time.sleep(TICK_SECONDS)
        return sent

    def wait_for_ends(self) -> int:
        """Cancels the goals that are left, and returns how many have ended after a while."""
        for _, identifier in self._uncancelled:
            self._cancel.publish(GoalID(id=identifier))
        end = time.monotonic() + LONGEST_WAIT
        while time.monotonic() < end and not self.goals <= self._ended:
            time.sleep(TICK_SECONDS)
        return len(self.goals & self._ended)

    def _send_goal(self) -> None:
        """Sends a goal, or cancels one that was sent a while ago."""
        if self._uncancelled and self._uncancelled[0][0] < time.monotonic() - GOAL_SECONDS:
            self._cancel.publish(GoalID(id=self._uncancelled.popleft()[1]))
            return
        identifier = f"flood {next(self._number)}"
        self.goals.add(identifier)
        self._uncancelled.append((time.monotonic(), identifier))
        goal = ROSoClingoActionGoal(goal=ROSoClingoGoal("rest", []))
        goal.goal_id.id = identifier
        self._goal.publish(goal)

    def _on_result(self, message: ROSoClingoActionResult) -> None:
        self._ended.add(message.status.goal_id.id)

    def _on_dispatch(self, message: ROSoClingoDispatch) -> None:
        self._run = message.run
        answered = [one.number for one in message.actions if one.state == one.ANSWERED]
        self._answered = max(answered, default=0)


def main() -> None:
    """Floods until the standard input ends."""
    node, rate, *kinds = rospy.myargv(sys.argv)[1:]
    rospy.init_node("flooder", disable_signals=True)
    flooder = Flooder(node)
    is_over = threading.Event()

    def wait_for_end() -> None:
        sys.stdin.read()
        is_over.set()

    threading.Thread(target=wait_for_end, daemon=True).start()
    print("begins", flush=True)
    sent = flooder.flood(float(rate), kinds, is_over.is_set)
    print(sent, len(flooder.goals), flooder.wait_for_ends(), flush=True)
    rospy.signal_shutdown("the flood is over")


if __name__ == "__main__":
    main()
