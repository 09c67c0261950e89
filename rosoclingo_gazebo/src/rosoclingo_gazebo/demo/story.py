"""Narrates and checks the paper's third scenario, line by line."""

from __future__ import annotations

import re
import threading
from typing import Callable, Dict, List, Set

from rosoclingo.loop.journal import (
    ActionPublished,
    GoalArrived,
    MessageArrived,
    Record,
    StatusSet,
)
from rosoclingo.loop.words import SUCCESS
from rosoclingo_aspprograms.validator import Map, Validator
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.trace import DriveEventKind, DriveTrace, TracePoint

DEMO_ROBOT = "mailbot"
BOOK = Bring("bring(o7,o11)", ("book",))
LETTER = Bring("bring(o2,o3)", ("letter",))

_ORDERS = (BOOK, LETTER)  # numbered in the order of their coming, and so are the slots
_NEAR_METRES = 2.0
_ROUTE = (
    "go(c6) go(c5) go(c4) go(c6) go(open1) go(c1) go(c2) go(o2) pickup(2) go(c2) go(c1) go(o3) "
    "deliver(2) go(c1) go(c2) go(c3) go(c4) go(o7) pickup(1) go(c4) go(o11) deliver(1)"
)


class DemoStory:
    """Narrates the scenario, and checks it. Thread-safe.

    The robot is asked for a book, and near c6 for a letter too; an obstacle stands between c5 and
    c4. So it turns round, and the letter comes first: section 4 of the paper, third scenario.

    Attributes:
        trace: The drive.
        killed: How many nodes were killed.
    """

    def __init__(
        self, graph: Map, c6: TracePoint, ask: Callable[[Bring], None], *, undisturbed: bool = True
    ) -> None:
        """Starts before the first event.

        Args:
            graph: The map that the robot's actions are checked against.
            c6: Where c6 is, in metres.
            ask: Sends a request; must not wait.
            undisturbed: Whether the robot is to go the way of the paper. Where nodes are killed,
                it may be another one that is as short, and an action may fail.
        """
        self.trace = DriveTrace()
        self.killed = 0
        # Guards all below; ask is called under it.
        self._lock = threading.RLock()
        self._validator = Validator(graph)
        self._c6 = c6
        self._ask = ask
        self._undisturbed = undisturbed
        self._asked = 0
        self._orders: Dict[str, Bring] = {}  # by the goals' ids
        self._actions: List[str] = []
        self._running = ""
        self._begin = 0.0
        self._shown: Set[str] = set()
        self._failures: List[str] = []
        self._touched = False

    def begins(self, obstacle: TracePoint) -> None:
        """An obstacle stands at a place, in metres, and the first request is sent."""
        with self._lock:
            self.trace.happen(DriveEventKind.OBSTACLE, "a box", obstacle)
            self._send(BOOK)

    def moves(self, seconds: float, place: TracePoint) -> None:
        """The robot is at a place, in metres, at a time, in seconds of simulated time."""
        with self._lock:
            self.trace.move(seconds, place)
            if self._asked == 1 and self.trace.distance(self._c6) < _NEAR_METRES:
                self._send(LETTER)

    def touches(self) -> None:
        """Records that the robot touches something."""
        with self._lock:
            self._touched = True

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
            if isinstance(event, ActionPublished) and event.actuator == DEMO_ROBOT:
                self._running = event.action
                self._begin = self.trace.seconds
                self._actions.append(event.action)
                self._validator.action(DEMO_ROBOT, event.action)
            elif isinstance(event, MessageArrived) and event.source == DEMO_ROBOT:
                self._validator.message(DEMO_ROBOT, event.value)
                self._end(event.value, record.horizon)
            elif isinstance(event, GoalArrived):
                self._orders[event.goal] = next(o for o in _ORDERS if o.request == event.request)
            elif isinstance(event, StatusSet):
                order = self._orders[event.goal]
                self._validator.status(order, event.status.value, event.slot)

    @property
    def has_ended(self) -> bool:
        """Whether all requests have ended."""
        with self._lock:
            return all(goal.ended for goal in self._validator.goals.values())

    def wrong(self) -> List[str]:
        """Returns the faults, when nothing is expected to happen any more."""
        with self._lock:
            wrong = [*self._validator.finish()]
            if self._undisturbed and self._failures != ["go(c4)"]:
                wrong.append(f"one go(c4) was to fail, not {', '.join(self._failures) or 'none'}")
            if self._undisturbed and self._actions != _ROUTE.split():
                wrong.append(f"the actions were to be {_ROUTE}, not {' '.join(self._actions)}")
            if not (self._undisturbed or self.killed):
                wrong.append("no node was killed")
            if self._touched:
                wrong.append("the robot has touched something")
            return wrong

    def _send(self, bring: Bring) -> None:
        self._asked += 1
        self._validator.request(bring, bring.request)
        self.trace.happen(DriveEventKind.REQUEST, f"{bring.information[0]}, please")
        self._ask(bring)

    def _end(self, answer: str, horizon: int) -> None:
        action = self._running
        x, y = self.trace.path[-1]
        steps = f"{len(self._actions)} of {max(horizon, len(self._actions))}"
        seconds = self.trace.seconds - self._begin
        print(
            f"  step {steps:9} {action:11} {answer:8} {seconds:5.1f} s  at ({x:.1f}, {y:.1f})",
            flush=True,
        )
        if answer != SUCCESS:
            self._failures.append(action)
            self.trace.happen(DriveEventKind.FAILURE, f"{action} fails")
        elif action.startswith(("pickup(", "deliver(")):
            thing = _ORDERS[int(action[-2]) - 1].information[0]
            kind = (
                DriveEventKind.PICKUP if action.startswith("pickup(") else DriveEventKind.DELIVERY
            )
            self.trace.happen(kind, thing)
