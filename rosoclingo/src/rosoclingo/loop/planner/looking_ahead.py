"""Searches several horizons in turn, where searching them one by one takes too long.

The plan that is found first is kept for its horizon: a mode that requests one horizon after the
other is told that there is none before it. So modes need not know of this.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Callable, List, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.interleaving import Interleaving, UnbrokenFirst
from rosoclingo.loop.planner.local_search import below
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.added import UNBROKEN
from rosoclingo.loop.values.atoms import query
from rosoclingo.loop.values.solver import Solver

_DYNAMIC_RESTARTS = wire.Restarts("D,100,0.7")  # as in clingo's configuration trendy


def look_ahead(
    solver: Solver,
    run: Callable[[Sequence[wire.Command]], object],
    ground: Callable[[int], None],
    ground_pauses: Callable[[int], None],
    *,
    step: int,
    asked: int,
    last: float,
    stopped: Callable[[], bool],
) -> SearchEnded:
    """Searches horizons in turn until there is a plan, and restores the query of the first one.

    A search that optimises has the rest of its turn to find a better plan, but for the long turns
    of plans without pauses.

    Args:
        solver: The planner's solver.
        run: Runs commands that concern queries and pauses alone.
        ground: Grounds all steps up to one.
        ground_pauses: Grounds :data:`.PAUSES_PART` for all steps up to one.
        step: The current step, after which pauses can be forbidden.
        asked: The horizon that is asked for, which is the first one.
        last: The last one; infinite if there is none.
        stopped: Whether the search has to end.

    Returns:
        How it has ended.
    """
    others = Interleaving(asked, last, growth=1.2, seconds=0.1, share=0.95, lengthening=1.2)
    order = UnbrokenFirst(asked, last, others)
    unbroken = _Unbroken(run, step)
    with unbroken, _Query(run, ground, asked) as asking:
        for turn in order.turns():
            if stopped():
                return SearchEnded(Ended.AHEAD_CALLED, grounded=asking.grounded)
            asking.move(turn.horizon)
            if turn.is_unbroken:
                ground_pauses(turn.horizon)
            unbroken.move(turn.horizon if turn.is_unbroken else 0)
            found: List[wire.Improvement] = []
            until = _until(turn.seconds, stopped, found if turn.is_unbroken else ())
            strategy = (_DYNAMIC_RESTARTS,) if turn.restarts_dynamically else ()
            outcome = solver.solve(strategy, until, found.append)
            symbols = outcome.symbols or (found[-1].symbols if found else ())
            if outcome.result is wire.Result.SAT or symbols:
                quality = Quality(found[-1].cost) if found else None
                return SearchEnded(
                    Ended.AHEAD, symbols, quality, horizon=turn.horizon, grounded=asking.grounded
                )
            if outcome.result is wire.Result.UNSAT:
                order.refute(turn)
    last_step = asking.grounded
    return SearchEnded(Ended.AHEAD_REFUTED, horizon=last_step + 1, grounded=last_step)


def look_for_cheaper(
    solver: Solver,
    run: Callable[[Sequence[wire.Command]], object],
    ground: Callable[[int], None],
    cost_of: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]],
    *,
    asked: int,
    last: float,
    cost: Tuple[int, ...],
    stopped: Callable[[], bool],
) -> Optional[SearchEnded]:
    """Searches horizons in turn for cheaper plans, and restores the query of the first one.

    Args:
        solver: The planner's solver.
        run: Runs commands that concern queries alone.
        ground: Grounds all steps up to one.
        cost_of: Returns what the last answer set of a search costs.
        asked: The horizon that is asked for, all of whose plans cost at least as much as its best.
        last: The last one; infinite if there is none.
        cost: What that one costs.
        stopped: Whether the search has to end.

    Returns:
        The cheapest plan, with a bound if none is cheaper with any horizon; None if none is cheaper
        than that of the horizon that is asked for.
    """
    order = Interleaving(asked + 1, last, width=3, growth=1.5, seconds=0.1)
    best: Optional[SearchEnded] = None
    with _Query(run, ground, asked) as asking:
        for turn in order.turns():
            if stopped():
                return best
            asking.move(turn.horizon)
            found: List[wire.Improvement] = []
            bound = wire.CostBound(below(cost))
            outcome = solver.solve((bound,), _until(turn.seconds, stopped), found.append)
            symbols = outcome.symbols or (found[-1].symbols if found else ())
            if symbols:
                cost = cost_of(outcome, found) or bound.cost
                best = SearchEnded(
                    Ended.AHEAD, symbols, Quality(cost),
                    horizon=turn.horizon, grounded=asking.grounded,
                )  # fmt: skip
            if outcome.result is not wire.Result.UNKNOWN:
                order.refute(turn.horizon)  # none is cheaper than the best one
    if best is None:
        return None
    return replace(best, quality=Quality(cost, cost), grounded=asking.grounded)


class _Query:
    """Moves the query from one horizon to another, and back to the first one at the end."""

    def __init__(
        self,
        run: Callable[[Sequence[wire.Command]], object],
        ground: Callable[[int], None],
        asked: int,
    ) -> None:
        self.grounded = asked
        self._run = run
        self._ground = ground
        self._first = self._current = asked

    def __enter__(self) -> _Query:
        return self

    def __exit__(self, *_: object) -> None:
        self._assign(self._first)

    def move(self, horizon: int) -> None:
        """Grounds the steps of a horizon, and sets the query to it."""
        if horizon > self.grounded:
            self._ground(horizon)
            self.grounded = horizon
        self._assign(horizon)

    def _assign(self, horizon: int) -> None:
        if horizon != self._current:
            self._run(
                [
                    wire.AssignExternal(query(self._current), wire.Truth.FALSE),
                    wire.AssignExternal(query(horizon), wire.Truth.TRUE),
                ]
            )
            self._current = horizon


class _Unbroken:
    """Forbids pauses between actions up to a horizon, and allows them at the end."""

    def __init__(self, run: Callable[[Sequence[wire.Command]], object], step: int) -> None:
        self._run = run
        self._first = step + 2  # whose step before is the first one without an action
        self._next = self._first

    def __enter__(self) -> _Unbroken:
        return self

    def __exit__(self, *_: object) -> None:
        self.move(0)

    def move(self, horizon: int) -> None:
        """Forbids pauses up to a horizon, and allows all later ones."""
        after = max(self._first, horizon + 1)
        truth = wire.Truth.TRUE if after > self._next else wire.Truth.FALSE
        steps = range(min(after, self._next), max(after, self._next))
        self._next = after
        if steps:
            self._run([wire.AssignExternal(f"{UNBROKEN}({step})", truth) for step in steps])


def _until(
    seconds: float, stopped: Callable[[], bool], found: Sequence[wire.Improvement] = ()
) -> Callable[[], bool]:
    """Returns a stop condition: told to stop, its time is over, or it has found enough."""
    end = time.monotonic() + seconds
    return lambda: stopped() or bool(found) or time.monotonic() > end
