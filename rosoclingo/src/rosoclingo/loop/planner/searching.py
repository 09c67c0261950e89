"""Searches of the planner: time limits, costs, and the outcomes that a replay needs.

The result of a search with a time limit depends on the speed of the machine, and that of several
threads is random. So the outcomes of such searches are recorded, and a replay uses them instead
of searching.
"""

from __future__ import annotations

import contextlib
import dataclasses
from typing import Any, Callable, List, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosclingo.wire import commands as wire
from rosoclingo.errors import PlannerError, SearchProcessError, TaskError
from rosoclingo.loop.journal import IMPROVING, Ended, SearchEnded
from rosoclingo.loop.planner.demand import Demand
from rosoclingo.loop.planner.layers import LayeredSearch, LayersState, WantedLayers
from rosoclingo.loop.planner.local_search import Incumbent, LocalSearch
from rosoclingo.loop.planner.neighbourhoods import (
    Neighbourhoods,
    is_constructed,
    is_restricted,
    says_choices,
)
from rosoclingo.loop.planner.task_search import TaskSearch, task_of
from rosoclingo.loop.planner.work import SearchClock, Work, read_statistics
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.recorded import Recorded
from rosoclingo.loop.values.solver import Solver

_MOST_ROUNDS = 10_000  # answer sets in a row that ask for something
_AS_BEFORE = "as_before"  # as_before(K): the plan of search K is the one before
_SAME_SECONDS = 0.05  # that it may take at least to count what is left of a plan


