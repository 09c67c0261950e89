"""Goals: their statuses, their slots in the planner, and the queue of those without one."""

from __future__ import annotations

import itertools
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Callable, Deque, Dict, Iterable, List, Optional, Sequence, Tuple

from rosoclingo.loop.journal import TERMINAL_STATUSES, Reason, Status, StatusSet
from rosoclingo.loop.values.snapshot import take_over

# By kinds of feedback, the kinds that they make outdated, so that these are sent again.
_OUTDATED = {"plan": ("planning,", "no"), "no": ("why:", "plan")}


class GoalClient:
    """Callbacks to the client that has sent a goal; subclasses override the methods."""

    def noted(self, change: StatusSet) -> None:
        """Called first with a change of the status; does not wait, nor use the goal's methods."""

    def changed(self, change: StatusSet) -> None:
        """Called with the change: the goal is accepted, or has ended."""

    def feedback(self, line: str) -> None:
        """Called with a line for the goal's client."""

    @property
    def address(self) -> str:
        """The address by which another process finds the client after a crash; empty for none."""
        return ""


@dataclass(eq=False)
class GoalState:
    """Saved state of a :class:`Goal`.

    Attributes:
        id: What the client calls it.
        request: The request, a ground term as clingo prints it.
        information: What came with the request.
        slot: The planner's id for the goal, once it has one.
        status: How far the goal is.
        reason: Why it has ended.
        given_up: Why rosoclingo has canceled it by itself; empty if it has not. Such a goal ends
            aborted as soon as the planner has canceled it.
        cancel_told: Whether the planner knows that it is to be canceled.
        came: When the loop has taken it, in seconds of world time.
        is_first: Whether it gets a slot before others that came earlier; None if undecided.
        overtaken: By how many of these it was overtaken in the queue.
        expected: When it will be served, as its client was told last, in seconds of world time.
    """

    request: str
    information: Tuple[str, ...] = ()
    id: str = ""
    slot: Optional[str] = None
    status: Status = Status.PENDING
    reason: str = ""
    given_up: str = ""
    cancel_told: bool = False
    came: float = 0.0
    is_first: Optional[bool] = None
    overtaken: int = 0
    expected: Optional[float] = None
    _told: Dict[str, str] = field(default_factory=dict)  # the last line of each kind


class Goal(GoalState):
    """A request of a client, with its status.

    Used by the loop's thread, and by the callback that polls whether its search is to stop; any
    thread may call :meth:`recall`.

    Attributes:
        client: Who has sent it; another one may be set before that is told anything.
    """

    def __init__(
        self,
        request: str,
        information: Sequence[str] = (),
        identifier: str = "",
        client: Optional[GoalClient] = None,
    ) -> None:
        super().__init__(request, tuple(information), identifier)
        self.client = client or GoalClient()
        # Guards slot and status; held for moments only, and only the client's noted() runs under it
        self._lock = threading.Lock()

    @property
    def ended(self) -> bool:
        """True if the goal has ended."""
        return self.status in TERMINAL_STATUSES

    def set_status(self, status: Status, reason: str = "") -> bool:
        """Sets the status.

        A goal that succeeds was accepted before, and one that was accepted is aborted in the place
        of rejected. An ended goal stays as it is.

        Args:
            status: The status.
            reason: Text for the client.

        Returns:
            Whether this ended the goal.
        """
        if status is Status.CANCELED and self.given_up:
            status, reason = Status.ABORTED, self.given_up
        with self._lock:
            before = self.status
            if before.is_terminal or before is status:
                return False
            if before is Status.ACCEPTED and status is Status.REJECTED:
                status = Status.ABORTED
            self.status = status
            self.reason = reason if status.is_terminal else ""
        if before is Status.PENDING and status is Status.SUCCEEDED:
            self._change(Status.ACCEPTED, reason)
        self._change(status, reason)
        return status.is_terminal

    def _change(self, status: Status, reason: str) -> None:
        change = StatusSet(self.id, status, self.slot or "", reason)
        self.client.noted(change)
        self.client.changed(change)
        if status is Status.ACCEPTED:
            self.tell(status.value)

    def recall(self) -> None:
        """Cancels the goal if it has no slot yet. Thread-safe."""
        change = StatusSet(self.id, Status.CANCELED, "", Reason.RECALLED)
        with self._lock:
            if self.slot is not None or self.status is not Status.PENDING:
                return
            self.status, self.reason = change.status, change.reason
            self.client.noted(change)  # before the loop can see it
        self.client.changed(change)

    def place(self, slot: str) -> bool:
        """Gives the goal a slot, unless it has been recalled, and returns whether it was not."""
        with self._lock:
            if self.ended:
                return False
            self.slot = slot
            return True

    def tell(self, line: str, *, kind: str = "", again: bool = False) -> bool:
        """Sends a line of feedback, unless it repeats the last one of its kind.

        Args:
            line: The line.
            kind: Its kind; by default its first word.
            again: Whether it is sent in that case, too: it says something else now.

        Returns:
            Whether it was sent.
        """
        kind = kind or line.split(maxsplit=1)[0]
        for outdated in _OUTDATED.get(kind, ()):
            self._told.pop(outdated, None)
        is_new = again or self._told.get(kind) != line
        if is_new:
            self._told[kind] = line
            self.client.feedback(line)
        return is_new


