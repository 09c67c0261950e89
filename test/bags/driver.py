"""The clients and the robot of a run that is recorded: all that comes from outside, in an order.

Everything is sent while the planning loop waits, which its journal says. So what happens does not
depend on who is faster, and a replay has to come to the same.
"""

from __future__ import annotations

import threading
import time
from typing import Any, Callable, Dict, List, Optional

from actionlib_msgs.msg import GoalID

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.loop import journal
from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoEvent,
    ROSoClingoGoal,
    ROSoClingoIn,
    ROSoClingoOut,
)

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes


class Driver:
    """Drives one system, whose nodes have their default names."""

    def __init__(self) -> None:
        """Waits until the system and its recorder are there."""
        self.actions: List[str] = []
        self._changed = threading.Condition()
        self._events: Dict[int, journal.Event] = {}
        self._seen = 0  # events that were looked at, in order
        self._sent = 0  # the number of the last event that this has caused
        self._waits = 0  # the number of the last event that says that the loop waits
        self._acting: List[str] = []  # actuators that have not answered
        self._goals: Dict[str, Optional[journal.Status]] = {}  # the last one
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
        self._goals[name] = None
        goal = ROSoClingoGoal(request, [])
        self._goal.publish(ROSoClingoActionGoal(goal_id=GoalID(id=name), goal=goal))
        self._wait_until_taken(
            lambda event: isinstance(event, journal.GoalArrived) and event.goal == name
        )

    def cancel(self, number: int) -> None:
        """Cancels the goal with a number, counted from 1."""
        self.wait()
        name = f"g{number}"
        self._cancel.publish(id=name)
        self._wait_until_taken(
            lambda event: isinstance(event, journal.CancelArrived) and event.goal == name
        )

    def message(self, identifier: str, value: str) -> None:
        """Sends a message."""
        self.wait()
        self._in.publish(identifier, value)
        self._wait_until_taken(
            lambda event: isinstance(event, journal.MessageArrived) and event.source == identifier
        )

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
        assert not {None, journal.Status.ACCEPTED} & {*self._goals.values()}, self._goals

    def see_plan(self) -> None:
        """Waits for the plan that a static mode publishes."""
        self._wait_for(lambda: [message for message in self._published if message.id == "solver"])
        self._wait_for(lambda: isinstance(self._last, journal.CommandDone) and self._last.publishes)

    def wait(self) -> None:
        """Waits until the loop waits, having dealt with all that was sent."""
        self._wait_for(lambda: self._waits > self._sent)

    def _wait_until_taken(self, is_it: Callable[[journal.Event], bool]) -> None:
        """Waits until the journal has what was just sent while the loop waited."""
        begin = self._waits

        def is_taken() -> bool:
            for number in range(begin + 1, self._seen + 1):
                if is_it(self._events[number]):
                    self._sent = number
                    return True
            return False

        self._wait_for(is_taken)

    @property
    def _last(self) -> Optional[journal.Event]:
        return self._events.get(self._seen)

    def _on_event(self, message: ROSoClingoEvent) -> None:
        with self._changed:
            self._events[message.number] = journal.decode(message)
            while self._seen + 1 in self._events:
                self._seen += 1
                self._take(self._events[self._seen])
            self._changed.notify_all()

    def _take(self, event: journal.Event) -> None:
        if isinstance(event, journal.LoopWaits):
            self._waits = self._seen
        elif isinstance(event, journal.ActionPublished):
            self.actions.append(event.action)
            self._acting.append(event.actuator)
        elif isinstance(event, journal.MessageArrived) and event.source in self._acting:
            self._acting.remove(event.source)
        elif isinstance(event, journal.StatusSet):
            self._goals[event.goal] = event.status

    def _wait_for(self, condition: Callable[[], Any]) -> None:
        end = time.monotonic() + TIMEOUT
        with self._changed:
            while not condition():
                assert time.monotonic() < end, f"timeout after {self._last}; {self.actions}"
                self._changed.wait(0.05)
