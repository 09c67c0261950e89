"""Decides when a replay sends its next input, as long as the run is the recorded one, and after.

By cause, not by the clock: an input has to come after the outputs that it came after when it was
recorded, such as an answer after its action. Needs no ROS.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import AbstractSet, Optional

from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.inputs import LoopActivity, RecordedInput
from rosoclingo.bags.replay.progress import ReplayProgress
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.replay_inbox import ScheduledKind


class Replay(ABC):
    """Sends recorded inputs in order. Not thread-safe.

    Attributes:
        progress: What was sent and seen.
        is_exact: Whether the loop's gate decides when an input is taken; else it has to be opened.
    """

    is_exact = False

    def __init__(self, progress: ReplayProgress) -> None:
        """Goes on from some progress."""
        self.progress = progress

    def see(self, record: journal.Record, now: float) -> None:
        """Takes an event of the replayed journal; see :meth:`.ReplayProgress.see`."""
        event = record.event
        if isinstance(event, journal.LoopWaits) and event.for_a_replay and not self.is_exact:
            return  # the gate is to be opened, and the loop goes on then
        self.progress.see(record, now)

    @abstractmethod
    def due(self, now: float) -> Optional[RecordedInput]:
        """Returns the next input if it is to be sent now; the caller sends it.

        Args:
            now: The time, in seconds of the clock of :meth:`see`.
        """


class ExactReplay(Replay):
    """Sends inputs ahead; the loop's gate takes each when the recorded loop has taken it.

    It is over when another command comes than was recorded, or when the gate waits in vain.
    :class:`FreeReplay` goes on from there.
    """

    def __init__(
        self,
        run: Run,
        *,
        rate: Optional[float] = None,
        arrived: AbstractSet[str] = frozenset(),
        kills: bool = False,
    ) -> None:
        """Begins before the first event.

        Args:
            run: The recorded run. Without a journal, it is not known when inputs were taken, and
                the exact replay is over.
            rate: That of :class:`ReplayProgress`.
            arrived: The ids of goals that the node has; grows.
            kills: Whether nodes are killed as recorded, see :meth:`go_on`.
        """
        super().__init__(ReplayProgress(run, rate))
        self.is_exact = run.has_journal
        events = (entry.event for entry in run.entries)
        self._commands = (event for event in events if isinstance(event, journal.CommandDone))
        self._arrived = arrived
        self._kills = kills
        self._restarts = 0  # of the node with the loop

    def see(self, record: journal.Record, now: float) -> None:
        """Takes an event of the replayed journal, and compares commands."""
        super().see(record, now)
        seen = record.event
        if isinstance(seen, journal.CommandDone):
            expected = next(self._commands, seen)
            if (expected.command, expected.result) != (seen.command, seen.result):
                self.is_exact = False

    def go_on(self, now: float, *, restarts: bool) -> None:
        """Resumes after the kill of a node for which the loop has waited.

        Args:
            now: The time, in seconds of the clock of :meth:`see`.
            restarts: Whether it was the node with the loop; another one is there.
        """
        self._restarts += restarts
        self.progress.go_on(now)

    def due(self, now: float) -> Optional[RecordedInput]:
        """Returns the next input if what comes before it has come."""
        progress, planned = self.progress, self.progress.next
        if planned is None or not self.is_exact:
            return None
        if progress.awaited.missing:
            if progress.is_settled(now):
                progress.stall()
                self.is_exact = False
            return None
        is_lost = self._kills and planned.restarts > self._restarts  # with a node that is killed
        if is_lost or not progress.is_time(planned, now):
            return None
        kind, identifier, _ = planned.key
        is_on_way = (
            progress.on_way[ScheduledKind.GOAL, identifier, ""] and identifier not in self._arrived
        )
        if kind == ScheduledKind.CANCEL and is_on_way and not progress.has_arrived(now):
            return None  # it would overtake its goal
        return progress.send(planned, now)


class FreeReplay(Replay):
    """Sends inputs with the gate open, as far as they make sense in a run that is another one.

    What came while the loop waited is sent when it waits again. A loop that waits in vain for what
    is expected is noted, and the rest of the inputs is sent, without answers to no action.
    """

    def due(self, now: float) -> Optional[RecordedInput]:
        """Returns the next input if the loop does what it did when it took that."""
        progress = self.progress
        planned = progress.next
        while planned is not None:
            is_ready = not progress.awaited.missing and self._is_at(planned)
            if not (is_ready or progress.is_settled(now)):
                return None
            if progress.awaited.missing:
                progress.stall()
            if planned.answers and progress.stalls and planned.key[1] not in progress.acting:
                if not progress.is_settled(now):
                    return None
                progress.skip()
                planned = progress.next
                continue
            overtakes = progress.on_way and planned.key[0] != progress.sent_kind
            if not progress.is_time(planned, now) or (overtakes and not progress.has_arrived(now)):
                return None
            return progress.send(planned, now)
        return None

    def _is_at(self, planned: RecordedInput) -> bool:
        progress = self.progress
        if planned.point is LoopActivity.SEARCHING and not progress.on_way:
            return progress.settled or progress.command == planned.command
        return progress.settled or planned.point is LoopActivity.BUSY
