"""The answers to questions, as values and in sentences. All of them are immutable."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any, Optional, Tuple

from rosoclingo.why.facts import Fact
from rosoclingo.why.planner_copy import Possible
from rosoclingo.why.reason import MinimalReason, ReasonMember
from rosoclingo.why.situation import moved


@dataclass(frozen=True)
class WhyNoPlan:
    """Explanation why there is no plan.

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


@dataclass(frozen=True)
class WhyGoal:
    """Explanation why a goal waits, or fails.

    Attributes:
        text: The answer in sentences.
        slot: Its slot; empty if it has none.
        request: The request.
        ends: The step in which it ends by the plan, if it does.
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
    """

    text: str
    action: str
    is_demanded: bool
    plan: Optional[Possible]
    other: Optional[Possible] = None
    longer: Optional[int] = None
    reason: Optional[MinimalReason] = None
    is_possible: bool = True

    @property
    def is_planned(self) -> bool:
        """Whether the best plan has the action."""
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
        actuator: Who has done it; empty if nobody has.
        step: When, as the loop counts steps; below 0 if that was before the last reset, None if it
            was never done, or if nobody knows.
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


@singledispatch
def later(value: Any, steps: int) -> Any:
    """Returns an answer, or a part of one, with each of its steps counted some steps later."""
    raise TypeError(f"{value!r} is no answer")


@later.register(type(None))
def _(value: None, steps: int) -> None:
    return value


@later.register(tuple)
def _(value: Tuple[Any, ...], steps: int) -> Tuple[Any, ...]:
    return tuple(
        moved(part, steps) if isinstance(part, str) else later(part, steps) for part in value
    )


@later.register(Possible)
def _(value: Possible, steps: int) -> Possible:
    return replace(
        value,
        actions=later(value.actions, steps),
        step=value.step + steps,
        horizon=value.horizon + steps,
        ends=tuple((slot, status, step + steps) for slot, status, step in value.ends),
    )


@later.register(Fact)
def _(value: Fact, steps: int) -> Fact:
    return replace(value, step=value.step + steps, atoms=later(value.atoms, steps))


@later.register(ReasonMember)
def _(value: ReasonMember, steps: int) -> ReasonMember:
    return ReasonMember(later(value.fact, steps), later(value.without, steps))


@later.register(MinimalReason)
def _(value: MinimalReason, steps: int) -> MinimalReason:
    members, given = later(value.members, steps), later(value.given, steps)
    enabling = later(value.enabling, steps)
    relaxed = later(value.relaxed, steps)
    up_to = None if value.examined_up_to is None else value.examined_up_to + steps
    return replace(
        value,
        members=members,
        given=given,
        enabling=enabling,
        relaxed=relaxed,
        examined_up_to=up_to,
    )


@later.register(WhyNoPlan)
def _(value: WhyNoPlan, steps: int) -> WhyNoPlan:
    horizon = None if value.horizon is None else value.horizon + steps
    plan, reason = later(value.plan, steps), later(value.reason, steps)
    return replace(value, plan=plan, horizon=horizon, reason=reason)


@later.register(WhyGoal)
def _(value: WhyGoal, steps: int) -> WhyGoal:
    return replace(value, ends=None if value.ends is None else value.ends + steps)


@later.register(Contrast)
def _(value: Contrast, steps: int) -> Contrast:
    return replace(
        value,
        action=moved(value.action, steps),
        plan=later(value.plan, steps),
        other=later(value.other, steps),
        reason=later(value.reason, steps),
    )


@later.register(WhatIf)
def _(value: WhatIf, steps: int) -> WhatIf:
    told, before = later(value.told, steps), later(value.before, steps)
    return replace(value, told=told, before=before, plan=later(value.plan, steps))
