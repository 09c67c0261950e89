"""The planner: grounds steps, searches for plans, and keeps the plan that stands."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from dataclasses import field
from typing import Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Set, Tuple

from rosclingo.errors import OutOfMemoryError
from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import split_term
from rosoclingo.engine.process import prepare_search
from rosoclingo.engine.task import PlanningTask
from rosoclingo.errors import SpareMemoryError
from rosoclingo.loop.journal import IMPROVING, LOOKING_AHEAD, Ended, SearchEnded
from rosoclingo.loop.planner.demand import TOLD, Demand, Pair, needed_horizon, step_parts
from rosoclingo.loop.planner.layers import LayersState
from rosoclingo.loop.planner.looking_ahead import look_ahead, look_for_cheaper
from rosoclingo.loop.planner.neighbourhoods import Neighbourhoods
from rosoclingo.loop.planner.requests import Requests, read_externals
from rosoclingo.loop.planner.searching import Searching, read_summary
from rosoclingo.loop.planner.shortening import cheapen, shorten
from rosoclingo.loop.planner.task_search import FollowedPlan, TaskSearch
from rosoclingo.loop.planner.work import SearchClock, Work, WorkClock
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.added import (
    AVOIDS,
    AVOIDS_PART,
    EMPTY_PARTS,
    PAUSES,
    PAUSES_PART,
    SLOT,
    SLOT_PART,
    SLOTS,
)
from rosoclingo.loop.values.atoms import QUERY, Action, Plan, query
from rosoclingo.loop.values.recorded import Recorded
from rosoclingo.loop.values.solver import Solver

DEFAULT_PATIENCE = -1.0
"""The value for what every user wants: a second, if better plans are looked for while robots act,
and 0.01 s for a plan of many tasks, which is not proven the best soon; else 0."""

ONE_BY_ONE_SECONDS = 2.0
"""How long nodes and ``plan.py`` search one horizon after the other, by default."""

_FOLLOW_SECONDS = 0.5  # how long it may take to find the rest of a plan again
_PATIENCE = 1.0
_AWAITED_SECONDS = 0.25  # of work, for a first plan of a task that is not improved later
_FIRST = 0.01
_MORE_SECONDS = 10.0  # of work, for which a plan for further wishes is looked for at first
_MORE = 2.0  # the factor by which that is longer the next time


@dataclasses.dataclass(frozen=True)
class KeptPlan:
    """A cached plan: answers searches from its horizon on, until the planner is told something."""

    outcome: wire.Outcome
    horizon: int


@dataclasses.dataclass
class PlannerState:
    """Saved state of :class:`Planner`.

    Attributes:
        demand: The events that are told by grounding, and requests for parts.
        quality: How good the plan is; None if its encoding minimises nothing, or if that is not
            known.
        last_horizon: The last horizon that the mode may ask for; infinite without one, None if
            that is unknown, so that no horizon is looked ahead to.
        layers: The layers of its plans, as far as they are decided.
        task_plan: The plan that is followed, where the encoding shows its task.
        is_thrifty: Whether a search that no goal needs has run out of memory, so that there are
            no more: for better plans, and ahead for longer ones.
    """

    demand: Demand = field(default_factory=Demand)
    quality: Optional[Quality] = None
    last_horizon: Optional[float] = None
    layers: LayersState = field(default_factory=LayersState)
    task_plan: FollowedPlan = field(default_factory=FollowedPlan)
    is_thrifty: bool = False
    _kept: Optional[KeptPlan] = None
    _ahead: Set[int] = field(default_factory=set)  # steps grounded before the mode requests them
    _top: int = 0  # the last step that is grounded
    _is_timed: bool = False  # whether time has ended a search, so that plans depend on it
    _stays_near: bool = False  # whether the mode has stopped before a plan that was kept
    _symbols: Tuple[str, ...] = ()  # the plan that is followed, if it may not be the shortest
    _passed: int = 0  # the steps of that plan before the last reset
    _is_through: bool = False  # whether a search for a better plan has tried all
    _limited: int = 0  # the last step whose pauses can be limited
    _later: List[str] = field(default_factory=list)  # externals that are to be true
    _avoided: int = 0  # how many externals that forbid an action there have been
    _avoiding: List[str] = field(default_factory=list)  # those that are true
    _more_seconds: float = _MORE_SECONDS  # how long it is looked for a plan for further wishes


class Planner(PlannerState):
    """The planner's solver, with the operations that commands need: grounding, search, improvement.

    Attributes:
        patience: After how many seconds an optimising search ends that has found a plan; 0 for
            never, DEFAULT_PATIENCE for what suits its encoding.
        is_awaited: Whether no better plan is looked for while robots act. Then ``patience`` counts
            the solver's work in the place of time, so that the same plan is found each time.
        most_seconds: For how long a plan for further wishes is looked for at most, in seconds of
            work, until there is news.
        one_by_one_seconds: How long one horizon after the other is searched, without grounding
            on demand, until several take turns; 0 for always.
        recorded: Knows in a replay how searches end that depend on time.
        note: Called with how such a search has ended.
        missing: Called with an external that a mode makes true or free, and that there is not.
    """

    def __init__(
        self,
        solver: Solver,
        patience: float = 0.0,
        one_by_one_seconds: float = 0.0,
    ) -> None:
        super().__init__()
        # A dialect's translation may be in between.
        self._is_translated = bool(getattr(solver, "events_are_facts", False))
        self._solver = Work(solver)
        self._requests = Requests(self._solver)
        self._tasks = TaskSearch(self._solver, self.run, lambda: self.task_plan)
        self.patience = patience
        self.is_awaited = False
        self.most_seconds = math.inf
        self.one_by_one_seconds = one_by_one_seconds
        self._began: Optional[float] = None  # when it was first searched in this situation
        self.recorded = Recorded()
        self._neighbourhoods = Neighbourhoods()
        self.note: Callable[[SearchEnded], None] = lambda _: None
        self.missing: Callable[[str], None] = lambda _: None
        self._optional: Set[str] = set()  # externals that a mode has set
        self._has_threads: Optional[bool] = None  # None as long as that is not known

    @property
    def _task_patience(self) -> float:
        """Seconds of work for which a first plan of a task is improved; 0 for a moment."""
        if self.patience == DEFAULT_PATIENCE:
            return _AWAITED_SECONDS if self.is_awaited else 0.0
        return self.patience

    @property
    def _limit(self) -> float:
        """Seconds after which an optimising search with a plan ends; 0 for no limit."""
        if self.patience == DEFAULT_PATIENCE:
            return _PATIENCE if self.demand.improves else 0.0
        return self.patience

    @property
    def events_are_facts(self) -> bool:
        """True if an event that was made true cannot be made false again."""
        return self._is_translated or self.demand.tells

    @property
    def needed(self) -> Optional[int]:
        """The first horizon of the plan that was found, if its encoding says so."""
        return None if self._kept is None else self._kept.horizon

    def knows(self, horizon: int) -> bool:
        """Returns whether the plan that is kept answers the next search, if that has a horizon."""
        return self._kept is not None and (bool(self.demand) or horizon <= self._kept.horizon)

    def begin(self, saved: Sequence[str] = (), slots: Optional[Sequence[str]] = None) -> List[str]:
        """Grounds base, state(0) and query(0) on a fresh solver.

        Args:
            saved: The events ``event(save,F,0)`` that an encoding which is told its events knows
                from the beginning.
            slots: The ids for goals, if they are known from the last time.

        Returns:
            The ids that the encoding has for goals.

        Raises:
            PlannerError: A command failed, or the encoding lacks a part.
        """
        self.demand.begin(wire.Programs(()))
        self._later = []
        self._avoided, self._avoiding = 0, []
        self._forget_plan()
        self.quality = None
        self.layers = LayersState()
        self._ahead.clear()
        self._top, self._limited, self._passed = 0, 0, 0
        self._is_timed, self._symbols = False, ()
        self._has_threads = None
        is_first = slots is None
        self.run(wire.Restart(), *([SLOTS] if is_first else ()), *EMPTY_PARTS)
        self.demand.begin(wire.Programs(()) if self._is_translated else self._requests.programs())
        base = [wire.Part("base"), *([wire.Part(SLOT_PART)] if is_first else ())]
        first = [wire.Part("state", ("0",)), wire.Part("query", ("0",))]
        if self.demand:
            self.run(self.demand.ground(base))
            self.demand.tell(saved)
            self.run(self.demand.ground(first))
        else:
            self.run(wire.Ground((*base, *first)))
        ids = list(slots) if slots is not None else self._learn_slots()
        if self.demand.has_tasks:  # after a reset, base is what it was
            self._tasks.read_facts(self.demand.ground)
            if not (self.recorded.knows_searches or self.demand.is_constrained):
                prepare_search()
        if self.demand.tells:
            self.run(wire.ReleaseExternal(TOLD))  # each search takes some time for each external
        return ids

    def _learn_slots(self) -> List[str]:
        """Returns the ids that the encoding has for goals, and learns its examples."""
        externals = self.externals()
        declared = [atom for atom in externals if atom.startswith(SLOT)]
        ids = [split_term(atom)[1][0] for atom in declared]
        self.demand.learn_examples(externals, ids)
        self.run(*(wire.ReleaseExternal(atom) for atom in declared))
        return ids

    def ground_steps(self, steps: Iterable[int]) -> None:
        """Grounds state, transition and query of steps after step 0.

        While there is a plan that stands, that has time until the planner is needed.
        """
        if self._kept is None or not self.demand:
            self.run(*self._ground_missing(steps))
        else:
            self.demand.add_steps(steps)

    def _ground_missing(self, steps: Iterable[int]) -> List[wire.Command]:
        """Returns the commands that ground steps, without those that were grounded ahead."""
        steps = list(steps)
        missing = [step for step in steps if step not in self._ahead]
        self._ahead.difference_update(steps)
        self._top = max([self._top, *missing])
        return [self._grounding(step) for step in missing]

    def _grounding(self, step: int) -> wire.Ground:
        parts = step_parts(step)
        return self.demand.ground(parts) if self.demand else wire.Ground(tuple(parts))

    def query(self, horizon: int, before: Optional[int], steps: Sequence[int]) -> None:
        """Sets the query to a horizon.

        While there is a plan that stands, that has time until the planner is needed.

        Args:
            horizon: The step at which all has to be done.
            before: The horizon that was asked for before, if that was another one.
            steps: The steps to be grounded for it.

        Raises:
            PlannerError: A command failed.
        """
        if self._kept is not None and self.demand:
            self.demand.add_steps(steps)
            if before is not None:
                self.demand.set_query(query(before), wire.Truth.FALSE)
            self.demand.set_query(query(horizon), wire.Truth.TRUE)
            return
        old = [] if before is None else [wire.AssignExternal(query(before), wire.Truth.FALSE)]
        grounding = self._ground_missing(steps)
        self.run(*old, *grounding, wire.AssignExternal(query(horizon), wire.Truth.TRUE))

    def run(self, *commands: wire.Command) -> wire.Reply:
        """Runs commands, after those that are queued.

        Raises:
            PlannerError: A command failed.
        """
        return self._run(commands)[0]

    def _run(self, commands: Sequence[wire.Command]) -> Tuple[wire.Reply, List[str]]:
        """Runs commands; returns the reply, and the externals set by a mode that do not exist."""
        later, self._later = self._later, []
        if later:
            self.assign(later, wire.Truth.TRUE)
        commands = (*self.demand.take_pending(), *commands)
        if not commands:
            return wire.Reply(), []
        truths = [c for c in commands if isinstance(c, (wire.AssignExternal, wire.ReleaseExternal))]
        if any(not command.name.startswith(QUERY) for command in truths):
            self._forget_plan()
        reply, skipped = self._requests.run(commands, self._optional)
        missing = [one.name for one in skipped if one.value is not wire.Truth.FALSE]
        for atom in missing:
            self.missing(atom)
        return reply, missing

    def _forget_plan(self) -> None:
        """Invalidates the cached plan, because the planner was told something."""
        self._kept = None
        self._began = None
        self._stays_near = self._is_through = False
        self.demand.note_news()

    def search(
        self, step: int, horizon: int, stopped: Callable[[], bool], *, looks_ahead: bool = True
    ) -> wire.Outcome:
        """Searches for a plan until told to stop, which may be so from the beginning.

        A plan whose encoding says from which horizon on it is one stands until something is told.

        Args:
            step: The current step.
            horizon: The step at which all has to be done.
            stopped: Whether the search has to end.
            looks_ahead: Whether further horizons may be searched, too, if it takes too long.

        Raises:
            PlannerError: The encoding requests a part that does not exist.
        """
        if stopped():
            return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
        if not self.demand:
            outcome = self._search_plain(step, horizon, stopped, looks_ahead)
            if self._is_timed and looks_ahead and outcome.result is wire.Result.SAT:
                self._symbols, self._passed = outcome.symbols, 0
            return outcome
        if self._kept is None:
            prefers = self._limit > 0 and self.demand.prefers and self.demand.searches > 0
            hastens = self._is_hasty and self.demand.hastens
            commands = self.demand.prepare(step, prefers=prefers, hastens=hastens)
            self.run(*commands)
            outcome, self.quality = self._searching(step).find(
                stopped, self.quality, compares=prefers and bool(commands)
            )
            while self.demand.may_relax and outcome.result is wire.Result.UNSAT:
                self.run(self.demand.begin_search(step, "search", "relax"))
                outcome, self.quality = self._searching(step).find(stopped, self.quality)
            if not self.is_short or self._more_seconds > self.most_seconds:
                self._more_seconds = _MORE_SECONDS
            needed = needed_horizon(outcome.symbols) if self.demand else None
            if needed is None or outcome.result is not wire.Result.SAT:
                return outcome
            self._kept = KeptPlan(outcome, needed)
            if self.demand.has_tasks:
                self._tasks.follow(outcome.symbols)
        if horizon < self._kept.horizon:
            return wire.Outcome(wire.Result.UNSAT)
        return self._kept.outcome

    def _search_plain(
        self, step: int, horizon: int, stopped: Callable[[], bool], looks_ahead: bool
    ) -> wire.Outcome:
        """Searches with an encoding that is grounded step by step, without requests for parts."""
        kept = self._kept
        if kept is not None and horizon <= kept.horizon and looks_ahead:
            is_there = horizon == kept.horizon
            return kept.outcome if is_there else wire.Outcome(wire.Result.UNSAT)
        self._kept = None
        if self._began is None:
            self._began = time.monotonic()
        ended = self.recorded.search_due(*LOOKING_AHEAD)
        if ended is None:
            last = self.last_horizon
            may = self._takes_turns and looks_ahead
            looks_far = may and not self._stays_near and last is not None and last > horizon
            end = self._began + self.one_by_one_seconds if looks_far else math.inf
            self.run()  # what is still to be told
            ended = self._find_rest(step, horizon, stopped) if may else None
        if ended is None:
            outcome, self.quality = self._searching(step, lambda: time.monotonic() > end).find(
                stopped, self.quality
            )
            if outcome.result is wire.Result.SAT:
                ended = self.recorded.search_due(*LOOKING_AHEAD)
                if ended is None and looks_far:
                    ended = self._find_cheaper(horizon, stopped)
            elif outcome.result is wire.Result.UNKNOWN and time.monotonic() > end:
                ended = self._look_ahead(step, horizon, stopped)
            if ended is None:
                return outcome
        self._ground_ahead(ended.grounded)
        self.note(ended)
        return self._take_ahead(ended, horizon)

    def _look_ahead(
        self, step: int, horizon: int, stopped: Callable[[], bool]
    ) -> Optional[SearchEnded]:
        """Searches several horizons in turn, unless it has to stop before."""
        if self.last_horizon is None or stopped():
            return None
        self._is_timed = True
        with self._spare():
            return look_ahead(
                self._solver, self._requests.run, self._ground_ahead, self._ground_pauses,
                step=step, asked=horizon, last=self.last_horizon, stopped=stopped,
            )  # fmt: skip

    def _find_cheaper(self, horizon: int, stopped: Callable[[], bool]) -> Optional[SearchEnded]:
        """Searches longer horizons for a cheaper plan, for the time that ``patience`` has left."""
        if self.last_horizon is None or self._limit <= 0 or self.quality is None:
            return None
        assert self._began is not None
        end = self._began + self._limit
        searching = self._searching(0)
        with self._spare():
            ended = look_for_cheaper(
                self._solver, self._requests.run, self._ground_ahead, searching.cost,
                asked=horizon, last=self.last_horizon, cost=self.quality.cost,
                stopped=lambda: stopped() or time.monotonic() > end,
            )  # fmt: skip
        self._is_timed |= ended is not None
        return ended

    @contextlib.contextmanager
    def _spare(self) -> Iterator[None]:
        """A context of a search that is given up permanently if it runs out of memory.

        Raises:
            SpareMemoryError: It has.
        """
        try:
            yield
        except OutOfMemoryError as err:
            self.is_thrifty = True
            raise SpareMemoryError(str(err)) from err

    @property
    def _takes_turns(self) -> bool:
        """True if horizons are searched interleaved, which may find longer plans than needed."""
        may = self.one_by_one_seconds > 0 and not self.is_thrifty
        return may and not self.recorded.knows_searches

    def _find_rest(
        self, step: int, horizon: int, stopped: Callable[[], bool]
    ) -> Optional[SearchEnded]:
        """Searches for the rest of the followed plan again, where that took long to find.

        So no plan takes its place that ends later, as often as the planner is asked: after each
        answer, and after each reset.

        Returns:
            How that has ended; None if it is no plan now, or not found soon.
        """
        rest = [
            wire.Assumption(str(Action(one.actuator, one.name, one.step - self._passed)), True)
            for one in Plan(self._symbols).actions_from(max(step, 1) + self._passed)
        ]
        if not rest:
            return None
        end = time.monotonic() + _FOLLOW_SECONDS
        found: List[wire.Improvement] = []
        outcome = self._solver.solve(
            rest, lambda: stopped() or time.monotonic() > end, found.append
        )
        symbols = outcome.symbols or (found[-1].symbols if found else ())
        if stopped() or not symbols:
            return None
        quality = Quality(found[-1].cost) if found else None
        return SearchEnded(Ended.AHEAD, symbols, quality, horizon=horizon, grounded=self._top)

    def warn_of_search(self, warn: Callable[[str], None]) -> None:
        """Sets the callback for the reason why the search for plans cannot be used."""
        self._tasks.warn = warn

    def warn_of_plans(self, warn: Callable[[str], None]) -> None:
        """Sets the callback for faults in a plan of clingo's."""
        self._tasks.warn_of_plan = warn

    def know_ages(self, ages: Callable[[], Mapping[str, float]]) -> None:
        """Sets the ages of requests, from which their deadlines count.

        Args:
            ages: Returns how many seconds ago each request has come, by slots.
        """
        self._tasks.ages = ages

    def show_tasks(self, show: Callable[[PlanningTask], None]) -> None:
        """Sets the callback for the planning task of each search that shows one."""
        self._tasks.show = show

    def note_last_horizon(self, last: Optional[float]) -> None:
        """Stores the last horizon; None, as after a restart, keeps what is known."""
        self.last_horizon = self.last_horizon if last is None else last

    def note_reset(self, step: int) -> None:
        """Renumbers the steps of the followed plan after a reset."""
        self._passed += step
        self.task_plan.passed += step

    def _take_ahead(self, ended: SearchEnded, horizon: int) -> wire.Outcome:
        """Keeps the results for horizons beyond the requested one."""
        if ended.how is Ended.AHEAD_CALLED:
            return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
        outcome = wire.Outcome(wire.Result.UNSAT)
        if ended.how is Ended.AHEAD:
            self.quality = ended.quality
            outcome = wire.Outcome(wire.Result.SAT, interrupted=True, symbols=ended.symbols)
        self._kept = KeptPlan(outcome, ended.horizon)
        return outcome if horizon == ended.horizon else wire.Outcome(wire.Result.UNSAT)

    def _ground_ahead(self, last: int) -> None:
        """Grounds all steps up to one that the mode has not requested yet."""
        steps = range(self._top + 1, last + 1)
        if steps:
            self.run(*map(self._grounding, steps))
            self._ahead.update(steps)
            self._top = last

    def give_up_ahead(self) -> bool:
        """Drops a plan for a horizon that the mode does not request, and stops looking ahead.

        Returns:
            Whether there was one, so that shorter horizons were answered though not searched.
        """
        kept = self._kept
        if self.demand or kept is None or kept.outcome.result is not wire.Result.SAT:
            return False
        self._kept = None
        self._stays_near = True
        return True

    @property
    def _is_hasty(self) -> bool:
        """True if the first plan of many tasks is published at once, and improved later."""
        return self.patience == DEFAULT_PATIENCE and not self.is_awaited

    @property
    def is_short(self) -> bool:
        """True if the plan serves only some of the requests, and a longer search may serve more."""
        return self.demand.improves and self.layers.missing > 0

    @property
    def may_improve(self) -> bool:
        """True if anytime improvement may find a better plan than the current one."""
        if self.is_short:
            return not self._is_through
        if self.demand:
            is_best = self.quality is None or self.quality.is_best
            may = self._limit > 0 and self.demand.improves and not self.is_thrifty
            return may and not (is_best or self._is_through)
        is_open = self._is_timed and bool(self._symbols) and not self._is_through
        is_best = self.quality is not None and self.quality.is_best
        return is_open and self._takes_turns and not is_best

    def improve(
        self, step: int, stopped: Callable[[], bool], *, horizon: int = 0
    ) -> Optional[wire.Outcome]:
        """Searches for a better plan than the current one, until told to stop or through.

        That is for an encoding that has opted in, see ``Demand.improves``: it is not stopped before
        it is known what the plan costs that stands. And for a plan beyond the shortest horizon, in
        whose place a shorter one comes, or a cheaper one, if its encoding minimises. What was
        published stays in the plan. If it is not told of a better one, the plan stands as it was.
        If the plan is short, one is better that grants more, and is looked for with more work each
        time.

        Args:
            step: The current step.
            stopped: Whether the search has to end; what it has found is taken then.
            horizon: The step at which all has to be done, where the encoding is not on demand.

        Returns:
            The better plan; None if none was found.

        Raises:
            PlannerError: The encoding requests a part that does not exist.
            SpareMemoryError: It ran out of memory.
        """
        with self._spare():
            if self.demand:
                return self._improve_demand(step, stopped)
            return self._improve_plain(step, horizon, stopped)

    def _improve_demand(self, step: int, stopped: Callable[[], bool]) -> Optional[wire.Outcome]:
        """Searches for a cheaper plan of an encoding that is grounded on demand."""
        self.run(self.demand.begin_search(step, "search", "improve"))
        seconds = self._more_seconds if self.is_short else 0.0
        ended, better = self._searching(step).improve(stopped, seconds=seconds)
        if ended.how is Ended.NOTHING:  # the plan stands, and costs what it did
            self._is_through = True
            return None
        self.quality = ended.quality
        self._kept = None
        if better is not None and self.demand.has_tasks:
            self._tasks.follow(better.symbols)
        is_in_vain = ended.how is Ended.AS_BEFORE and not stopped()
        self._is_through = is_in_vain and (not seconds or seconds * _MORE > self.most_seconds)
        if seconds and is_in_vain:
            self._more_seconds = seconds * _MORE
        return better

    def _improve_plain(
        self, step: int, horizon: int, stopped: Callable[[], bool]
    ) -> Optional[wire.Outcome]:
        """Searches for a cheaper plan, or, if the encoding minimises nothing, for a shorter one."""
        ended = self.recorded.search_due(*IMPROVING)
        if ended is None:
            plan = Plan(self._symbols)
            if self.quality is not None:
                cost_of = self._searching(step).cost
                ended = cheapen(
                    self._solver, cost_of, plan, self.quality.cost, step=step, stopped=stopped
                )
            else:
                self._ground_pauses(horizon)
                ended = shorten(
                    self._solver, self._requests.run, plan,
                    step=step, horizon=horizon, stopped=stopped,
                )  # fmt: skip
            self._is_through = not stopped()
        if self.quality is not None:
            self.quality = ended.quality
        self.note(ended)
        if ended.how is not Ended.BETTER:
            return None
        self._symbols, self._passed = ended.symbols, 0
        self._kept = None
        is_best = ended.quality is not None and ended.quality.is_best
        return wire.Outcome(wire.Result.SAT, not is_best, ended.symbols)

    def _ground_pauses(self, last: int) -> None:
        """Grounds the parts by which pauses can be limited in each step up to a last one."""
        steps = range(self._limited + 1, last + 1)
        if steps:
            parts = tuple(wire.Part(PAUSES_PART, (str(step),)) for step in steps)
            self.run(*([] if self._limited else [PAUSES]), wire.Ground(parts))
            self._limited = last

    def _searching(self, step: int, is_late: Callable[[], bool] = lambda: False) -> Searching:
        return Searching(
            self._solver,
            self.demand,
            self.run,
            patience=self._limit,
            first=_FIRST if self._is_hasty else None,
            awaits_layers=self.patience > 0 or (self.is_awaited and self._limit > 0),
            task_patience=self._task_patience,
            neighbourhoods=self._neighbourhoods,
            recorded=self.recorded,
            note=self.note,
            layers=self.layers,
            tasks=self._tasks,
            step=step,
            clock=WorkClock(self._solver) if self.is_awaited else SearchClock(),
            is_late=is_late,
            varies=self._varies,
        )

    def _varies(self) -> bool:
        """Returns whether plans are not reproducible: time limits or several threads decide."""
        if self._is_timed:
            return True
        if self._has_threads is None:
            number = read_summary(self._solver, "concurrency")
            self._has_threads = None if number is None else number > 1
        return bool(self._has_threads)

    def has_answer_set(self, stopped: Callable[[], bool]) -> Optional[bool]:
        """Returns whether any answer set exists, optimal or not; None if stopped before."""
        if stopped():
            return None
        self.run()  # what is still to be told
        return self._searching(0).has_answer_set(stopped)

    def avoid(self, action: Action, steps: Sequence[int], stopped: Callable[[], bool]) -> None:
        """Forbids an action in all plans until :meth:`end_avoiding`.

        Args:
            action: The action; its step does not count.
            steps: In which steps, which are grounded.
            stopped: Whether it need not be looked for.

        Raises:
            PlannerError: The encoding has something else of that name.
        """
        parts = [] if self._avoided else [AVOIDS_PART]
        self._avoided += 1
        name = f"{AVOIDS}({self._avoided})"
        arguments = (str(self._avoided), action.actuator, action.name)
        ground = [wire.Part(AVOIDS, (*arguments, str(step))) for step in steps]
        self.run(*parts, wire.Ground(tuple(ground)), wire.AssignExternal(name, wire.Truth.TRUE))
        if self.has_answer_set(stopped):
            self._avoiding.append(name)
        else:
            self.run(wire.ReleaseExternal(name))

    @property
    def avoids(self) -> bool:
        """True if an action is forbidden by :meth:`avoid`."""
        return bool(self._avoiding)

    def end_avoiding(self) -> None:
        """Allows the action again that :meth:`avoid` has forbidden."""
        avoiding, self._avoiding = self._avoiding, []
        if avoiding:
            self.run(*(wire.ReleaseExternal(name) for name in avoiding))

    def externals(self) -> Dict[str, wire.Truth]:
        """Returns all externals with their values."""
        return read_externals(self.run(wire.GetExternals()))

    def set_external(self, atom: str, value: wire.Truth) -> bool:
        """Sets an external for a mode; ignores atoms that are no externals, as clingo does.

        An encoding that has opted in learns a ``query(T)`` together with what it is told.

        Returns:
            Whether there is such an external, as far as that is known.

        Raises:
            PlannerError: The solver refuses the request.
        """
        self._optional.add(atom)
        if self.demand and atom.startswith(QUERY):
            self.demand.set_query(atom, value)
            return True
        return atom not in self._run([wire.AssignExternal(atom, value)])[1]

    def declare(self, pairs: Sequence[Pair]) -> None:
        """Asks an encoding that is told its events whether it knows them."""
        self._requests.declare(self.demand, pairs)

    def tell(self, atoms: Sequence[str]) -> List[Tuple[str, str]]:
        """Makes events true: by their externals, or by grounding.

        Returns:
            The atoms that the encoding does not know, each with the reason.
        """
        if not self.demand.tells:
            return self.assign(atoms, wire.Truth.TRUE)
        pairs = {atom: _pair(atom) for atom in atoms}
        asked = {atom: pair for atom, pair in pairs.items() if pair[0] not in ("commit", "save")}
        self.declare(list(asked.values()))
        missing = [atom for atom, pair in asked.items() if not self.demand.declared[pair]]
        self.demand.tell([atom for atom in atoms if atom not in missing])
        if len(missing) < len(atoms):
            self._forget_plan()
        return [(atom, f"there is no external event({','.join(pairs[atom])})") for atom in missing]

    def make_true_later(self, atoms: Sequence[str]) -> None:
        """Queues externals that exist, to be made true before the planner's next request."""
        if atoms:
            self._later += atoms
            self._forget_plan()

    def assign(self, atoms: Sequence[str], value: wire.Truth) -> List[Tuple[str, str]]:
        """Assigns a value to those atoms that are externals.

        Returns:
            The other atoms, each with the reason.
        """
        if not atoms:
            return []
        self.run()  # what is still to be told
        if not all(atom.startswith(QUERY) for atom in atoms):
            self._forget_plan()
        return self._requests.assign(atoms, value)


def _pair(atom: str) -> Pair:
    """Returns the source and the content of an event."""
    source, content, _ = split_term(atom)[1]
    return source, content
