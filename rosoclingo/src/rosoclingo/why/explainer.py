"""Answers questions about a situation."""

from __future__ import annotations

from dataclasses import replace
from typing import Callable, Dict, List, Optional, Sequence, Tuple, Type, TypeVar

from rosclingo.solver.options import Options
from rosclingo.solver.programs import parse_files
from rosclingo.wire.commands import Assumption
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import InterruptedQuestionError, QuestionError
from rosoclingo.loop.single.dialects import Dialect2, says_status
from rosoclingo.loop.situation import Situation, moved
from rosoclingo.loop.values.atoms import canonical, event
from rosoclingo.loop.values.ids import CANCEL, GOAL, split_event
from rosoclingo.why import answers, words
from rosoclingo.why.answers import Contrast, WhatIf, WhyGoal, WhyNoPlan
from rosoclingo.why.contrast import Instead
from rosoclingo.why.copy_by_assumptions import AssumingCopy
from rosoclingo.why.copy_by_regrounding import RebuildingCopy
from rosoclingo.why.copy_by_replay import RetellingCopy
from rosoclingo.why.phrases import Phrases
from rosoclingo.why.planner_copy import Copy, CopyAnswer, Deadline, Possible, Verdict
from rosoclingo.why.query import Case
from rosoclingo.why.rules import Rules

AnswerT = TypeVar("AnswerT", WhyNoPlan, WhyGoal, Contrast, WhatIf)
_ON_DEMAND = {("event", 3), ("search", 2)}
_FARTHER = 0.3  # of the time that is left, for looking beyond the last step


