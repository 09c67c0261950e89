"""Carries out an operator's requests: lets held actions begin, holds them back, or rejects them.

A request names an actuator, an action and its token, or leaves some of them out. When it is taken,
it is checked against what is held then. So each request has an outcome, which says what became of
it: of an approval and a rejection of the same action at once, one is refused.
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Optional, Sequence

from rosclingo.errors import shorten
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.loop import beginning
from rosoclingo.loop.journal import (
    OWN_CONTROLS,
    ActionWithdrawn,
    Control,
    ControlArrived,
    ControlOutcome,
)
from rosoclingo.loop.publishing import publish_abort, reject, send
from rosoclingo.loop.state import State
from rosoclingo.loop.values.execution import Execution, HoldReason
from rosoclingo.loop.words import INFO

_OF_ACTION = (Control.APPROVE, Control.REJECT)
_OF_ACTUATOR = (Control.HOLD, Control.RELEASE)
_NO_APPROVAL = {
    HoldReason.HOLD: "its actuator is on hold (~release)",
    HoldReason.PAUSE: "the run is paused (~resume)",
}


def control(state: State, request: ControlArrived, seconds: float) -> bool:
    """Carries out an operator's request, and answers it.

    Args:
        state: What is known.
        request: The request.
        seconds: How long the command takes that is carried out meanwhile; 0 between commands.

    Returns:
        Whether that is news for the mode.
    """
    held = _meant(state, request)
    refused = _refusal(state, request, held)
    noted = replace(request, seconds=seconds, refused=refused or "")
    if len(held) == 1 and request.control in _OF_ACTION:
        (one,) = held
        noted = replace(noted, actuator=one.actuator, action=one.action, token=one.number)
    state.note(noted)
    if refused is not None:
        state.environment.answer_control(request, ControlOutcome(False, refused))
        return False
    is_news = _apply(state, request, held)
    begun = let_go(state)
    text = _outcome(state, request, held, begun)
    if request.control not in OWN_CONTROLS:
        state.environment.info(f"{noted.words}: {text}")
        if request.control is Control.REJECT:
            state.goals.tell(f"an operator has {text}")
    state.environment.answer_control(request, ControlOutcome(True, text))
    return is_news


def let_go(state: State) -> List[Execution]:
    """Has the actions begin that nothing holds any more, and returns them."""
    free = [one for one in state.executions.held if state.hold_reason(one) is None]
    for one in free:
        state.executions.dispatch(one.actuator)
    send(state, [(one.actuator, one.action) for one in free])
    return free


def take_back(state: State) -> None:
    """Lets the next plan do without held actions, since a goal is cancelled.

    The planner is no longer told that it is committed to that, and leaves out what no goal needs.
    Where events are facts, it begins again with what it knew before the step, if nothing else has
    happened in that. What is left counts as failed if it serves none but cancelled goals.
    """
    executions, planner = state.executions, state.planner
    planner.end_avoiding()  # what has come since may need it
    if not executions.held:
        return
    if not planner.events_are_facts:
        opened = executions.open_to_change()
        for action in opened:
            state.externals.take_back(action.commit)
        if planner.quality is None:  # else a plan has no action that serves nothing
            for action in opened:
                steps = [n for n in sorted(state.externals.grounded) if n >= action.step]
                planner.avoid(action, steps, lambda: state.mail.inbox.closed)
    elif _is_all_held(state) and beginning.can_begin_again(state):
        executions.open_to_change()
        beginning.begin_again(state)
        return
    for one in executions.held:
        if not (one.is_open_to_change or one.pauses) and _serves_cancelled(state, one):
            reject(state, one)


def _is_all_held(state: State) -> bool:
    """True if nothing but holding actions has happened in the current step."""
    of_step = [one for one in state.executions.ordered if one.acts]
    if not all(one.is_held and one.is_open and not one.goes_on for one in of_step):
        return False
    slots = (*state.goals.slots, "commit", INFO)
    happened = [atom for atom in state.externals.true if last_number(atom) == state.step]
    return state.step > 0 and all(split_term(atom)[1][0] in slots for atom in happened)


def _serves_cancelled(state: State, one: Execution) -> bool:
    """Returns whether an action names a cancelled goal, or all goals are cancelled."""
    cancelled = {goal.slot for goal in state.goals.open if goal.cancel_told}
    is_all = all(goal.cancel_told for goal in state.goals.open)
    return is_all or not cancelled.isdisjoint(split_term(one.action)[1])


def withdraw(state: State, step: int) -> None:
    """Forgets held actions that the plan after a cancel request does without.

    One whose planner has begun again, and so has other steps, may be the next of its actuator.

    Args:
        state: What is known.
        step: The step whose actions were just published.
    """
    state.planner.end_avoiding()
    ahead = state.plan.actions_from(step)
    for one in [one for one in state.executions.ordered if one.is_open_to_change]:
        following = next((each for each in ahead if each.actuator == one.actuator), None)
        if not one.acts and following is not None and following.name == one.action:
            continue
        state.executions.withdraw(one.actuator)
        state.note(ActionWithdrawn(one.actuator, one.action))
        state.goals.tell(f"withdrawn: {one.actuator} {one.action}")
    let_go(state)


def _meant(state: State, request: ControlArrived) -> List[Execution]:
    """Returns the held actions that a request may be for."""
    return [
        one
        for one in state.executions.held
        if request.actuator in ("", one.actuator)
        and request.action in ("", one.action)
        and request.token in (0, one.number)
    ]


def _refusal(state: State, request: ControlArrived, held: Sequence[Execution]) -> Optional[str]:
    """Returns why a request is refused; None if it is carried out."""
    if not state.mail.dynamic:
        return "the loop has ended, or its mode is static: it publishes a whole plan"
    names_action = request.control in _OF_ACTUATOR and (request.action or request.token)
    if held or not (names_action or request.control in _OF_ACTION):
        return None
    comes = request.control is Control.HOLD and _is_planned(state, request)
    return None if comes else _why_not_held(state, request)


def _is_planned(state: State, request: ControlArrived) -> bool:
    """Returns whether an action is planned that is not committed yet, so that it has no token."""
    named = (request.actuator, request.action)
    ahead = [one for one in state.ahead() if one not in state.executions.published]
    return not request.token and any((one.actuator, one.name) == named for one in ahead)


def _why_not_held(state: State, request: ControlArrived) -> str:
    """Returns why the action that a request names is not held."""
    token = str(request.token or "")
    of = f" of {shorten(request.actuator)}" if request.actuator else ""
    name = "".join(f" {one}" for one in (shorten(request.action), token) if one)
    nothing = f"no action{name}{of} is held"
    for one in state.executions.ordered:
        if request.actuator not in ("", one.actuator) or request.action not in ("", one.action):
            continue
        named = f"{shorten(one.action)} of {shorten(one.actuator)}"
        if request.token not in (0, one.held_as):
            if one.is_held and one.is_open and not one.is_rejected:
                return f"{nothing} any more; {named} is held as {one.number}"
        elif one.is_rejected:
            return f"{nothing} any more: {named} was rejected"
        elif one.is_open and not one.is_held:
            how = "was approved, and has begun" if one.is_approved else "has begun"
            return f"{nothing}{' any more' if one.held_as else ''}: {named} {how}"
        elif one.held_as and not one.is_held:
            return f"{nothing} any more: {named} has begun, and is answered"
    return nothing


def _apply(state: State, request: ControlArrived, held: Sequence[Execution]) -> bool:
    """Changes what a request is for; returns whether that is news for the mode."""
    word, actuator, executions = request.control, request.actuator, state.executions
    if word is Control.REJECT:
        is_news = False
        for one in held:
            executions.reject(one.actuator, state.ask_again)
            if not one.is_open_to_change:  # else the next plan says whether it is planned at all
                is_news |= state.mail.reject(one.actuator)
        state.watchdog.look_soon()
        return is_news
    if word is Control.APPROVE:
        for one in held:
            executions.approve(one.actuator)
            executions.end_pause(one.actuator)
    elif word is Control.RETRY:
        executions.end_pause(actuator)
    elif word is Control.ASK:
        executions.rejected.pop((actuator, request.action), None)
    else:
        state.interlock.apply(word, actuator)
    if word is Control.HALT:
        for one in executions.dispatched:
            if one.acts and one.is_open:
                publish_abort(state, one.actuator)
    return False


def _outcome(
    state: State, request: ControlArrived, held: Sequence[Execution], begun: Sequence[Execution]
) -> str:
    """Returns what has followed from a request, in words."""
    word, have_begun = request.control, {one.actuator for one in begun}
    if word is Control.REJECT:
        return f"rejected {_named(held)}: that counts as failed, and the planner plans anew"
    said = [f"begun: {_named(begun)}"] if begun else []
    if word is Control.APPROVE:
        said = [_approval(state, one, has_begun=one.actuator in have_begun) for one in held]
    elif word in (Control.PAUSE, Control.HOLD):
        acting = [one for one in state.executions.dispatched if one.acts and one.is_open]
        acting = [one for one in acting if one.actuator not in have_begun]
        going = [one for one in acting if request.actuator in ("", one.actuator)]
        said += [f"goes on to its end: {_named(going)}"] if going else []
    elif not begun and word in (Control.STEP, Control.RESUME, Control.RELEASE):
        said = ["no action was held only by that"]
    return "; ".join(said)


def _approval(state: State, one: Execution, *, has_begun: bool) -> str:
    """Returns what has followed from the approval of an action."""
    if has_begun:
        return f"approved, and has begun: {_named([one])}"
    reason = state.hold_reason(state.executions.last[one.actuator])
    why = _NO_APPROVAL.get(reason, str(reason)) if reason is not None else "it is planned anew"
    return f"approved, and does not begin yet: {_named([one])}; {why}"


def _named(held: Sequence[Execution]) -> str:
    return ", ".join(f"{shorten(one.action)} of {shorten(one.actuator)}" for one in held)
