"""Measures the grounding and search times of a planner's solver, and logs its commands."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Callable, Dict, List, Optional, Sequence, Tuple, Union

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire

_STEP_PARTS = ("state", "transition", "query")
_GROUNDS = (  # commands on which it depends what is grounded
    wire.Add,
    wire.CleanupDomains,
    wire.Ground,
    wire.Load,
    wire.ReleaseExternal,
    wire.Restart,
)


@dataclass(frozen=True)
class Grounding:
    """A command that has changed the grounding.

    Attributes:
        command: The command.
        step: The step that it has grounded; None if it has grounded something else.
        horizon: The horizon for which that was.
        seconds: How long it has taken; 0 for a command that grounds nothing itself.
    """

    command: wire.Command
    step: Optional[int]
    horizon: int
    seconds: float


@dataclass(frozen=True)
class TimedSearch:
    """A search with its time.

    Attributes:
        horizon: Its horizon.
        seconds: How long it has taken.
        result: How it has ended.
        first: After how many seconds it had an answer set, if it optimises and has found one.
    """

    horizon: int
    seconds: float
    result: wire.Result
    first: Optional[float] = None


@dataclass
class SolverTrace:
    """A log of what a planner's solver has done, in order.

    Attributes:
        events: The groundings and the searches.
        doing: What it does now, in words; empty for nothing.
        horizon: Says which horizon is asked for.
    """

    events: List[Union[Grounding, TimedSearch]] = field(default_factory=list)
    doing: str = ""
    horizon: Callable[[], int] = field(default=lambda: 0)

    @property
    def groundings(self) -> List[Grounding]:
        """The groundings."""
        return [event for event in self.events if isinstance(event, Grounding)]

    @property
    def searches(self) -> List[TimedSearch]:
        """The searches."""
        return [event for event in self.events if isinstance(event, TimedSearch)]


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
        if not isinstance(command, _GROUNDS):
            return super().apply(command)
        if not isinstance(command, wire.Ground):
            answer = super().apply(command)
            self._trace.events.append(Grounding(command, None, self._trace.horizon(), 0.0))
            return answer
        step = step_of(command)
        self._trace.doing = "grounding" if step is None else f"grounding step {step}"
        begin = time.perf_counter()
        try:
            answer = super().apply(command)
        finally:
            self._trace.doing = ""
        seconds = time.perf_counter() - begin
        self._trace.events.append(Grounding(command, step, self._trace.horizon(), seconds))
        return answer

    def solve(
        self,
        assumptions: Sequence[wire.Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[wire.Improvement], None] = lambda _: None,
    ) -> wire.Outcome:
        """Searches, and adds the search to the trace."""
        first: Optional[float] = None
        begin = time.perf_counter()

        def note(improvement: wire.Improvement) -> None:
            nonlocal first
            first = time.perf_counter() - begin if first is None else first
            improved(improvement)

        horizon = self._trace.horizon()
        self._trace.doing = f"searching with horizon {horizon}"
        try:
            outcome = super().solve(assumptions, stopped, note)
        finally:
            self._trace.doing = ""
        seconds = time.perf_counter() - begin
        self._trace.events.append(TimedSearch(horizon, seconds, outcome.result, first))
        return outcome


def step_of(command: wire.Command) -> Optional[int]:
    """Returns the step that a command grounds, if it grounds one."""
    steps = [
        int(part.parameters[-1])
        for part in (command.parts if isinstance(command, wire.Ground) else ())
        if part.name in _STEP_PARTS and part.parameters and part.parameters[-1].isdecimal()
    ]
    return max(steps, default=None)


@dataclass
class Horizon:
    """The work for a horizon.

    Attributes:
        grounding: How long its step, and what was asked for then, took to ground, in seconds.
        searching: How long the searches took, in seconds.
        searches: How many there were.
        results: How they have ended, each way once.
    """

    grounding: float = 0.0
    searching: float = 0.0
    searches: int = 0
    results: Tuple[wire.Result, ...] = ()


def by_horizon(trace: SolverTrace) -> Dict[int, Horizon]:
    """Returns the work for each horizon, in their order."""
    found: Dict[int, Horizon] = {}
    for event in trace.events:
        number = event.horizon
        if isinstance(event, Grounding) and event.step is not None:
            number = event.step
        one = found.setdefault(number, Horizon())
        if isinstance(event, Grounding):
            one.grounding += event.seconds
        else:
            one.searching += event.seconds
            one.searches += 1
            one.results = tuple(dict.fromkeys((*one.results, event.result)))
    return dict(sorted(found.items()))
