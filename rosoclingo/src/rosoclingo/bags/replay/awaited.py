"""Awaits the outputs that a replay has to produce before its next input. Needs no ROS."""

from __future__ import annotations

from collections import Counter
from typing import List, Optional, Set

from rosoclingo.bags.read.run import Output, Run
from rosoclingo.bags.replay.inputs import begins_a_wait
from rosoclingo.loop import journal


class Awaited:
    """The outputs that are expected before the next input and have not come.

    Attributes:
        missing: How many of them have not come.
    """

    def __init__(self, run: Run) -> None:
        """Prepares; :meth:`expect` sets the outputs."""
        self.missing = 0
        self._expected = [output for output in run.outputs if output is not None]
        self._knows_threads = run.has_journal
        self._of_lost_decisions = _of_lost_decisions(run)
        self._begin = 0  # of those that were expected last
        self._end: Optional[int] = 0  # of the same
        self._counts: Counter[journal.Event] = Counter()
        self._of_others: List[Output] = []  # that no input waits for, but the end does
        self._waived: Counter[journal.Event] = Counter()  # given up, and may still come

    def expect(self, end: Optional[int]) -> None:
        """Expects the outputs between the input before and the next one.

        Args:
            end: How many outputs were there before the next input; None if there is no other.
        """
        assert self._end is not None
        self._begin, self._end = self._end, end
        expected = self._expected[self._begin : end]
        if end is None:
            expected += self._of_others
        for number, output in enumerate(expected, self._begin):
            if isinstance(output.event, journal.LoopEnded):  # what it took then, had come before
                continue
            is_another_thread = isinstance(output.event, journal.StatusSet) and output.step is None
            may_come_later = is_another_thread or number in self._of_lost_decisions
            if may_come_later and self._knows_threads and end is not None:
                self._of_others.append(output)
                continue
            self._counts[output.key] += 1
            if self._counts[output.key] > 0:
                self.missing += 1

    def came(self, key: journal.Event) -> None:
        """Counts an output of the replayed run, by its key."""
        if self._waived[key] > 0:
            self._waived[key] -= 1
            return
        if self._counts[key] > 0:
            self.missing -= 1
        self._counts[key] -= 1

    def give_up(self) -> int:
        """Waives the missing outputs, and returns the place of the first one."""
        missing = +self._counts
        places = range(self._begin, len(self._expected))
        first = (place for place in places if self._expected[place].key in missing)
        self._waived.update(missing)
        self._counts.subtract(missing)
        self.missing = 0
        return next(first, self._begin)


def _of_lost_decisions(run: Run) -> Set[int]:
    """Returns the numbers of the statuses that were set by decisions to wait that were lost.

    The loop has died in that wait. A replay has what came in the wait before the decision, and so
    before these statuses.
    """
    found: Set[int] = set()
    new: Set[int] = set()  # since the last command
    count, waits = 0, False
    for entry, output in zip(run.entries, run.outputs):
        event = entry.event
        if output is not None:
            if isinstance(event, journal.StatusSet) and not waits:
                new.add(count)
            count += 1
        is_loop = isinstance(event, journal.NodeResumed) and event.node == journal.LOOP
        if is_loop and waits:
            found |= new
        if is_loop or isinstance(event, journal.CommandDone):
            new, waits = set(), False
        waits |= begins_a_wait(event)
    return found
