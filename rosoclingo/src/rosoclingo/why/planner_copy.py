"""A private copy of the planner, for hypothetical queries."""

from __future__ import annotations

import abc
import contextlib
import enum
import time
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import (
    AbstractSet,
    Callable,
    Dict,
    FrozenSet,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
)

from rosclingo.solver.engine import Engine
from rosclingo.wire.commands import Assumption, Improvement, Outcome, Result
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import InterruptedQuestionError
from rosoclingo.loop.journal import TERMINAL_STATUSES
from rosoclingo.loop.situation import moved
from rosoclingo.loop.values.arrivals import expected_arrivals, planned_spans
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.loop.values.execution import Execution


class CopyAnswer(enum.Enum):
    """The result of a hypothetical query."""

    PLAN = "plan"
    NONE = "none"
    CONTRADICTION = "contradiction"  # there is no answer set, even if no plan is asked for


@dataclass(frozen=True)
class Possible:
    """A hypothetical plan.

    Attributes:
        actions: Its actions from the current step on, as ``do(R,A,T)``, ordered by step.
        step: The current step.
        horizon: The step at which all is done.
        steps: How many steps it still takes: those after the current one, and that one if there is
            something to be done in it that was not done yet.
        ends: Slot, status and step of each goal that ends in it.
        holds: The fluents that hold at the current step, as far as the encoding shows them.
        late: By how many seconds goals will be late, by slots; None if the plan does not say how
            long all that is under way takes.
        next_begins: In how many seconds the next step begins, if that is known.
    """

    actions: Tuple[str, ...]
    step: int
    horizon: int
    steps: int
    ends: Tuple[Tuple[str, str, int], ...] = ()
    holds: Tuple[str, ...] = ()
    late: Optional[Tuple[Tuple[str, int], ...]] = None
    next_begins: float = 0.0

    def end_of(self, slot: str) -> Optional[int]:
        """Returns the step in which the goal in a slot ends."""
        return next((step for own, _, step in self.ends if own == slot), None)

    def later(self, steps: int) -> Possible:
        """Returns the same plan some steps later."""
        return replace(
            self,
            actions=tuple(moved(action, steps) for action in self.actions),
            step=self.step + steps,
            horizon=self.horizon + steps,
            ends=tuple((slot, word, at + steps) for slot, word, at in self.ends),
        )


@dataclass(frozen=True)
class Verdict:
    """The copy's result for a set of facts: a plan, or an unsatisfiable core.

    Attributes:
        answer: Whether there is a plan up to the last step.
        plan: One of the shortest, if there is one, also if it is beyond the last step.
        core: If there is none: facts that exclude it, whatever the others are. None if unknown.
    """

    answer: CopyAnswer
    plan: Optional[Possible] = None
    core: Optional[FrozenSet[str]] = None


@dataclass(frozen=True)
class PlanQuery:
    """A hypothetical query: whether there is a plan.

    Attributes:
        told: The events that are true; no others are.
        goals: The slots of goals that have to end in the plan, whatever the encoding wants.
        demands: Atoms that have to be in it, or must not.
    """

    told: FrozenSet[str]
    goals: FrozenSet[str] = frozenset()
    demands: Tuple[Assumption, ...] = ()


class Deadline:
    """The deadline of an answer."""

    def __init__(self, seconds: float, stopped: Callable[[], bool] = lambda: False) -> None:
        self._end = time.monotonic() + seconds
        self._stopped = stopped

    def is_over(self) -> bool:
        """Returns whether the deadline has passed, or the question was cancelled."""
        return time.monotonic() > self._end or self._stopped()

    def left(self) -> float:
        """Returns the seconds that are left."""
        return max(0.0, self._end - time.monotonic())

    @contextlib.contextmanager
    def share(self, share: float) -> Iterator[None]:
        """A context with an earlier deadline, a share of the time that is left."""
        end = self._end
        self._end = min(end, time.monotonic() + self.left() * share)
        try:
            yield
        finally:
            self._end = end

    def check(self) -> None:
        """Raises InterruptedQuestionError if it is too late."""
        if self.is_over():
            raise InterruptedQuestionError("there was no time for an answer")


