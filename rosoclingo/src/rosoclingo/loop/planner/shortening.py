"""Anytime improvement: searches for a shorter or cheaper plan while the current one is executed.

The horizon stays as it is, so that modes need not know of this. A shorter plan is one in which
no action is done from some step on: for each step there is an external that forbids actions. A
cheaper one is looked for where the encoding says what plans cost.
"""

from __future__ import annotations

import time
from typing import Callable, List, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.local_search import below
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.added import STILL
from rosoclingo.loop.values.atoms import Action, Plan
from rosoclingo.loop.values.solver import Solver

_JUMP_SECONDS = 1.0  # how long a plan may be looked for that is shorter by several steps


def shorten(
    solver: Solver,
    run: Callable[[Sequence[wire.Command]], object],
    plan: Plan,
    *,
    step: int,
    horizon: int,
    stopped: Callable[[], bool],
) -> SearchEnded:
    """Searches for plans whose last action comes earlier, until none is left or it is stopped.

    After each success it tries to save twice as many steps. What was done up to the current step
    stays, also where the encoding is not told of it.

    Args:
        solver: The planner's solver; its externals ``STILL`` are false before and after
            that.
        run: Runs commands that set these externals.
        plan: The plan that stands.
        step: The current step, whose actions are published.
        horizon: The horizon that is asked for.
        stopped: Whether the search has to end.

    Returns:
        How it has ended; a plan costs the number of its last step with an action.
    """
    last, saved, best = plan.last_actions(step, horizon), 1, plan
    is_best = False
    past = _until(plan, step)
    still: List[int] = []
    try:
        while last > step and not stopped():
            target = max(step, last - saved)
            more = [one for one in range(target + 1, horizon + 1) if one not in still]
            less = [one for one in still if one <= target]
            run([*_set(more, wire.Truth.TRUE), *_set(less, wire.Truth.FALSE)])
            still = list(range(target + 1, horizon + 1))
            outcome, symbols = _solve(solver, past, stopped, saved > 1)
            found = Plan(symbols)
            if symbols and _until(found, step) == past:
                best, last = found, found.last_actions(step, horizon)
                saved *= 2
            elif saved > 1:
                saved = 1
            else:
                is_best = outcome.result is wire.Result.UNSAT
                break
    finally:
        run(_set(still, wire.Truth.FALSE))
    is_best = is_best and _can_assume(solver, best)
    bound = (last,) if is_best or last <= step else ()
    how = Ended.AS_BEFORE if best is plan else Ended.BETTER
    return SearchEnded(how, best.symbols, Quality((last,), bound))


def cheapen(
    solver: Solver,
    cost_of: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]],
    plan: Plan,
    cost: Tuple[int, ...],
    *,
    step: int,
    stopped: Callable[[], bool],
) -> SearchEnded:
    """Searches for cheaper plans, until none is left or it is stopped.

    What was done up to the current step stays, as for :func:`shorten`.

    Args:
        solver: The planner's solver.
        cost_of: Returns what the last answer set of a search costs.
        plan: The plan that stands.
        cost: What that one costs.
        step: The current step, whose actions are published.
        stopped: Whether the search has to end.

    Returns:
        How it has ended; the bound is that of the horizon, with what was done.
    """
    past = _until(plan, step)
    others: List[Action] = []  # that cannot have been done either, as far as the search tries them
    while True:
        done = [wire.Assumption(str(action), True) for action in past]
        not_done = [wire.Assumption(str(action), False) for action in others]
        found: List[wire.Improvement] = []
        outcome = solver.solve(
            (*done, *not_done, wire.CostBound(below(cost))), stopped, found.append
        )
        symbols = outcome.symbols or (found[-1].symbols if found else ())
        more = [action for action in _until(Plan(symbols), step) if action not in past]
        if all(action in others for action in more):
            break
        others += more
    if symbols and not more:
        cost = cost_of(outcome, found) or below(cost)
        bound = cost if outcome.result is wire.Result.SAT and not outcome.interrupted else ()
        return SearchEnded(Ended.BETTER, symbols, Quality(cost, bound))
    is_best = outcome.result is wire.Result.UNSAT and _can_assume(solver, plan)
    return SearchEnded(Ended.AS_BEFORE, plan.symbols, Quality(cost, cost if is_best else ()))


def _until(plan: Plan, step: int) -> List[Action]:
    """Returns the actions of a plan up to a step, ordered."""
    return sorted((one for one in plan.actions_from(0) if one.step <= step), key=str)


def _can_assume(solver: Solver, plan: Plan) -> bool:
    """Returns whether a plan's actions can be assumptions: they are atoms, not shown terms."""
    found: List[wire.Improvement] = []
    assumed = [wire.Assumption(str(action), True) for action in plan.actions_from(0)]
    outcome = solver.solve(assumed, lambda: bool(found), found.append)
    return bool(found) or outcome.result is wire.Result.SAT


def _solve(
    solver: Solver, past: Sequence[Action], stopped: Callable[[], bool], is_jump: bool
) -> Tuple[wire.Outcome, Tuple[str, ...]]:
    """Returns the end of a search, and the last answer set that it has found."""
    found: List[wire.Improvement] = []
    end = time.monotonic() + _JUMP_SECONDS
    assumed = [wire.Assumption(str(action), True) for action in past]
    outcome = solver.solve(
        assumed, lambda: stopped() or (is_jump and time.monotonic() > end), found.append
    )
    return outcome, outcome.symbols or (found[-1].symbols if found else ())


def _set(steps: Sequence[int], value: wire.Truth) -> List[wire.Command]:
    return [wire.AssignExternal(f"{STILL}({step})", value) for step in steps]
