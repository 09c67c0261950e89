"""A solver wrapper that retries searches which other clients have interrupted."""

from __future__ import annotations

from typing import Callable, Optional, Sequence

from rosclingo.wire.commands import Assumed, Improvement, Outcome
from rosoclingo.errors import OutsideError
from rosoclingo.loop.values.solver import Forwarding, Solver

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
            OutsideError: Somebody else has ended the search again and again.
        """
        for _ in range(_TRIES):
            outcome = super().solve(assumptions, stopped, improved)
            if not outcome.interrupted or (stopped is not None and stopped()):
                return outcome
            if not self._warned:
                self._warned = True
                self._warn(
                    f"a search of {self._name} was ended by a goal, cancel or control request of "
                    f"somebody else, and is tried again; leave {self._name}/goal and "
                    f"{self._name}/cancel out of what rosbag plays, and let nobody else use it"
                )
        raise OutsideError(
            f"{_TRIES} times, others have ended the same search of {self._name}: does another "
            "rosoclingo use that solver? Give each its own (~controller, ~planner)"
        )
