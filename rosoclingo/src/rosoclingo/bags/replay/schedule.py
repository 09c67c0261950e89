"""Schedules the sending of recorded inputs to the replayed system. Needs no ROS.

By cause, not by the clock: an input has to come after the outputs that it came after when it was
recorded, such as an answer after its action. When the loop takes it is up to the loop's gate, as
long as the run is the recorded one. Without a gate, and when the run goes another way, what came
while the loop waited is sent when it waits again. A loop that waits in vain for what is expected is
noted, and the rest of the inputs is sent as far as it makes sense.
"""

from __future__ import annotations

from collections import Counter
from typing import AbstractSet, Dict, List, Optional

from rosoclingo.bags.compare.comparison import Stall
from rosoclingo.bags.read.run import Outputs, Run
from rosoclingo.bags.read.run_end import RunEnd
from rosoclingo.bags.replay.awaited import Awaited
from rosoclingo.bags.replay.inputs import (
    Input,
    Point,
    begins_a_wait,
    input_key,
    inputs,
    is_refused,
)
from rosoclingo.loop import journal
from rosoclingo.loop.replay_inbox import Key, Kind

_SETTLED_SECONDS = 1.0  # a loop that waits has nothing to do any more
_LOST_SECONDS = 5.0  # what a loop that waits has not taken by then is lost, on a busy machine too
_ORDER_SECONDS = 1.0  # an input that takes another topic lets the one before it arrive first
_MOST_ON_THEIR_WAY = 1000  # inputs that are sent and not taken; publishers have a limited queue