@dataclass(frozen=True)
class GoalsSnapshot:
    """Saved state of :class:`Goals`.

    Attributes:
        goals: The goals that have a slot, wait for one, or are spoken of elsewhere.
        slots: Each slot, with the id of its goal.
        waiting: The ids of the goals without a slot, in order.
        some_ended: Whether a goal has ended since the last reset.
        alone: How many of the first in the queue get a slot one by one.
    """

    goals: Tuple[GoalState, ...]
    slots: Dict[str, Optional[str]]
    waiting: Tuple[str, ...]
    some_ended: bool
    alone: int = 0


class Goals:
    """All goals that have not ended, and ended ones that still have their slot.

    Only the loop's thread changes it; :meth:`occupant` may be called from others.

    Attributes:
        some_ended: Whether a goal has ended since this was last set to False.
        alone: How many of the first in the queue get a slot one by one, each with a plan of its
            own, because one of them needs too much.
    """

    def __init__(self) -> None:
        self.some_ended = False
        self.alone = 0
        self._slots: Dict[str, Optional[Goal]] = {}
        self._waiting: Deque[Goal] = deque()

    def ages(self, now: float) -> Dict[str, float]:
        """Returns how long ago goals in slots have come, by slots.

        Args:
            now: The time, in seconds of world time.
        """
        return {slot: now - goal.came for slot, goal in self._slots.items() if goal is not None}

    def snapshot(self, others: Iterable[Goal]) -> GoalsSnapshot:
        """Returns the state of all goals to save.

        Args:
            others: Goals that have come, and are not known here yet or any more.
        """
        goals = {goal.id: goal for goal in (*self._placed, *self._waiting, *others)}
        return GoalsSnapshot(
            tuple(goals.values()),
            {slot: None if goal is None else goal.id for slot, goal in self._slots.items()},
            tuple(goal.id for goal in self._waiting),
            self.some_ended,
            self.alone,
        )

    def restore(self, saved: GoalsSnapshot, client: Callable[[str], GoalClient]) -> Dict[str, Goal]:
        """Takes over the goals of a run that was interrupted.

        Args:
            saved: What was known of them.
            client: Returns who has sent a goal, by its id.

        Returns:
            All goals, by their ids.
        """
        goals = {}
        for known in saved.goals:
            goals[known.id] = goal = Goal(known.request, client=client(known.id))
            take_over(goal, known)
        slots = saved.slots.items()
        self._slots = {slot: None if key is None else goals[key] for slot, key in slots}
        self._waiting = deque(goals[key] for key in saved.waiting)
        self.some_ended = saved.some_ended
        self.alone = saved.alone
        return goals

    def set_slots(self, slots: Iterable[str], *, keep: bool = False) -> None:
        """Sets the ids that the planner has for goals, all free.

        A goal that had one is aborted: the planner that knew of it is no more.

        Args:
            slots: The ids.
            keep: Whether all stays as it is, if these are the ids that were set before.
        """
        slots = list(slots)
        if keep and slots == self.slots:
            return
        for goal in self._placed:
            self.end(goal, Status.ABORTED, "the mode has initialised the planner anew")
        self._slots = dict.fromkeys(slots)

    @property
    def slots(self) -> List[str]:
        """The ids that the planner has for goals."""
        return list(self._slots)

    @property
    def open(self) -> List[Goal]:
        """The goals that have a slot and have not ended, in the order of the slots."""
        return [goal for goal in self._placed if not goal.ended]

    @property
    def _placed(self) -> List[Goal]:
        """The goals that have a slot, in the order of the slots."""
        return [goal for goal in self._slots.values() if goal is not None]

    @property
    def queued(self) -> List[Goal]:
        """The goals without a slot that have not ended, in the order in which they get one."""
        return [goal for goal in self._waiting if not goal.ended]

    @property
    def unplaced(self) -> int:
        """How many goals have no slot, with some that were recalled."""
        return len(self._waiting)

    def occupant(self, slot: str) -> Optional[Goal]:
        """Returns the goal in a slot."""
        return self._slots.get(slot)

    def is_open(self, goal: Goal) -> bool:
        """Returns whether a goal has a slot and has not ended."""
        return goal in self.open

    def add(self, goal: Goal) -> None:
        """Puts a goal at the end of the queue."""
        self._waiting.append(goal)

    def undecided(self) -> List[Goal]:
        """Returns the goals of which it matters now whether they are first, and is not known."""
        queued, free = self.queued, list(self._slots.values()).count(None)
        if not self._slots or free >= len(queued):
            return []
        return [goal for goal in queued if goal.is_first is None]

    def decide(self, goal: Goal, *, is_first: bool) -> None:
        """Moves a goal forward in the queue if it is to get a slot before others.

        Each of the others is overtaken by as many goals as there are slots, and by no more, so
        that no client waits for ever.
        """
        goal.is_first = is_first
        place = self._waiting.index(goal)
        self._waiting.remove(goal)
        while is_first and place and self._can_be_overtaken(self._waiting[place - 1]):
            place -= 1
            self._waiting[place].overtaken += 1
        self._waiting.insert(place, goal)

    def _can_be_overtaken(self, goal: Goal) -> bool:
        return not goal.is_first and goal.overtaken < len(self._slots)

    def cancel(self, goal: Goal) -> bool:
        """Recalls a goal that has no slot yet.

        Returns:
            Whether it is up to the planner instead.
        """
        goal.recall()
        self.some_ended |= goal.reason == Reason.RECALLED
        return self.is_open(goal)

    def end(self, goal: Goal, status: Status, reason: str = "") -> None:
        """Sets a goal's status, which may end it."""
        self.some_ended |= goal.set_status(status, reason)

    @property
    def waiting(self) -> bool:
        """True if a goal has no slot."""
        while self._waiting and self._waiting[0].ended:  # recalled
            self._waiting.popleft()
        return bool(self._waiting)

    def likely_slots(self, number: int) -> List[str]:
        """Returns the slots that further goals will probably get, and the first if none is free.

        Raises:
            ValueError: The slots are not known yet.
        """
        first, *_ = self._slots
        free = [slot for slot, goal in self._slots.items() if goal is None or goal.ended]
        free = free[len(self._waiting) :][:number]
        return free + [first] * (number - len(free))

    def has_free_slot(self, next_step: bool = False) -> bool:
        """Returns whether there is a free slot, now or as soon as the next step begins."""
        return any(goal is None or (next_step and goal.ended) for goal in self._slots.values())

    @property
    def wait_for_next_step(self) -> bool:
        """True if a goal waits for a slot that becomes free with the next step."""
        return self.waiting and not self.has_free_slot() and self.has_free_slot(next_step=True)

    def queue_first(self, goals: Sequence[Goal]) -> None:
        """Puts goals without a slot in front of the queue, from where they are placed one by one.

        Args:
            goals: The goals, in their order.
        """
        self._waiting.extendleft(reversed(goals))
        self.alone = len(goals)

    def place(self) -> List[Tuple[str, Goal]]:
        """Gives the free slots to the goals that are first in the queue, and returns these.

        As long as some are placed alone, that is one goal.
        """
        placed: List[Tuple[str, Goal]] = []
        for slot in self._slots:
            while self._slots[slot] is None and self._waiting and not (placed and self.alone):
                goal = self._waiting.popleft()
                if goal.place(slot):
                    self._slots[slot] = goal
                    placed.append((slot, goal))
        return placed

    def remove(self, goal: Goal) -> None:
        """Takes a goal out of its slot."""
        if goal.slot is not None:
            self._slots[goal.slot] = None
            goal.slot = None

    @property
    def used(self) -> List[str]:
        """The slots of ended goals, which become free with the next step."""
        ended = (goal for goal in self._placed if goal.ended)
        return [goal.slot for goal in ended if goal.slot is not None]

    def free_slots(self) -> None:
        """Frees the slots of ended goals."""
        for goal in self._placed:
            if goal.ended:
                self.remove(goal)

    def tell_positions(self) -> None:
        """Tells the goals for which there is no slot their place in the queue, counted from 1."""
        free = list(self._slots.values()).count(None)
        self._waiting = deque(self.queued)  # many may have been recalled
        for place, goal in enumerate(itertools.islice(self._waiting, free, None), 1):
            goal.tell(f"queued {place}")

    def tell(self, line: str) -> List[Goal]:
        """Tells a line to all goals that have a slot and have not ended.

        Returns:
            Those for which it is new.
        """
        return [goal for goal in self.open if goal.tell(line)]

    def all_ended(self) -> bool:
        """Returns whether every slot has a goal that has ended."""
        return all(goal is not None and goal.ended for goal in self._slots.values())

    def end_waiting(self, status: Status, reason: str) -> None:
        """Ends the goals without a slot."""
        while self._waiting:
            self.end(self._waiting.popleft(), status, reason)

    def abort_all(self, reason: str) -> None:
        """Aborts every goal."""
        for goal in self._placed:
            self.end(goal, Status.ABORTED, reason)
        self.end_waiting(Status.ABORTED, reason)
