"""Outcomes that a replay dictates besides inputs: how searches end, and what clocks measure."""

from __future__ import annotations

import threading
from collections import Counter, deque
from typing import Collection, Deque, Mapping, Optional, Sequence, Tuple

from rosoclingo.loop.journal import IMPROVING, Ended, SearchEnded


def reading(number: int) -> str:
    """Returns the name of a reading of the clock.

    Args:
        number: Its number in the run.
    """
    return f"clock {number}"


class Recorded:
    """Outcomes of a recorded run, which the loop has to repeat; none in a new run. Thread-safe.

    Attributes:
        decision: How many decisions the replay has carried out; -1 before the first one.
        knows_searches: Whether all time-dependent searches have known outcomes, so that time ends
            none; not after :meth:`forget`.
        knows_inputs: Whether all inputs are known, so that none follows from the time that passes;
            not after :meth:`forget`.
    """

    def __init__(
        self,
        searches: Sequence[Tuple[int, SearchEnded]] = (),
        times: Optional[Mapping[str, float]] = None,
        *,
        knows_searches: bool = False,
        early: Collection[int] = (),
    ) -> None:
        """Begins before the first decision.

        Args:
            searches: How searches end, each with the number of decisions before it.
            times: What clocks have measured, in seconds: how long actions took, by the numbers of
                their tokens, and the time, by :func:`reading`; None in a new run.
            knows_searches: Whether these are all searches whose outcome depends on time.
            early: The numbers of decisions to wait during which the loop was killed, once for each
                search for a better plan in that wait. A replay repeats these searches before the
                decision.
        """
        self.decision = -1
        self.knows_searches = knows_searches
        self.knows_inputs = times is not None
        self._searches: Deque[Tuple[int, SearchEnded]] = deque(searches)
        self._times = times
        self._early = Counter(early)
        self._lock = threading.Lock()  # guards the searches

    def search_due(self, *ways: Ended, number: int = 0) -> Optional[SearchEnded]:
        """Returns how the next of these searches ends, and removes it.

        Args:
            ways: In which of these ways.
            number: How many answer sets have asked for something before, in the same search.

        Returns:
            None if the next one ends otherwise, or if there is none before the next decision.
        """
        with self._lock:
            ended = self._next()
            if ended is None or ended.how not in ways or ended.round != number:
                return None
            self._searches.popleft()
            if ended.how in IMPROVING:
                self._early[self.decision] -= 1
            return ended

    @property
    def is_early_due(self) -> bool:
        """True if the replay has to repeat a search for a better plan before the next decision."""
        return self._early[self.decision] > 0 and self.is_search_due(improves=True)

    def is_search_due(self, *, improves: bool) -> bool:
        """Tells if an outcome is recorded before the next decision; removes nothing.

        Args:
            improves: Whether the next one is to be for a better plan, or for a plan.
        """
        with self._lock:
            ended = self._next()
            return ended is not None and improves == (ended.how in IMPROVING)

    def measured(self, name: str, seconds: float) -> Optional[float]:
        """Returns what a clock has measured; in a replay, what it did in the recording.

        Args:
            name: The number of an action's token, or what :func:`reading` returns.
            seconds: What it has measured now, in seconds.

        Returns:
            None if the recording does not say.
        """
        return seconds if self._times is None else self._times.get(name)

    def forget(self) -> None:
        """Has the loop go on by itself from now on, as the run is another one."""
        with self._lock:
            self.knows_searches = self.knows_inputs = False
            self._searches.clear()

    def _next(self) -> Optional[SearchEnded]:
        while self._searches and self._searches[0][0] < self.decision:
            self._searches.popleft()
        is_due = self._searches and self._searches[0][0] == self.decision
        return self._searches[0][1] if is_due else None
