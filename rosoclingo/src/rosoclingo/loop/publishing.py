"""Publishes actions of the plan with their tokens, and aborts actions of busy actuators."""

from __future__ import annotations

from typing import List, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.errors import PlannerError
from rosoclingo.loop.atoms import Action, event
from rosoclingo.loop.journal import ActionPublished
from rosoclingo.loop.state import State
from rosoclingo.loop.words import ABORT, BUSY


def split(state: State, actions: Sequence[Action]) -> Tuple[List[Action], List[Action]]:
    """Splits actions into new ones, and those that repeat what busy actuators do.

    Raises:
        PlannerError: A busy actuator has another one.
    """
    repeated = [action for action in actions if state.acting.goes_on(action.actuator)]
    for action in repeated:
        doing = state.tokens.last[action.actuator].action
        if action.name != doing:
            raise PlannerError(
                f"the plan has {shorten(str(action))}, and {shorten(action.actuator)} is still "
                f"busy with {shorten(doing)}: an encoding that declares "
                f"#external {shorten(event(action.actuator, BUSY, state.step))} has to repeat "
                "that, after a reset too; see docs/protocol.md, Steps without a barrier"
            )
    return [action for action in actions if action not in repeated], repeated


def publish(state: State, actions: Sequence[Action]) -> None:
    """Gives actions their tokens and sends them; from then on their actuators owe answers."""
    for action in actions:
        state.tokens.begin(action)
    if actions:
        state.show_told()
    for action in actions:
        state.note_published(action)
        state.acting.begin_action(action.actuator)
        state.arrivals.begin(action, state.plan, state.environment.world_now())
        state.environment.publish(action.actuator, action.name)
        state.note(ActionPublished(action.actuator, action.name))


def publish_abort(state: State, actuator: str) -> None:
    """Tells an actuator to abort its action, once in a step; nobody answers that."""
    abort = Action(actuator, ABORT, state.step)
    if not state.is_published(abort) and not state.tokens.is_aborted(actuator):
        state.note_published(abort)
        state.tokens.abort(actuator)
        state.show_told()
        state.environment.publish(actuator, abort.name)
