"""The loop's port to the world: clocks, actions, results, journal and log."""

from __future__ import annotations

import time
from typing import Mapping, Optional, Sequence

from rosoclingo.loop.journal import ControlArrived, ControlOutcome, Record
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.arrivals import PlanTime
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.beliefs import Beliefs
from rosoclingo.loop.values.execution import Execution, OperatorState
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.served import ServedGoal


class Environment:
    """The loop's port to the world; a node overrides the methods."""

    def now(self) -> float:
        """Returns the time by which actuators answer, in seconds; it never goes back."""
        return time.monotonic()

    def world_now(self) -> float:
        """Returns the time where actuators act, in seconds: that of ROS, in a node.

        It does not depend on the process, but where a simulator has a clock, it may begin anew.
        """
        return self.now()

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action, or with the id ``solver`` a whole plan."""

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        """Publishes the last action of each actuator, with its token.

        An action is shown before it is published.

        Args:
            run: The id of the run.
            executions: The last one of each actuator, in the order of their numbers.
        """

    def show_served(self, run: str, number: int, served: Sequence[ServedGoal]) -> None:
        """Publishes the goals for which the shown executions are done; called before these.

        Args:
            run: The id of the run.
            number: That of the last action that is considered.
            served: The goals, in the order of the actions.
        """

    def show_held(self, decided: OperatorState) -> None:
        """Publishes what an operator has decided, and what waits for that."""

    def answer_control(self, request: ControlArrived, outcome: ControlOutcome) -> None:
        """Answers an operator's request, which is the one that was put into the inbox."""

    def show_plan(
        self,
        step: int,
        horizon: int,
        actions: Sequence[Action],
        times: Sequence[PlanTime] = (),
    ) -> None:
        """Publishes the plan from the current step on.

        Args:
            step: The current step.
            horizon: The last step of the plan.
            actions: Its actions from the current step on.
            times: When goals will be served, when they are due, and when actions begin and end, as
                far as that is known.
        """

    def show_quality(self, quality: Optional[Quality]) -> None:
        """Publishes the plan's quality; None if unknown, or if the encoding minimises nothing."""

    def show_beliefs(self, beliefs: Beliefs, since: Mapping[str, float]) -> None:
        """Publishes what is believed to be the causes of what was observed.

        Never called for encodings that look for no causes.

        Args:
            beliefs: The beliefs, which may be none any more.
            since: Since when the causes of the best explanation are believed, in seconds of
                :meth:`world_now`.
        """

    def begin_to_wait(self, goals: Sequence[Goal]) -> None:
        """Called by the loop's thread when the plan has no action for these goals now.

        Does not wait. It may look for the reason, and tell the goals later.
        """

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        """Called by the loop's thread when there is no plan for these goals; does not wait."""

    def finish_reasons(self) -> None:
        """Waits for explanations under way, because the loop is about to end."""

    def note(self, record: Record) -> None:
        """Adds an event to the journal; may be called from any thread."""

    def info(self, text: str) -> None:
        """Logs information, for commands of one's own."""

    def warn(self, text: str) -> None:
        """Logs a warning."""