class Explainer:
    """Answers questions, each with its own deadline. One thread makes the calls.

    All methods raise InterruptedQuestionError if there was no time for any answer, QuestionError if
    a question names what there is not, and RosclingoError if the encoding does not fit.
    """

    def __init__(
        self,
        options: Options,
        situation: Situation,
        dialect: Type[Dialect2] = Dialect2,
        *,
        seconds: float = 5.0,
        stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        """Prepares; the first question makes a copy of the planner.

        Args:
            options: The planner's command line.
            situation: What the questions are about.
            dialect: The encoding's dialect.
            seconds: How long an answer may take; clingo cannot be interrupted while it grounds.
            stopped: Whether the answer is not wanted any more; called in another thread.
        """
        self._options = options
        self._situation = situation
        self._dialect = dialect
        self._seconds = seconds
        self._stopped = stopped
        program = parse_files(options.files)
        self._is_told = ("event", 3) in program.parts
        self._must_rebuild = bool(program.parts.keys() & _ON_DEMAND) or dialect is not Dialect2
        self._says_ends = self._is_told or says_status(options)
        self._phrases = Phrases.read(program.texts.values())
        self._rules = Rules.read(program)
        self._copies: Dict[Optional[int], Copy] = {}

    # The questions.

    def no_plan(self) -> WhyNoPlan:
        """Says why there is no plan in which all goals end."""
        return words.with_queue(self._no_plan(self._begin()), self._situation)

    def goal(self, which: str) -> WhyGoal:
        """Says why a goal waits, or cannot be reached.

        Args:
            which: Its slot, or its request.
        """
        case = self._begin()
        situation, name = self._situation, canonical(which)
        found = [goal for goal in situation.goals if name in goal]
        if not found:
            if name in situation.queued:
                return words.queued(name, situation, self._phrases, len(case.copy.slots))
            known = [request for _, request in situation.goals] + list(situation.queued)
            raise QuestionError(
                f"there is no open goal {name}; there are {', '.join(known) or 'none'}"
            )
        slot, request = found[0]
        plan = case.ask(case.facts.all(), frozenset()).plan
        end = plan.end_of(slot) if plan else None
        if plan is not None and end is not None:
            earlier = sorted((s, own) for own, _, s in plan.ends if s < end and own != slot)
            requests = dict(situation.goals)
            after = tuple(requests[own] for _, own in earlier if own in requests)
            late = dict(plan.late or ()).get(slot, 0)
            found_end = WhyGoal("", slot, request, end, after, situation.silent, late=late)
            return words.goal(self._in_time(found_end), situation, self._phrases)
        case.take_as_given(slot)
        case.request = request
        no_plan = self._no_plan(case)
        return words.goal(
            WhyGoal("", slot, request, silent=situation.silent, no_plan=no_plan),
            situation,
            self._phrases,
        )

    def why(self, action: str) -> Contrast:
        """Compares the plan with the best one without an action ``do(mailbot,go(c3),4)``."""
        return self._contrast(action, is_demanded=False)

    def why_not(self, action: str) -> Contrast:
        """Compares the plan with the best one with an action ``do(mailbot,go(c3),4)``."""
        return self._contrast(action, is_demanded=True)

    def what_if(self, events: Sequence[str]) -> WhatIf:
        """Plans with hypothetical events in the current step.

        Args:
            events: For instance ``goal:bring(o2,o3)``, ``cancel:1`` with a slot, or
                ``info:blocked(c3,c4)`` with any id.
        """
        case = self._begin()
        before = case.ask(case.facts.all()).plan
        told, goals = self._events(events, case.copy)
        unknown = case.copy.unknown(told)
        if unknown:
            raise QuestionError(f"the planner does not know it: {'; '.join(unknown)}")
        situation = replace(
            self._situation,
            told=(*self._situation.told, *told),
            goals=(*self._situation.goals, *goals),
        )
        case = self._case(case.copy, situation, case.deadline)
        found = self._look(case)
        what_if = self._in_time(WhatIf("", tuple(told), before, found.plan))
        if found.reason is not None or found.is_contradictory:
            what_if = replace(what_if, plan=None, no_plan=self._say(found, case))
        return words.what_if(what_if)

    # How they are answered.

    def _begin(self) -> Case:
        deadline = Deadline(self._seconds, self._stopped)
        return self._case(self._copy(deadline), self._situation, deadline)

    def _case(self, copy: Copy, situation: Situation, deadline: Deadline) -> Case:
        return Case(copy, situation, deadline, says_ends=self._says_ends, rules=self._rules)

    def _copy(self, deadline: Deadline, last: Optional[int] = None) -> Copy:
        """Returns the copy that may plan up to a step; it serves all questions."""
        if last not in self._copies:
            self._copies[last] = self._new_copy(deadline, last)
        self._copies[last].deadline = deadline
        return self._copies[last]

    def _new_copy(self, deadline: Deadline, last: Optional[int]) -> Copy:
        if self._is_told:
            return RetellingCopy(self._options, self._situation, deadline, last)
        if self._must_rebuild:
            return RebuildingCopy(self._options, self._situation, deadline, self._dialect, last)
        return AssumingCopy(self._options, self._situation, deadline, last)

    def _no_plan(self, case: Case) -> WhyNoPlan:
        """Says why there is no plan, or that there is one."""
        return self._say(self._look(case), case)

    def _say(self, answer: WhyNoPlan, case: Case) -> WhyNoPlan:
        last = case.copy.last + self._situation.offset
        return words.no_plan(self._in_time(answer), last, self._phrases, case.request)

    def _in_time(self, answer: AnswerT) -> AnswerT:
        """Returns an answer with the steps as the loop counts them."""
        return answers.later(answer, self._situation.offset)

    def _look(self, case: Case) -> WhyNoPlan:
        """Searches for a plan, or for the reason why there is none, in the situation's steps."""
        verdict = case.ask(case.facts.all())
        answer = WhyNoPlan("", verdict.plan)
        if verdict.answer is not CopyAnswer.PLAN:
            is_contradictory = verdict.answer is CopyAnswer.CONTRADICTION
            farther = None if is_contradictory else self._farther(case, verdict)
            if farther is not None:
                is_limit = self._situation.is_limit
                answer = WhyNoPlan("", farther, farther.horizon if is_limit else None)
            else:
                reason = case.explain(verdict.answer)
                answer = WhyNoPlan("", is_contradictory=is_contradictory, reason=reason)
        return answer

    def _farther(self, case: Case, verdict: Verdict) -> Optional[Possible]:
        """Returns a plan beyond the last step, if one is found."""
        if verdict.plan is not None or self._is_told:
            return verdict.plan
        last = 2 * case.copy.last + 10
        deadline = Deadline(case.deadline.left() * _FARTHER, self._stopped)
        try:
            return self._copy(deadline, last).ask(case.query(case.facts.all())).plan
        except InterruptedQuestionError:
            return None

    def _contrast(self, text: str, *, is_demanded: bool) -> Contrast:
        named = canonical(text)
        name, arguments = split_term(named)
        step = last_number(named)
        if name != "do" or len(arguments) != 3 or step is None:
            raise QuestionError(f"{named} is no action; one is do(R,A,T), T being a step")
        now = self._situation.step + self._situation.offset
        case = self._begin()
        if step < now:
            plan = answers.later(case.ask(case.facts.all()).plan, self._situation.offset)
            has = words.planned_like(plan, arguments[1])
            raise QuestionError(
                f"{named}: step {step} has gone by; it is step {now} now, and the plan has {has}"
            )
        action = moved(named, -self._situation.offset)
        if self._is_told:
            if not isinstance(case.copy, RetellingCopy):
                raise AssertionError("an encoding that is told its events has another copy")
            best = case.ask(case.facts.all(), frozenset()).plan
            case.take_as_given()
            contrast = Instead(case.copy, case.facts, case.deadline)
            found = contrast.look(best, action, is_demanded=is_demanded)
            requests = dict(self._situation.goals)
            return words.contrast(self._in_time(found), self._phrases, requests)
        no_plan = self._look(case)
        best = no_plan.plan
        if no_plan.reason is not None:
            found = Contrast("", action, is_demanded, None, reason=no_plan.reason)
            return words.contrast(self._in_time(found), self._phrases)
        case.take_as_given()
        case.demands = (Assumption(action, is_demanded),)
        verdict = case.ask(case.facts.all())
        other = verdict.plan
        if other is None and verdict.answer is CopyAnswer.NONE:
            other = self._farther(case, verdict)
        found = Contrast("", action, is_demanded, best, other)
        if other is None:
            reason = case.explain(verdict.answer)
            found = replace(found, reason=reason)
        elif best is not None:
            found = replace(found, longer=other.horizon - best.horizon)
        return words.contrast(self._in_time(found), self._phrases)

    def _events(self, texts: Sequence[str], copy: Copy) -> Tuple[List[str], List[Tuple[str, str]]]:
        """Returns events in the current step, and the goals among them.

        A goal whose slot another one has until the step ends is told in the next step.
        """
        used = self._situation.used
        free = [slot for slot in copy.slots if slot not in dict(self._situation.goals)]
        free.sort(key=used.__contains__)
        told: List[str] = []
        goals: List[Tuple[str, str]] = []
        for text in texts:
            typed = split_event(text)
            if typed is None:
                raise QuestionError(
                    f"{text} is no event; one is goal:REQUEST, cancel:SLOT or ID:VALUE"
                )
            source, content = map(canonical, typed)
            step = copy.step
            if typed[0] == GOAL:
                if not free:
                    raise QuestionError(f"there is no free slot for {content}")
                source = free.pop(0)
                goals.append((source, content))
                step += source in used
            elif typed[0] == CANCEL:
                source, content = content, CANCEL
            told.append(event(source, content, step))
        return told, goals
