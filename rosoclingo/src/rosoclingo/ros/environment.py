"""Sends the loop's outputs to ROS: topics, the log, and statuses of action goals."""

from __future__ import annotations

import json
import threading
import time
from typing import Callable, Mapping, Optional, Sequence

import actionlib
import rospy
from std_msgs.msg import String

from rosclingo.ros.history_publisher import HistoryPublisher
from rosclingo.ros.low_latency import publisher
from rosoclingo.loop import journal
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.arrivals import PlanTime
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.beliefs import Beliefs, Evidence
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution, OperatorState
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo.msg import (
    ROSoClingoBeliefs,
    ROSoClingoCause,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoExplanation,
    ROSoClingoFeedback,
    ROSoClingoHeld,
    ROSoClingoOut,
    ROSoClingoPlan,
    ROSoClingoServed,
    ROSoClingoServedGoal,
    ROSoClingoToken,
)
from rosoclingo.ros.goal_statuses import address_of, apply_status
from rosoclingo.ros.questions import Questions

_JOURNAL_LENGTH = 2_000  # events that late subscribers get


class ActionClient(GoalClient):
    """The client of a goal of the node's action."""

    def __init__(
        self, handle: actionlib.ServerGoalHandle, note: Callable[[journal.Event], None]
    ) -> None:
        self._handle = handle
        self._note = note

    def noted(self, change: journal.StatusSet) -> None:
        """Adds the status to the journal."""
        self._note(change)

    def changed(self, change: journal.StatusSet) -> None:
        """Accepts the goal, or sends the result."""
        apply_status(self._handle, change)

    def feedback(self, line: str) -> None:
        """Sends a line of feedback to the client."""
        self._handle.publish_feedback(ROSoClingoFeedback(line))

    @property
    def address(self) -> str:
        """The sender's node and the goal's time, as JSON."""
        return address_of(self._handle)


