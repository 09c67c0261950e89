"""Reports the health of a node with a loop: the loop, each actuator, the store, a solver.

The same in short is the topic ``~summary``.
"""

from __future__ import annotations

from typing import Callable, Dict, List, Optional, Set

import rospy
from std_msgs.msg import Header

from rosclingo.health import Health, since
from rosclingo.ros.diagnostics import DiagnosticsPublisher, read_parameters
from rosclingo.ros.low_latency import publisher
from rosoclingo.loop.actuator_health import HealthClocks, actuator_health, actuators_of
from rosoclingo.loop.durability import Durability
from rosoclingo.loop.execution.tokens import untaken_answers
from rosoclingo.loop.health import loop_health, store_health
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.monitor import LoopSummary
from rosoclingo.loop.state import State
from rosoclingo.loop.summary import actuator_activity, summary_text
from rosoclingo.loop.values.environment import Environment
from rosoclingo.msg import ROSoClingoSummary

SolverReport = Callable[[float], Health]
"""Returns the health of a solver in this process, given after how many seconds it is slow."""


class LoopDiagnostics(DiagnosticsPublisher):
    """Publishes the health of a loop on ``/diagnostics``, and ``~summary``.

    Both say what the loop's :class:`.LoopMonitor` has, and are published one after the other.
    """

    def __init__(
        self,
        state: State,
        inbox: Inbox,
        environment: Environment,
        durability: Durability,
        solver: Optional[SolverReport] = None,
    ) -> None:
        """Opens the topics, unless this is a replay or ``~diagnostics_period`` is 0.

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
        period = 0.0 if isinstance(inbox, ReplayInbox) else period
        super().__init__(self._report, period)
        if period > 0:  # else, nothing is reported
            self._summary = publisher("~summary", ROSoClingoSummary, latch=True, queue_size=1)
        self._monitor = state.monitor
        self._heartbeats = state.heartbeats
        self._began = environment.now()
        self._inbox = inbox
        self._environment = environment
        self._durability = durability
        self._solver = solver
        self._actuators: Set[str] = set()  # of which something was said

    def _report(self) -> List[Health]:
        """Returns the health of all parts, and publishes the summary."""
        monitor, items = self._monitor, self._inbox.waiting()
        summary = monitor.summary
        monitor.is_wanted = True  # for the next report: the loop may be busy now
        now, world = self._environment.now(), self._environment.world_now()
        clocks = HealthClocks(now, world, self._began)
        answers = untaken_answers(items, summary.run)
        slow = self._slow_seconds
        healths = [loop_health(monitor, clocks.now, queue=len(items), slow_seconds=slow)]
        self._actuators.update(actuators_of(summary))
        beats = {one.actuator: self._heartbeats.last(one.number) for one in summary.executions}
        actuators = {
            one: actuator_health(one, summary, clocks, answers, beats.get(one))
            for one in sorted(self._actuators)
        }
        healths += actuators.values()
        self._publish_summary(summary, actuators, clocks.now)
        store = self._durability.summary
        if store is not None:
            healths.append(store_health(store, monitor.end, clocks.now))
        if self._solver is not None:
            healths.append(self._solver(slow))
        return healths

    def _publish_summary(
        self, summary: LoopSummary, actuators: Dict[str, Health], now: float
    ) -> None:
        monitor, activity = self._monitor, self._monitor.activity
        activities = [
            actuator_activity(one, health, summary, now) for one, health in actuators.items()
        ]
        self._summary.publish(
            ROSoClingoSummary(
                header=Header(stamp=rospy.Time.now()),
                text=summary_text(activity, summary, activities, monitor.end),
                state=str(activity.doing),
                paused=summary.is_paused,
                step=summary.step,
                horizon=summary.horizon,
                goals_open=summary.goals_open,
                goals_waiting=summary.all_waiting,
                seconds_since_decision=_seconds(since(monitor.decided, now)),
                seconds_of_last_search=_seconds(monitor.searched),
                age=_seconds(since(summary.time, now)),
                actuators=[one.actuator for one in activities],
                states=[one.state for one in activities],
                actions=[one.action for one in activities],
                seconds=[one.seconds for one in activities],
            )
        )


def _seconds(value: Optional[float]) -> float:
    """Returns seconds for a message, where those that are not known are less than 0."""
    return -1.0 if value is None else value
