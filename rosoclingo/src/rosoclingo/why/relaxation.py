"""Finds the constraints that prevent a plan, where no fact does.

Those with names are relaxed, and as few as possible are looked for without which there is a plan.
Of the others, as few as possible are kept so that there is none, whatever becomes of the rest.

That few constraints exclude a plan may take very long to prove for many steps. So they are looked
for up to a few steps first, and then up to twice as many. What suffices up to a few steps is tried
for all steps; and if the time is over, it is the answer so far.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import Dict, FrozenSet, Iterator, Tuple

from rosoclingo.errors import InterruptedQuestionError
from rosoclingo.why.facts import Fact, Facts, atoms
from rosoclingo.why.planner_copy import Copy, CopyAnswer, Deadline, PlanQuery, Possible, Verdict
from rosoclingo.why.reason import Ask, MinimalReason, ReasonSearch
from rosoclingo.why.rules import Rules

_SINGLES = 0.5  # of the time that is left, for relaxing one rule at a time
_ALL_STEPS = 0.3  # of the time that is left, for proving a set for all steps


class Relaxation:
    """Searches for the constraints that prevent a plan with some facts."""

    def __init__(self, copy: Copy, rules: Rules, query: PlanQuery, wrong: CopyAnswer) -> None:
        """Prepares a search.

        Args:
            copy: The copy, which ends when its deadline is over.
            rules: The constraints that can be relaxed.
            query: The query if nothing is relaxed.
            wrong: The answer to that.
        """
        self._copy = copy
        self._rules = rules
        self._query = query
        self._wrong = wrong
        self._every = frozenset((*rules.named, *rules.others))
        self._plans: Dict[FrozenSet[Fact], Possible] = {}

    def add_to(self, reason: MinimalReason) -> MinimalReason:
        """Returns a reason with the rules that were found until the time was over."""
        try:
            if self._has_plan(frozenset(self._rules.named)):
                return self._with_names(reason)
            relaxed = self._relax(self._every)
        except InterruptedQuestionError:
            return replace(reason, is_examined=False)
        if relaxed.answer is self._wrong:
            return reason
        first = self._copy.last
        if relaxed.plan is not None and self._wrong is CopyAnswer.NONE:
            first = relaxed.plan.horizon
        return self._with_quotes(reason, first)

    def _with_names(self, reason: MinimalReason) -> MinimalReason:
        """Adds a correction set: as few named rules as possible without which there is a plan."""
        named = frozenset(self._rules.named)
        singles = [frozenset([rule]) for rule in _sorted(named)]
        with contextlib.suppress(InterruptedQuestionError), self._deadline.share(_SINGLES):
            for last in self._lasts(self._plans[named].horizon):
                with self._copy.up_to(last):
                    for single in singles:
                        if single not in self._plans:
                            self._has_plan(single)
        found = [single for single in singles if single in self._plans]
        if found:
            # The least change: without a rule of how robots move at all, a plan is very short.
            least = max(found, key=lambda single: self._plans[single].horizon)
            return replace(reason, rules=_sorted(least), relaxed=self._plans[least])
        least, is_smallest = self._search(self._relax, named, CopyAnswer.PLAN)
        with contextlib.suppress(InterruptedQuestionError):
            self._has_plan(least)
        if least not in self._plans:
            least, is_smallest = named, False
        relaxed = self._plans[least]
        return replace(reason, rules=_sorted(least), relaxed=relaxed, is_examined=is_smallest)

    def _with_quotes(self, reason: MinimalReason, first: int) -> MinimalReason:
        """Adds constraints that prevent a plan, each of which is needed for that.

        Args:
            reason: The reason.
            first: The first step up to which that is looked for.
        """
        reason = replace(reason, is_examined=False)
        for last in self._lasts(first):
            with self._copy.up_to(last):
                rules, is_smallest = self._search(self._keep, self._every, self._wrong)
            if not is_smallest:
                break
            reason = replace(reason, rules=_sorted(rules), examined_up_to=last)
            if last == self._copy.last or self._suffice(rules):
                return replace(reason, is_examined=True, examined_up_to=None)
        return reason

    def _lasts(self, first: int) -> Iterator[int]:
        """Returns the steps up to which plans are looked for, one after the other."""
        steps = max(1, first - self._copy.step)
        while self._copy.step + steps < self._copy.last:
            yield self._copy.step + steps
            steps *= 2
        yield self._copy.last

    def _suffice(self, rules: FrozenSet[Fact]) -> bool:
        """Returns whether rules are proven in time to prevent a plan up to the last step."""
        with contextlib.suppress(InterruptedQuestionError), self._deadline.share(_ALL_STEPS):
            return self._keep(rules).answer is self._wrong
        return False

    def _has_plan(self, rules: FrozenSet[Fact]) -> bool:
        """Returns whether there is a plan without some rules, which is cached."""
        plan = self._relax(rules).plan
        if plan is not None:
            self._plans[rules] = plan
        return plan is not None

    def _relax(self, rules: FrozenSet[Fact]) -> Verdict:
        """Searches for a plan without some rules."""
        return self._copy.ask(self._without(rules))

    def _keep(self, rules: FrozenSet[Fact]) -> Verdict:
        """Searches for a plan with only some rules."""
        query = self._without(self._every - rules)
        verdict = self._copy.ask_any(query) if self._wrong is CopyAnswer.NONE else None
        return self._copy.ask(query) if verdict is None else verdict

    def _without(self, rules: FrozenSet[Fact]) -> PlanQuery:
        return replace(self._query, told=self._query.told | atoms(rules))

    def _search(
        self, ask: Ask, rules: FrozenSet[Fact], wrong: CopyAnswer
    ) -> Tuple[FrozenSet[Fact], bool]:
        """Returns the fewest rules that still have the answer to be explained, and if they are.

        If there is no time, they are more than that.
        """
        facts = Facts(tuple(rules), (), frozenset())
        found = ReasonSearch(ask, facts, self._deadline, wrong).run()
        return found.facts, found.is_complete

    @property
    def _deadline(self) -> Deadline:
        return self._copy.deadline


def _sorted(rules: FrozenSet[Fact]) -> Tuple[Fact, ...]:
    return tuple(sorted(rules, key=lambda rule: rule.content))
