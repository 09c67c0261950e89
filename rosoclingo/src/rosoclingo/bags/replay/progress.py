"""The inputs that a replay has sent, and the outputs that have come of them. Needs no ROS."""

from __future__ import annotations

from collections import Counter
from typing import Dict, List, Optional

from rosoclingo.bags.compare.comparison import Stall
from rosoclingo.bags.read.run import Outputs, Run
from rosoclingo.bags.read.run_end import RunEnd
from rosoclingo.bags.replay.awaited import Awaited
from rosoclingo.bags.replay.inputs import RecordedInput, begins_a_wait, inputs, is_refused
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.replay_inbox import InputKey, ScheduledKind

_SETTLED_SECONDS = 1.0  # a loop that waits has nothing to do any more
_LOST_SECONDS = 5.0  # what a loop that waits has not taken by then is lost, on a busy machine too
_ORDER_SECONDS = 1.0  # an input that takes another topic lets the one before it arrive first
_MOST_ON_THEIR_WAY = 1000  # inputs that are sent and not taken; publishers have a limited queue


class ReplayProgress:
    """Progress of a replay: the inputs sent, and the replayed journal so far. Not thread-safe.

    Attributes:
        planned: The inputs, in order.
        stalls: Where the replay went another way and waited.
        skipped: How many inputs were not sent: answers to actions that never came.
        passed: How many inputs were sent or skipped.
        awaited: The outputs that come before the next input.
        on_way: The inputs that were sent and not taken.
        acting: The actuators without an answer, in order.
        is_held: Whether the loop rests because its gate has it wait.
        settled: Whether the loop waits, or is through, and knows of all that was sent.
        command: The last command.
        end: How far the run's end has come.
        sent_kind: The kind of the last input.
    """

    def __init__(self, run: Run, rate: Optional[float] = None) -> None:
        """Begins before the first input.

        Args:
            run: The recorded run.
            rate: How many times faster than recorded the inputs follow what they followed; None for
                at once.
        """
        self.planned = inputs(run)
        self.stalls: List[Stall] = []
        self.skipped = 0
        self.passed = -1
        self.awaited = Awaited(run)
        self.on_way: Counter[InputKey] = Counter()
        self.acting: Dict[str, None] = {}
        self.is_held = False
        self.settled = False
        self.command = ""
        self.end = RunEnd()
        self.sent_kind: Optional[str] = None
        self._is_open = run.is_open
        self._rate = rate
        self._outputs = Outputs()
        self._rests = False  # the loop waits, or is through
        self._seen_at = self._sent_at = 0.0
        self._begin = 0.0  # of the time until the next input
        self._step()

    def see(self, record: journal.Record, now: float) -> None:
        """Takes an event of the replayed journal.

        Args:
            record: The event, in the journal's order.
            now: The time, in seconds of a monotonic clock.
        """
        event, output = record.event, self._outputs.find(record)
        self._seen_at = now
        self.end.see(event)
        if output is not None or isinstance(event, journal.ARRIVALS) or begins_a_wait(event):
            self._begin = now
        if is_refused(event):
            pass  # the loop does not see it, and may begin to wait before its status is noted
        elif isinstance(event, journal.ARRIVALS):
            self._take(journal.key_of(event))
            if self.is_held:  # the loop has got what it waited for
                self.go_on(now)
        elif isinstance(event, journal.LoopWaits):
            self.is_held = event.for_a_replay
            self._rests, self.settled = True, not self.on_way
        elif isinstance(event, journal.CommandDone):
            self.command, self.is_held, self._rests = event.command, False, event.publishes
            self.settled = self._rests and not self.on_way
        elif isinstance(event, journal.ActionPublished):
            self.acting[event.actuator] = None
        elif isinstance(event, journal.StatusSet) and event.status is not journal.Status.ACCEPTED:
            self._take((ScheduledKind.GOAL, event.goal, ""))  # if it was refused
            if event.reason is not journal.Reason.RECALLED:
                # actionlib passes on none to an ended goal.
                self._take((ScheduledKind.CANCEL, event.goal, ""))
        if output is not None:
            self.awaited.came(output.key)

    def _take(self, key: InputKey) -> None:
        if self.on_way[key] > 0:
            self.on_way[key] -= 1
            if not self.on_way[key]:
                del self.on_way[key]

    def go_on(self, now: float) -> None:
        """Records that the loop has got what its gate had it wait for."""
        self._seen_at = now
        self.is_held = self._rests = self.settled = False

    # What is sent.

    @property
    def next(self) -> Optional[RecordedInput]:
        """The next input; None if all were sent, or if the loop has ended."""
        if self.passed == len(self.planned) or self.end.loop_has_ended:
            return None
        return self.planned[self.passed]

    def is_settled(self, now: float) -> bool:
        """Tells if the loop is idle until an input is sent."""
        limit = _LOST_SECONDS if self.on_way else _SETTLED_SECONDS
        if self._rests and now - max(self._seen_at, self._sent_at) >= limit:
            self.on_way.clear()  # lost: a loop that waits takes at once what comes
            self.settled = True
        return self.settled

    def is_time(self, planned: RecordedInput, now: float) -> bool:
        """Tells if an input is neither too early, nor too much for the publishers' queues."""
        is_full = sum(self.on_way.values()) >= _MOST_ON_THEIR_WAY
        # A gate waits for all at once.
        return now >= self._earliest(planned) and (self.is_held or not is_full)

    def _earliest(self, planned: RecordedInput) -> float:
        gap = 0.0 if self._rate is None else planned.gap / self._rate
        return max(self._begin, self._sent_at) + gap

    def has_arrived(self, now: float) -> bool:
        """Tells if the last input was sent so long ago that no other one overtakes it."""
        return now - self._sent_at >= _ORDER_SECONDS

    def send(self, planned: RecordedInput, now: float) -> RecordedInput:
        """Records that the next input is sent now, and returns it."""
        kind, identifier, _ = planned.key
        if not (
            kind == ScheduledKind.CANCEL and identifier in self.end.ended_goals
        ):  # else it is lost
            self.on_way[planned.key] += 1
            self.settled = False
        if kind == ScheduledKind.MESSAGE:
            self.acting.pop(identifier, None)
        self._sent_at, self.sent_kind = now, kind
        self._step()
        return planned

    def skip(self) -> None:
        """Records that the next input is not sent."""
        self.skipped += 1
        self._step()

    def _step(self) -> None:
        self.passed += 1
        is_last = self.passed == len(self.planned)
        self.awaited.expect(None if is_last else self.planned[self.passed].position)

    def stall(self) -> None:
        """Waives the awaited outputs, and records the stall."""
        self.stalls.append(Stall(self.awaited.give_up(), tuple(self.acting)))

    # The end.

    def is_finished(self, now: float) -> bool:
        """Tells if all inputs are sent, and no more events can come."""
        if self.end.loop_has_ended:
            # The journal tells of what the loop takes last, and of what becomes of it, after that.
            return self.end.is_over and not self.on_way
        if self.passed < len(self.planned):
            return False
        if self._is_open and not self.awaited.missing and not self.on_way:
            return True
        if not self.is_settled(now):
            return False
        if self.awaited.missing:
            self.stall()
        return True

    def wake(self, now: float) -> float:
        """Returns the seconds until an input may be due even if no event comes."""
        latest = max(self._seen_at, self._sent_at)
        times = [latest + _SETTLED_SECONDS, latest + _LOST_SECONDS, self._sent_at + _ORDER_SECONDS]
        times += [self._earliest(one) for one in self.planned[self.passed : self.passed + 1]]
        return min((time - now for time in times if time > now), default=_SETTLED_SECONDS)
