"""An execution: the last action of an actuator, with its token, answer and part in the step."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

from rosoclingo.loop.values.atoms import Action


class HoldReason(str, enum.Enum):
    """Why an action is held; its value is the word on the wire."""

    APPROVAL = "approval"  # an operator is to approve it
    HOLD = "hold"  # its actuator is on hold
    PAUSE = "pause"  # the run is paused
    RETRY = "retry"  # it has failed, and is tried again after a pause
    REJECTED = "rejected"  # an operator has rejected it, and is not asked again yet
    CANCEL = "cancel"  # a goal was cancelled, and the plan after that is not known yet

    __str__ = str.__str__


class HeldAction(NamedTuple):
    """An action of which its actuator has not been told yet.

    Attributes:
        actuator: Who is to act.
        action: What to do.
        reason: Why it is held.
        token: The number of the action while it is held.
    """

    actuator: str
    action: str
    reason: HoldReason
    token: int = 0


class RejectedAction(NamedTuple):
    """An action that an operator has rejected, and is not asked about again yet.

    Attributes:
        actuator: Who was to act.
        action: What to do.
        instead: What the actuator is to do next by the plan; None for nothing.
    """

    actuator: str
    action: str
    instead: Optional[Action] = None


class OperatorState(NamedTuple):
    """An operator's decisions, and the actions that wait for one.

    Attributes:
        is_paused: Whether the run is paused.
        on_hold: The actuators that are on hold.
        held: The actions that wait.
        rejected: The actions that were rejected, and are not asked about again yet.
    """

    is_paused: bool = False
    on_hold: Tuple[str, ...] = ()
    held: Tuple[HeldAction, ...] = ()
    rejected: Tuple[RejectedAction, ...] = ()


@dataclass(frozen=True)
class Execution:
    """The last action that an actuator was told to do.

    Attributes:
        number: That of its token: counts the actions of a run, from 1.
        step: The step in which it was published, since the reset before that.
        actuator: Who is to act.
        action: What to do.
        began: When it was published, in seconds of the environment's clock.
        world_began: The same in seconds of world time.
        reminded: When its silence was logged last, as ``began``.
        kind: What the encoding calls such actions; empty if it does not say how long they take.
        seconds: How long it takes by the plan.
        retries: How often it is tried again after a failure, by the plan.
        pause: How long before each of these, in seconds.
        is_timed: Whether its answer will come when it is through.
        is_enqueued: Whether its timeout, or the end of its pause, is in the inbox or taken.
        aborted: Whether it is to stop.
        answer: The answer that was taken; None as long as none was.
        outcome: The same as the planner is told it.
        acts: Whether its actuator acts in the current step, or has answered in it.
        is_held: Whether its actuator is not told of it yet, see :class:`.Interlock`.
        held_as: Its number while it was held last; 0 if it was not.
        is_approved: Whether an operator has approved it.
        is_rejected: Whether an operator has rejected it.
        is_open_to_change: Whether it is held, and the next plan may do without it.
        attempt: Which attempt it is, from 1; see :class:`.ActionPolicy`.
        pauses: Whether it is held until the pause before the next attempt is over.
        retry_at: When that is so, as ``began``.
        goes_on: Whether it acts, and was busy in the step before.
        is_busy: Whether it is busy in the current step, so that its answer belongs to the next one.
    """

    number: int
    step: int
    actuator: str
    action: str
    began: float = 0.0
    world_began: float = 0.0
    reminded: float = 0.0
    kind: str = ""
    seconds: int = 0
    retries: int = 0
    pause: int = 0
    is_timed: bool = True
    is_enqueued: bool = False
    aborted: bool = False
    answer: Optional[str] = None
    outcome: Optional[str] = None
    acts: bool = True
    is_held: bool = False
    held_as: int = 0
    is_approved: bool = False
    is_rejected: bool = False
    is_open_to_change: bool = False
    attempt: int = 1
    pauses: bool = False
    retry_at: float = 0.0
    goes_on: bool = False
    is_busy: bool = False

    @property
    def is_open(self) -> bool:
        """Whether its answer is still to come."""
        return self.answer is None

    @property
    def end(self) -> float:
        """Its expected end, in seconds of world time; only if it is not held."""
        return self.world_began + self.seconds

    def end_after(self, now: float) -> float:
        """Returns its expected end, if it has not ended by now; one that is held begins now."""
        return now + self.seconds if self.is_held else max(self.end, now)

    @property
    def published(self) -> Action:
        """The action of the plan with which it began."""
        return Action(self.actuator, self.action, self.step)
