"""What happens in the third scenario, line by line, and whether it is right."""

from __future__ import annotations

import re
import threading
from collections import deque
from typing import Callable, Deque, List, Set

from rosoclingo.loop.words import SUCCESS
from rosoclingo_aspprograms.validator import Map, Validator
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.trace import Kind, Point, Trace

ROBOT = "mailbot"
BOOK = Bring("bring(o7,o11)", ("book",))
LETTER = Bring("bring(o2,o3)", ("letter",))

_ORDERS = (BOOK, LETTER)  # numbered in the order of their coming, and so are the slots
_NEAR_METRES = 2.0
_PLAN = re.compile(r"plan (\d+) steps?")
_ROUTE = (
    "go(c6) go(c5) go(c4) go(c6) go(open1) go(c1) go(c2) go(o2) pickup(2) go(c2) go(c1) go(o3) "
    "deliver(2) go(c1) go(c2) go(c3) go(c4) go(o7) pickup(1) go(c4) go(o11) deliver(1)"
)


class Story:
    """Is told what is seen, and says what happens. Thread-safe.

    The robot is asked for a book, and near c6 for a letter too; an obstacle stands between c5 and
    c4. So it turns round, and the letter comes first: section 4 of the paper, third scenario.

    Attributes:
        trace: The drive.
    """

    def __init__(self, graph: Map, c6: Point, ask: Callable[[Bring], None]) -> None:
        """Begins before anything has happened.

        Args:
            graph: The map that the robot's actions are checked against.
            c6: Where c6 is, in metres.
            ask: Sends a request; must not wait.
        """
        self.trace = Trace()
        # Guards all below; ask is called under it.
        self._lock = threading.RLock()
        self._validator = Validator(graph)
        self._done: Set[str] = set()  # actions that succeeded
        self._early: List[str] = []  # requests that were said to succeed before their last action
        self._c6 = c6
        self._ask = ask
        self._asked = 0
        self._actions: List[str] = []
        # What is heard in another order than it was said in.
        self._to_begin: Deque[str] = deque()
        self._to_end: Deque[str] = deque()
        self._running = ""
        self._horizon = 0
        self._begin = 0.0
        self._shown: Set[str] = set()
        self._failures: List[str] = []
        self._touched = False

    def begins(self, obstacle: Point) -> None:
        """An obstacle stands at a place, in metres, and the first request is sent."""
        with self._lock:
            self.trace.happen(Kind.OBSTACLE, "a box", obstacle)
            self._send(BOOK)

    def moves(self, seconds: float, place: Point) -> None:
        """The robot is at a place, in metres, at a time, in seconds of simulated time."""
        with self._lock:
            self.trace.move(seconds, place)
            if self._asked == 1 and self.trace.distance(self._c6) < _NEAR_METRES:
                self._send(LETTER)

    def touches(self) -> None:
        """The robot touches something."""
        with self._lock:
            self._touched = True

    def acts(self, action: str) -> None:
        """The robot is told to do an action."""
        with self._lock:
            self._to_begin.append(action)
            self._go_on()

    def answers(self, answer: str) -> None:
        """The robot has done an action, or failed to."""
        with self._lock:
            self._to_end.append(answer)
            self._go_on()

    def hears(self, line: str) -> None:
        """Something has become of a request: ``[1] bring(o7,o11) book: accepted``."""
        number, _, state = line.partition("] ")
        word = state.rpartition(": ")[2]
        plan = _PLAN.fullmatch(word)
        with self._lock:
            if plan:
                self._horizon = int(plan.group(1))
            slot = number[1:]
            if word == "succeeded" and f"deliver({slot})" not in self._done:
                self._early.append(slot)  # the robot's answer takes another connection
            elif word in ("accepted", "succeeded", "canceled", "rejected", "aborted"):
                self._validator.status(_ORDERS[int(slot) - 1], word, slot)
            if not re.match(r"(plan|step|queued) ?", word) and line not in self._shown:
                self._shown.add(line)
                print(line, flush=True)

    def wrong(self) -> List[str]:
        """Returns what went wrong, when nothing is expected to happen any more."""
        with self._lock:
            for slot in self._early:
                self._validator.status(_ORDERS[int(slot) - 1], "succeeded", slot)
            wrong = self._validator.finish()
            if self._failures != ["go(c4)"]:
                wrong.append(f"one go(c4) was to fail, not {', '.join(self._failures) or 'none'}")
            if self._actions != _ROUTE.split():
                wrong.append(f"the actions were to be {_ROUTE}, not {' '.join(self._actions)}")
            if self._touched:
                wrong.append("the robot has touched something")
            return wrong

    def _send(self, bring: Bring) -> None:
        self._asked += 1
        self._validator.request(bring, bring.request)
        self.trace.happen(Kind.REQUEST, f"{bring.information[0]}, please")
        self._ask(bring)

    def _go_on(self) -> None:
        while self._to_end if self._running else self._to_begin:
            if self._running:
                self._end(self._running, self._to_end.popleft())
                self._running = ""
            else:
                self._running = self._to_begin.popleft()
                self._begin = self.trace.seconds
                self._actions.append(self._running)
                self._validator.action(ROBOT, self._running)

    def _end(self, action: str, answer: str) -> None:
        self._validator.message(ROBOT, answer)
        if answer == SUCCESS:
            self._done.add(action)
        for slot in [slot for slot in self._early if f"deliver({slot})" in self._done]:
            self._early.remove(slot)
            self._validator.status(_ORDERS[int(slot) - 1], "succeeded", slot)
        x, y = self.trace.path[-1]
        steps = f"{len(self._actions)} of {max(self._horizon, len(self._actions))}"
        seconds = self.trace.seconds - self._begin
        print(
            f"  step {steps:9} {action:11} {answer:8} {seconds:5.1f} s  at ({x:.1f}, {y:.1f})",
            flush=True,
        )
        if answer != SUCCESS:
            self._failures.append(action)
            self.trace.happen(Kind.FAILURE, f"{action} fails")
        elif action.startswith(("pickup(", "deliver(")):
            thing = _ORDERS[int(action[-2]) - 1].information[0]
            kind = Kind.PICKUP if action.startswith("pickup(") else Kind.DELIVERY
            self.trace.happen(kind, thing)
