"""Reports the health of a node with a loop: the loop, each actuator, the store, a solver."""

from __future__ import annotations

from typing import Callable, List, Optional, Set

from rosclingo.health import Health
from rosclingo.ros.diagnostics import DiagnosticsPublisher, read_parameters
from rosoclingo.loop.actuator_health import (
    HealthClocks,
    actuator_health,
    actuators_of,
    untaken_answers,
)
from rosoclingo.loop.durability import Durability
from rosoclingo.loop.health import loop_health, store_health
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment

SolverReport = Callable[[float], Health]
"""Returns the health of a solver in this process, given after how many seconds it is slow."""


class LoopDiagnostics(DiagnosticsPublisher):
    """Publishes the health of a loop on ``/diagnostics``; see :class:`.LoopMonitor`."""

    def __init__(
        self,
        state: State,
        inbox: Inbox,
        environment: Environment,
        durability: Durability,
        solver: Optional[SolverReport] = None,
    ) -> None:
        """Opens the topic, unless this is a replay or ``~diagnostics_period`` is 0.

        Args:
            state: The loop's, of which the monitor and the heartbeats are used.
            inbox: Where inputs wait for the loop.
            environment: Where the clocks are.
            durability: Stores the run.
            solver: Returns the health of the solver in this process; None if there is none.

        Raises:
            ParameterError: A parameter is wrong.
        """
        period, self._slow_seconds = read_parameters()
        super().__init__(self._report, 0.0 if isinstance(inbox, ReplayInbox) else period)
        self._monitor = state.monitor
        self._heartbeats = state.heartbeats
        self._inbox = inbox
        self._environment = environment
        self._durability = durability
        self._solver = solver
        self._actuators: Set[str] = set()  # of which something was said

    def _report(self) -> List[Health]:
        monitor, items = self._monitor, self._inbox.waiting()
        summary = monitor.summary
        monitor.is_wanted = True  # for the next report: the loop may be busy now
        clocks = HealthClocks(self._environment.now(), self._environment.world_now())
        answers = untaken_answers(items, summary.run)
        slow = self._slow_seconds
        healths = [loop_health(monitor, clocks.now, queue=len(items), slow_seconds=slow)]
        self._actuators.update(actuators_of(summary))
        beats = {one.actuator: self._heartbeats.last(one.number) for one in summary.executions}
        healths += (
            actuator_health(one, summary, clocks, answers, beats.get(one))
            for one in sorted(self._actuators)
        )
        store = self._durability.summary
        if store is not None:
            healths.append(store_health(store, monitor.end, clocks.now))
        if self._solver is not None:
            healths.append(self._solver(slow))
        return healths
