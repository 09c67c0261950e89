"""Publishes actions of the plan with their tokens, and aborts actions of busy actuators."""

from __future__ import annotations

from typing import List, Sequence, Tuple

from rosclingo.errors import shorten
from rosoclingo.errors import PlannerError
from rosoclingo.loop.journal import ActionPublished
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import Action, event
from rosoclingo.loop.words import ABORT, BUSY


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
    """Gives actions their tokens and sends them; from then on their actuators owe answers."""
    for action in actions:
        state.executions.begin(action, *state.plan.lasting.get(action, ("", 0)))
    if actions:
        state.show_executions()
    for action in actions:
        state.environment.publish(action.actuator, action.name)
        state.note(ActionPublished(action.actuator, action.name))


def publish_abort(state: State, actuator: str) -> None:
    """Tells an actuator to abort its action, once in a step; nobody answers that."""
    if state.executions.abort(actuator, state.step):
        state.show_executions()
        state.environment.publish(actuator, ABORT)
