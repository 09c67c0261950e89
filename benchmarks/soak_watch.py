"""Judges a soak: each goal ends once, nothing is lost, robots do what they can. Needs no ROS.

A :class:`SoakWatch` is told what clients send and hear, what is in the journal, which processes
there are, and what was done to them; it says what cannot be right.
"""

from __future__ import annotations

import math
import threading
from collections import Counter, deque
from typing import Callable, Deque, Dict, List, Sequence, Set

from journal_validator import JournalValidator
from rosoclingo.loop import journal
from rosoclingo.loop.words import SUCCESS
from rosoclingo_aspprograms.validator import Edge, Map, arguments
from soak_alarms import Alarm, AlarmJudge, Order
from soak_latencies import ACKNOWLEDGED, BUSY, SoakLatencies, slow_down
from soak_records import Incident, Violation, WatchedGoal, WatchedNode
from soak_trends import Sample

_MOST_SECONDS = 7200.0  # of simulated time, that a goal may be open
_RECENT_EVENTS = 200  # of the journal, that a violation comes with, without those below
_ROUTINE = (
    journal.CommandDone,
    journal.SearchEnded,
    journal.PlanFound,
    journal.LoopWaits,
    journal.ActionTook,
)


class SoakWatch:
    """Watches a run. Thread-safe.

    Attributes:
        violations: What was wrong, in the order in which it was found.
        incidents: What has happened.
        counts: How often, by the kinds of incidents.
        latencies: What was measured.
        memory: In MiB, by nodes.
        alarms: Judges warnings.
    """

    def __init__(self, graph: Map, say: Callable[[Violation], object]) -> None:
        """Starts before the first event.

        Args:
            graph: The map, with the robots.
            say: Called with each violation, under a lock.
        """
        self._lock = threading.RLock()  # guards all below
        self._say = say
        self._journal = JournalValidator(graph)
        self._noted = 0  # events of the journal
        self._recent: Deque[str] = deque(maxlen=_RECENT_EVENTS)
        self._goals: Dict[str, WatchedGoal] = {}
        self._over: Dict[str, WatchedGoal] = {}  # whose ends are known to all
        self._nodes: Dict[str, WatchedNode] = {}
        self._acts: Dict[str, str] = {}
        self._failed: Set[Edge] = set()  # ways, until they are said to be free
        self._loop_ended = -math.inf  # in wall time
        self.violations: List[Violation] = []
        self.incidents: List[Incident] = []
        self.counts: Counter[str] = Counter()
        self.latencies = SoakLatencies()
        self.memory: Dict[str, List[Sample]] = {}
        self.alarms = AlarmJudge()

    def sends(
        self, goal: str, request: str, seconds: float, wall: float, *, finds_slot: bool
    ) -> None:
        """A client sends a goal, for which there may be a free slot."""
        with self._lock:
            self._goals[goal] = WatchedGoal(request, seconds, wall, finds_slot)
            self.happens(seconds, "asked", request)

    def sends_again(self, goal: str) -> None:
        """A client sends a goal again, whose result comes again then."""
        with self._lock:
            if goal in self._goals:
                self._goals[goal].excuses += 1
                self._goals[goal].wall = -1.0

    def cancels(self, goal: str) -> None:
        """A client asks to cancel a goal."""
        with self._lock:
            if goal in self._goals:
                self._goals[goal].is_cancelled = True

    def acknowledges(self, goal: str, seconds: float, wall: float) -> None:
        """A goal is in a list of statuses."""
        with self._lock:
            known = self._goals.get(goal)
            if known is not None and not known.is_acknowledged:
                known.is_acknowledged = True
                self.latencies.measure(ACKNOWLEDGED, known.wall, seconds, wall)

    def hears(self, goal: str, word: str, seconds: float, wall: float) -> None:
        """A client gets a result.

        Args:
            goal: The goal.
            word: How it has ended, as the journal has it, such as ``succeeded``.
            seconds: When, in simulated time.
            wall: The same, in wall time.
        """
        with self._lock:
            known = self._goals.get(goal) or self._over.get(goal)
            if known is None:
                self.wrong(seconds, f"a result of {goal}, which nobody has asked for")
                return
            if not known.result:
                self.happens(seconds, word, known.request)
            wrong = known.hear(word, wall, self._loop_ended)
            if wrong:
                self.wrong(seconds, f"{goal}, {known.request}{wrong}")

    def learns(self, number: int, event: journal.Event, seconds: float, wall: float) -> None:
        """The journal has an event, which may come again when the loop begins again.

        Args:
            number: That of the event in the run, from 1.
            event: The event.
            seconds: When, in simulated time.
            wall: When it came here, in wall time.
        """
        with self._lock:
            if number <= self._noted:
                return
            if number > self._noted + 1 and self._noted:
                lost = f"{self._noted + 1} to {number - 1}"
                self.wrong(seconds, f"the journal's events {lost} did not come")
            self._noted = number
            if not isinstance(event, _ROUTINE):
                self._recent.append(f"{seconds:.1f} s, {number}: {event}")
            self._journal.learns(event)
            violations = self._journal.validator.violations
            for text in violations:
                self.wrong(seconds, text)
            violations.clear()
            self._learn(event, seconds, wall)

    def _learn(self, event: journal.Event, seconds: float, wall: float) -> None:
        if isinstance(event, journal.MessageArrived):
            self.latencies.arrives(wall)
        if isinstance(event, journal.MessageDropped):
            self.alarms.warns(Alarm(journal.LOOP, event.reason, seconds, wall))
        if isinstance(event, journal.StatusSet):
            self._set_status(event, seconds, wall)
        elif isinstance(event, journal.MessageArrived) and event.source in self._acts:
            self._happens_in(event, seconds)
            self.latencies.answers(event.source, wall)
        elif isinstance(event, journal.MessageArrived):
            self._failed.discard(frozenset(arguments(event.value, "unblocked")))
        elif isinstance(event, journal.ActionPublished):
            self._acts[event.actuator] = event.action
            self.latencies.acts(event.actuator, seconds, wall)
        elif isinstance(event, journal.LoopWaits):
            self.latencies.forget_answers()
        elif isinstance(event, journal.NodeResumed):
            self.latencies.forget_answers()
            self.happens(seconds, "resumed", event.node)
        elif isinstance(event, journal.LoopEnded):
            self.wrong(seconds, f"the planning loop has ended: {event.reason}")
        elif isinstance(event, journal.GoalArrived):
            # One that is recalled is over before the loop takes it.
            known = self._goals.get(event.goal) or self._over.get(event.goal)
            if known is None:
                self.wrong(seconds, f"{event.goal} arrives, {event.request}: nobody asks for it")
            elif known.has_arrived:
                self.wrong(seconds, f"{event.goal}, {event.request}, arrives twice")
            else:
                known.has_arrived = True

    def _set_status(self, event: journal.StatusSet, seconds: float, wall: float) -> None:
        known = self._goals.get(event.goal)
        if known is None:
            about = f"{event.goal} is {event.status.value}"
            self.wrong(seconds, f"{about}, and is over or nobody has asked for it")
            return
        if event.status is journal.Status.CANCELED and not known.is_cancelled:
            self.wrong(seconds, f"{event.goal}, {known.request}, is canceled: nobody asks for it")
        known.status = event.status.value
        if event.status is journal.Status.ACCEPTED and known.finds_slot:
            self.latencies.accepts(known.wall, seconds, wall)

    def _happens_in(self, event: journal.MessageArrived, seconds: float) -> None:
        """An action of a robot has ended."""
        action = self._acts.pop(event.source)
        target = arguments(action, "go")
        if event.value != SUCCESS:
            here = self._journal.validator.positions[event.source]
            self._failed |= {frozenset((here, waypoint)) for waypoint in target}
            self.happens(seconds, f"{event.value} of an action", f"{event.source}: {action}")
        for _ in arguments(action, "deliver") if event.value == SUCCESS else ():
            self.happens(seconds, "handed over", event.source)

    def happens(self, seconds: float, kind: str, text: str = "") -> None:
        """Something has happened, to be drawn."""
        with self._lock:
            self.counts[kind] += 1
            self.incidents.append(Incident(seconds, kind, text))

    def wrong(self, seconds: float, text: str) -> None:
        """Something is wrong, here or where the caller has found it."""
        with self._lock:
            violation = Violation(seconds, text, tuple(self._recent))
            self.violations.append(violation)
            self.happens(seconds, "violation", text)
            self._say(violation)

    def ends(self, node: str, how: str, seconds: float, wall: float) -> None:
        """The soak ends a node; goals that are under way take longer because of that."""
        with self._lock:
            self._nodes[node].is_ended = True
            self.alarms.ends(node, wall)
            if node == journal.LOOP:
                self._loop_ended = wall
            self.happens(seconds, how, node)
            self.latencies.forget_answers()
            for goal in self._goals.values():
                goal.wall = -1.0

    def tells(self, run: str, orders: Sequence[Order], seconds: float, wall: float) -> None:
        """Actuators are told something, by ``~dispatch``."""
        with self._lock:
            self.alarms.tells(run, orders, seconds, wall)

    def answers(self, run: str, number: int, value: str, wall: float) -> None:
        """An interface answers with a token."""
        with self._lock:
            self.alarms.answers(run, number, value, wall)

    def warns(self, alarm: Alarm) -> None:
        """A node warns in its log."""
        with self._lock:
            self.alarms.warns(alarm)

    def reports(self, alarm: Alarm, *, is_well: bool) -> None:
        """A part of diagnostics says how it is."""
        with self._lock:
            self.alarms.reports(alarm, is_well=is_well)

    def judge_alarms(self, seconds: float, wall: float) -> None:
        """Judges the warnings that have come, but for the last ones."""
        with self._lock:
            for alarm, why in self.alarms.judge(wall):
                self.wrong(seconds, f"a false alarm of {alarm.source}: {alarm.text}: {why}")

    def is_process(self, node: str, pid: int, seconds: float, wall: float) -> None:
        """A node has been looked for.

        Args:
            node: Its name.
            pid: Its process; 0 if there is none.
            seconds: When, in simulated time.
            wall: The same, in wall time.
        """
        with self._lock:
            known = self._nodes.setdefault(node, WatchedNode(node, wall))
            wrong = known.look(pid, wall)
            if wrong:
                self.wrong(seconds, wrong)

    def takes(self, node: str, mebibytes: float, seconds: float) -> None:
        """A node has so much memory."""
        with self._lock:
            life = self._nodes[node].pid
            self.memory.setdefault(node, []).append(Sample(seconds, mebibytes, life))

    def uses(self, used: Dict[int, float], seconds: float) -> None:
        """The processes that plan have used so many seconds of processor time."""
        with self._lock:
            self.latencies.uses(used, seconds)
            self.latencies.samples[BUSY].append(Sample(seconds, slow_down()))

    @property
    def open(self) -> List[str]:
        """The goals without a result."""
        with self._lock:
            return [goal for goal, known in self._goals.items() if not known.result]

    @property
    def blocked(self) -> Set[Edge]:
        """The ways that count as blocked, or on which a drive has failed."""
        with self._lock:
            return self._journal.validator.believed() | self._failed

    @property
    def lost(self) -> Set[str]:
        """The robots that are lost."""
        with self._lock:
            return set(self._journal.validator.lost)

    def is_open(self, goal: str) -> bool:
        """Tells if a goal has no result yet."""
        with self._lock:
            return goal in self._goals and not self._goals[goal].result

    # What is judged in between, and in the end.

    def check(self, seconds: float) -> int:
        """Looks for goals that do not end, and forgets the others; returns how many are left."""
        with self._lock:
            for goal, known in list(self._goals.items()):
                if known.result and known.status == known.result:
                    self._over[goal] = self._goals.pop(goal)
                    self._journal.forget(goal)
                elif seconds - known.sent > _MOST_SECONDS and not known.is_late:
                    known.is_late = True
                    what = "no end" if not known.result else f"{known.status} in the journal"
                    text = f"{goal}, {known.request}: {what} after {_MOST_SECONDS:.0f} s"
                    self.wrong(seconds, text)
            return len(self._goals)

    def finish(self, seconds: float) -> None:
        """Checks that all goals have ended, and as the journal has it."""
        with self._lock:
            for goal, known in self._goals.items():
                about = f"{goal}, {known.request}"
                if not known.result:
                    told = "acknowledged" if known.is_acknowledged else "never acknowledged"
                    self.wrong(seconds, f"{about}: lost, without a result; it was {told}")
                elif known.status != known.result:
                    journal = known.status or "unknown"
                    text = f"{about}: its client hears {known.result}, the journal has {journal}"
                    self.wrong(seconds, text)
            for text in self._journal.validator.finish():
                self.wrong(seconds, text)
            self._journal.validator.violations.clear()
