"""Large neighbourhood search for a cheaper plan, by solving under assumptions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Callable, List, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.planner.neighbourhoods import Neighbourhood, Neighbourhoods, is_restricted
from rosoclingo.loop.planner.work import SearchClock
from rosoclingo.loop.values.solver import Solver

_MOST = 2**31 - 1  # a cost at a priority of which nothing is known


@dataclass(frozen=True)
class Incumbent:
    """The best plan so far. Immutable.

    Attributes:
        cost: What it costs, the highest priority first.
        symbols: Its answer set.
        is_best: Whether there is no better one.
    """

    cost: Tuple[int, ...]
    symbols: Tuple[str, ...]
    is_best: bool = False


@dataclass(eq=False)
class LocalSearch:
    """Improves a plan, neighbourhood by neighbourhood, and proves it the best if there is time.

    Attributes:
        solver: The planner's solver.
        neighbourhoods: Says which ones are tried.
        cost: Returns what the last answer set of a search costs; nothing if there is none.
        clock: What time is measured by.
    """

    solver: Solver
    neighbourhoods: Neighbourhoods
    cost: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]]
    clock: SearchClock = field(default_factory=SearchClock)

    def descend(
        self,
        best: Incumbent,
        is_called: Callable[[], bool],
        *,
        until: float = math.inf,
        shows: bool = False,
        lengthen: Callable[[], bool] = lambda: False,
    ) -> Incumbent:
        """Improves a plan until told to stop, or until it is proven optimal.

        Args:
            best: The plan. If it says nothing of its choices, everything is searched at once.
            is_called: Whether to end.
            until: When it ends at the latest.
            shows: Whether to end also when it is time to show a better plan.
            lengthen: Allows longer plans when a plan is proven the best, unless they are too long.

        Returns:
            The best plan that was found.
        """
        first = best
        now = self.clock.now
        end = now() + self.neighbourhoods.until_shown() if shows else math.inf

        def stopped() -> bool:
            is_shown = best.cost < first.cost and now() > end
            return is_called() or is_shown or now() > until

        plan = Neighbourhood.of(best.symbols)
        seeds = [] if plan is None else self.neighbourhoods.begin(plan)
        while plan is not None and self.neighbourhoods.size < len(plan.groups):
            had_success = False
            for seed in seeds or self.neighbourhoods.seeds(plan):
                has_success = True
                while has_success:
                    if stopped():
                        return best
                    better = self._try(best, plan, seed, stopped)
                    has_success = better is not None
                    if better is not None:
                        best, had_success = better, True
                        plan = Neighbourhood.of(best.symbols) or plan
            if not had_success and not seeds:
                self.neighbourhoods.grow()
            seeds = []
        best = self._search_all(best, stopped, until)
        while best.is_best and not stopped() and lengthen():
            best = self._search_all(replace(best, is_best=False), stopped, until)
        return best

    def _search_all(self, best: Incumbent, stopped: Callable[[], bool], until: float) -> Incumbent:
        """Searches all plans; with a limit, the last search has to prove that none is better."""
        better = best
        while not (better.is_best or stopped()):
            best = better
            better = self._search(best, self.clock.limits(until), stopped)
            if better.cost == best.cost:
                break
        return better

    def _try(
        self, best: Incumbent, plan: Neighbourhood, seed: str, stopped: Callable[[], bool]
    ) -> Optional[Incumbent]:
        """Returns a better plan in the neighbourhood of a group; None if none was found."""
        hood = self.neighbourhoods
        end = self.clock.now() + hood.seconds
        kept = plan.assumptions(plan.around(seed, hood.size, hood.dice))
        limit = wire.ConflictLimit(hood.conflicts)
        better = self._search(best, (*kept, limit), lambda: stopped() or self.clock.now() > end)
        return better if better.cost < best.cost else None

    def _search(
        self,
        best: Incumbent,
        kept: Sequence[wire.Assumed],
        stopped: Callable[[], bool],
    ) -> Incumbent:
        """Returns the best plan found under some assumptions, or within some limits."""
        found: List[wire.Improvement] = []
        bound = wire.CostBound(below(best.cost))
        outcome = self.solver.solve((*kept, bound), stopped, found.append)
        is_all = not (outcome.interrupted or is_restricted(best.symbols)) and (
            not kept or (outcome.result is wire.Result.UNSAT and not _assumes(kept))
        )
        cost = self.cost(outcome, found)
        if cost and cost < best.cost:
            return Incumbent(cost, outcome.symbols or found[-1].symbols, is_all)
        return Incumbent(best.cost, best.symbols, best.is_best or is_all)


def _assumes(kept: Sequence[wire.Assumed]) -> bool:
    return any(isinstance(one, wire.Assumption) for one in kept)


def below(cost: Sequence[int]) -> Tuple[int, ...]:
    """Returns the highest costs below some.

    >>> below((3, 17)), below((3, 0))
    ((3, 16), (2, 2147483647))
    """
    *higher, last = cost
    if higher and last == 0:  # clingo takes no negative bounds
        return (*below(higher), _MOST)
    return (*higher, last - 1)
