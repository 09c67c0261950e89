"""Saves a loop between two steps, and goes on with another one, as a store does."""

from __future__ import annotations

from typing import Callable, Dict

from rosoclingo.loop.loop import Loop, LoopSnapshot
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.snapshot import decode, encode


def snapshot_of(loop: Loop) -> str:
    """Returns all that a loop knows, as JSON."""
    return encode(LoopSnapshot(loop._controller.snapshot(), loop.state.snapshot()))


def resume(loop: Loop, saved: str, client: Callable[[str], GoalClient]) -> Dict[str, Goal]:
    """Has a loop go on where another one was, whose planner it has.

    Args:
        loop: The loop, which is not prepared.
        saved: The snapshot of the other one.
        client: Returns who has sent a goal, by its id.

    Returns:
        All goals, by their ids.
    """
    snapshot = decode(LoopSnapshot, saved)
    loop._controller.restore(snapshot.controller)
    return loop.state.restore(snapshot.state, client)
