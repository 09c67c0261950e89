"""Waits for inputs and answers; meanwhile looks after the actuators and the solvers."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Callable, Optional

from rosclingo.errors import shorten
from rosoclingo.errors import ShutdownError
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.execution.watchdog import ExecutionWatchdog
from rosoclingo.loop.journal import Event, LoopWaits, Reason, Status
from rosoclingo.loop.mail import Mail
from rosoclingo.loop.monitor import Doing, LoopMonitor
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goals

LOOK_SECONDS = 1.0
"""How often solvers are checked, while waiting."""

_ENDLESS_SECONDS = 30.0  # of a search without a last horizon, after which a warning is logged
_SILENT_SECONDS = 1.0  # how long the goals hear nothing while a plan is searched for


@dataclass(eq=False)
class Waiting:
    """Waits for inputs. The loop's thread uses it.

    Attributes:
        mail: What has come.
        executions: Who acts in the step.
        goals: The goals.
        environment: Where warnings go.
        note: Adds an event to the journal.
        monitor: Where it is marked that the loop waits.
        polled: Called each time when inputs are taken.
        correct: Called now and then; tells clients what takes longer than they were told.
        check: Called now and then; raises an error if a solver went away.
        watchdog: Looks after the actuators.
        is_short: Whether the plan lacks what takes more time to find.
        reminded: Whether the controller has been told that goals wait for the next step.
    """

    mail: Mail
    executions: Executions
    goals: Goals
    environment: Environment
    note: Callable[[Event], None]
    monitor: LoopMonitor
    polled: Callable[[], None]
    correct: Callable[[], None]
    check: Callable[[], None]
    watchdog: ExecutionWatchdog
    is_short: Callable[[], bool]
    reminded: bool = False
    _stops: bool = False
    _look_at: float = 0.0  # when it is time to look again
    _warned_of: Optional[float] = None  # the beginning of the search that may have no end

    def wait(self, step: int, improve: Callable[[], bool]) -> None:
        """Waits for an input that the controller does not know of.

        Args:
            step: The current step.
            improve: Called when there is nothing to do: does what is worth doing then, until
                something comes, and returns whether there was anything.

        Raises:
            ShutdownError: The node is shutting down.
            RosclingoError: A solver went away.
        """
        mail = self.mail
        mail.end_attempt()
        mail.between_steps = not self.executions.pending_actions
        while mail.inbox.recorded.is_search_due(improves=True) and improve():
            pass  # a replay has what came then already
        mail.take(may_ask=True)
        if self._is_told_to_stop():
            return
        if not (self.executions.pending_actions or mail.has_news):
            line = f"waiting in step {step}: the plan has no action for now"
            if self.is_short():
                line += ", as the time for planning was up; more is planned"
            told = self.goals.tell(line)
            if told:
                self.environment.begin_to_wait(told)
        noted = False
        while not (mail.has_news or self._step_is_awaited(step)):
            if mail.inbox.closed:
                raise ShutdownError(Reason.SHUTDOWN)
            if not noted:
                noted = True
                self.note(LoopWaits())
            if improve():
                if self._is_told_to_stop():
                    return
                continue
            self._wait()

    def wait_for_answers(self) -> None:
        """Waits for the answers of all actuators that the step waits for.

        Raises:
            ShutdownError: The node is shutting down.
            RosclingoError: A solver went away.
        """
        mail = self.mail
        mail.end_attempt()
        if self.executions.pending_actions:
            self.note(LoopWaits())  # before an answer to what the command itself has published
        mail.take(may_ask=True)
        while self.executions.pending_actions:
            if mail.inbox.closed:
                raise ShutdownError(Reason.SHUTDOWN)
            self._wait()

    def _wait(self) -> None:
        """Waits until something comes, or it is time to look at something, and takes inputs."""
        self._look()
        self.monitor.begin(Doing.WAITS)
        if self.mail.wait(self._seconds):
            self.monitor.go_on()  # to take it may last, if the planner is asked
        self.mail.take(may_ask=True)
        self.polled()

    def stop(self) -> None:
        """Ends the wait, since the step has new actions: the mode hears of news."""
        self._stops = True

    def _is_told_to_stop(self) -> bool:
        stops, self._stops = self._stops, False
        if stops:
            self.mail.new_goals = True
        return stops

    def _look(self) -> None:
        """Looks now and then, whatever comes, whether the solvers and the actuators are there."""
        is_due = self.environment.now() >= self._look_at
        self.look_at_actuators()
        if is_due:
            self.check()

    def look_at_actuators(self) -> None:
        """Looks after the actuators, and corrects arrival times, now and then; asks no solver."""
        self.watchdog.look()
        if self.environment.now() >= self._look_at:
            self._look_at = self.environment.now() + LOOK_SECONDS
            self.correct()

    @property
    def _seconds(self) -> float:
        """Seconds until the next check is due."""
        return max(0.0, min(self._look_at - self.environment.now(), self.watchdog.seconds))

    def _step_is_awaited(self, step: int) -> bool:
        """Returns whether the next step can begin: with a free slot for a goal, or an answer.

        The mode is told once in each step, as of a goal that has just come. If it waits again
        nevertheless, the step does not go on, and goals without a slot end here.
        """
        goals = self.goals
        has_slot = goals.waiting and goals.has_free_slot(next_step=True)
        if self.executions.pending_actions or not (has_slot or self.executions.keeps_answers):
            return False
        if not self.reminded:
            self.reminded = True
            self.mail.new_goals = True
            return True
        if has_slot and goals.all_ended():
            goals.end_waiting(
                Status.ABORTED,
                f"the mode waits in step {step}, and all slots belong to goals that ended in "
                "it; the maximal horizon may be reached (-c steps=N)",
            )
        return False

    def rest(self) -> None:
        """Refuses goals until the node is shut down.

        Raises:
            ShutdownError: The node is shutting down.
        """
        inbox = self.mail.inbox
        self.mail.end_attempt()
        self.monitor.begin(Doing.WAITS)
        while not inbox.closed:
            self.mail.take()
            self.polled()
            self.mail.wait(LOOK_SECONDS)
        raise ShutdownError(Reason.SHUTDOWN)

    def tell_progress(self, horizon: int, last: Optional[float]) -> None:
        """Tells the goals how far the planner is, once they have waited for a while.

        Warns once in a search, which may last for many horizons, that it may have no end.

        Args:
            horizon: The horizon at which it searches.
            last: The last one at which it may search; infinite if there is none, None if unknown.
        """
        begin = self.monitor.planning_since
        if begin is None:
            return
        seconds = time.monotonic() - begin
        if seconds > _SILENT_SECONDS:
            self.goals.tell(f"planning, horizon {horizon}")
        if seconds > _ENDLESS_SECONDS and last == math.inf and self._warned_of != begin:
            self._warned_of = begin
            requests = shorten(", ".join(goal.request for goal in self.goals.open))
            self.environment.warn(
                f"no plan for {requests or 'the program'} after {seconds:.0f} s. There is no last "
                "step: until there is a plan, or a goal is cancelled, the search takes time and "
                "memory. -c steps=N sets a last step"
            )
