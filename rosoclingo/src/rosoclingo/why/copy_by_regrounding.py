"""Planner copy by regrounding: restarts for each set of facts, for events that are grounded."""

from __future__ import annotations

from typing import Dict, FrozenSet, List, Optional, Sequence, Tuple, Type

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    Ground,
    Outcome,
    Part,
    Result,
    Truth,
)
from rosclingo.wire.term_text import last_number
from rosoclingo.errors import InterruptedQuestionError, PlannerError
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.single.dialects import Dialect2, PaperDialect
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import PASSED, SAVE, query
from rosoclingo.why.planner_copy import Copy, CopyAnswer, Deadline, PlanQuery, Verdict
from rosoclingo.why.rules import is_relaxed, relaxable


class RebuildingCopy(Copy):
    """A copy for any encoding with externals ``query(T)``, in any dialect."""

    def __init__(
        self,
        options: Options,
        situation: Situation,
        deadline: Deadline,
        dialect: Type[Dialect2] = Dialect2,
        last: Optional[int] = None,
    ) -> None:
        """Reads the encoding.

        Args:
            options: The planner's command line.
            situation: What the planner knows.
            deadline: When to end.
            dialect: The encoding's dialect.
            last: The last step that may be planned for; by default, that of the situation.
        """
        self.step = max(situation.step, dialect.first_step)
        self.last = max(self.step, situation.last if last is None else last)
        self.deadline = deadline
        self._dialect = dialect
        self._engine = Engine(options, rereads=False, rewrite=relaxable)
        self._planner = Planner(dialect(self._engine))
        self.ages, self.silent = dict(situation.ages), dict(situation.silent)
        self._planner.know_ages(lambda: self.ages)
        self.slots = self._planner.begin()
        self.savable = frozenset(a for a in self._planner.externals() if a.startswith(SAVE))
        self._cache: Dict[Tuple[object, ...], Verdict] = {}
        self._excluded = 0  # how many demands
        self._guards: List[str] = []  # of those that are made now

    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""
        self._planner.begin((), self.slots)
        self._planner.ground_steps(range(1, self.step + 1))
        return [reason for _, reason in self._planner.tell(list(events))]

    def ask(self, asked: PlanQuery, *, best: bool = False) -> Verdict:
        """Searches for a shortest plan, always the best; see :class:`.planner_copy.Copy`."""
        key = (asked, self.step, self.last)
        if key not in self._cache:
            try:
                self._cache[key] = self._ask(asked)
            except PlannerError:
                # What contradicts itself declares nothing any more.
                if self._planner.has_answer_set(self.deadline.is_over) is not False:
                    raise
                self._cache[key] = Verdict(CopyAnswer.CONTRADICTION)
        return self._cache[key]

    def _begin(self, told: FrozenSet[str], saved: Sequence[str] = ()) -> None:
        """Restarts the planner, and relaxes the constraints whose atoms are among the events."""
        self._planner.begin(saved, self.slots)
        self._planner.assign(sorted(filter(is_relaxed, told)), Truth.TRUE)

    def _ask(self, asked: PlanQuery) -> Verdict:
        told = asked.told
        self._begin(told)
        self._replay(told, self.step)
        is_consistent = False
        planner = self._planner
        open_demands = {demand: last_number(demand.name) or 0 for demand in asked.demands}
        self._guards = []
        before: Optional[int] = None
        for horizon in range(self.step, self.last + 1):
            self.deadline.check()
            planner.query(horizon, before, [horizon] if horizon > self.step else ())
            before = horizon
            for demand in [d for d, step in open_demands.items() if step <= horizon]:
                del open_demands[demand]
                self._exclude(demand)
            if any(demand.value for demand in open_demands):
                continue
            outcome = self._search(horizon)
            if outcome.result is Result.SAT:
                plan = self._plan(outcome.symbols, horizon, told)
                if all(plan.end_of(slot) is not None for slot in asked.goals):
                    return Verdict(CopyAnswer.PLAN, plan)
                is_consistent = True
        if is_consistent or self._has_answer_set(self.last):
            return Verdict(CopyAnswer.NONE)
        return Verdict(CopyAnswer.CONTRADICTION)

    def _exclude(self, demand: Assumption) -> None:
        """Adds a constraint that enforces a demand."""
        self._excluded += 1
        name = f"rosoclingo_demand_{self._excluded}"
        atom = demand.name
        if issubclass(self._dialect, PaperDialect) and atom.startswith("do("):
            atom = f"occurs{atom[len('do') :]}"
        # Without a guard, the program might contradict itself permanently.
        rules = f"#external {name}. :- {name}, {'not ' if demand.value else ''}{atom}."
        self._planner.run(
            Add(name, (), rules), Ground((Part(name),)), AssignExternal(name, Truth.TRUE)
        )
        self._guards.append(name)

    def _replay(self, told: FrozenSet[str], last: int) -> None:
        """Tells an initialised planner the events, step by step.

        Args:
            told: The events.
            last: The last step; in all before it there are searches.
        """
        by_step: Dict[int, List[str]] = {}
        for atom in sorted(told):
            if is_relaxed(atom):
                continue
            by_step.setdefault(last_number(atom) or 0, []).append(atom)
        planner = self._planner
        for step in range(last + 1):
            self.deadline.check()
            if step:
                planner.ground_steps([step])
            events = by_step.get(step, [])
            # When a step goes by, all else of it is known already.
            passed = [atom for atom in events if atom.startswith(PASSED)]
            self._tell([atom for atom in events if atom not in passed])
            # An encoding may learn only from a search what has happened in a step.
            if len(events) > len(passed) and step < last:
                planner.run(*planner.demand.prepare(step))
            self._tell(passed)

    def _tell(self, events: Sequence[str]) -> None:
        if events:
            self._planner.tell(events)  # what it does not know now, it did not know then

    def _search(self, horizon: int) -> Outcome:
        outcome = self._planner.search(self.step, horizon, self.deadline.is_over)
        if outcome.result is Result.UNKNOWN:
            raise InterruptedQuestionError("there was no time for an answer")
        return outcome

    def _has_answer_set(self, horizon: int) -> bool:
        """Distinguishes, without a plan, whether the encoding has an answer set at all."""
        self._planner.assign([query(horizon), *self._guards], Truth.FALSE)
        found = self._planner.has_answer_set(self.deadline.is_over)
        if found is None:
            raise InterruptedQuestionError("there was no time for an answer")
        return found
