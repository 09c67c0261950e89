"""The clients and the robot of a run that is recorded: all that comes from outside, in an order.

Everything is sent while the planning loop waits, which its journal says. So what happens does not
depend on who is faster, and a replay has to come to the same.
"""

from __future__ import annotations

import threading
import time
from typing import Any, Callable, Dict, List

from actionlib_msgs.msg import GoalID

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoEvent,
    ROSoClingoGoal,
    ROSoClingoIn,
    ROSoClingoOut,
)

TIMEOUT = 60.0  # seconds; no more than a bound for what never comes
_ENDS = ("succeeded", "canceled", "aborted", "rejected")


class Driver:
    """Drives one system, whose nodes have their default names."""

    def __init__(self) -> None:
        """Waits until the system and its recorder are there."""
        self.actions: List[str] = []
        self._changed = threading.Condition()
        self._events: Dict[int, Any] = {}
        self._seen = 0  # events that were looked at, in order
        self._sent = 0  # the number of the last event that this has caused
        self._waits = 0  # the number of the last event that says that the loop waits
        self._acting: List[str] = []  # actuators that have not answered
        self._goals: Dict[str, str] = {}  # their last status
        self._published: List[ROSoClingoOut] = []
        self._goal = publisher("rosoclingo/goal", ROSoClingoActionGoal)
        self._cancel = publisher("rosoclingo/cancel", GoalID)
        self._in = publisher("rosoclingo/in", ROSoClingoIn)
        self._journal = subscriber("rosoclingo/journal", ROSoClingoEvent, self._on_event)
        self._out = subscriber("rosoclingo/out", ROSoClingoOut, self._published.append)
        for topic in (self._goal, self._cancel, self._in):
            for node in ("/rosoclingo", "/recorder"):
                self._wait_for(lambda topic=topic, node=node: topic.impl.has_connection(node))

    def goal(self, request: str) -> None:
        """Sends a goal; they are called g1, g2 and so on."""
        name = f"g{len(self._goals) + 1}"
        self.wait()
        self._goals[name] = ""
        goal = ROSoClingoGoal(request, [])
        self._goal.publish(ROSoClingoActionGoal(goal_id=GoalID(id=name), goal=goal))
        self._wait_until_taken("goal", name)

    def cancel(self, number: int) -> None:
        """Cancels the goal with a number, counted from 1."""
        self.wait()
        self._cancel.publish(id=f"g{number}")
        self._wait_until_taken("cancel", f"g{number}")

    def message(self, identifier: str, value: str) -> None:
        """Sends a message."""
        self.wait()
        self._in.publish(identifier, value)
        self._wait_until_taken("message", identifier)

    def answer(self, *values: str) -> None:
        """Answers the next actions, one by one."""
        for value in values:
            self.wait()
            assert self._acting, f"nobody acts after {self.actions}"
            self.message(self._acting[0], value)

    def finish(self) -> None:
        """Answers success to all actions until all goals have ended."""
        self.wait()
        while self._acting:
            self.answer("success")
            self.wait()
        assert all(status in _ENDS for status in self._goals.values()), self._goals

    def see_plan(self) -> None:
        """Waits for the plan that a static mode publishes."""
        self._wait_for(lambda: [message for message in self._published if message.id == "solver"])
        self._wait_for(lambda: self._last().text == "publish")

    def wait(self) -> None:
        """Waits until the loop waits, having dealt with all that was sent."""
        self._wait_for(lambda: self._waits > self._sent)

    def _wait_until_taken(self, kind: str, identifier: str) -> None:
        """Waits until the journal has what was just sent while the loop waited."""
        begin = self._waits

        def is_taken() -> bool:
            for number in range(begin + 1, self._seen + 1):
                event = self._events[number]
                if (event.kind, event.id) == (kind, identifier):
                    self._sent = number
                    return True
            return False

        self._wait_for(is_taken)

    def _last(self) -> Any:
        return self._events[self._seen] if self._seen else ROSoClingoEvent()

    def _on_event(self, event: ROSoClingoEvent) -> None:
        with self._changed:
            self._events[event.number] = event
            while self._seen + 1 in self._events:
                self._seen += 1
                self._take(self._events[self._seen])
            self._changed.notify_all()

    def _take(self, event: Any) -> None:
        if event.kind == "waiting":
            self._waits = event.number
        elif event.kind == "action":
            self.actions.append(event.text)
            self._acting.append(event.id)
        elif event.kind == "message" and event.id in self._acting:
            self._acting.remove(event.id)
        elif event.kind == "status":
            self._goals[event.id] = event.text

    def _wait_for(self, condition: Callable[[], Any]) -> None:
        end = time.monotonic() + TIMEOUT
        with self._changed:
            while not condition():
                assert time.monotonic() < end, f"timeout after {self._last()}; {self.actions}"
                self._changed.wait(0.05)
