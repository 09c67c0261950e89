"""Solver wrappers: one retries interrupted searches, one takes a mode's lost memory for a loss."""

from __future__ import annotations

from typing import Callable, Optional, Sequence, Set, TypeVar

from rosclingo.errors import OutOfMemoryError, ServiceError
from rosclingo.wire.commands import Assumed, Improvement, Outcome
from rosoclingo.errors import OutsideError
from rosoclingo.loop.values.solver import Forwarding, Solver

_T = TypeVar("_T")

# Two loops that share a solver end each other's searches for ever; a bag comes to an end.
_TRIES = 1000


class RetryingSolver(Forwarding):
    """Retries searches: a solver's newest goal preempts the one before, of whichever client."""

    def __init__(self, solver: Solver, name: str, warn: Callable[[str], None]) -> None:
        """Wraps a solver.

        Args:
            solver: The solver.
            name: Its name, for messages.
            warn: Logs what disturbs it, once.
        """
        super().__init__(solver)
        self._name = name
        self._warn = warn
        self._warned = False

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches until there is a result or ``stopped`` is true; retries if others interrupt it.

        Raises:
            OutsideError: It is interrupted again and again.
        """
        is_told = False

        def is_stopped() -> bool:
            nonlocal is_told  # it may be false again when the search has ended
            is_told = is_told or (stopped is not None and stopped())
            return is_told

        others: Set[str] = set()
        for _ in range(_TRIES):
            outcome = super().solve(assumptions, is_stopped, improved)
            if not outcome.interrupted or is_stopped():
                return outcome
            if outcome.ended_by:
                others.add(outcome.ended_by)
                self._warn_of(outcome.ended_by)
        if others:
            raise OutsideError(
                f"{_TRIES} times, the same search of {self._name} was ended, also by "
                f"{', '.join(sorted(others))}: does another rosoclingo use that solver? Give each "
                "its own (~controller, ~planner)"
            )
        raise OutsideError(
            f"{_TRIES} times, the same search of {self._name} was interrupted, and no other node "
            "is known to have done that: see what its terminal says, and which options it has"
        )

    def _warn_of(self, other: str) -> None:
        if not self._warned:
            self._warned = True
            self._warn(
                f"a search of {self._name} was ended by a goal, cancel or control request of "
                f"{other}, and is tried again; leave {self._name}/goal and {self._name}/cancel out "
                "of what rosbag plays, and let no other node use it"
            )


class ModeSolver(Forwarding):
    """A mode's solver: one that ran out of memory counts as lost, since no goal is the cause."""

    def _call(self, call: Callable[[], _T]) -> _T:
        try:
            return call()
        except OutOfMemoryError as err:
            raise ServiceError(f"the controller: {err}") from err
