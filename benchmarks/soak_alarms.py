"""Judges a soak's warnings: each is held against the log of the robots, and none is false.

The robots' log is independent of the planning nodes' state: what interfaces were told by
``~dispatch``, what they have answered and when, and which nodes were ended. Needs no ROS.

>>> judge = AlarmJudge()
>>> judge.tells("run", [Order(1, "robot", "go(3)", True)], seconds=10.0, wall=1.0)
>>> judge.answers("run", 1, "success", wall=2.0)
>>> judge.tells("run", [Order(2, "robot", "go(4)", True)], seconds=12.0, wall=3.0)
>>> text = "answer success to action 1: its actuator was told something else since then"
>>> judge.warns(Alarm("/rosoclingo", text, seconds=13.0, wall=4.0))
>>> [(alarm.text, why) for alarm, why in judge.judge(wall=100.0)] == [(text, NO_NEWS)]
True
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Match, NamedTuple, Optional, Sequence, Tuple

from rosoclingo.loop.words import GIVEN_UP, SUCCESS, UNKNOWN

NO_NEWS = "it is a copy of an answer that was given in time"

_SETTLED_SECONDS = 5.0  # of wall time, after which all that came before a warning has come here
_TOLERANCE_SECONDS = 2.0  # of wall time, by which topics differ
_DELAY_SECONDS = 60.0  # of simulated time, that go by until a topic is here
_RECOVERY_SECONDS = 90.0  # of wall time, in which a node that was ended is there again
_MOST_ORDERS = 1000  # that are remembered
_PLANNING = ("/rosoclingo", "/controller", "/planner")


class Alarm(NamedTuple):
    """A warning or an error of a node's log, diagnostics or journal.

    Attributes:
        source: The node, or the part of diagnostics.
        text: What it says.
        seconds: When, in simulated time.
        wall: The same moment, in wall time.
    """

    source: str
    text: str
    seconds: float
    wall: float


class Order(NamedTuple):
    """An action of ``~dispatch``.

    Attributes:
        number: That of its token.
        actuator: Who is to do it.
        action: Its name.
        is_open: Whether it is to be answered.
    """

    number: int
    actuator: str
    action: str
    is_open: bool


@dataclass
class _Told:
    """An order with its answers; times in wall time, except ``seconds``."""

    order: Order
    seconds: float
    since: float
    closed: float = math.inf  # the loop has stopped waiting for an answer
    answers: List[Tuple[float, str]] = field(default_factory=list)

    @property
    def first(self) -> Optional[str]:
        """The first answer, if it came while the loop waited for it."""
        if self.answers and self.answers[0][0] <= self.closed + _TOLERANCE_SECONDS:
            return self.answers[0][1]
        return None

    def is_silent(self, wall: float) -> bool:
        """Tells if there was no answer until a time."""
        return not self.answers or self.answers[0][0] > wall - _TOLERANCE_SECONDS


class AlarmJudge:
    """Holds warnings against the robots' log. One thread at a time.

    Attributes:
        counts: How many warnings were judged, by what they say.
    """

    def __init__(self) -> None:
        """Begins with a run in which nothing has happened."""
        self.counts: Counter[str] = Counter()
        self._run = ""
        self._told: Dict[int, _Told] = {}  # by numbers, in this run
        self._ended: Dict[str, float] = {}  # when nodes were ended last, in wall time
        self._waiting: List[Alarm] = []
        self._parts: Dict[str, str] = {}  # of diagnostics: what each has said last

    # The robots' log.

    def tells(self, run: str, orders: Sequence[Order], seconds: float, wall: float) -> None:
        """Actuators are told something, by ``~dispatch``."""
        if run != self._run:
            self._run, self._told = run, {}
        for order in orders:
            known = self._told.get(order.number)
            if known is None:
                self._told[order.number] = known = _Told(order, seconds, wall)
            if not order.is_open:
                known.closed = min(known.closed, wall)
        numbers = {order.number for order in orders}
        for number, told in self._told.items():
            if number not in numbers:
                told.closed = min(told.closed, wall)
        for number in list(self._told)[:-_MOST_ORDERS]:
            del self._told[number]

    def answers(self, run: str, number: int, value: str, wall: float) -> None:
        """An interface answers an action, for the first time or again."""
        told = self._told.get(number)
        if run == self._run and told is not None:
            told.answers.append((wall, value))

    def ends(self, node: str, wall: float) -> None:
        """A node is ended by the soak."""
        self._ended["/" + node.lstrip("/")] = wall

    # The warnings.

    def warns(self, alarm: Alarm) -> None:
        """A node warns, in its log or by an event in the journal."""
        self._waiting.append(alarm)

    def reports(self, alarm: Alarm, *, is_well: bool) -> None:
        """A part of diagnostics says how it is; what it repeats, with other times, is one alarm."""
        kind = "" if is_well else re.sub(r"[\d.]+", "N", alarm.text)
        if kind and self._parts.get(alarm.source) != kind:
            self._waiting.append(alarm)
        self._parts[alarm.source] = kind

    def judge(self, wall: float) -> List[Tuple[Alarm, str]]:
        """Returns the false ones of the warnings that are old enough to be judged, with reasons."""
        due = [one for one in self._waiting if one.wall <= wall - _SETTLED_SECONDS]
        self._waiting = [one for one in self._waiting if one not in due]
        judged = [(one, self._why_false(one)) for one in due]
        return [(one, why) for one, why in judged if why]

    def _why_false(self, alarm: Alarm) -> str:
        """Returns why a warning is false; empty if it is true."""
        for kind, pattern, rule in _RULES:
            found = pattern.search(alarm.text)
            if found is not None:
                self.counts[kind] += 1
                return rule(self, alarm, found)
        self.counts["other"] += 1
        return "nothing is known of such a warning"

    # Each kind of warning.

    def _dropped_answer(self, alarm: Alarm, found: Match[str]) -> str:
        value, number, reason = found[1], int(found[2]), found[3]
        told = self._told.get(number)
        if reason.startswith("it is of the run "):
            return "it is of this run" if reason.split()[5].rstrip(",") == self._run else ""
        if told is None:
            is_none = reason == "there is none" or number < min(self._told, default=0)
            return "" if is_none else "the robots' log has no such action"
        if reason == "there is none":
            return f"{told.order.actuator} was told {told.order.action}"
        return NO_NEWS if told.first == value else ""

    def _dropped_message(self, alarm: Alarm, found: Match[str]) -> str:
        of_it = [one for one in self._told.values() if one.order.actuator == found[1]]
        return NO_NEWS if of_it and of_it[-1].first == found[2] else ""

    def _silence(self, alarm: Alarm, found: Match[str]) -> str:
        actuator = _actuator_of(alarm) or found[1]
        of_it = [one for one in self._told.values() if one.order.actuator == actuator]
        told = next((one for one in reversed(of_it) if one.since <= alarm.wall), None)
        if told is None:
            return f"{actuator} was told nothing"
        if not told.is_silent(alarm.wall):
            return f"it has answered {told.answers[0][1]}"
        passed = alarm.seconds - told.seconds
        is_too_much = found.re.groups > 1 and float(found[2]) > passed + _DELAY_SECONDS
        return f"it has had {passed:.0f} s" if is_too_much else ""

    def _unknown(self, alarm: Alarm, found: Match[str]) -> str:
        said = [value for one in self._told.values() for _, value in one.answers]
        has_said = any(value in (UNKNOWN, *GIVEN_UP) for value in said)
        return "" if has_said else f"{found[1]} has not said so"

    def _failure(self, alarm: Alarm, found: Match[str]) -> str:
        near = [
            one
            for one in self._told.values()
            if (one.order.actuator, one.order.action) == (found[1], found[2])
            if one.since - _TOLERANCE_SECONDS <= alarm.wall
        ]
        if not near:
            return f"{found[1]} was not told {found[2]}"
        return "its action has succeeded" if near[-1].first == SUCCESS else ""

    def _rival(self, alarm: Alarm, found: Match[str]) -> str:
        other = found[1]
        return f"{other} is a part of the system" if other in _PLANNING else ""

    def _lost_solver(self, alarm: Alarm, found: Match[str]) -> str:
        is_so = any(self._was_ended(node, alarm.wall) for node in _PLANNING)
        return "" if is_so else "no node that plans was ended"

    def _lost_node(self, alarm: Alarm, found: Match[str]) -> str:
        is_so = any(self._was_ended(node, alarm.wall) for node in self._ended)
        return "" if is_so else "no node was ended"

    def _no_time(self, alarm: Alarm, found: Match[str]) -> str:
        passed = alarm.wall - self._ended.get(alarm.source, -math.inf)
        is_so = passed > float(found[1]) - _TOLERANCE_SECONDS
        return "" if is_so else f"the node was ended {passed:.0f} s before"

    def _own_end(self, alarm: Alarm, found: Match[str]) -> str:
        return "" if self._was_ended(alarm.source, alarm.wall) else "the node was not ended"

    def _was_ended(self, node: str, wall: float) -> bool:
        """Tells if the soak has ended a node not long before a time."""
        passed = wall - self._ended.get(node, -math.inf)
        return -_TOLERANCE_SECONDS <= passed <= _RECOVERY_SECONDS

    def _holds(self, alarm: Alarm, found: Match[str]) -> str:  # it is what the world has said
        return ""


def _actuator_of(alarm: Alarm) -> str:
    """Returns the actuator that a part of diagnostics is about; empty for another part."""
    return alarm.source.partition(": actuator ")[2]


_Rule = Callable[[AlarmJudge, Alarm, Match[str]], str]

_RULES: List[Tuple[str, re.Pattern[str], _Rule]] = [
    (kind, re.compile(pattern), rule)
    for kind, pattern, rule in (
        ("answer dropped", r"answer (\S+) to action (\d+): (.*)", AlarmJudge._dropped_answer),
        ("message dropped", r"id (\S+), value (\S+): ", AlarmJudge._dropped_message),
        ("given up", r"(\S+) has not answered (?:in time|for .*timed out)", AlarmJudge._silence),
        ("silent", r"(\S+) has not answered ", AlarmJudge._silence),
        ("late", r"() takes (\d+) s, and \d+ s were expected", AlarmJudge._silence),
        ("unknown outcome", r"whether (\S+) has done its action", AlarmJudge._unknown),
        ("search ended", r"was ended by .* of (\S+), and is tried again", AlarmJudge._rival),
        ("goes on", r"goes on with the run|was begun before this node", AlarmJudge._own_end),
        ("solver lost", r"waits until that node is there|waits for a so", AlarmJudge._lost_solver),
        ("solver lost", r"waiting for the solver |^starts, for ", AlarmJudge._lost_solver),
        ("no time", r"^why .*: there was no answer within (\S+) s; ", AlarmJudge._no_time),
        ("no connection", r" does not listen to ", AlarmJudge._lost_node),
        ("no connection", r"^Inbound TCP/IP connection failed: ", AlarmJudge._holds),
        ("the world", r", as ~faults says|^fault \d+ |^too slow: ", AlarmJudge._holds),
        ("failed", r"^(\w+): (\w+\(.*?\)): ", AlarmJudge._failure),
    )
]
