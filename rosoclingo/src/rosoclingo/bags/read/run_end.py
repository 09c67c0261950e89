"""Detects the end of a run in its journal, for recorder, replay and comparison. Needs no ROS.

A journal says that its loop has ended before it says what becomes of the goals that are open then,
and goals are what a client waits for. So a run is over with the last status of its last goal:

>>> end = RunEnd()
>>> for event in GoalArrived("g", "visit(3)"), LoopEnded("no plan"):
...     end.see(event)
>>> end.is_over
False
>>> end.see(StatusSet("g", Status.ABORTED, "1"))
>>> end.is_over
True
"""

from __future__ import annotations

from typing import Set

from rosoclingo.loop.journal import Event, GoalArrived, LoopEnded, Status, StatusSet


class RunEnd:
    """Detects the end of a run, event by event. Not thread-safe.

    A goal that comes after the end is refused, and the journal has no arrival of it.

    Attributes:
        loop_has_ended: Whether the loop has ended, so that nothing is taken any more.
        ended_goals: The ids of the goals with a last status.
    """

    def __init__(self) -> None:
        """Begins before the first event."""
        self.loop_has_ended = False
        self.ended_goals: Set[str] = set()
        self._open: Set[str] = set()

    def see(self, event: Event) -> None:
        """Takes the next event of the journal."""
        if isinstance(event, GoalArrived):
            if event.goal not in self.ended_goals:  # else it was recalled before the loop took it
                self._open.add(event.goal)
        elif isinstance(event, StatusSet) and event.status is not Status.ACCEPTED:
            self.ended_goals.add(event.goal)
            self._open.discard(event.goal)
        elif isinstance(event, LoopEnded):
            self.loop_has_ended = True

    @property
    def is_over(self) -> bool:
        """Whether the loop and all of its goals have ended."""
        return self.loop_has_ended and not self._open