class Schedule:
    """Decides which input is sent next, from the replayed system's journal. Not thread-safe.

    Attributes:
        planned: The inputs, in order.
        stalls: Where the replay went another way and waited.
        skipped: How many inputs were not sent: answers to actions that never came.
        passed: How many inputs were sent or skipped.
        in_step: Whether the loop's gate decides when an input is taken. It has to be opened when
            this is False.
    """

    def __init__(
        self,
        run: Run,
        *,
        has_gate: bool = True,
        arrived: AbstractSet[str] = frozenset(),
        rate: Optional[float] = None,
        kills: bool = False,
    ) -> None:
        """Begins before the first input.

        Args:
            run: The recorded run.
            has_gate: Whether the loop has a gate, which takes the inputs as recorded.
            arrived: The ids of goals that the node has; grows.
            rate: How many times faster than recorded the inputs follow what they followed; None for
                at once.
            kills: Whether nodes are killed as recorded, see :meth:`go_on`.
        """
        self.planned = inputs(run)
        self.stalls: List[Stall] = []
        self.skipped = 0
        self.passed = 0
        self.in_step = has_gate
        events = (entry.event for entry in run.entries)
        self._commands = (event for event in events if isinstance(event, journal.CommandDone))
        self._arrived = arrived
        self._is_open = run.is_open
        self._rate = rate
        self._kills = kills
        self._restarts = 0  # of the node with the loop
        self._outputs = Outputs()
        self._awaited = Awaited(run, has_gate=has_gate)
        self._on_way: Counter[Key] = Counter()  # sent and not taken
        self._acting: Dict[str, None] = {}  # actuators without an answer, in order
        self._rests = False  # the loop waits, or is through
        self._settled = False  # and knows of all that was sent
        self._command = ""
        self._end = RunEnd()
        self._is_held = False  # the loop rests because its gate has it wait
        self._seen_at = self._sent_at = 0.0
        self._begin = 0.0  # of the time until the next input
        self._sent_kind: Optional[Kind] = None
        self._expect()

    # What the replayed run does.

    def see(self, record: journal.Record, now: float) -> None:
        """Takes an event of the replayed journal.

        Args:
            record: The event, in the journal's order.
            now: The time, in seconds of a monotonic clock.
        """
        event, output = record.event, self._outputs.find(record)
        self._seen_at = now
        self._end.see(event)
        if output is not None or isinstance(event, journal.ARRIVALS) or begins_a_wait(event):
            self._begin = now
        if is_refused(event):
            pass  # the loop does not see it, and may begin to wait before its status is noted
        elif isinstance(event, journal.ARRIVALS):
            self._take(input_key(event))
            if self._is_held:  # the loop has got what it waited for, and goes on
                self._is_held = self._rests = self._settled = False
        elif isinstance(event, journal.LoopWaits):
            if event.for_a_replay and not self.in_step:
                return  # the gate is to be opened, and the loop goes on then
            self._is_held = event.for_a_replay
            self._rests, self._settled = True, not self._on_way
        elif isinstance(event, journal.CommandDone):
            self._see_command(event)
        elif isinstance(event, journal.ActionPublished):
            self._acting[event.actuator] = None
        elif isinstance(event, journal.StatusSet) and event.status is not journal.Status.ACCEPTED:
            self._take((Kind.GOAL, event.goal, ""))  # if it was refused
            if event.reason is not journal.Reason.RECALLED:
                # actionlib passes on none to an ended goal.
                self._take((Kind.CANCEL, event.goal, ""))
        if output is not None:
            self._awaited.came(output.key)

    def _see_command(self, seen: journal.CommandDone) -> None:
        self._command = seen.command
        self._is_held = False
        self._rests = seen.publishes
        self._settled = self._rests and not self._on_way
        expected = next(self._commands, seen)
        if (expected.command, expected.result) != (seen.command, seen.result):
            self.in_step = False

    def _take(self, key: Key) -> None:
        if self._on_way[key] > 0:
            self._on_way[key] -= 1
            if not self._on_way[key]:
                del self._on_way[key]

    def go_on(self, now: float, *, restarts: bool) -> None:
        """Resumes after the kill of a node for which the loop has waited.

        Args:
            now: The time, in seconds of the clock of :meth:`see`.
            restarts: Whether it was the node with the loop; another one is there.
        """
        self._seen_at = now
        self._restarts += restarts
        self._is_held = self._rests = self._settled = False

    # What is to be sent.

    def due(self, now: float) -> Optional[Input]:
        """Returns the next input if it is to be sent now; the caller sends it.

        Args:
            now: The time, in seconds of the clock of :meth:`see`.
        """
        while self.passed < len(self.planned) and not self._end.loop_has_ended:
            planned = self.planned[self.passed]
            ready = not self._awaited.missing and self._at(planned)
            if not (ready or self._is_settled(now)):
                return None
            if self._awaited.missing:
                self._stall()
            if planned.answers and self.stalls and planned.key[1] not in self._acting:
                if not self._is_settled(now):
                    return None
                self.skipped += 1
                self._step()
                continue
            if not self._may_go(planned, now):
                return None
            self._send(planned, now)
            return planned
        return None

    @property
    def loop_has_ended(self) -> bool:
        """Whether the replayed loop has ended."""
        return self._end.loop_has_ended

    def is_finished(self, now: float) -> bool:
        """Whether all inputs are sent, and no more events can come."""
        if self._end.loop_has_ended:
            # The journal tells of what the loop takes last, and of what becomes of it, after that.
            return self._end.is_over and not self._on_way
        if self.passed < len(self.planned):
            return False
        if self._is_open and not self._awaited.missing and not self._on_way:
            return True
        if not self._is_settled(now):
            return False
        if self._awaited.missing:
            self._stall()
        return True

    def wake(self, now: float) -> float:
        """Returns the seconds until an input may be due even if no event comes."""
        latest = max(self._seen_at, self._sent_at)
        times = [latest + _SETTLED_SECONDS, latest + _LOST_SECONDS, self._sent_at + _ORDER_SECONDS]
        if self.passed < len(self.planned) and self._rate is not None:
            gap = self.planned[self.passed].gap / self._rate
            times.append(max(self._begin, self._sent_at) + gap)
        return min((time - now for time in times if time > now), default=_SETTLED_SECONDS)

    def _at(self, planned: Input) -> bool:
        if self.in_step:
            return True
        if planned.point is Point.WAITING:
            return self._settled
        if planned.point is Point.SEARCHING:
            return self._settled or (not self._on_way and self._command == planned.command)
        return True

    def _is_settled(self, now: float) -> bool:
        """Whether the loop is idle until an input is sent."""
        limit = _LOST_SECONDS if self._on_way else _SETTLED_SECONDS
        if self._rests and now - max(self._seen_at, self._sent_at) >= limit:
            self._on_way.clear()  # lost: a loop that waits takes at once what comes
            self._settled = True
        return self._settled

    def _may_go(self, planned: Input, now: float) -> bool:
        if self._kills and self.in_step and planned.restarts > self._restarts:
            return False  # it would be lost with the node that is to be killed
        gap = 0.0 if self._rate is None else planned.gap / self._rate
        if now < max(self._begin, self._sent_at) + gap:
            return False
        is_full = sum(self._on_way.values()) >= _MOST_ON_THEIR_WAY
        if is_full and not self._is_held:  # a gate waits for all at once
            return False
        kind, identifier, _ = planned.key
        if now - self._sent_at >= _ORDER_SECONDS:
            return True
        if self.in_step:  # but for actionlib's order
            is_on_way = self._on_way[Kind.GOAL, identifier, ""] and identifier not in self._arrived
            return kind is not Kind.CANCEL or not is_on_way
        return not self._on_way or kind is self._sent_kind

    def _send(self, planned: Input, now: float) -> None:
        kind, identifier, _ = planned.key
        if not (kind is Kind.CANCEL and identifier in self._end.ended_goals):  # else it is lost
            self._on_way[planned.key] += 1
            self._settled = False
        if kind is Kind.MESSAGE:
            self._acting.pop(identifier, None)
        self._sent_at, self._sent_kind = now, kind
        self._step()

    def _step(self) -> None:
        self.passed += 1
        self._expect()

    def _expect(self) -> None:
        is_last = self.passed == len(self.planned)
        self._awaited.expect(None if is_last else self.planned[self.passed].position)

    def _stall(self) -> None:
        """Waives the awaited outputs, and records the stall."""
        self.in_step = False
        self.stalls.append(Stall(self._awaited.give_up(), tuple(self._acting)))
