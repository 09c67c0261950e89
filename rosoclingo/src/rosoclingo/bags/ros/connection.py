"""The topics by which a replay sends inputs to the loop's node and receives its journal."""

from __future__ import annotations

import queue
from collections import Counter
from dataclasses import replace
from typing import Any, Dict, Iterator, Optional, Set

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from std_msgs.msg import Empty, String

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry
from rosoclingo.msg import ROSoClingoActionGoal, ROSoClingoEvent, ROSoClingoGoal, ROSoClingoIn


class Connection:
    """The topics of a node with the planning loop. Make it after the node is initialised.

    Attributes:
        arrived: The ids of goals that the node has.
    """

    def __init__(self, name: str) -> None:
        """Opens the topics below a node with the planning loop, by its resolved name."""
        self._heard_by: Counter[str] = Counter()  # by topics: the number of connections
        self._lives = 1  # of the node

        def opened(topic: str, kind: Any) -> rospy.Publisher:
            self._heard_by[topic] = 0
            return publisher(
                f"{name}/{topic}", kind, on_subscriber=lambda _: self._heard_by.update([topic])
            )

        self._goal = opened("goal", ROSoClingoActionGoal)
        self._cancel = opened("cancel", GoalID)
        self._in = opened("in", ROSoClingoIn)
        self._open = opened("open_gate", Empty)
        self._go_on = opened("go_on", Empty)
        self._control = opened("replay_control", String)
        self.arrived: Set[str] = set()
        # None says that a goal has arrived.
        self._received: queue.SimpleQueue[Optional[ROSoClingoEvent]] = queue.SimpleQueue()
        self._early: Dict[int, ROSoClingoEvent] = {}  # that came before the ones they follow
        self._number = 0
        self._status = subscriber(f"{name}/status", GoalStatusArray, self._on_status)
        self._journal = subscriber(f"{name}/journal", ROSoClingoEvent, self._received.put)

    @property
    def is_complete(self) -> bool:
        """True if the node is connected to all topics."""
        topics = [self._status, self._journal]
        is_heard = all(number >= self._lives for number in self._heard_by.values())
        return is_heard and all(topic.get_num_connections() for topic in topics)

    @property
    def is_open(self) -> bool:
        """True if the node is still connected; afterwards, all that it has sent has arrived."""
        return bool(self._journal.get_num_connections())

    def begin_again(self) -> None:
        """Expects the connections of another process in the node's place."""
        self._lives += 1

    def send(self, event: journal.Arrival) -> None:
        """Sends a recorded input; does not wait."""
        if isinstance(event, journal.GoalArrived):
            goal = ROSoClingoGoal(event.request, list(event.information))
            self._goal.publish(ROSoClingoActionGoal(goal_id=GoalID(id=event.goal), goal=goal))
        elif isinstance(event, journal.CancelArrived):
            self._cancel.publish(GoalID(id=event.goal))
        elif isinstance(event, journal.ControlArrived):
            # Of another run, which goes another way, the tokens may be others.
            self._control.publish(journal.to_text(replace(event, token=0, refused="")))
        else:
            self._in.publish(event.source, event.value)

    def open_gate(self) -> None:
        """Lets the loop take everything as soon as it comes."""
        self._open.publish()

    def go_on(self) -> None:
        """Tells the loop that the node was killed for which it waits."""
        self._go_on.publish()

    def hear(self, timeout: float) -> Iterator[Entry]:
        """Waits for events, and yields those that came, in the journal's order.

        Args:
            timeout: Longest time to wait, in seconds.

        Yields:
            The events, with their times in seconds since 1970.
        """
        try:
            self._sort(self._received.get(timeout=timeout))
            while True:
                self._sort(self._received.get_nowait())
        except queue.Empty:
            pass
        while self._number + 1 in self._early:
            self._number += 1
            message = self._early.pop(self._number)
            event, seconds = journal.decode(message), message.stamp.to_sec()
            yield Entry(event, message.step, message.horizon, self._number, seconds)

    def _on_status(self, message: GoalStatusArray) -> None:
        new = {status.goal_id.id for status in message.status_list} - self.arrived
        if new:
            self.arrived |= new
            self._received.put(None)

    def _sort(self, message: Optional[ROSoClingoEvent]) -> None:
        # A late subscriber gets some of them twice.
        if message is not None and message.number > self._number:
            self._early[message.number] = message
