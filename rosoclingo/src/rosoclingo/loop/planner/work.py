"""Work budgets: limits of searches that do not depend on the load of the machine.

The unit is about a second of a processor. The solver's conflicts are counted for that, and weighed
by the size of its problem: so a budget depends neither on other processes nor on chance, and the
same searches end in the same way each time.

>>> class Problem:
...     def run(self, commands):
...         return wire.Reply((wire.Stats({"problem": {"generator": {"vars": 20_000.0}}}),))
>>> work = Work(Problem())
>>> work.limit(1.0), work.limit(0.0)
(ConflictLimit(conflicts=6666), ConflictLimit(conflicts=1))
"""

from __future__ import annotations

import time
from typing import Any, Callable, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.values.solver import Forwarding, Solver

_PER_SEARCH = 0.5e-6  # seconds for each variable of the problem
_PER_CONFLICT = 1e-5  # seconds
_PER_CONFLICT_AND_VARIABLE = 7e-9  # seconds, in addition
_LONG = 0.05  # seconds; of a longer limit, it is asked how much was used
_EARLY = 4  # a search that ends before a shorter one has used a fourth, as a rule of thumb


class Work(Forwarding):
    """A solver that counts the work of its searches. One thread makes the calls.

    Attributes:
        seconds: The work so far, in seconds of a processor; searches without a limit of conflicts
            count as hardly any.
    """

    def __init__(self, solver: Solver) -> None:
        super().__init__(solver)
        self.seconds = 0.0
        self._size = 0.0  # variables of the problem in the last search
        self._has_grown = self._may_read = True

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        self._has_grown |= any(isinstance(one, (wire.Ground, wire.Restart)) for one in commands)
        return super().run(commands)

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches for answer sets until told to stop, and counts the work."""
        outcome = super().solve(assumptions, stopped, improved)
        self._may_read |= self._has_grown  # clingo's statistics are those of the last search
        self._has_grown = False
        self.seconds += _PER_SEARCH * self._size
        limits = [one.conflicts for one in assumptions if isinstance(one, wire.ConflictLimit)]
        if limits:
            is_used_up = outcome.result is wire.Result.UNKNOWN and not outcome.interrupted
            seconds = limits[-1] * self._per_conflict
            if not is_used_up and seconds > _LONG:
                seconds = self._read("solving", "solvers", "conflicts") * self._per_conflict
            elif not is_used_up:
                seconds /= _EARLY
            self.seconds += seconds
        return outcome

    def limit(self, seconds: float) -> wire.ConflictLimit:
        """Returns the limit of a search for a budget in seconds of work."""
        if self._may_read:
            self._may_read = False
            self._size = self._read("problem", "generator", "vars")
        return wire.ConflictLimit(max(1, min(10**9, int(seconds / self._per_conflict))))

    @property
    def _per_conflict(self) -> float:
        return _PER_CONFLICT + _PER_CONFLICT_AND_VARIABLE * self._size

    def _read(self, *keys: str) -> float:
        """Returns a value of clingo's statistics about the last search; 0 if it is missing."""
        values: Any = read_statistics(self)
        for key in keys:
            values = values.get(key, {})
        return float(values or 0.0)


class SearchClock:
    """A clock for limits of searches: wall time, where robots wait for the plan.

    Attributes:
        is_seen: Whether it goes on while a search does.
    """

    is_seen = True

    def now(self) -> float:
        """Returns the time in seconds, from some beginning."""
        return time.monotonic()

    def limits(self, until: float) -> Tuple[wire.ConflictLimit, ...]:
        """Returns the solver's limits for a deadline, if :meth:`now` stops during a search."""
        return ()


class WorkClock(SearchClock):
    """A clock that shows the work done, where nothing waits and plans must be reproducible."""

    is_seen = False

    def __init__(self, work: Work) -> None:
        self._work = work

    def now(self) -> float:
        """Returns the work so far, which stands still during a search."""
        return self._work.seconds

    def limits(self, until: float) -> Tuple[wire.ConflictLimit, ...]:
        """Returns the limit of a search that has to end at a time."""
        return (self._work.limit(min(until - self.now(), 1e6)),)


def read_statistics(solver: Solver) -> Any:
    """Returns clingo's statistics about the last search; empty if there are none."""
    for answer in solver.run([wire.GetStats()]).answers:
        if isinstance(answer, wire.Stats):
            return answer.values
    return {}
