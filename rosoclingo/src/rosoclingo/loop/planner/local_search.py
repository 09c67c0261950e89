"""Large neighbourhood search for a cheaper plan, by solving under assumptions."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Callable, List, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.planner.neighbourhoods import Neighbourhood, Neighbourhoods, is_restricted
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
    """

    solver: Solver
    neighbourhoods: Neighbourhoods
    cost: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]]

    def descend(
        self,
        best: Incumbent,
        is_called: Callable[[], bool],
        *,
        shows: bool = False,
        lengthen: Callable[[], bool] = lambda: False,
    ) -> Incumbent:
        """Improves a plan until told to stop, or until it is proven the best.

        Args:
            best: The plan. If it says nothing of its choices, everything is searched at once.
            is_called: Whether to end.
            shows: Whether to end also when it is time to show a better plan.
            lengthen: Allows longer plans when a plan is proven the best, unless they are too long.

        Returns:
            The best plan that was found.
        """
        first = best
        end = time.monotonic() + self.neighbourhoods.until_shown() if shows else math.inf

        def stopped() -> bool:
            is_shown = best.cost < first.cost and time.monotonic() > end
            return is_called() or is_shown

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
        best = self._search(best, (), stopped)
        while best.is_best and not stopped() and lengthen():
            best = self._search(replace(best, is_best=False), (), stopped)
        return best

    def _try(
        self, best: Incumbent, plan: Neighbourhood, seed: str, stopped: Callable[[], bool]
    ) -> Optional[Incumbent]:
        """Returns a better plan in the neighbourhood of a group; None if none was found."""
        hood = self.neighbourhoods
        end = time.monotonic() + hood.seconds
        kept = plan.assumptions(plan.around(seed, hood.size, hood.dice))
        limit = wire.ConflictLimit(hood.conflicts)
        better = self._search(best, (*kept, limit), lambda: stopped() or time.monotonic() > end)
        return better if better.cost < best.cost else None

    def _search(
        self,
        best: Incumbent,
        kept: Sequence[wire.Assumed],
        stopped: Callable[[], bool],
    ) -> Incumbent:
        """Returns the best plan that was found under some assumptions."""
        found: List[wire.Improvement] = []
        bound = wire.CostBound(below(best.cost))
        outcome = self.solver.solve((*kept, bound), stopped, found.append)
        is_best = not (kept or outcome.interrupted or is_restricted(best.symbols))
        cost = self.cost(outcome, found)
        if cost and cost < best.cost:
            return Incumbent(cost, outcome.symbols or found[-1].symbols, is_best)
        return Incumbent(best.cost, best.symbols, best.is_best or is_best)


def below(cost: Sequence[int]) -> Tuple[int, ...]:
    """Returns the highest costs below some.

    >>> below((3, 17)), below((3, 0))
    ((3, 16), (2, 2147483647))
    """
    *higher, last = cost
    if higher and last == 0:  # clingo takes no negative bounds
        return (*below(higher), _MOST)
    return (*higher, last - 1)
