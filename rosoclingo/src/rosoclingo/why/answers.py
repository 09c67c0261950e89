"""The answers: what was found, and what is said of it. All of them are immutable."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from rosoclingo.why.copy import Possible
from rosoclingo.why.reason import Reason


@dataclass(frozen=True)
class WhyNoPlan:
    """Why there is no plan.

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
    reason: Optional[Reason] = None


@dataclass(frozen=True)
class WhyGoal:
    """Why a goal waits, or fails.

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
    """What would be if an action were demanded, or excluded.

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
    reason: Optional[Reason] = None
    is_possible: bool = True

    @property
    def is_planned(self) -> bool:
        """Whether the best plan has the action."""
        return self.plan is not None and self.action in self.plan.actions


@dataclass(frozen=True)
class WhatIf:
    """What would be with further events.

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