@dataclasses.dataclass(eq=False)
class Searching:
    """One search of the planner's, for a plan or for a better one.

    The planner is told all before that, and is told nothing meanwhile.

    Attributes:
        solver: The planner's solver.
        demand: The parts that its encoding requests.
        run: Runs commands.
        patience: After how many seconds it ends if it optimises and has found a plan; 0 for when
            it is through.
        first: The same for a plan that shows its choices, if that is another time.
        awaits_layers: Whether ``patience`` counts for plans in layers, too: else, their first plan
            is taken.
        task_patience: For how many seconds of work a first plan of a task is improved; 0 for a
            moment.
        neighbourhoods: Says what of a plan is searched anew.
        recorded: Knows in a replay how it ends, if that depends on time.
        note: Called with how it has ended, if that depends on time.
        layers: What is known of the layers of its plans.
        tasks: Finds plans for its tasks.
        step: The current step.
        clock: What ``patience`` is measured by.
        is_late: Whether a search without an answer set has to end, though nothing has come.
        varies: Whether which answer set the solver finds is up to chance, or to searches that time
            has ended; asked after a search.
    """

    solver: Work
    demand: Demand
    run: Callable[..., object]
    patience: float
    first: Optional[float]
    awaits_layers: bool
    task_patience: float
    neighbourhoods: Neighbourhoods
    recorded: Recorded
    note: Callable[[SearchEnded], None]
    layers: LayersState
    tasks: TaskSearch
    step: int
    clock: SearchClock
    is_late: Callable[[], bool]
    varies: Callable[[], bool]

    def __post_init__(self) -> None:
        self._lengthen: Callable[[], bool] = lambda: False
        self._has_gathered = False  # so that the plan is clingo's
        self._layered = LayeredSearch(self.solver, self.run, self.layers, self.cost)

    def find(
        self,
        stopped: Callable[[], bool],
        quality: Optional[Quality],
        *,
        compares: bool = False,
        rounds: int = 0,
    ) -> Tuple[wire.Outcome, Optional[Quality]]:
        """Searches until an answer set requests no new part.

        Args:
            stopped: Whether it has to end.
            quality: How good the plan before is, which may be found again.
            compares: Whether to begin with what is left of the plan before.
            rounds: How many answer sets have requested parts already.

        Returns:
            How the last search ended; interrupted also if one before it was cut off. And how good
            the plan is, if that is known.

        Raises:
            PlannerError: The encoding requests a part that does not exist, or endlessly many.
        """
        if not rounds:
            self.neighbourhoods.note_news()
        bound: Optional[Tuple[int, ...]] = None  # if one was cut off
        has_layers = self.demand.has_layers
        best: Optional[Incumbent] = None
        for number in range(rounds, _MOST_ROUNDS):
            called = self.recorded.search_due(Ended.CALLED, number=number)
            if called or stopped():  # while it was grounded
                return self._be_called(number, is_recorded=called is not None), quality
            outcome, found = self._solve(
                stopped, number, compares=compares and not (number or has_layers), best=best
            )
            best = None
            if outcome.result is wire.Result.UNKNOWN:
                return self._be_called(number), quality
            if outcome.result is not wire.Result.SAT:
                return outcome, quality
            number_of_task = task_of(outcome.symbols) if self.demand.has_tasks else ""
            if number_of_task:
                ended = self._find_for_task(outcome.symbols, stopped, number)
                if ended is None:
                    outcome = self._gather(number_of_task)
                elif ended.how is Ended.CALLED:
                    return self._be_called(number), quality
                else:
                    quality = self._take_found(ended)
                    continue
            wanted = self._layered.wanted(outcome.symbols) if has_layers else None
            if wanted is not None:
                ended = self._find_layers(wanted, stopped, number, compares=compares)
                if ended.how is Ended.CALLED:
                    return self._be_called(number), quality
                if ended.how is Ended.FOUND:
                    quality = self._take_found(ended)
                    continue
                if ended.quality is not None:
                    best = Incumbent(ended.quality.cost, ended.symbols)
                    self._lengthen = self._layered.longer(wanted, ended.horizon, ended.granted)
                continue
            if outcome.interrupted:
                bound = found.bound if found else ()
            if found is not None and bound is not None:
                found = dataclasses.replace(found, bound=bound)
            # An encoding that looks for better plans requests parts in each new one, and has
            # decided then what that costs.
            # One that constructs a plan may have decided all.
            is_new = bool(self.demand) and (
                self.demand.asks(outcome.symbols, completes=False)
                or is_constructed(outcome.symbols)
            )
            if is_new or not self.demand.improves:
                quality = found
            parts = self.demand.asked_for(outcome.symbols) if self.demand else []
            if not parts and self._has_gathered:
                self.tasks.check(outcome.symbols)
            if not parts:
                return dataclasses.replace(outcome, interrupted=bound is not None), quality
            self.run(self.demand.ground(parts))
        raise PlannerError(
            f"{_MOST_ROUNDS} answer sets in a row of the planner have asked for something, the "
            f"last for {shorten(str(parts[0]))}: does it ever stop asking?"
        )

    def improve(
        self, stopped: Callable[[], bool], *, seconds: float = 0.0
    ) -> Tuple[SearchEnded, Optional[wire.Outcome]]:
        """Searches for a better plan than the current one.

        Args:
            stopped: Whether it has to end, once it is known what that one costs; what it has found
                is taken then, or chosen, so that the next search completes it.
            seconds: If the one that stands does not grant all wishes: how long one that grants
                more is looked for, in seconds of work; else 0.

        Returns:
            How it has ended, and the better plan; None if none was found.

        Raises:
            PlannerError: The encoding requests a part that does not exist.
        """
        ended = self.recorded.search_due(*IMPROVING)
        if ended is None and self.demand.has_tasks:
            ended = self._improve_for_task(stopped, seconds)
            if ended is None:
                self._gather(str(self.demand.searches))
        if ended is None:
            look = self._look_for_more(stopped, seconds) if seconds else None
            ended = look or self._look_for_better(stopped)
        self.note(ended)
        self.layers.missing = ended.missing
        if ended.how is Ended.NOTHING:
            return ended, None
        is_chosen = ended.how is Ended.CHOSEN
        parts = self.demand.asked_for(ended.symbols, completes=not is_chosen)
        if parts:
            self.run(self.demand.ground(parts))
        if is_chosen:
            return ended, None
        outcome, _ = self.find(lambda: False, ended.quality, rounds=1)
        is_better = ended.how is Ended.BETTER and outcome.result is wire.Result.SAT
        return ended, outcome if is_better else None

    def _improve_for_task(
        self, stopped: Callable[[], bool], seconds: float
    ) -> Optional[SearchEnded]:
        """Searches for a better plan for the task; returns None if clingo has to do that."""
        self.tasks.read_facts(self.demand.ground)
        symbols = self.solver.solve().symbols
        self.tasks.note_task(symbols)
        if self.demand.is_constrained:
            return None
        try:
            return self.tasks.improve(symbols, self.step, stopped, seconds)
        except TaskError:  # the search does not know all that an execution does
            pass
        except (SearchProcessError, OSError) as err:
            self.tasks.warn_of(err)
        return None if seconds else SearchEnded(Ended.NOTHING)

    def _find_layers(
        self,
        wanted: WantedLayers,
        stopped: Callable[[], bool],
        number: int,
        *,
        compares: bool,
    ) -> SearchEnded:
        """Finds the plan's number of layers.

        Args:
            wanted: What an answer set says of them.
            stopped: Whether it has to end.
            number: How many answer sets have asked for something before.
            compares: Whether to begin with what is left of the plan before.
        """
        ended = self.recorded.search_due(Ended.LAYERED, Ended.CALLED, number=number)
        if ended is None:
            with contextlib.closing(self.tasks):
                ended = self._find_beside_tasks(wanted, stopped, compares=compares)
        elif ended.how is Ended.LAYERED:
            self._layered.take(wanted, ended)
        if ended.how is Ended.FOUND:
            self.note(dataclasses.replace(ended, round=number))
        elif ended.how is not Ended.CALLED:
            self.note(dataclasses.replace(ended, symbols=(), quality=None, round=number))
        return ended

    def _find_beside_tasks(
        self, wanted: WantedLayers, stopped: Callable[[], bool], *, compares: bool
    ) -> SearchEnded:
        """Finds layers, or takes the plan of the task search, whichever is first."""
        same = self._same() if compares else None
        ended = self._layered.find(wanted, lambda: stopped() or self.tasks.is_ready, same=same)
        if ended.how is Ended.CALLED and not stopped():
            ended = self.tasks.take() or self._layered.find(wanted, stopped, same=same)
        return ended

    def _find_for_task(
        self, symbols: Sequence[str], stopped: Callable[[], bool], number: int
    ) -> Optional[SearchEnded]:
        """Finds a plan for the task that an answer set shows; returns None without one."""
        ended = self.recorded.search_due(Ended.FOUND, Ended.CALLED, number=number)
        if ended is None and not self.recorded.knows_searches:
            self.tasks.read_facts(self.demand.ground)
            self.tasks.note_task(symbols)
        if ended is None and not (self.recorded.knows_searches or self.demand.is_constrained):
            ended = self.tasks.find(symbols, self.step, stopped, self.task_patience)
        if ended is not None and ended.how is Ended.FOUND:
            self.note(dataclasses.replace(ended, round=number))
        return ended

    def _take_found(self, ended: SearchEnded) -> Optional[Quality]:
        """Tells the encoding a plan that was found, and returns its quality."""
        self.layers.missing = ended.missing
        self.run(self.demand.ground(self.demand.asked_for(ended.symbols)))
        return ended.quality

    def _gather(self, number: str) -> wire.Outcome:
        """Has the encoding search for layers, and returns its answer set."""
        self._has_gathered = True
        self.run(
            self.demand.ground([wire.Part("gather", (number,))]),
            wire.AssignExternal(f"gathered({number})", wire.Truth.TRUE),
        )
        return self.solver.solve()

    def has_answer_set(self, stopped: Callable[[], bool]) -> Optional[bool]:
        """Returns whether any answer set exists, optimal or not; None if stopped before."""
        found: List[wire.Improvement] = []
        outcome = self.solver.solve((), lambda: bool(found) or stopped(), found.append)
        if found or outcome.result is wire.Result.SAT:
            return True
        return False if outcome.result is wire.Result.UNSAT else None

    def _look_for_better(self, stopped: Callable[[], bool]) -> SearchEnded:
        """Computes the plan's current cost, and searches for a cheaper plan."""
        found: List[wire.Improvement] = []
        if self.demand.has_layers and not self._keep_layers():
            return SearchEnded(Ended.NOTHING)
        outcome = self.solver.solve((self._same(),), None, found.append)
        cost = self.cost(outcome, found)
        if outcome.result is not wire.Result.SAT or not cost:
            return SearchEnded(Ended.NOTHING)
        before, symbols = cost, outcome.symbols
        found.clear()
        if says_choices(symbols):
            best = Incumbent(before, symbols)
            best = self._local_search().descend(best, stopped, shows=True)
            quality = Quality(best.cost, best.cost if best.is_best else ())
            how = Ended.BETTER if best.cost < before else Ended.AS_BEFORE
            if stopped() and self.demand.can_wait(best.symbols):
                how = Ended.CHOSEN
            return SearchEnded(how, best.symbols, quality)
        outcome = self.solver.solve((), stopped, found.append)
        better = self.cost(outcome, found)
        bound = better if outcome.result is wire.Result.SAT else self._bound()
        if not better or better >= before:
            return SearchEnded(Ended.AS_BEFORE, symbols, Quality(before, bound))
        symbols = outcome.symbols or found[-1].symbols
        return SearchEnded(Ended.BETTER, symbols, Quality(better, bound))

    def _look_for_more(self, stopped: Callable[[], bool], seconds: float) -> Optional[SearchEnded]:
        """Searches for a plan in layers that grants more wishes than the rest of the one before.

        Returns:
            How it has ended: also if that has granted none, with the rest of the plan; None if it
            has no layers.
        """
        wanted = self._layered.wanted(self.solver.solve().symbols)
        if wanted is None:
            return None
        same = self._same()
        found = self._layered.find_more(wanted, stopped, same=same, seconds=seconds)
        if found.granted > wanted.kept:
            return SearchEnded(Ended.BETTER, found.symbols, found.quality, missing=found.missing)
        self._layered.keep(wanted)
        outcome = self.solver.solve((same,) if wanted.before else ())
        if outcome.result is not wire.Result.SAT:
            return SearchEnded(Ended.NOTHING, missing=found.missing)
        return SearchEnded(Ended.AS_BEFORE, outcome.symbols, missing=found.missing)

    def _keep_layers(self) -> bool:
        """Sets the number of layers to that of the rest of the plan, if there is any."""
        wanted = self._layered.wanted(self.solver.solve().symbols)
        if wanted is None or not wanted.before:
            return False
        self._layered.keep(wanted)
        return True

    def _same(self) -> wire.Assumption:
        """Returns the assumption that keeps the rest of the plan before."""
        return wire.Assumption(f"{_AS_BEFORE}({self.demand.searches})", True)

    def _be_called(self, number: int, *, is_recorded: bool = False) -> wire.Outcome:
        """Records that an input has interrupted a search, and returns that outcome."""
        if is_recorded or (self.demand and self._depends_on_time()):
            self.note(SearchEnded(Ended.CALLED, round=number))
        return wire.Outcome(wire.Result.UNKNOWN, interrupted=True)

    def _depends_on_time(self) -> bool:
        """Returns whether the last search's result depends on time or chance."""
        return bool(self.patience or self.demand.has_layers or self.varies())

    def _solve(
        self,
        stopped: Callable[[], bool],
        number: int,
        *,
        compares: bool,
        best: Optional[Incumbent],
    ) -> Tuple[wire.Outcome, Optional[Quality]]:
        """Searches until told to stop, or, with a model, until the time limit.

        Args:
            stopped: Whether it has to end.
            number: How many answer sets have asked for something before.
            compares: Whether to begin with what is left of the plan before.
            best: A plan that is known already.

        Returns:
            How that has ended, and how good the answer set is, if that is known.
        """
        ended = self.recorded.search_due(Ended.CUT, Ended.FINISHED, Ended.REFUTED, number=number)
        if ended is None:
            outcome, quality = self._solve_in_time(stopped, compares=compares, best=best)
            if not self._depends_on_time() or task_of(outcome.symbols):
                return outcome, quality
            if outcome.result is wire.Result.UNSAT and self.demand.may_relax:
                self.note(SearchEnded(Ended.REFUTED, round=number))
            if outcome.result is not wire.Result.SAT:
                return outcome, quality
            how = Ended.CUT if outcome.interrupted else Ended.FINISHED
            ended = SearchEnded(how, outcome.symbols, quality, number)
        self.note(ended)
        if ended.how is Ended.REFUTED:
            return wire.Outcome(wire.Result.UNSAT), None
        is_cut = ended.how is Ended.CUT
        outcome = wire.Outcome(wire.Result.SAT, interrupted=is_cut, symbols=ended.symbols)
        return outcome, ended.quality

    def _solve_in_time(
        self, stopped: Callable[[], bool], *, compares: bool, best: Optional[Incumbent]
    ) -> Tuple[wire.Outcome, Optional[Quality]]:
        """Searches within the time limit; ``interrupted`` is set if that was too short."""
        found: List[wire.Improvement] = []
        limit = self.patience if not self.recorded.knows_searches else 0.0
        now = self.clock.now
        begin = now()
        end = begin + limit
        is_stopped = False

        def has_to_end() -> bool:
            nonlocal is_stopped
            is_stopped = is_stopped or stopped()
            has_plan = bool(limit and (found or best))
            is_over = has_plan and now() > end
            return is_stopped or is_over or (not found and self.is_late())

        def has_to_end_first() -> bool:
            return has_to_end() or bool(limit and found and self._goes_on(found[-1].symbols))

        if limit and compares:
            allowed, end = end, max(end, now() + _SAME_SECONDS)
            outcome = self.solver.solve((self._same(),), has_to_end_first, found.append)
            end = allowed
            if is_constructed(outcome.symbols):
                return dataclasses.replace(outcome, interrupted=True), Quality(())
            best = self._incumbent(outcome, found)
            found.clear()
        bound: Tuple[int, ...] = ()
        if best is None or not self._goes_on(best.symbols):
            outcome = self.solver.solve((), has_to_end_first, found.append)
            if is_constructed(outcome.symbols) and self.demand.improves:
                return dataclasses.replace(outcome, interrupted=True), Quality(())
            is_cut = limit and outcome.interrupted and not is_stopped
            if not (is_cut and (found or best)):
                # What only says how many layers there are, or what the task is, costs nothing.
                is_task = self.demand.has_tasks and bool(task_of(outcome.symbols))
                is_plan = not is_task and WantedLayers.of(outcome.symbols) is None
                cost = self.cost(outcome, found) if is_plan else ()
                is_best = not is_restricted(outcome.symbols)
                return outcome, Quality(cost, cost if is_best else ()) if cost else None
            bound = self._bound()
            best = self._incumbent(outcome, found, best)
        assert best is not None
        if self._goes_on(best.symbols) and (self.awaits_layers or not self.demand.has_layers):
            if self.first is not None:
                end = min(end, begin + self.first)
            best = self._local_search().descend(
                best, has_to_end, until=end, lengthen=self._lengthen
            )
            if is_stopped:
                return wire.Outcome(wire.Result.UNKNOWN, interrupted=True), None
            bound = () if is_restricted(best.symbols) else bound
        if best.is_best or (self.demand.improves and not self.demand.asks(best.symbols)):
            # If it requests no part, it stands, or an answer set before has decided it: there is no
            # other.
            outcome = wire.Outcome(wire.Result.SAT, symbols=best.symbols)
            return outcome, Quality(best.cost, best.cost)
        outcome = wire.Outcome(wire.Result.SAT, interrupted=True, symbols=best.symbols)
        return outcome, Quality(best.cost, bound)

    def _goes_on(self, symbols: Sequence[str]) -> bool:
        """Returns whether further searches improve a first plan: by parts, or within limits."""
        is_limited = not self.clock.is_seen and WantedLayers.of(symbols) is None
        return says_choices(symbols) or is_limited

    def _local_search(self) -> LocalSearch:
        return LocalSearch(self.solver, self.neighbourhoods, self.cost, self.clock)

    def _incumbent(
        self,
        outcome: wire.Outcome,
        found: Sequence[wire.Improvement],
        before: Optional[Incumbent] = None,
    ) -> Optional[Incumbent]:
        """Returns the better plan of the one that a search has found and the incumbent."""
        cost = self.cost(outcome, found)
        if not found or (before is not None and not (cost and cost < before.cost)):
            return before
        return Incumbent(cost, outcome.symbols or found[-1].symbols)

    def cost(self, outcome: wire.Outcome, found: Sequence[wire.Improvement]) -> Tuple[int, ...]:
        """Returns the cost of a search's last answer set; empty if unknown."""
        if found and (found[-1].symbols == outcome.symbols or not outcome.symbols):
            return found[-1].cost
        # Over ROS, the result may be here before the costs. Who does not minimise is not asked.
        is_known = bool(found) or self.demand.improves
        return self._numbers("costs") if is_known and outcome.symbols else ()

    def _bound(self) -> Tuple[int, ...]:
        """Returns the lower bound that the last search has proven, if it is known."""
        return self._numbers("lower")

    def _numbers(self, name: str) -> Tuple[int, ...]:
        return tuple(map(int, read_summary(self.solver, name) or ()))


def read_summary(solver: Solver, name: str) -> Any:
    """Returns a value of clingo's summary of the last search; None if there is none."""
    return read_statistics(solver).get("summary", {}).get(name)
