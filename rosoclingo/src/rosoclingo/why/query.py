"""A query: a situation with its facts, and the planner copy that is asked about it."""

from __future__ import annotations

from dataclasses import replace
from typing import FrozenSet, Optional, Tuple

from rosclingo.wire.commands import Assumption
from rosoclingo.loop.situation import Situation
from rosoclingo.why.facts import Fact, FactKind, Facts, atoms
from rosoclingo.why.planner_copy import Copy, CopyAnswer, Deadline, PlanQuery, Verdict
from rosoclingo.why.reason import MinimalReason, ReasonSearch
from rosoclingo.why.relaxation import Relaxation
from rosoclingo.why.rules import NO_RULES, Rules


class Case:
    """A query about a situation, with the planner copy that answers it. Lasts for one question.

    Attributes:
        copy: The copy.
        situation: The situation.
        facts: What was told.
        deadline: When to answer.
        demands: What has to be in a plan.
        request: That of the goal that alone matters; empty if all do.
    """

    def __init__(
        self,
        copy: Copy,
        situation: Situation,
        deadline: Deadline,
        *,
        says_ends: bool,
        rules: Rules = NO_RULES,
    ) -> None:
        """Makes a query about all facts and goals.

        Args:
            copy: The copy.
            situation: The situation.
            deadline: When to answer.
            says_ends: Whether the encoding says how goals end.
            rules: The constraints that can be relaxed.
        """
        self.copy = copy
        self.situation = situation
        self.facts = Facts.of(situation, copy.slots, copy.savable)
        self.deadline = deadline
        self.demands: Tuple[Assumption, ...] = ()
        self._says_ends = says_ends
        self._rules = rules
        self.request = ""
        self._only: Optional[FrozenSet[str]] = None  # the slots of the goals that matter

    def goals(self, facts: FrozenSet[Fact]) -> FrozenSet[str]:
        """Returns the slots of the goals that have to end if these facts are so."""
        if self._only is not None or not self._says_ends:
            return self._only or frozenset()
        # Of a goal that has ended in the same slot, the request is history.
        requests = {fact for fact in self.facts.free if fact.kind is FactKind.REQUEST}
        known = {fact.source for fact in requests}
        asked = {fact.source for fact in requests & facts}
        return frozenset(s for s, _ in self.situation.goals if s in asked or s not in known)

    def take_as_given(self, slot: str = "") -> None:
        """Fixes that a goal is wanted, and ignores all other goals from now on.

        Args:
            slot: The goal's; by default, all goals are wanted.
        """
        self._only = (
            frozenset((slot,)) if slot and self._says_ends else self.goals(self.facts.all())
        )
        wanted = frozenset(
            fact
            for fact in self.facts.free
            if fact.kind is FactKind.REQUEST and slot in ("", fact.source)
        )
        free = tuple(fact for fact in self.facts.free if fact not in wanted)
        self.facts = Facts(free, self.facts.history, self.facts.fixed | atoms(wanted))

    def ask(self, facts: FrozenSet[Fact], goals: Optional[FrozenSet[str]] = None) -> Verdict:
        """Searches for a plan with these facts."""
        return self.copy.ask(self.query(facts, goals), best=facts == self.facts.all())

    def query(self, facts: FrozenSet[Fact], goals: Optional[FrozenSet[str]] = None) -> PlanQuery:
        """Returns the query to a copy for a plan with these facts."""
        goals = self.goals(facts) if goals is None else goals
        return PlanQuery(atoms(facts) | self.facts.fixed, goals, self.demands)

    def ask_any(self, facts: FrozenSet[Fact], others: FrozenSet[Fact]) -> Optional[bool]:
        """Returns whether there is a plan with some facts, and any of others; None if not known."""
        groups = [fact.atoms for fact in sorted(others, key=str)]
        verdict = self.copy.ask_any(self.query(facts), groups)
        return None if verdict is None else verdict.answer is CopyAnswer.PLAN

    def explain(self, wrong: CopyAnswer) -> MinimalReason:
        """Returns the reason for an answer: facts, or else constraints.

        Args:
            wrong: The answer with all facts.
        """
        ask_any = self.ask_any if wrong is CopyAnswer.NONE else lambda facts, others: None
        reason = ReasonSearch(self.ask, self.facts, self.deadline, wrong, ask_any).run()
        if reason.is_complete and reason.has_only_goals:
            query = self.query(reason.facts)
            obstacles, doubts = (
                self.copy.doubts(query.told) if wrong is CopyAnswer.NONE else ((), ())
            )
            if obstacles or doubts:
                return replace(reason, obstacles=obstacles, doubts=doubts)
            return Relaxation(self.copy, self._rules, query, wrong).add_to(reason)
        return reason
