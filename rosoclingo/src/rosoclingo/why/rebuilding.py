"""A copy that begins anew for each set of facts, because what it was told cannot be taken back."""

from __future__ import annotations

import contextlib
from typing import Dict, FrozenSet, Iterator, List, Optional, Sequence, Tuple, Type

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    Add,
    Assumption,
    GetPrograms,
    Ground,
    Outcome,
    Part,
    Programs,
    Result,
    Truth,
)
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import InterruptedQuestionError, QuestionError
from rosoclingo.loop.atoms import query
from rosoclingo.loop.externals import SAVE
from rosoclingo.loop.solver import Planner
from rosoclingo.single.dialects import Dialect2, PaperDialect
from rosoclingo.why.copy import Answer, Copy, Deadline, Verdict
from rosoclingo.why.situation import Situation

_PASSED = "event(info,passed,"


class RebuildingCopy(Copy):
    """A copy for all encodings: it is told events in the way in which the planner is."""

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
        self._deadline = deadline
        self._situation = situation
        self._dialect = dialect
        engine = Engine(options)
        parts = engine.run([GetPrograms()]).answers
        self._has_possible = any(
            ("possible", 1) in a.parts for a in parts if isinstance(a, Programs)
        )
        self._planner = Planner(dialect(engine))
        self.slots = self._planner.begin()
        self._cache: Dict[Tuple[object, ...], Verdict] = {}
        self._has_begun = True  # and nothing was told
        self._excluded = 0  # how many demands

    @property
    def is_told(self) -> bool:
        """Whether the encoding is told its events by grounding."""
        return self._planner.demand.tells

    @contextlib.contextmanager
    def at(self, step: int) -> Iterator[None]:
        """Returns a context in which another step is the current one."""
        own, self.step = self.step, step
        try:
            yield
        finally:
            self.step = own

    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""
        if not self.is_told:
            self._begin(())
            self._planner.ground_steps(range(1, self.step + 1))
        return [reason for _, reason in self._planner.tell(list(events))]

    def ask(
        self,
        told: FrozenSet[str],
        goals: FrozenSet[str] = frozenset(),
        demands: Tuple[Assumption, ...] = (),
    ) -> Verdict:
        """Looks for a shortest plan; see :class:`.copy.Copy`.

        Raises:
            QuestionError: There are demands, and the encoding has no atoms for its actions.
        """
        if demands and self.is_told:
            raise QuestionError("an encoding that is told its events has no atoms to be demanded")
        key = (told, goals, demands, self.step, self.last)
        if key not in self._cache:
            self._cache[key] = self._ask(told, goals, demands)
        return self._cache[key]

    def possible(self, told: FrozenSet[str]) -> FrozenSet[Tuple[str, str]]:
        """Returns who can do what next, by the part ``possible(k)`` of the encoding.

        Raises:
            QuestionError: It has none.
        """
        if not self._has_possible:
            raise QuestionError(
                "the encoding does not say what can be done instead: it has no part possible(k) "
                "with #external possible(R,A); see docs/why.md"
            )
        self._ask(told, frozenset(), ())
        planner = self._planner
        planner.run(planner.demand.ground([Part("possible", (str(planner.demand.searches),))]))
        terms = (split_term(atom) for atom in planner.externals())
        return frozenset((a[0], a[1]) for n, a in terms if n == "possible" and len(a) == 2)

    def _ask(
        self, told: FrozenSet[str], goals: FrozenSet[str], demands: Tuple[Assumption, ...]
    ) -> Verdict:
        self._replay(told)
        is_consistent = False
        planner = self._planner
        open_demands = {demand: last_number(demand.name) or 0 for demand in demands}
        before: Optional[int] = None
        grounded = horizon = self.step
        while horizon <= self.last or planner.needed == horizon:
            self._deadline.check()
            planner.query(horizon, before, range(grounded + 1, horizon + 1))
            before, grounded = horizon, max(grounded, horizon)
            for demand in [d for d, step in open_demands.items() if step <= horizon]:
                del open_demands[demand]
                self._exclude(demand)
            if any(demand.value for demand in open_demands):
                horizon += 1
                continue
            outcome = self._search(horizon)
            if outcome.result is Result.SAT:
                plan = self._plan(outcome.symbols, horizon, told)
                if all(plan.end_of(slot) is not None for slot in goals):
                    answer = Answer.PLAN if horizon <= self.last else Answer.NONE
                    return Verdict(answer, plan)
                is_consistent = True
                if planner.needed is not None:
                    break  # it is the plan for all other horizons, too
            horizon = max(horizon + 1, planner.needed or 0)
        if is_consistent or self._has_answer_set(before):
            return Verdict(Answer.NONE)
        return Verdict(Answer.CONTRADICTION)

    def _exclude(self, demand: Assumption) -> None:
        """Excludes the answer sets that do not have what is demanded."""
        self._excluded += 1
        name = f"rosoclingo_demand_{self._excluded}"
        atom = demand.name
        if issubclass(self._dialect, PaperDialect) and atom.startswith("do("):
            atom = f"occurs{atom[len('do') :]}"
        rule = f":- {'not ' if demand.value else ''}{atom}."
        self._planner.run(Add(name, (), rule), Ground((Part(name),)))

    def _begin(self, saved: Sequence[str]) -> None:
        if not self._has_begun or saved:
            self._planner.begin(saved)
        self._has_begun = False

    def _replay(self, told: FrozenSet[str]) -> None:
        """Begins anew, and tells what has happened step by step."""
        saved = sorted(atom for atom in told if atom.startswith(SAVE))
        planner = self._planner
        self._begin(saved if self.is_told else ())
        by_step: Dict[int, List[str]] = {}
        for atom in sorted(told - set(saved)):
            by_step.setdefault(last_number(atom) or 0, []).append(atom)
        if saved and not self.is_told:
            by_step.setdefault(0, []).extend(saved)
        for step in range(self.step + 1):
            self._deadline.check()
            if step:
                planner.ground_steps([step])
            events = by_step.get(step, [])
            # When a step goes by, all else of it is known already.
            passed = [atom for atom in events if atom.startswith(_PASSED)]
            self._tell([atom for atom in events if atom not in passed])
            # The encoding learns from a search what has happened in a step, and remembers it.
            if len(events) > len(passed) and step < self.step:
                planner.run(*planner.demand.prepare(step))
            self._tell(passed)

    def _tell(self, events: Sequence[str]) -> None:
        if events:
            self._planner.tell(events)  # what it does not know now, it did not know then

    def _search(self, horizon: int) -> Outcome:
        outcome = self._planner.search(self.step, horizon, self._deadline.is_over)
        if outcome.result is Result.UNKNOWN:
            raise InterruptedQuestionError("there was no time for an answer")
        return outcome

    def _has_answer_set(self, horizon: Optional[int]) -> bool:
        """Returns whether there is an answer set if no plan is asked for."""
        if horizon is not None:
            self._planner.assign([query(horizon)], Truth.FALSE)
        found = self._planner.has_answer_set(self._deadline.is_over)
        if found is None:
            raise InterruptedQuestionError("there was no time for an answer")
        return found
