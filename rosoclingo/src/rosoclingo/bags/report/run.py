"""The statistics of a recorded run, as values. Needs no ROS.

All times are in seconds of wall time since the recording began; they are negative for what happened
before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from rosoclingo.bags.believed import BeliefSpan
from rosoclingo.bags.holds import HoldSpan
from rosoclingo.bags.run_model import TrackedAction

OPEN = "open"
RECALLED = "recalled"
PLANNED = "planned"
"""The answer of actions that have not begun, and are only planned."""


@dataclass(frozen=True)
class GoalRun:
    """A goal from its arrival to its end.

    Attributes:
        id: That of actionlib.
        came: When it was taken.
        request: The request.
        information: What came with it.
        slot: The planner's id for it; empty if it is not known to have had one.
        name: What it is called: its request, numbered if others before it had the same one.
        behind: The name of the goal that had this slot while it waited; empty if it was not queued.
        accepted: When the planner accepted it, if it did.
        cancels: When it was asked to be cancelled, if it was.
        ended: When it ended, if it did.
        outcome: ``open``, ``succeeded``, ``canceled``, ``rejected``, ``aborted``, or ``recalled``
            if it was cancelled before it had a slot.
        reason: Why it ended.
        steps: How many steps began from its acceptance on until its end.
        due: When it is due, if it has a deadline.
        expected: When it is expected to be met, if it is open and that is known.
    """

    id: str
    came: float
    request: str = ""
    information: Tuple[str, ...] = ()
    slot: str = ""
    name: str = ""
    behind: str = ""
    accepted: Optional[float] = None
    cancels: Optional[float] = None
    ended: Optional[float] = None
    outcome: str = OPEN
    reason: str = ""
    steps: int = 0
    due: Optional[float] = None
    expected: Optional[float] = None

    @property
    def late(self) -> float:
        """By how many seconds it was late, or is expected to be; 0 if it is in time."""
        end = self.expected if self.ended is None else self.ended
        return 0.0 if self.due is None or end is None else max(0.0, end - self.due)


@dataclass(frozen=True)
class MessageRun:
    """A message that answered no action.

    Attributes:
        seconds: When it was taken.
        id: Its id; empty if it was dropped and the journal does not say which one it was.
        value: Its value; empty where the id is.
        step: In which step.
        dropped: Why it was dropped; empty if it was not.
    """

    seconds: float
    id: str
    value: str
    step: int
    dropped: str = ""


@dataclass(frozen=True)
class SearchRecord:
    """A search for a plan.

    Attributes:
        ended: When it ended.
        duration: How long it took, in seconds.
        result: ``sat``, ``unsat``, or ``unknown`` if it was interrupted.
        step: In which step.
        horizon: Up to which step it planned.
    """

    ended: float
    duration: float
    result: str
    step: int
    horizon: int


@dataclass
class StepRun:
    """A step, or what was before the first one.

    Attributes:
        began: When it began.
        number: Its number; a reset makes that 0.
        horizon: The step that was planned up to when it ended.
        searches: How many searches there were in it.
        interrupted: How many of these were interrupted.
        solving: How long they took together, in seconds.
        other: How long the loop's other commands took, but for waiting, in seconds.
    """

    began: float
    number: int
    horizon: int
    searches: int = 0
    interrupted: int = 0
    solving: float = 0.0
    other: float = 0.0


@dataclass(frozen=True)
class Cause:
    """The cause of a change of the plan.

    Attributes:
        kind: ``start`` for the first plan; ``goal`` for a goal that came, ``queued`` for one that
            got its slot later; ``cancel``, ``message``, ``failure``; ``answer`` for an action's
            answer that is neither ``success`` nor ``failure``; ``success``; ``none`` if nothing
            came before.
        text: What it was.
    """

    kind: str
    text: str = ""


@dataclass(frozen=True)
class PlanChange:
    """A plan that differs from the rest of the one before.

    Attributes:
        seconds: When it was found.
        step: In which step.
        horizon: Up to which step it goes.
        causes: Why it was searched for.
        old: How many actions the old plan had from the step on.
        new: How many the new one has.
        first: The first step with other actions.
        before: The actions that are no longer done in it.
        after: Those that are done in it instead.
    """

    seconds: float
    step: int
    horizon: int
    causes: Tuple[Cause, ...]
    old: int
    new: int
    first: int
    before: Tuple[str, ...]
    after: Tuple[str, ...]


@dataclass(frozen=True)
class AnswerRun:
    """A question that was answered.

    Attributes:
        seconds: When.
        step: In which step.
        question: The question.
        text: The answer, in sentences.
        duration: How long it took, in seconds.
    """

    seconds: float
    step: int
    question: str
    text: str
    duration: float


@dataclass(frozen=True)
class NodeRestart:
    """A node that was replaced after it had died or been ended.

    Attributes:
        seconds: When that goes on.
        step: In which step.
        node: What it is: ``rosoclingo``, ``controller`` or ``planner``.
        reason: With what error it was lost; empty if that is not known.
        duration: How long a solver was missed, or how long rosoclingo took to go on, in seconds.
        last: When the last event before was.
    """

    seconds: float
    step: int
    node: str
    reason: str
    duration: float
    last: float


@dataclass(frozen=True)
class Statistics:
    """The statistics of a run.

    Attributes:
        began: When its first event was.
        ended: When its last one was.
        end: Why the loop ended; empty if it did not.
        goals: The goals, in order of arrival.
        actions: The actions, in order of publication.
        messages: The messages that answered nothing, dropped ones included, in order.
        received: How many messages there were of all kinds.
        searches: The searches, in order.
        steps: The steps, what was before the first one included.
        plans: How many plans were found.
        changes: Those of them that changed what was planned before.
        answers: The questions that were answered, in order.
        restarts: The nodes in whose place others have gone on, in order.
        holds: What an operator held, in order.
        beliefs: What was believed to be the causes of what was observed, in order.
        planned: The actions that are planned when the recording ends, as far as it is known when,
            in order.
    """

    began: float
    ended: float
    end: str
    goals: Tuple[GoalRun, ...]
    actions: Tuple[TrackedAction, ...]
    messages: Tuple[MessageRun, ...]
    received: int
    searches: Tuple[SearchRecord, ...]
    steps: Tuple[StepRun, ...]
    plans: int
    changes: Tuple[PlanChange, ...]
    answers: Tuple[AnswerRun, ...]
    restarts: Tuple[NodeRestart, ...]
    holds: Tuple[HoldSpan, ...]
    beliefs: Tuple[BeliefSpan, ...]
    planned: Tuple[TrackedAction, ...] = ()

    @property
    def until(self) -> float:
        """The end of the run, or of its plan if that is later."""
        ends = [goal.expected for goal in self.goals if goal.expected is not None]
        ends += [action.ended for action in self.planned if action.ended is not None]
        return max([self.ended, *ends])


def numbered(request: str, number: int) -> str:
    """Returns the name of the first, second, ... goal with the same request."""
    return request if number == 1 else f"{request} ({number})"
