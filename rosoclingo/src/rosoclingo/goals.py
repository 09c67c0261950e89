"""Goals: their statuses, their slots in the planner, and the queue of those without one."""

from __future__ import annotations

import enum
import itertools
from collections import deque
from typing import Deque, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple


class Stage(enum.Enum):
    """How far a goal is, as actionlib sees it."""

    PENDING = "pending"
    ACTIVE = "active"
    ENDED = "ended"


class Goal:
    """A request and how its client learns of it; subclasses say the latter.

    Only the loop's thread uses it.

    Attributes:
        request: The request, a ground term as clingo prints it.
        information: What came with the request.
        slot: The planner's id for the goal, once it has one.
        stage: How far the goal is.
        cancel_requested: Whether the client wants the goal to be cancelled.
    """

    def __init__(self, request: str, information: Sequence[str] = ()) -> None:
        self.request = request
        self.information = tuple(information)
        self.slot: Optional[str] = None
        self.stage = Stage.PENDING
        self.cancel_requested = False
        self._told: Dict[str, str] = {}  # the last line of each kind

    def set_status(self, word: str, reason: str = "") -> bool:
        """Sets the status to accepted, rejected, succeeded, canceled or aborted.

        actionlib knows no way from active to rejected, and none from pending to succeeded or
        aborted: the table says which legal ones stand for them. An ended goal stays as it is.

        Args:
            word: The status.
            reason: Text for the client.

        Returns:
            Whether this ended the goal.

        Raises:
            KeyError: There is no such status.
        """
        steps = _TRANSITIONS[word].get(self.stage, ())
        for step in steps:
            if step == "accepted":
                self.stage = Stage.ACTIVE
                self.accepted()
                self.tell("accepted")
            else:
                self.stage = Stage.ENDED
                self.ended(step, reason)
        return bool(steps) and self.stage is Stage.ENDED

    def tell(self, line: str) -> None:
        """Sends a line of feedback, unless it says what the last of its kind has said.

        Args:
            line: The line; its first word is its kind.
        """
        kind = line.split(maxsplit=1)[0]
        if self._told.get(kind) != line:
            self._told[kind] = line
            self.feedback(line)

    def accepted(self) -> None:
        """The planner has accepted the request."""

    def ended(self, word: str, reason: str) -> None:
        """The goal is rejected, succeeded, canceled or aborted."""

    def feedback(self, line: str) -> None:
        """Something about the goal has changed."""


_TRANSITIONS: Mapping[str, Mapping[Stage, Tuple[str, ...]]] = {
    "accepted": {Stage.PENDING: ("accepted",)},
    "rejected": {Stage.PENDING: ("rejected",), Stage.ACTIVE: ("aborted",)},
    "succeeded": {Stage.PENDING: ("accepted", "succeeded"), Stage.ACTIVE: ("succeeded",)},
    "canceled": {Stage.PENDING: ("canceled",), Stage.ACTIVE: ("canceled",)},
    "aborted": {Stage.PENDING: ("accepted", "aborted"), Stage.ACTIVE: ("aborted",)},
}
STATUSES = frozenset(_TRANSITIONS)


class Goals:
    """All goals that have not ended, and ended ones that still have their slot.

    Only the loop's thread changes it; :meth:`occupant` may be called from others.
    """

    def __init__(self) -> None:
        self._slots: Dict[str, Optional[Goal]] = {}
        self._waiting: Deque[Goal] = deque()

    def set_slots(self, slots: Iterable[str]) -> None:
        """Sets the ids that the planner has for goals, all free."""
        self._slots = dict.fromkeys(slots)

    @property
    def has_slots(self) -> bool:
        """Whether the planner has ids for goals."""
        return bool(self._slots)

    def is_slot(self, term: str) -> bool:
        """Whether a term is the id of a slot."""
        return term in self._slots

    def occupant(self, slot: str) -> Optional[Goal]:
        """Returns the goal in a slot."""
        return self._slots.get(slot)

    def add(self, goal: Goal) -> None:
        """Puts a goal at the end of the queue."""
        self._waiting.append(goal)

    def cancel(self, goal: Goal) -> bool:
        """Recalls a goal that has no slot yet.

        Returns:
            Whether it is up to the planner instead.
        """
        goal.cancel_requested = True
        if goal.slot is not None:
            return goal.stage is not Stage.ENDED
        if goal.stage is Stage.PENDING:
            self._waiting = deque(other for other in self._waiting if other is not goal)
            goal.set_status("canceled", "recalled before it had a slot")
        return False

    @property
    def waiting(self) -> bool:
        """Whether a goal has no slot."""
        return bool(self._waiting)

    def has_free_slot(self, next_step: bool = False) -> bool:
        """Whether there is a free slot, now or as soon as the next step begins."""
        return any(
            goal is None or (next_step and goal.stage is Stage.ENDED)
            for goal in self._slots.values()
        )

    def place(self) -> List[Goal]:
        """Gives the free slots to the goals that have waited longest, and returns these."""
        placed = []
        for slot, occupant in self._slots.items():
            if occupant is None and self._waiting:
                goal = self._waiting.popleft()
                goal.slot = slot
                self._slots[slot] = goal
                placed.append(goal)
        return placed

    def remove(self, goal: Goal) -> None:
        """Takes a goal out of its slot."""
        if goal.slot is not None:
            self._slots[goal.slot] = None

    def free_slots(self) -> None:
        """Frees the slots of ended goals."""
        for goal in list(self._slots.values()):
            if goal is not None and goal.stage is Stage.ENDED:
                self.remove(goal)

    def tell_positions(self) -> None:
        """Tells the goals for which there is no slot their place in the queue, counted from 1."""
        free = list(self._slots.values()).count(None)
        for place, goal in enumerate(itertools.islice(self._waiting, free, None), 1):
            goal.tell(f"queued {place}")

    def tell(self, line: str) -> None:
        """Tells a line to all goals that have a slot and have not ended."""
        for goal in self._slots.values():
            if goal is not None and goal.stage is not Stage.ENDED:
                goal.tell(line)

    def all_ended(self) -> bool:
        """Whether every slot has a goal that has ended."""
        return all(goal is not None and goal.stage is Stage.ENDED for goal in self._slots.values())

    def end_waiting(self, word: str, reason: str) -> None:
        """Ends the goals without a slot."""
        while self._waiting:
            self._waiting.popleft().set_status(word, reason)

    def end_all(self, word: str, reason: str) -> None:
        """Ends every goal."""
        for goal in self._slots.values():
            if goal is not None:
                goal.set_status(word, reason)
        self.end_waiting(word, reason)
