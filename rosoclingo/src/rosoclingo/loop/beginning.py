"""Initialises the planner, and re-initialises it from what held after a step."""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

from rosclingo.wire.term_text import last_number
from rosoclingo.errors import PlannerError
from rosoclingo.loop.journal import Status
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import event
from rosoclingo.loop.values.ids import why_no_slot


def begin(state: State, slots: Sequence[str]) -> None:
    """Resets the loop's state when the planner is initialised.

    Args:
        state: What is known.
        slots: The ids that the planner has for goals.

    Raises:
        PlannerError: One of them cannot be the id of a slot.
    """
    if state.mail.dynamic:
        for reason in filter(None, map(why_no_slot, slots)):
            raise PlannerError(reason)
    again = state.take_beginning()
    is_again = again is not None
    state.goals.set_slots(slots, keep=is_again)
    state.externals.begin(state.goals.slots)
    state.mail.begin(keep=is_again)
    state.executions.initialize(keep=is_again)
    if state.mail.dynamic and not state.goals.slots:
        state.mail.rejection = (
            "the planner's encoding has no slots for goals, rslot(ID); is a library missing, such "
            "as actions.lp?"
        )
        state.goals.end_waiting(Status.REJECTED, state.mail.rejection)
    state.begin_steps()
    state.durations.told.clear()
    state.free_slots()
    if again:
        state.externals.make_true(again)


def can_begin_again(state: State) -> bool:
    """Whether the planner can begin again with what it knew before the current step."""
    can = state.mail.dynamic and state.planned >= 0 and state.externals.can_be_saved()
    return can and bool(_known(state))


def begin_again(state: State) -> None:
    """Restarts the mode, and re-initialises the planner from before the current step.

    Goals stay as they are; those that came in this step are told again.
    """
    again = _known(state)
    for goal in state.goals.open:
        for content in (goal.request, "cancel"):
            if state.externals.is_true(event(goal.slot or "", content, state.step)):
                again.append(event(goal.slot or "", content, 0))
    state.begin_with(again)
    state.begin_mode()


def _known(state: State) -> List[str]:
    """Returns the fluents before the current step, as saved events."""
    if state.step == 0:
        return state.externals.saved
    return [event("save", fluent, 0) for fluent in _fluents(state, state.step - 1)]


def _fluents(state: State, step: int) -> List[str]:
    """Returns the fluents that hold in a step of the plan.

    An encoding that is told its events shows that only for the step of the search. After it
    there may be steps without actions, which change nothing.
    """
    if state.planner.demand.tells:
        return state.plan.last_fluents(step)
    return state.plan.fluents(step)


def known_to_hold(state: State) -> Optional[Tuple[int, List[str]]]:
    """Returns the last passed step whose fluents are known, with these.

    Returns:
        None if that is not known, or could not be told by events ``event(save,F,0)``.
    """
    if not state.shows_plan:
        return None
    new = (last_number(atom) or 0 for atom in state.externals.told)
    step = min([state.step, *new]) - 1
    if state.planner.demand.tells:
        step = state.plan.last_shown(step)
    fluents = state.plan.fluents(step)
    if not fluents or not state.externals.can_save(fluents):
        return None
    return step, fluents


def reset(state: State, step: int) -> None:
    """Resets: makes the fluents of a step the initial ones, and forgets the past."""
    if not state.externals.reset(_fluents(state, step)) and not state.has_warned("reset"):
        _warn_of_forgetting(state, step)
    state.planner.note_reset(step)
    state.executions.reset()
    state.free_slots()
    state.goals.some_ended = False
    state.forget_steps()


def _warn_of_forgetting(state: State, step: int) -> None:
    if not state.externals.can_be_saved():
        lacks = "its encoding declares no #external event(save,F,0)"
    elif not _fluents(state, step):
        if state.plan.last_shown(step) >= 0 or not state.plan.actions_from(0):
            return  # it may be that nothing holds
        lacks = f"its answer set shows no holds(F,{step})"
    else:
        lacks = "its encoding declares #external event(save,F,0) for other fluents than hold"
    state.warn_once(
        "reset",
        f"a reset keeps nothing of what the planner knows, because {lacks}: for the planner, "
        "all is as in the beginning again, wherever the robot is; a mode recording needs no "
        "reset",
    )
