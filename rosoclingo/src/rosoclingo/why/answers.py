"""Answers to questions, as immutable values with their sentences."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Dict, Optional, Tuple

from rosoclingo.loop.situation import moved
from rosoclingo.why.facts import Fact
from rosoclingo.why.planner_copy import Possible
from rosoclingo.why.reason import MinimalReason, ReasonMember


@dataclass(frozen=True)
class WhyNoPlan:
    """Explanation of a missing plan.

    Attributes:
        text: The answer in sentences.
        plan: The plan, if there is one after all; or the one beyond the last step.
        horizon: If it is only the horizon: the last step that would do.
        is_contradictory: Whether there is no answer set even if no plan is asked for.
        reason: What prevents a plan.
    """

    text: str
    plan: Optional[Possible] = None
    horizon: Optional[int] = None
    is_contradictory: bool = False
    reason: Optional[MinimalReason] = None

    @property
    def is_finished(self) -> bool:
        """True if more time would not improve the reason."""
        return self.reason is None or self.reason.is_finished


@dataclass(frozen=True)
class WhyGoal:
    """Explanation of a goal that waits, or fails.

    Attributes:
        text: The answer in sentences.
        slot: Its slot; empty if it has none.
        request: The request.
        ends: The step in which it ends by the plan, if it does.
        late: By how many seconds it will be late then, as far as that is known.
        after: The requests of the goals whose turn comes before.
        silent: The actuators that have not answered, and since how many seconds.
        no_plan: Why it does not end, if it does not.
    """

    text: str
    slot: str
    request: str
    ends: Optional[int] = None
    after: Tuple[str, ...] = ()
    silent: Tuple[Tuple[str, float], ...] = ()
    no_plan: Optional[WhyNoPlan] = None
    late: int = 0

    @property
    def is_finished(self) -> bool:
        """True if more time would not improve the reason."""
        return self.no_plan is None or self.no_plan.is_finished


@dataclass(frozen=True)
class Contrast:
    """Contrastive explanation: the best plan, and the best one with, or without, an action.

    Attributes:
        text: The answer in sentences.
        action: The action, as ``do(R,A,T)``.
        is_demanded: Whether it has to be in the plan; else, it must not.
        plan: The best plan; None if there is none in any case.
        other: The best plan with the demand; None if there is none.
        longer: By how many steps that is longer.
        reason: Why there is none.
        is_possible: Whether the action itself is possible then, as far as that is known.
        later: The goals that are late then, or later than by the best plan: for each its slot, by
            how many seconds it is late then, and by how many in the best plan.
    """

    text: str
    action: str
    is_demanded: bool
    plan: Optional[Possible]
    other: Optional[Possible] = None
    longer: Optional[int] = None
    reason: Optional[MinimalReason] = None
    is_possible: bool = True
    later: Tuple[Tuple[str, int, int], ...] = ()

    @property
    def is_planned(self) -> bool:
        """True if the best plan has the action."""
        return self.plan is not None and self.action in self.plan.actions


@dataclass(frozen=True)
class WhatIf:
    """Counterfactual: the plan with further events.

    Attributes:
        text: The answer in sentences.
        told: The events, as ``event(S,C,T)``.
        before: The plan without them.
        plan: The plan with them.
        no_plan: Why there is none.
    """

    text: str
    told: Tuple[str, ...]
    before: Optional[Possible]
    plan: Optional[Possible] = None
    no_plan: Optional[WhyNoPlan] = None


@dataclass(frozen=True)
class Happened:
    """How an action went, and the causes that are believed.

    Attributes:
        text: The answer in sentences.
        action: The action, such as ``go(c4)``.
        actuator: The actuator that did it; empty without one.
        step: When, as the loop counts steps; below 0 if that was before the last reset, None if it
            was never done, or if that is unknown.
        answer: How it was answered; empty if it was not.
        because: The causes of that in the best explanation.
        others: The causes in other explanations that were kept.
        refuted: Further ones against which something speaks.
    """

    text: str
    action: str
    actuator: str = ""
    step: Optional[int] = None
    answer: str = ""
    because: Tuple[str, ...] = ()
    others: Tuple[str, ...] = ()
    refuted: Tuple[str, ...] = ()


_MOVED: Dict[type, Tuple[str, ...]] = {  # the fields that are steps, or have steps in them
    Fact: ("step", "atoms"),
    ReasonMember: ("fact", "without"),
    MinimalReason: ("members", "given", "enabling", "relaxed", "examined_up_to"),
    WhyNoPlan: ("plan", "horizon", "reason"),
    WhyGoal: ("ends",),
    Contrast: ("action", "plan", "other", "reason"),
    WhatIf: ("told", "before", "plan"),
}


def later(value: Any, steps: int) -> Any:
    """Returns an answer, or a part of one, with its step numbers shifted."""
    if value is None:
        return None
    if isinstance(value, int):
        return value + steps
    if isinstance(value, str):
        return moved(value, steps)
    if isinstance(value, tuple):
        return tuple(later(part, steps) for part in value)
    if isinstance(value, Possible):
        return value.later(steps)
    fields = _MOVED[type(value)]
    return replace(value, **{name: later(getattr(value, name), steps) for name in fields})