class RosEnvironment(Environment):
    """The loop's environment in ROS: publishes to topics and logs.

    Attributes:
        questions: Explains to goals why they wait; None if nothing does.
        told: The number of the last action of each actuator that was told something.
        decided: An operator's decisions, as they were published last.
        answered_control: Called by the loop's thread with the outcome of an operator's request,
            which is the one that was put into the inbox.
    """

    def __init__(self, description: str) -> None:
        """Opens the topics.

        Args:
            description: What :func:`rosclingo.solver.about.about` says of the node.
        """
        self.questions: Optional[Questions] = None
        self.told: Mapping[str, int] = {}  # is replaced as a whole
        self.decided = OperatorState()
        self.answered_control: Callable[[journal.ControlArrived, journal.ControlOutcome], None] = (
            lambda *_: None
        )
        self._held = publisher("~held", ROSoClingoHeld, latch=True)
        self._served = publisher("~served", ROSoClingoServed, latch=True)
        # Opened before ~out: who hears an action there can tell whether it comes here, too.
        self._dispatch = publisher("~dispatch", ROSoClingoDispatch, latch=True)
        self._out = publisher("~out", ROSoClingoOut, latch=True)
        self._plan = publisher("~plan", ROSoClingoPlan, latch=True)
        self._quality = publisher("~plan_quality", String, latch=True)
        self._beliefs = publisher("~beliefs", ROSoClingoBeliefs, latch=True)
        self._about = publisher("~about", String, latch=True)
        self._about.publish(description)
        self._journal = HistoryPublisher("~journal", ROSoClingoEvent, _JOURNAL_LENGTH)
        self._lock = threading.Lock()  # guards the number; the journal's order is that of numbers
        self._number = 0

    def publish(self, actuator: str, action: str) -> None:
        """Publishes an action or a plan."""
        self._out.publish(actuator, action)
        rospy.loginfo("%s: %s", actuator, action)

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        """Publishes to ``~dispatch``."""
        self.told = {**self.told, **{one.actuator: one.number for one in executions}}
        self._dispatch.publish(
            run,
            [
                ROSoClingoToken(one.number, one.step, one.actuator, one.action, _state(one))
                for one in executions
            ],
        )

    def show_served(self, run: str, number: int, served: Sequence[ServedGoal]) -> None:
        """Publishes to ``~served``."""
        self._served.publish(
            run,
            number,
            [
                ROSoClingoServedGoal(
                    one.number, one.slot, one.request, one.goal_id, list(one.information)
                )
                for one in served
            ],
        )

    def show_held(self, decided: OperatorState) -> None:
        """Publishes to ``~held``."""
        held, rejected = decided.held, decided.rejected
        self.decided = decided
        self._held.publish(
            decided.is_paused,
            list(decided.on_hold),
            [f"do({one.actuator},{one.action})" for one in held],
            [str(one.reason) for one in held],
            [one.token for one in held],
            [f"do({one.actuator},{one.action})" for one in rejected],
            ["" if one.instead is None else str(one.instead) for one in rejected],
        )

    def answer_control(
        self, request: journal.ControlArrived, outcome: journal.ControlOutcome
    ) -> None:
        """Passes the answer on to the service that was called."""
        self.answered_control(request, outcome)

    def world_now(self) -> float:
        """Returns ROS's time, which is a simulator's if there is one that has a clock."""
        return float(rospy.get_time())

    def show_plan(
        self,
        step: int,
        horizon: int,
        actions: Sequence[Action],
        times: Sequence[PlanTime] = (),
    ) -> None:
        """Publishes to ``~plan``."""
        self._plan.publish(step, horizon, [str(one) for one in (*actions, *times)])

    def show_quality(self, quality: Optional[Quality]) -> None:
        """Publishes to ``~plan_quality``."""
        self._quality.publish(json.dumps({} if quality is None else quality.as_json()))

    def show_beliefs(self, beliefs: Beliefs, since: Mapping[str, float]) -> None:
        """Publishes to ``~beliefs``."""
        explanations = [ROSoClingoExplanation(w, list(c)) for w, c in beliefs.explanations]
        causes = [_cause(cause, beliefs, since) for cause in beliefs.causes]
        left = beliefs.terms(beliefs.unexplained)
        self._beliefs.publish(rospy.Time.now(), explanations, causes, left)

    def begin_to_wait(self, goals: Sequence[Goal]) -> None:
        """Requests the reasons why goals wait."""
        if self.questions is not None:
            self.questions.explain_waiting(goals)

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        """Requests the reason why there is no plan."""
        if self.questions is not None:
            self.questions.explain_no_plan(goals)

    def finish_reasons(self) -> None:
        """Waits for these reasons."""
        if self.questions is not None:
            self.questions.finish()

    def note(self, record: journal.Record) -> None:
        """Publishes to ``~journal``. Thread-safe."""
        if self.questions is not None:
            self.questions.hear(record)
        with self._lock:
            if isinstance(record, journal.Entry):
                self._number, now = record.number, record.seconds
            else:
                self._number, now = self._number + 1, time.time()
            stamp = rospy.Time.from_sec(now)  # of wall time, whatever a simulator's clock
            self._journal.publish(
                ROSoClingoEvent(
                    stamp, self._number, record.step, record.horizon, *journal.encode(record.event)
                )
            )

    def info(self, text: str) -> None:
        """Logs at level INFO."""
        rospy.loginfo("%s", text)

    def warn(self, text: str) -> None:
        """Logs at level WARN."""
        rospy.logwarn("%s", text)


def _cause(cause: str, beliefs: Beliefs, since: Mapping[str, float]) -> ROSoClingoCause:
    evidence = beliefs.evidence.get(cause, Evidence())
    return ROSoClingoCause(
        cause,
        cause in since,
        rospy.Time.from_sec(since.get(cause, 0.0)),
        cause in beliefs.certain,
        beliefs.terms(evidence.speaks_for),
        beliefs.terms(one for one, _ in evidence.speaks_against),
    )


def _state(one: Execution) -> int:
    """Returns the state of an action for ``dispatch``: to do, to abort or done."""
    if not one.is_open:
        return int(ROSoClingoToken.ANSWERED)
    return int(ROSoClingoToken.ABORTED if one.aborted else ROSoClingoToken.PENDING)
