"""Finds the goals for which actions are done: those whose slots they name.

The action ``pick(1)`` is done for the goal in slot 1. See docs/protocol.md, section "Served goals".

>>> goals = Goals()
>>> goals.set_slots(["1", "2"])
>>> goals.add(Goal("dish(t3)", identifier="a"))
>>> _ = goals.place()
>>> [served] = ServedGoals().update([Execution(7, 1, "robot", "pick(1)")], goals)
>>> served.number, served.slot, served.request, served.goal_id
(7, '1', 'dish(t3)', 'a')
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Sequence, Tuple

from rosclingo.wire.term_text import split_term
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, Goals


@dataclass(frozen=True)
class ServedGoal:
    """A goal for which an action is done.

    Attributes:
        number: The number of the action's token.
        slot: The goal's slot, which the action names.
        request: The goal's request.
        goal_id: The goal's id.
        information: What the client has sent with the request.
    """

    number: int
    slot: str
    request: str
    goal_id: str
    information: Tuple[str, ...] = ()


class ServedGoals:
    """The served goals of the last actions, as they were when each of these was dispatched.

    Used by the loop's thread.
    """

    def __init__(self) -> None:
        self._known: Dict[int, Tuple[ServedGoal, ...]] = {}  # by the numbers of tokens

    def update(
        self, executions: Sequence[Execution], goals: Goals, *, is_resumed: bool = False
    ) -> List[ServedGoal]:
        """Returns the goals that executions serve.

        Args:
            executions: The last ones that were dispatched; older ones are forgotten.
            goals: All goals.
            is_resumed: Whether the run has just been resumed, so that a slot that was named may
                have another goal now.
        """
        known: Dict[int, Tuple[ServedGoal, ...]] = {}
        for one in executions:
            if one.number in self._known:
                known[one.number] = self._known[one.number]
                continue
            named = [(slot, goals.occupant(slot)) for slot in dict.fromkeys(_names(one))]
            known[one.number] = tuple(
                ServedGoal(one.number, slot, goal.request, goal.id, goal.information)
                for slot, goal in named
                if goal is not None and not (is_resumed and _is_later(goal, one))
            )
        self._known = known
        return [goal for served in known.values() for goal in served]


def _names(one: Execution) -> List[str]:
    """Returns the arguments of an action, some of which may be slots."""
    return split_term(one.action)[1]


def _is_later(goal: Goal, one: Execution) -> bool:
    return goal.came > one.world_began
