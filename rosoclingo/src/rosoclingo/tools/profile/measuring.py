"""Measures how long a planner's solver grounds and searches, and logs what it grounds."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Callable, List, Optional, Sequence

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire

_GROUNDS = (  # commands on which it depends what is grounded
    wire.Add,
    wire.CleanupDomains,
    wire.Ground,
    wire.Load,
    wire.ReleaseExternal,
    wire.Restart,
)


@dataclass
class SolverTrace:
    """A trace of a planner's solver: its grounding commands, times and number of searches.

    Attributes:
        commands: The commands on which it depends what is grounded, in order.
        grounding: How long it has grounded, in seconds.
        searching: How long it has searched, in seconds.
        searches: How often it has searched.
    """

    commands: List[wire.Command] = field(default_factory=list)
    grounding: float = 0.0
    searching: float = 0.0
    searches: int = 0


class MeasuredEngine(Engine):
    """A solver that adds what it does to a trace. One thread makes the calls."""

    def __init__(
        self, options: Options, trace: SolverTrace, log: Callable[[str], None] = lambda _: None
    ) -> None:
        """Loads the files and grounds nothing.

        Args:
            options: The command line.
            trace: The trace.
            log: Called with clingo's warnings.
        """
        self._trace = trace
        super().__init__(options, log=log)

    def apply(self, command: wire.Command) -> Optional[wire.Answer]:
        """Runs a command, and adds it to the trace if it changes the grounding."""
        begin = time.perf_counter()
        answer = super().apply(command)
        if isinstance(command, wire.Ground):
            self._trace.grounding += time.perf_counter() - begin
        if isinstance(command, _GROUNDS):
            self._trace.commands.append(command)
        return answer

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches, and adds the search to the trace."""
        begin = time.perf_counter()
        outcome = super().solve(assumptions, stopped, improved)
        self._trace.searching += time.perf_counter() - begin
        self._trace.searches += 1
        return outcome
