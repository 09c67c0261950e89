"""Anytime improvement: searches for a plan that is cheaper, or grants more, while the loop is idle.

No open goal is left to itself: as long as the plan has nothing for it, and it is not proven that
there is no such plan, one is looked for, also while robots have nothing to do.
"""

from __future__ import annotations

import math

from rosoclingo.loop.monitor import Doing
from rosoclingo.loop.search import take_plan
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import Plan

_QUIET_SECONDS = 0.1  # without an input, before it is looked for a better plan


def improve(state: State) -> bool:
    """Searches for a better plan until an input comes, if there may be one.

    Called while there is nothing else to do. In a replay it is done if it was done then.

    Returns:
        Whether it has looked.
    """
    inbox = state.mail.inbox
    known = inbox.recorded
    is_replay = known.knows_searches
    if not (known.is_search_due(improves=True) if is_replay else _may_improve(state)):
        return False
    inbox.durability.about_to_wait()  # the search may last
    if not is_replay and not inbox.stays_quiet(_QUIET_SECONDS):
        return False  # answers come in bursts, and it takes a while until a search can be stopped
    state.monitor.begin(Doing.IMPROVES)
    outcome = state.planner.improve(state.step, lambda: is_called(state), horizon=state.horizon)
    if outcome is not None:
        take_plan(state, Plan(outcome.symbols), is_best=not outcome.interrupted)
        begins = not state.executions.published.issuperset(state.plan.actions(state.step))
        if begins or state.plan.last_actions(state.step, math.inf) > state.horizon:
            state.waiting.stop()  # the mode has to ask for the rest of it
    state.show_plan()
    return True


def _may_improve(state: State) -> bool:
    """Whether the plan lacks something, or one is being executed that may not be the best."""
    if not state.planner.may_improve:
        return False
    if state.planner.is_short:
        return True
    if not state.mail.inbox.improves:
        return False
    return state.shows_plan and bool(state.ahead()) and state.executions.pending_actions


def is_called(state: State) -> bool:
    """Whether an input has come that ends a search for a better plan."""
    state.waiting.look_at_actuators()
    return state.interrupted() or state.mail.inbox.has_controls
