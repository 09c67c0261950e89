"""Planner copy by replay, for encodings that are told events by grounding and replan after them.

A fact left out changes the encoding's plans in the steps before, and the plan of such a
step would stand, although it was not executed. So a plan is always made in the last step in
which something happened: that step is the only one, or the encoding is told what holds after it as
what was saved, as a reset does it. Since then nothing has changed, and the plan is moved on to the
current step.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import FrozenSet, Iterator, List, Optional, Sequence, Tuple

from rosclingo.solver.options import Options
from rosclingo.wire.commands import GetPrograms, Part, Programs, Result
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import QuestionError
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import COMMIT, PASSED, SAVE, Plan, event
from rosoclingo.why.copy_by_regrounding import RebuildingCopy
from rosoclingo.why.doubts import DOUBTS, OBSTACLES, doubts, one_of_each, prevents, sentence
from rosoclingo.why.planner_copy import CopyAnswer, Deadline, PlanQuery, Possible, Verdict
from rosoclingo.why.rules import is_relaxed

_MOST_DOUBTS = 3  # that an answer names


class RetellingCopy(RebuildingCopy):
    """A planner copy that replays the events to an encoding, and plans where it has to replan."""

    def __init__(
        self,
        options: Options,
        situation: Situation,
        deadline: Deadline,
        last: Optional[int] = None,
    ) -> None:
        """Reads the encoding; for arguments see :class:`.copy_by_regrounding.RebuildingCopy`."""
        super().__init__(options, situation, deadline, last=last)
        answers = self._engine.run([GetPrograms()]).answers
        parts = [part for a in answers if isinstance(a, Programs) for part in a.parts]
        self._says_possible = ("possible", 1) in parts
        self._has_doubts = {(DOUBTS, 1), (OBSTACLES, 1)} <= set(parts)

    @contextlib.contextmanager
    def at(self, step: int, elapsed: float = 0.0) -> Iterator[None]:
        """Returns a context in which another step is the current one.

        Args:
            step: The step.
            elapsed: In how many seconds from now that is.
        """
        own, self.step, self.elapsed = (self.step, self.elapsed), step, elapsed
        try:
            yield
        finally:
            self.step, self.elapsed = own

    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""
        return [reason for _, reason in self._planner.tell(list(events))]

    def possible(self, told: FrozenSet[str]) -> FrozenSet[Tuple[str, str]]:
        """Returns the possible next actions, by the part ``possible(k)`` of the encoding.

        Raises:
            QuestionError: It has none.
        """
        if not self._says_possible:
            raise QuestionError(
                "the encoding does not say what can be done instead: it has no part possible(k) "
                "with #external possible(R,A); see docs/why.md"
            )
        self._ask(PlanQuery(told))
        planner = self._planner
        planner.run(planner.demand.ground([Part("possible", (str(planner.demand.searches),))]))
        terms = (split_term(atom) for atom in planner.externals())
        return frozenset((a[0], a[1]) for n, a in terms if n == "possible" and len(a) == 2)

    def doubts(self, told: FrozenSet[str]) -> Tuple[Tuple[str, ...], Tuple[str, ...]]:
        """Says what prevents a plan; see :class:`.planner_copy.Copy`."""
        if not self._has_doubts:
            return (), ()
        self._ask(PlanQuery(told))
        missing = doubts(self._planner, self.step, OBSTACLES)
        others = filter(prevents, doubts(self._planner, self.step, DOUBTS))
        found = one_of_each([*missing, *others])
        return (
            _sentences([one for one in found if one in missing]),
            _sentences([one for one in found if one not in missing]),
        )

    def ask(self, asked: PlanQuery, *, best: bool = False) -> Verdict:
        """Searches for the best plan; see :class:`.planner_copy.Copy`.

        Raises:
            QuestionError: There are demands, for which the encoding has no atoms.
        """
        if asked.demands:
            raise QuestionError("an encoding that is told its events has no atoms to be demanded")
        verdict = super().ask(PlanQuery(asked.told))
        plan = verdict.plan
        if plan is not None and any(plan.end_of(slot) is None for slot in asked.goals):
            return Verdict(CopyAnswer.NONE)
        return verdict

    def _ask(self, asked: PlanQuery) -> Verdict:
        told = asked.told
        saved = sorted(atom for atom in told if atom.startswith(SAVE))
        happened = told.difference(saved)
        happened = frozenset(
            atom for atom in happened if not (atom.startswith(PASSED) or is_relaxed(atom))
        )
        steps = {last_number(atom) or 0 for atom in happened}
        last = max(steps, default=0)
        past: Tuple[Tuple[str, str, int], ...] = ()
        has_acted = any(atom.startswith(COMMIT) for atom in happened)
        found = None
        if len(steps) <= 1 or not has_acted:
            self._begin(told, saved)
            self._replay(happened, last)
            found = self._shortest(last, told)
            if found is None:
                return Verdict(self._without_plan())
        if found is None or found.step < last:
            self._begin(told, saved)
            self._replay(happened, last)
            before = self._model(last, told)
            if before is None:
                return Verdict(CopyAnswer.CONTRADICTION)
            past, last = before.ends, 0
            holds = [event("save", fluent, 0) for fluent in before.holds]
            self._begin(told, sorted(holds))
            told = frozenset(holds)
            found = self._shortest(last, told)
            if found is None:
                return Verdict(self._without_plan())
        ahead = tuple(map(str, Plan(found.actions).actions_from(found.step + 1)))
        plan = replace(found, actions=ahead).later(self.step - last)
        plan = replace(plan, ends=(*(end for end in past if end[2] <= self.step), *plan.ends))
        return Verdict(CopyAnswer.PLAN if plan.horizon <= self.last else CopyAnswer.NONE, plan)

    def _model(self, step: int, told: FrozenSet[str]) -> Optional[Possible]:
        """Returns any plan after a step: the fluents of that step are the same in all of them."""
        demand = self._planner.demand
        self._planner.run(*demand.prepare(step))
        outcome = self._solve()
        if outcome.result is Result.UNSAT and demand.may_relax:
            self._planner.run(demand.begin_search(step, "search", "relax"))
            outcome = self._solve()
        if outcome.result is Result.UNSAT:
            return None
        with self.at(step):
            return self._plan(outcome.symbols, step, told)

    def _shortest(self, step: int, told: FrozenSet[str]) -> Optional[Possible]:
        """Returns the best plan for the first horizon with one, from a step on.

        Its step is that step, or an earlier one if it begins earlier.
        """
        planner = self._planner
        before: Optional[int] = None
        horizon = step
        with self.at(step):
            while horizon <= max(step, self.last) or planner.needed == horizon:
                self.deadline.check()
                planner.query(horizon, before, range((before or step) + 1, horizon + 1))
                before = horizon
                outcome = self._search(horizon)
                if outcome.result is Result.SAT:
                    plan = self._plan(outcome.symbols, horizon, told)
                    return replace(plan, step=_first(outcome.symbols, told, step))
                horizon = max(horizon + 1, planner.needed or 0)
        self._asked = before
        return None

    def _without_plan(self) -> CopyAnswer:
        """Returns whether there is an answer set at least."""
        asked = self._asked
        is_consistent = asked is None or self._has_answer_set(asked)
        return CopyAnswer.NONE if is_consistent else CopyAnswer.CONTRADICTION


def _first(symbols: Sequence[str], told: FrozenSet[str], step: int) -> int:
    """Returns the step before the first action that was not done, if that is before a step."""
    actions = Plan(tuple(symbols)).actions_from(0)
    new = (action.step for action in actions if action.commit not in told)
    return min(step, min(new, default=step + 1) - 1)


def _sentences(found: Sequence[str]) -> Tuple[str, ...]:
    """Returns the sentences of some doubts, the first few if there are many."""
    more = len(found) - _MOST_DOUBTS
    rest = (f"and {more} more",) if more > 0 else ()
    return (*map(sentence, found[:_MOST_DOUBTS]), *rest)
