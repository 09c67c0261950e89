"""Schedules the kills of a replay, and the inputs of the loops that follow. Needs no ROS."""

from __future__ import annotations

from typing import Collection, List, Optional, Sequence

from rosoclingo.bags.replay.input_schedule import rest, take
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.replay_inbox import ScheduledInput, ScheduledKind


class KillSchedule:
    """A schedule of inputs and kills, during the lives of the node with the loop. Not thread-safe.

    Attributes:
        dues: What the loop is to take that runs, or that starts next, counted from its beginning.
    """

    def __init__(self, dues: Sequence[ScheduledInput], nodes: Collection[str]) -> None:
        """Begins with the first life.

        Args:
            dues: The schedule of the whole replay.
            nodes: Those that can be killed.
        """
        self.dues: List[ScheduledInput] = [
            due for due in dues if due.kind is not ScheduledKind.KILL or due.id in nodes
        ]
        self._decisions = 0  # of the loop that runs

    def see(self, event: journal.Event) -> Optional[str]:
        """Takes an event of the replayed journal; returns the node that is to be killed now."""
        take(self.dues, event)
        if isinstance(event, journal.CommandDone):
            self._decisions += 1
        if not (isinstance(event, journal.LoopWaits) and event.for_a_replay):
            return None
        kill = self._next_kill
        return kill.id if kill is not None and kill.decision == self._decisions else None

    def killed(self) -> None:
        """Removes the next kill; after that of the loop, the schedule is for another one."""
        kill = self._next_kill
        assert kill is not None
        self.dues.remove(kill)
        if kill.id == journal.LOOP:
            self.dues = rest(self.dues, self._decisions)
            self._decisions = 0

    @property
    def _next_kill(self) -> Optional[ScheduledInput]:
        return next((due for due in self.dues if due.kind is ScheduledKind.KILL), None)
