"""Publishes actions of the plan with their tokens, and aborts actions of busy actuators.

The interlock may hold actions back until an operator lets them begin, and policies may have them
tried again.
"""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.errors import PlannerError
from rosoclingo.loop.journal import ActionPublished, ActionRetried
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import Action, event
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.words import ABORT, BUSY, FAILURE, LOST, TIMEOUT

_PAUSE_AFTER_TIMEOUT = 1.0  # seconds at least, in which what is said of the attempt is dropped


def split(state: State, actions: Sequence[Action]) -> Tuple[List[Action], List[Action]]:
    """Splits actions into new ones, and those that repeat what busy actuators do.

    Raises:
        PlannerError: A busy actuator has another one.
    """
    repeated = []
    for action in actions:
        one = state.executions.acting(action.actuator)
        if one is None or not one.goes_on:
            continue
        repeated.append(action)
        if action.name != one.action:
            raise PlannerError(
                f"the plan has {shorten(str(action))}, and {shorten(action.actuator)} is still "
                f"busy with {shorten(one.action)}: an encoding that declares "
                f"#external {shorten(event(action.actuator, BUSY, state.step))} has to repeat "
                "that, after a reset too; see docs/protocol.md, Steps without a barrier"
            )
    return [action for action in actions if action not in repeated], repeated


def publish(state: State, actions: Sequence[Action]) -> None:
    """Gives actions their tokens and sends them; from then on their actuators owe answers.

    Those that the interlock holds are sent when an operator lets them. One that was held before a
    goal was cancelled, and is planned again, stays the same action.
    """
    actions = [action for action in actions if not _plan_again(state, action)]
    held = {one.actuator: one for one in state.executions.held}
    for action in actions:
        one = held.get(action.actuator)
        if one is not None and not one.is_open_to_change:  # the mode has not waited for it
            reject(state, one)
    free = [a for a in actions if state.interlock.reason(a.actuator, a.name) is None]
    for action in actions:
        lasting = state.plan.lasting.get(action, ("", 0))
        retries = state.plan.retries.get(action, (0, 0))
        state.executions.begin(action, *lasting, retries=retries, is_held=action not in free)
    send(state, [(action.actuator, action.name) for action in free])


def _plan_again(state: State, action: Action) -> bool:
    """Keeps an action of a new plan that is held already; if it was rejected, it counts as failed.

    Returns:
        Whether that is so.
    """
    if not state.executions.plan_again(action):
        return False
    if state.executions.last[action.actuator].is_rejected:
        state.mail.reject(action.actuator)
    return True


def reject(state: State, one: Execution) -> None:
    """Enters that a held action counts as failed; its actuator was not told of it."""
    state.executions.fail_held(one.actuator)
    state.mail.reject(one.actuator)


def send(state: State, actions: Sequence[Tuple[str, str]]) -> None:
    """Publishes actions that nothing holds, and what is held.

    Args:
        state: What is known.
        actions: Pairs of an actuator and its action.
    """
    if actions:
        state.interlock.note_dispatched()
        state.show_executions()
        state.watchdog.look_soon()
    state.show_held()
    for actuator, action in actions:
        state.environment.publish(actuator, action)
        state.note(ActionPublished(actuator, action))


def fail(state: State, one: Execution, answer: str) -> Optional[str]:
    """Applies the policy of an action to the answer that ends it.

    Returns:
        What the planner is told; None if the action is tried again, so that it is told nothing.
    """
    policy = state.policies.of(one.actuator, one.action)
    was_aborted, retries, pause = one.aborted, policy.retries, policy.pause
    if retries is None and answer == FAILURE:
        retries, pause = one.retries, policy.pause or one.pause
    if answer == LOST or (answer == TIMEOUT and policy.limits):
        publish_abort(state, one.actuator)  # the interface may be there nevertheless
        pause = max(pause, _PAUSE_AFTER_TIMEOUT)
    if answer not in (FAILURE, TIMEOUT):
        return answer
    if was_aborted or one.attempt > (retries or 0):
        return policy.then or answer
    state.executions.retry(one.actuator, answer, pause)
    state.watchdog.look_soon()
    state.note(ActionRetried(one.actuator, one.action, one.attempt, answer))
    state.show_executions()
    state.goals.tell(
        f"{one.actuator} {one.action}: {answer}, retry {one.attempt} of {retries}"
        + (f" in {pause:g} s" if pause else "")
    )
    return None


def publish_abort(state: State, actuator: str) -> None:
    """Tells an actuator to abort its action, once in a step; that has no answer.

    An action that is held counts as failed.
    """
    held = [one for one in state.executions.held if one.actuator == actuator]
    if held:
        reject(state, held[0])
        state.show_executions()
    elif state.executions.abort(actuator, state.step):
        state.show_executions()
        state.environment.publish(actuator, ABORT)
