"""Narrates the drive of one robot line by line, and notes what happens on it."""

from __future__ import annotations

import re
import threading
from typing import Callable, Dict, Sequence, Set

from rosoclingo.bags.run_model import RunModel, TrackedAction
from rosoclingo.loop.journal import Entry, MessageArrived, Record
from rosoclingo.loop.words import SUCCESS
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.trace import DriveEventKind, DriveTrace, TracePoint

DEMO_ROBOT = "mailbot"


class DemoStory:
    """Narrates a drive. Thread-safe.

    A subclass says what is asked for and when.

    Attributes:
        obstacle: The command for an unannounced obstacle in the simulator; empty for
            none.
        title: What a picture of the drive is about.
        trace: The drive.
        killed: How many nodes were killed.
    """

    obstacle = ""
    title = ""

    def __init__(self, orders: Sequence[Bring], ask: Callable[[Bring], None]) -> None:
        """Starts before the first event.

        Args:
            orders: What is asked for, numbered in the order of their coming, and so are the slots.
            ask: Sends a request; must not wait.
        """
        self.trace = DriveTrace()
        self.killed = 0
        # Guards all below; ask is called under it.
        self._lock = threading.RLock()
        self._orders = orders
        self._ask = ask
        self._asked = 0
        self._run = RunModel()  # in seconds of the trace
        self._shown: Set[str] = set()

    def begins(self, places: Dict[str, TracePoint]) -> None:
        """All is ready, and the first request is sent.

        Args:
            places: Where the waypoints are, in metres.
        """
        with self._lock:
            self.request_next()

    def moves(self, seconds: float, place: TracePoint) -> None:
        """The robot is at a place, in metres, at a time, in seconds of simulated time."""
        with self._lock:
            self.trace.move(seconds, place)

    def kills(self, node: str) -> None:
        """A node was killed."""
        with self._lock:
            self.killed += 1
            self.trace.happen(DriveEventKind.KILL, node)
            print(f"  killed: {node}", flush=True)

    def hears(self, line: str) -> None:
        """Handles a status of a request from the client: ``[1] bring(o7,o11) book: accepted``."""
        word = line.rpartition(": ")[2]
        with self._lock:
            if not re.match(r"(plan|step|queued) ?", word) and line not in self._shown:
                self._shown.add(line)
                print(line, flush=True)

    def notes(self, record: Record) -> None:
        """Handles an event of the planning loop's journal."""
        event = record.event
        with self._lock:
            entry = Entry(event, record.step, record.horizon, seconds=self.trace.seconds)
            action = self._run.apply(entry)
            if action is not None and isinstance(event, MessageArrived):
                self._end(action, record.horizon)

    @property
    def has_ended(self) -> bool:
        """True when all requests have ended."""
        with self._lock:
            return all(goal.ended is not None for goal in self._run.goals.values())

    def request_next(self) -> None:
        """Sends the next request."""
        bring = self._orders[self._asked]
        self._asked += 1
        self.trace.happen(DriveEventKind.REQUEST, f"{bring.information[0]}, please")
        self._ask(bring)

    def _end(self, action: TrackedAction, horizon: int) -> None:
        x, y = self.trace.path[-1]
        steps = f"{action.number} of {max(horizon, action.number)}"
        seconds = self.trace.seconds - action.began
        print(
            f"  step {steps:9} {action.name:11} {action.answer:8} {seconds:5.1f} s  "
            f"at ({x:.1f}, {y:.1f})",
            flush=True,
        )
        if action.answer != SUCCESS:
            self.trace.happen(DriveEventKind.FAILURE, f"{action.name} fails")
        elif action.name.startswith(("pickup(", "deliver(")):
            thing = self._orders[int(action.name[-2]) - 1].information[0]
            kind = (
                DriveEventKind.PICKUP
                if action.name.startswith("pickup(")
                else DriveEventKind.DELIVERY
            )
            self.trace.happen(kind, thing)