class Copy(abc.ABC):
    """A private copy of the planner. One thread makes the calls.

    Attributes:
        slots: The ids that it has for goals.
        savable: The events ``event(save,F,0)`` that the encoding declares.
        step: The current step.
        last: The last step that may be planned for.
        deadline: When to end; may be set anew for each question.
        elapsed: In how many seconds from now the current step is; above 0 if it is hypothetical.
        ages: How many seconds ago goals have come, by slots.
        silent: Since how many seconds actuators have been busy.
    """

    deadline: Deadline
    slots: Sequence[str]
    savable: FrozenSet[str]
    step: int
    last: int
    elapsed: float = 0.0
    ages: Mapping[str, float] = MappingProxyType({})
    silent: Mapping[str, float] = MappingProxyType({})
    _engine: Engine

    @contextlib.contextmanager
    def up_to(self, last: int) -> Iterator[None]:
        """A context that limits plans to an earlier last step."""
        own, self.last = self.last, last
        try:
            yield
        finally:
            self.last = own

    @abc.abstractmethod
    def ask(self, asked: PlanQuery, *, best: bool = False) -> Verdict:
        """Searches for a shortest plan.

        Args:
            asked: What has to be so.
            best: Whether the plan that the encoding finds best is wanted, of those for its horizon.

        Raises:
            InterruptedQuestionError: It is too late.
            RosclingoError: The encoding does not fit.
        """

    def ask_any(self, asked: PlanQuery, others: Sequence[Sequence[str]] = ()) -> Optional[Verdict]:
        """Searches for any plan with some events and any subset of others; None if unsupported.

        It does not say which plan, or whether there is a contradiction. Its core has the
        constraints, too, that are not relaxed, by what would relax them.

        Args:
            asked: What has to be so.
            others: Events that are true or not; all events of a sequence are, or none.
        """
        return None

    def doubts(self, told: FrozenSet[str]) -> Tuple[Tuple[str, ...], Tuple[str, ...]]:
        """Returns why there is no plan: what is out of reach, or else modelling mistakes.

        Both are empty if the encoding does not know; see :mod:`.doubts`.

        Args:
            told: The events that are true; there is no plan with them.
        """
        return (), ()

    @abc.abstractmethod
    def unknown(self, events: Sequence[str]) -> List[str]:
        """Returns the reasons why some of these events cannot be told."""

    def _solve(self, assumptions: Sequence[Assumption] = (), *, best: bool = False) -> Outcome:
        """Searches for any answer set, or for the best one."""
        self.deadline.check()
        found: List[Improvement] = []

        def stopped() -> bool:
            return (bool(found) and not best) or self.deadline.is_over()

        outcome = self._engine.solve(assumptions, stopped, found.append)
        if found and not best:
            return Outcome(Result.SAT, symbols=found[-1].symbols)
        if outcome.result is Result.UNKNOWN:
            if found:  # the best so far
                return Outcome(Result.SAT, interrupted=True, symbols=found[-1].symbols)
            raise InterruptedQuestionError("there was no time for an answer")
        return outcome

    def _begins(self, told: AbstractSet[str]) -> Dict[str, int]:
        """Returns for each slot the step in which its last goal was told; 0 if it was saved."""
        begins = dict.fromkeys(self.slots, 0)
        for atom in told:
            _, arguments = split_term(atom)
            if len(arguments) == 3 and arguments[0] in begins and arguments[1] != "cancel":
                step = last_number(atom) or 0
                begins[arguments[0]] = max(begins[arguments[0]], step)
        return begins

    def _plan(self, symbols: Sequence[str], horizon: int, told: AbstractSet[str]) -> Possible:
        """Returns the plan that an answer set has."""
        plan = Plan(tuple(symbols))
        begins = self._begins(told)
        last = max(self.step, horizon)
        ends = [
            (slot, word, step)
            for step in range(last + 1)
            for slot, word in plan.statuses(step)
            if word in TERMINAL_STATUSES and step >= begins.get(slot, 0)
        ]
        now = plan.actions(self.step)
        steps = last - self.step + any(action.commit not in told for action in now)
        actions = [action for action in plan.actions_from(self.step) if action.step <= last]
        holds = plan.last_fluents(self.step)
        late, next_begins = self._times(plan, told)
        return Possible(
            tuple(map(str, actions)), self.step, last, steps, tuple(ends), tuple(holds), late,
            next_begins,
        )  # fmt: skip

    def _times(
        self, plan: Plan, told: AbstractSet[str]
    ) -> Tuple[Optional[Tuple[Tuple[str, int], ...]], float]:
        """Returns by how much goals will be late, and the seconds until the next step begins."""
        under_way = [action for action in plan.actions(self.step) if action.commit in told]
        if not plan.lasting or any(action not in plan.lasting for action in under_way):
            return None, 0.0
        began = {actuator: -seconds for actuator, seconds in self.silent.items()}
        busy = [
            Execution(
                0, self.step, one.actuator, one.name,
                world_began=began.get(one.actuator, self.elapsed),
                kind=plan.lasting[one][0], seconds=plan.lasting[one][1],
            )
            for one in under_way
        ]  # fmt: skip
        spans = planned_spans(plan, self.step, busy, (), self.elapsed)
        late = []
        for slot, end in expected_arrivals(plan, spans).items():
            limit = plan.limits.get(slot)
            seconds = 0 if limit is None else round(end + self.ages.get(slot, 0.0) - limit)
            if seconds > 0:
                late.append((slot, seconds))
        through = (span.ends for span in spans if span.last <= self.step)
        return tuple(sorted(late)), max(through, default=self.elapsed)
