"""Validates a fleet's journal: tells the validator of mailbots what the planning loop has noted."""

from __future__ import annotations

from typing import Dict, List, Sequence, Set, Tuple

from rosoclingo.loop.journal import (
    ActionPublished,
    CancelArrived,
    Event,
    GoalArrived,
    MessageArrived,
    PlanFound,
    Reason,
    Status,
    StatusSet,
)
from rosoclingo_aspprograms.validator import Map, Validator, arguments


class JournalValidator:
    """Replays a journal on the map. One thread at a time.

    Attributes:
        validator: Has the violations.
        slots: The goals of the slots, also of those that are not accepted yet.
    """

    def __init__(self, graph: Map) -> None:
        """Starts before the first event.

        Args:
            graph: The map, with the robots.
        """
        self.validator = Validator(graph)
        self.slots: Dict[str, str] = {}
        self._recalled: Set[str] = set()  # goals that have ended before the loop takes them
        self._new: Dict[str, List[str]] = {}  # goals of no known slot: origin and destination
        self._plan: Tuple[str, ...] = ()

    def learns(self, event: Event) -> None:
        """The journal has one more event."""
        if isinstance(event, GoalArrived):
            if event.goal in self._recalled:
                self._recalled.discard(event.goal)  # it is over
                return
            self.validator.request(event.goal, event.request)
            terms = arguments(event.request, "bring")
            if len(terms) >= 2:
                self._new[event.goal] = terms[:2]
        elif isinstance(event, CancelArrived):
            if event.goal in self.validator.goals:
                self.validator.cancel(event.goal)
        elif isinstance(event, PlanFound):
            self._plan = event.actions
        elif isinstance(event, ActionPublished):
            for slot in arguments(event.action, "pickup"):
                self._find_slot(event.actuator, slot)
            self.validator.action(event.actuator, event.action)
        elif isinstance(event, MessageArrived):
            self.validator.message(event.source, event.value)
        elif isinstance(event, StatusSet):
            self._set_status(event)

    def forget(self, goal: str) -> None:
        """Forgets a goal that has ended, so that a run of any length takes no more memory."""
        self.validator.goals.pop(goal, None)

    def _set_status(self, event: StatusSet) -> None:
        if event.reason == Reason.RECALLED:
            if event.goal not in self.validator.goals:
                self._recalled.add(event.goal)
                return
            self.validator.cancel(event.goal)  # which the loop has not taken yet
        if event.goal not in self.validator.goals:
            return  # one that was forgotten
        self.validator.status(event.goal, event.status.value, event.slot or None)
        self._new.pop(event.goal, None)
        if event.status is Status.ACCEPTED:
            self.slots[event.slot] = event.goal
        else:
            self.slots.pop(event.slot, None)

    def _find_slot(self, robot: str, slot: str) -> None:
        """Finds out whose slot it is: a robot may pick a package up before its goal is accepted.

        That is said at the end of the step. Until then it is the oldest new goal whose package is
        where the robot is, and if there are several, one that is to go where the plan delivers it.
        """
        if slot in self.slots or robot not in self.validator.positions:
            return
        here, there = self.validator.positions[robot], self._where_delivered(robot, slot)
        near = [goal for goal, (origin, _) in self._new.items() if origin == here]
        near.sort(key=lambda goal: self._new[goal][1] != there)
        for goal in near[:1]:
            del self._new[goal]
            self.slots[slot] = goal
            self.validator.place(goal, slot)

    def _where_delivered(self, robot: str, slot: str) -> str:
        """Returns where a robot is before its delivery in the plan; empty if that is unknown."""
        here = ""
        steps: List[Sequence[str]] = [arguments(action, "do") for action in self._plan]
        for actuator, action, _ in sorted(steps, key=lambda step: int(step[2])):
            if actuator == robot and action == f"deliver({slot})":
                return here
            if actuator == robot:
                here = "".join(arguments(action, "go")) or here
        return ""
