"""Contrastive queries, with or without an action, for encodings that are told their events.

Such an encoding has no atoms for the actions of a plan, but it says who can do what next, in its
part ``possible(k)``. So an action that may be done instead is told as one that was done, in the
step before which all goes as planned, and the rest is planned for.
"""

from __future__ import annotations

from dataclasses import replace
from typing import FrozenSet, List, Optional, Tuple

from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import QuestionError
from rosoclingo.loop.values.atoms import Action, Plan, event
from rosoclingo.loop.words import SUCCESS
from rosoclingo.why.answers import Contrast
from rosoclingo.why.copy_by_replay import RetellingCopy
from rosoclingo.why.facts import Fact, Facts, atoms
from rosoclingo.why.planner_copy import CopyAnswer, Deadline, PlanQuery, Possible, Verdict
from rosoclingo.why.reason import MinimalReason, ReasonSearch


class Instead:
    """Searches for the best plan with another action."""

    def __init__(self, copy: RetellingCopy, facts: Facts, deadline: Deadline) -> None:
        """Prepares a contrastive query.

        Args:
            copy: The copy, which is at the current step.
            facts: What was told.
            deadline: When to answer.
        """
        self._copy = copy
        self._facts = facts
        self._deadline = deadline

    def look(self, best: Optional[Possible], text: str, *, is_demanded: bool) -> Contrast:
        """Compares the best plan with the best one that has an action, or does not have it.

        Args:
            best: The best plan.
            text: The action.
            is_demanded: Whether the other plan has to have it.

        Raises:
            QuestionError: The action's step has gone by, or the encoding does not say enough.
        """
        actuator, name, _ = split_term(text)[1]
        action = Action(actuator, name, last_number(text) or 0)
        if action.step <= self._copy.step:
            raise QuestionError(f"{text}: the step has begun; the next is {self._copy.step + 1}")
        if best is None:
            raise QuestionError("there is no plan to compare with")
        planned = Plan(best.actions)
        done = [
            a for step in range(self._copy.step + 1, action.step) for a in planned.actions(step)
        ]
        beside = [a for a in planned.actions(action.step) if a.actuator != actuator]
        told = atoms(self._facts.all()) | self._facts.fixed
        possible, holds = self._before(told, done, action.step)
        if is_demanded and (actuator, name) not in possible:
            reason = self._why_impossible(action, done)
            return Contrast("", text, True, best, reason=reason, is_possible=False)
        # The times of later steps are not known: what goes on over several is taken to have ended.
        is_next = action.step == self._copy.step + 1
        elapsed = best.next_begins if is_next and best.late is not None else None
        if is_demanded:
            others: List[Optional[Action]] = [action]
        else:
            names = sorted(a for r, a in possible if r == actuator and a != name)
            others = [Action(actuator, a, action.step) for a in names]
            if elapsed is None or beside or not others:  # in seconds, one waits for another only
                others = [None, *others]
        plans = [
            self._with(holds, done, [*beside, *([a] if a else [])], action.step, elapsed)
            for a in others
        ]
        if not is_demanded:
            plans = [p for p in plans if p is not None and text not in p.actions]
        served = {slot for slot, _, step in best.ends if step >= action.step}
        same = [p for p in plans if p is not None and served <= {slot for slot, _, _ in p.ends}]
        other = min(same, key=_value, default=None)
        longer = None if other is None else other.horizon - best.horizon
        return Contrast("", text, is_demanded, best, other, longer, later=_later(best, other))

    def _before(
        self, told: FrozenSet[str], done: List[Action], step: int
    ) -> Tuple[FrozenSet[Tuple[str, str]], Tuple[str, ...]]:
        """Returns the possible actions of a step, and the fluents before it."""
        with_done = told | _events(done)
        with self._copy.at(step - 1):
            plan = self._copy.ask(PlanQuery(with_done)).plan
            return self._copy.possible(with_done), plan.holds if plan else ()

    def _why_impossible(self, action: Action, done: List[Action]) -> MinimalReason:
        facts = Facts(
            self._facts.free, (), self._facts.fixed | atoms(self._facts.history) | _events(done)
        )

        def ask(some: FrozenSet[Fact]) -> Verdict:
            with self._copy.at(action.step - 1):
                possible = self._copy.possible(atoms(some) | facts.fixed)
            can = (action.actuator, action.name) in possible
            return Verdict(CopyAnswer.PLAN if can else CopyAnswer.NONE)

        return ReasonSearch(ask, facts, self._deadline).run()

    def _with(
        self,
        holds: Tuple[str, ...],
        done: List[Action],
        actions: List[Action],
        step: int,
        elapsed: Optional[float],
    ) -> Optional[Possible]:
        """Returns the best plan from a step on, given the fluents before it and its actions.

        It has no times if it is not known when the step begins.
        """
        told = {event("save", fluent, 0) for fluent in holds}
        told |= {replace(action, step=1).commit for action in actions}
        with self._copy.at(1, elapsed or 0.0):
            plan = self._copy.ask(PlanQuery(frozenset(told))).plan
        if plan is None:
            return None
        told_of = {replace(action, step=1) for action in actions}
        new = [a for a in Plan(plan.actions).actions_from(1) if a not in told_of]
        ahead = tuple(map(str, new))
        plan = replace(plan, actions=ahead).later(step - 1)
        texts = (*map(str, [*done, *actions]), *plan.actions)
        now = self._copy.step
        late = None if elapsed is None else plan.late
        return replace(plan, actions=texts, step=now, steps=plan.horizon - now, late=late)


def _value(plan: Possible) -> Tuple[int, int]:
    """Returns the objective: by how much all goals are late, and the number of steps."""
    return sum(seconds for _, seconds in plan.late or ()), plan.horizon


def _later(best: Possible, other: Optional[Possible]) -> Tuple[Tuple[str, int, int], ...]:
    """Returns the goals that another plan has later than they are due and than the best plan.

    Returns:
        For each its slot, by how many seconds it is late then, and by how many in the best plan.
    """
    if other is None or best.late is None or other.late is None:
        return ()
    now = dict(best.late)
    then = ((slot, seconds, now.get(slot, 0)) for slot, seconds in other.late)
    return tuple(one for one in then if one[1] > one[2])


def _events(done: List[Action]) -> FrozenSet[str]:
    """Returns the events of done actions: each was published and has succeeded.

    Of an action that goes on in the next step, only its last step counts.
    """
    goes_on = {replace(action, step=action.step - 1) for action in done}
    ended = [action for action in done if action not in goes_on]
    return frozenset(
        [*(one.commit for one in done), *(event(one.actuator, SUCCESS, one.step) for one in ended)]
    )
