"""The loop's port to a solver, and a base class of wrappers.

:class:`rosclingo.ros.client.Client` is one over ROS, and
:class:`rosclingo.solver.engine.Engine` one in process.
"""

from __future__ import annotations

from typing import Callable, Optional, Protocol, Sequence, TypeVar

from rosclingo.wire import commands as wire

_T = TypeVar("_T")


class Solver(Protocol):
    """Runs commands and solve calls. One thread makes the calls."""

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = ...,
        stopped: Optional[Callable[[], bool]] = ...,
        improved: Callable[[wire.Improvement], None] = ...,
    ) -> wire.Outcome:
        """Searches for answer sets until told to stop."""

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""


class Forwarding:
    """Base class of wrappers: delegates every call to another solver.

    A wrapper overrides ``_call`` to guard all calls, or ``_found`` to change outcomes.
    """

    def __init__(self, solver: Solver) -> None:
        self._solver = solver

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        return self._call(lambda: self._solver.run(commands))

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches for answer sets until told to stop."""
        return self._found(self._call(lambda: self._solver.solve(assumptions, stopped, improved)))

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""
        self._call(self._solver.check)

    def _call(self, call: Callable[[], _T]) -> _T:
        """Makes a call of the other solver."""
        return call()

    def _found(self, outcome: wire.Outcome) -> wire.Outcome:
        """Returns the outcome of a search as the wrapper's caller gets it."""
        return outcome
