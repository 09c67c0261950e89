"""Uses measured durations: for the arrival times of goals, and to teach the planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, List, Sequence, Tuple

from rosoclingo.loop.execution.alarms import Alarms
from rosoclingo.loop.execution.durations import Durations
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.execution.progress import Progress
from rosoclingo.loop.journal import ActionTook, ClockRead, Event
from rosoclingo.loop.planner.externals import PlannerExternals
from rosoclingo.loop.values.arrivals import (
    PlannedSpan,
    PlanTime,
    SaidTime,
    arrival_lines,
    expected_arrivals,
    planned_spans,
)
from rosoclingo.loop.values.atoms import Plan, event
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goals
from rosoclingo.loop.values.recorded import Recorded, reading
from rosoclingo.loop.words import CLOCK, DUE, EXPECTED, INFO, NOW, SUCCESS

_MOVED_SECONDS = 5.0  # how far an overdue action moves an expected time until it is told
_MOVED_STEP_SECONDS = 1.0  # the same at each answer and each step


@dataclass(eq=False)
class Timing:
    """Tells clients when goals will be served, and the planner how long actions take.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.

    Attributes:
        durations: How long actions have taken.
        alarms: The clock that the planner knows.
        progress: The plan, and the step.
        goals: The goals.
        externals: What the planner's encoding knows.
        executions: What each actuator does.
        recorded: Knows in a replay how long actions took.
        environment: Where the clock of the world is.
        note: Adds an event to the journal.
    """

    durations: Durations
    alarms: Alarms
    progress: Progress
    goals: Goals
    externals: PlannerExternals
    executions: Executions
    recorded: Recorded
    environment: Environment
    note: Callable[[Event], None]

    def end_action(self, done: Execution, value: str) -> None:
        """Learns an action's duration from its success.

        Learns only if the encoding has named the kind of the action, and not if the clock stands
        still.
        """
        if not (done.kind and done.is_timed and value == SUCCESS) or done.aborted:
            return
        measured = max(0.0, self.environment.world_now() - done.world_began)
        seconds = self.recorded.measured(str(done.number), measured)
        if seconds:
            self.note(ActionTook(done.actuator, done.kind, done.number, seconds))
            self.durations.learn(done.kind, done.seconds, seconds)

    def tell_clock(self, step: int) -> None:
        """Tells the planner the time, in whole seconds, if its encoding takes that.

        Args:
            step: The step that ends now, or in which a goal has come.
        """
        if not self.externals.declares(INFO, f"{CLOCK}(0)"):
            return
        number, seconds = self.alarms.read_clock(self.environment.world_now())
        told = self.recorded.measured(reading(number), seconds)
        if told is not None:
            self.note(ClockRead(number, told))
            self.externals.make_true([event(INFO, f"{CLOCK}({int(told)})", step)])

    def tell_planner(self, step: int) -> None:
        """Tells the planner which actions take longer or shorter than it believes."""
        for kind, seconds in self.durations.news():
            content = f"lasts({kind},{seconds})"
            if self.externals.declares(INFO, content):
                self.externals.make_true([event(INFO, content, step)])
                self.durations.told[kind] = seconds
            else:
                self.durations.unknown.add(kind)

    def tell_clients(self, moved: float = _MOVED_STEP_SECONDS) -> None:
        """Tells clients the arrival times of their goals, if these are new.

        That depends on the time, and nothing else depends on it.

        Args:
            moved: By how many seconds a time has to have moved.
        """
        now, plan = self.environment.world_now(), self._plan
        times = expected_arrivals(plan, self._spans(now))
        for goal in self.goals.open:
            time, told = times.get(goal.slot or ""), goal.expected
            if time is not None and told is not None and abs(time - told) < moved:
                continue
            goal.expected = time
            if time is None:
                continue
            for line in arrival_lines(time, now, goal.came, plan.limits.get(goal.slot or "")):
                goal.tell(line, again=line.startswith(EXPECTED))

    @property
    def _plan(self) -> Plan:
        """The plan that stands; an empty one if there is none."""
        return self.progress.plan if self.progress.shows_plan else Plan()

    def _spans(self, now: float) -> List[PlannedSpan]:
        """Returns when the actions of the plan begin and end, as far as it says that."""
        executions = self.executions
        return planned_spans(
            self._plan,
            self.progress.step,
            executions.ordered,
            executions.published,
            now,
            clock=self.alarms.began,
        )

    def goal_times(self) -> Tuple[PlanTime, ...]:
        """Returns when goals will be served, as clients were told last, and when they are due."""
        limits = self._plan.limits
        times: List[PlanTime] = []
        for goal in self.goals.open if self.progress.shows_plan else ():
            slot = goal.slot or ""
            if goal.expected is not None:
                times.append(SaidTime(EXPECTED, goal.expected, slot))
            if slot in limits:
                times.append(SaidTime(DUE, goal.came + limits[slot], slot))
        return tuple(times)

    def plan_times(self, goal_times: Sequence[PlanTime]) -> Tuple[PlanTime, ...]:
        """Returns all that is said about times with the plan; nothing if none is known.

        Args:
            goal_times: Those of goals, by :meth:`goal_times`.
        """
        now = self.environment.world_now()
        times = (*goal_times, *self._spans(now))
        return (*times, SaidTime(NOW, now)) if times else ()

    def correct(self) -> bool:
        """Tells clients while actions go on that should have ended.

        Returns:
            Whether a client was told a time before.
        """
        if all(goal.expected is None for goal in self.goals.open):
            return False
        self.tell_clients(_MOVED_SECONDS)
        return True
