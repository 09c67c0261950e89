"""Recovery of a planner that ran out of memory: ends the goal that asked for too much, no other.

What was told since the last plan is the cause. If that were several goals, each is told again, one
after the other. The horizon goes back to that of the last plan. A planner that is lost is told all
that is known in the next step of the loop, so that the store has by then which goal has ended:
whatever happens next, it is not tried again.
"""

from __future__ import annotations

from typing import List, Optional

from rosclingo.errors import shorten
from rosclingo.wire.term_text import split_term
from rosoclingo.errors import ExhaustedError, SpareMemoryError
from rosoclingo.loop.journal import Status
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import event
from rosoclingo.loop.values.goals import Goal

_CANCEL = "cancel"


def recover(state: State, err: Exception) -> bool:
    """Ends or postpones goals after the planner ran out of memory, and asks it for nothing.

    If nothing goes on, the past may be the cause: the mode begins again with what holds.

    Args:
        state: What is known.
        err: By what it has failed.

    Returns:
        Whether the mode goes on, and does not begin again.

    Raises:
        ExhaustedError: No goal is the cause.
    """
    was_lost, state.externals.lost = state.externals.lost, True
    state.result = None
    if was_lost or not state.externals.grounded:
        raise ExhaustedError(f"the planner cannot begin: {err}")
    told = _told_goals(state)
    held = None if isinstance(err, SpareMemoryError) else _what_holds(state, told)
    if held is not None:
        state.environment.warn(f"the planner: {err}. It begins again with what holds now")
        _tell_again(state, told)
        state.begin_with([event("save", fluent, 0) for fluent in held])
        state.begin_mode()
        state.externals.grounded.clear()
        state.externals.lost = False  # the mode initialises it
        return False
    if state.planner.last_horizon is not None:  # else the mode counts the steps itself
        state.horizon = max(state.step, min(state.horizon, state.planned))
        state.externals.note_last_step(state.horizon)
    if isinstance(err, SpareMemoryError):
        state.environment.warn(
            f"the planner: {err}. No goal has asked for that: the run goes on with less"
        )
        return True
    _give_up(state, told, err)
    return True


def _give_up(state: State, told: List[Goal], err: Exception) -> None:
    """Ends the goal that is the cause, or has several goals told one by one."""
    if len(told) > 1:
        state.environment.warn(
            f"the planner: {err}. It is told of the last {len(told)} goals one by one, to find "
            "which one asks for too much"
        )
        _tell_again(state, told)
        state.mail.new_goals = True
        return
    reason = f"the planner: {err}"
    if told:
        (goal,) = told
        _take_back(state, goal)
        _end(state, goal, reason)
        return
    if state.mail.new_goals and state.goals.queued:  # for which the mode makes room
        _end(state, state.goals.queued[0], reason)
        state.mail.new_goals = state.goals.waiting
        return
    newest = _newest(state)
    if newest is None:
        raise ExhaustedError(f"{reason}; no goal can be given up")
    _say(state, newest, reason)
    state.externals.note_told([event(newest.slot or "", _CANCEL, state.step)], from_outside=True)
    newest.cancel_told, newest.given_up = True, reason


def _what_holds(state: State, told: List[Goal]) -> Optional[List[str]]:
    """Returns the fluents of the current step, if the planner can begin again with them.

    It cannot in step 0, if something goes on or has come, or if the encoding does not declare them.
    """
    if state.step == 0 or not (state.mail.dynamic and state.shows_plan) or state.mail.messages:
        return None
    acts = any(one.is_open or one.is_busy for one in state.executions.ordered)
    if acts or not state.executions.published.issuperset(state.plan.actions(state.step)):
        return None
    goals = {(goal.slot, goal.request) for goal in told}
    for atom, from_outside in state.externals.told.items():
        source, content, _ = split_term(atom)[1]
        if (from_outside or state.executions.acting(source)) and (source, content) not in goals:
            return None
    fluents = state.plan.last_fluents(state.step)
    return fluents if fluents and state.externals.can_save(fluents) else None


def _told_goals(state: State) -> List[Goal]:
    """Returns the goals of which the planner has learned since the last plan."""
    told = []
    for atom in state.externals.from_outside():
        source, content, _ = split_term(atom)[1]
        goal = state.goals.occupant(source)
        if goal is not None and goal.request == content and not goal.ended:
            told.append(goal)
    return told


def _tell_again(state: State, goals: List[Goal]) -> None:
    """Takes goals back, and queues them before all others."""
    for goal in goals:
        _take_back(state, goal)
    state.goals.queue_first(goals)


def _take_back(state: State, goal: Goal) -> None:
    """Retracts a goal's event, and frees its slot."""
    for atom in state.externals.from_outside():
        if split_term(atom)[1][:2] == [goal.slot, goal.request]:
            state.externals.note_taken_back(atom)
    state.goals.remove(goal)


def _newest(state: State) -> Optional[Goal]:
    """Returns the open goal that has come last, of those that the planner can still cancel."""
    can = [
        goal
        for goal in state.goals.open
        if not (goal.cancel_told or goal.given_up)
        and state.externals.knows([(goal.slot or "", _CANCEL)])
    ]
    return max(can, key=lambda goal: goal.came) if can else None


def _end(state: State, goal: Goal, reason: str) -> None:
    _say(state, goal, reason)
    state.goals.end(goal, Status.REJECTED, reason)


def _say(state: State, goal: Goal, reason: str) -> None:
    state.environment.warn(f"{reason}. {shorten(goal.request)} is given up")
