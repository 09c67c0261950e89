"""The inbox: a thread-safe queue of inputs, which the loop's thread takes."""

from __future__ import annotations

import threading
import time
from collections import deque
from contextlib import nullcontext
from dataclasses import dataclass
from typing import Callable, ContextManager, Deque, List, Optional, Sequence, Set, Union

from rosoclingo.loop.journal import (
    AnswerArrived,
    Arrival,
    CancelArrived,
    ControlArrived,
    Event,
    GoalArrived,
    MessageArrived,
    Status,
)
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.recorded import Recorded


@dataclass(frozen=True)
class Cancel:
    """A request to cancel a goal."""

    goal: Goal


Taken = Union[MessageArrived, Goal, Cancel, ControlArrived]
"""What the loop takes."""

Item = Union[Taken, AnswerArrived]
"""What comes; an answer is taken as a message."""


def arrival_of(item: Item) -> Union[Arrival, AnswerArrived]:
    """Returns the value of an input, without what the process knows of its goal."""
    if isinstance(item, Goal):
        return GoalArrived(item.id, item.request, item.information)
    return CancelArrived(item.goal.id) if isinstance(item, Cancel) else item


def item_of(event: Event, goals: Callable[[str], Optional[Goal]]) -> Optional[Item]:
    """Returns the input of which :func:`arrival_of` has returned the value.

    Args:
        event: The value.
        goals: Returns a goal by its id, None if it is of no interest any more.

    Returns:
        None if it is of such a goal.
    """
    if isinstance(event, (GoalArrived, CancelArrived)):
        goal = goals(event.goal)
        return Cancel(goal) if goal is not None and isinstance(event, CancelArrived) else goal
    assert isinstance(event, (MessageArrived, AnswerArrived, ControlArrived))
    return event


_LONGEST_REACTION = 0.2  # seconds


class DurableInputs:
    """Port for inputs that outlast the process; this class stores none. Thread-safe."""

    def receiving(self, items: Sequence[Item], end: Optional[str]) -> ContextManager[object]:
        """Stores inputs together, which are added to the inbox in the context that is returned.

        Args:
            items: The inputs, in order.
            end: Why the loop has ended, if it has.

        Raises:
            StoreError: They cannot be stored, and none is to be added.
        """
        return nullcontext()

    def together(self) -> ContextManager[object]:
        """A context in which all that this thread tells goals leaves together, at its end."""
        return nullcontext()

    def took(self, items: Sequence[Item]) -> None:
        """Called by the loop's thread when it has taken inputs, which the next commit removes."""

    def flush(self) -> None:
        """Called by it when it polls: lets out effects that need no commit, such as feedback."""

    def about_to_wait(self) -> None:
        """Called by it before it waits, or does something that may last."""


MOST_QUEUED = 100
"""So many goals without a slot the loop takes; the others stay in the inbox."""

_MOST_ENDED = 256  # goals that have ended in the inbox, and are taken at once


class Inbox:
    """A queue that any thread fills and the loop's thread empties. Thread-safe.

    Goals beyond :data:`MOST_QUEUED` are in a backlog, in order, until the loop makes room for them:
    what the loop does in a step must not grow with their number. All other inputs pass them, but
    for cancel requests of these goals, which have recalled them already.

    Attributes:
        durability: What stores inputs before anybody sees them.
        recorded: What a replay dictates besides inputs.
        improves: Whether a better plan is looked for while nothing comes, as long as that takes.
        pause_background_work: Callback that pauses background work on this machine: the loop's
            thread calls it with true when an input has come that it waited for, and with false
            when it waits again, or takes longer than a reaction does.
    """

    def __init__(self) -> None:
        self.durability = DurableInputs()
        self.recorded = Recorded()
        self.improves = True
        self.pause_background_work: Callable[[bool], None] = lambda _: None
        self._reacting_since: Optional[float] = None
        self._changed = threading.Condition()  # guards the other fields; held for moments only
        self._items: List[Item] = []
        self._room = MOST_QUEUED  # for goals in the items
        self._backlog: Deque[Item] = deque()
        self._in_backlog: Set[Goal] = set()
        self._callbacks: List[Callable[[], None]] = []
        self._closed = False
        self._end: Optional[str] = None

    def put(self, *items: Item) -> None:
        """Adds items, all or none; after the end of the loop, a goal is rejected instead.

        Raises:
            StoreError: They cannot be stored, and are not added.
        """
        with self.durability.receiving(items, self._end):
            for item in items:
                self.add(item)

    def add(self, item: Item) -> None:
        """Does the same with an item that is stored already; returns at once."""
        with self._changed:
            if self._end is None:
                if self._belongs_to_backlog(item):
                    self._backlog.append(item)
                else:
                    self._items.append(item)
                self._changed.notify_all()
                return
        if isinstance(item, Goal):
            item.set_status(Status.REJECTED, self._end)

    def _belongs_to_backlog(self, item: Item) -> bool:
        if isinstance(item, Cancel):
            return item.goal in self._in_backlog
        if isinstance(item, Goal):
            if self._backlog or self._room <= 0:
                self._in_backlog.add(item)
                return True
            self._room -= 1
        return False

    def make_room(self, goals: int) -> None:
        """Says how many goals the loop takes; called by its thread, before it takes them.

        Args:
            goals: So many that are open, those that have come included.
        """
        if not (self._backlog or self._items):  # what comes now is not missed: it has room
            self._room = goals
            return
        with self._changed:
            self._room = goals - sum(isinstance(item, Goal) for item in self._items)
            ended = 0
            while self._backlog_has_room and ended < _MOST_ENDED:
                item = self._backlog.popleft()
                if isinstance(item, Goal):
                    self._in_backlog.discard(item)
                    ended += item.ended
                    self._room -= not item.ended
                self._items.append(item)

    @property
    def _backlog_has_room(self) -> bool:
        if not self._backlog:
            return False
        first = self._backlog[0]
        return self._room > 0 or not isinstance(first, Goal) or first.ended

    @property
    def backlog(self) -> int:
        """How many goals are in the backlog."""
        return len(self._in_backlog)

    def cancel(self, *goals: Goal) -> None:
        """Adds cancel requests; goals without a slot are recalled at once.

        Raises:
            StoreError: They cannot be stored, and are not added.
        """
        items = [Cancel(goal) for goal in goals]
        with self.durability.receiving(items, self._end):
            for item in items:
                if self.recalls_at_once(item):
                    item.goal.recall()  # now: the loop may be busy for long
                self.add(item)

    def recalls_at_once(self, item: Cancel) -> bool:
        """Returns whether a cancel request recalls its goal when it comes."""
        return True

    def call_soon(self, function: Callable[[], None]) -> bool:
        """Schedules a callback on the loop's thread, which runs it when it polls the inbox next.

        It polls between two commands, while it waits, and in a search, and never while it changes
        what it knows. That is no news for the controller, and does not end a search.

        Args:
            function: Called once; does not wait, and raises nothing.

        Returns:
            Whether it will; not after the end of the loop.
        """
        with self._changed:
            if self._end is None:
                self._callbacks.append(function)
                self._changed.notify_all()
            return self._end is None

    def run_callbacks(self) -> None:
        """Calls the functions of :meth:`call_soon`; called by the loop's thread."""
        since = self._reacting_since
        if since is not None and time.monotonic() - since > _LONGEST_REACTION:
            self._end_reaction()
        if self._callbacks:
            with self._changed:
                callbacks, self._callbacks = self._callbacks, []
            for function in callbacks:
                function()

    def close(self) -> None:
        """Requests the end of the loop."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """True if the loop is to end."""
        return self._closed

    def begin_decision(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Called before the controller decides; a replay's inbox may wait.

        Args:
            waits: To be called if it does.
            take: To be called if it has an operator's request, since what it waits for may follow
                from that; or if a search for a better plan comes before what it waits for.
        """

    def begin_command(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Called before a command that was decided is carried out; a replay's inbox may wait."""

    def begin_end(self, waits: Callable[[], None]) -> None:
        """Called before the loop ends; a replay's inbox may wait."""

    def stays_quiet(self, seconds: float) -> bool:
        """Waits for some seconds, and returns whether nothing has come."""
        with self._changed:
            return not self._changed.wait_for(self._has_something, seconds)

    def take(self, *, controls: bool = True) -> List[Item]:
        """Returns all items in order of arrival and removes them; does not wait.

        Args:
            controls: Whether an operator's requests are taken, too.
        """
        self.run_callbacks()
        if not self._items:
            return []
        with self._changed:
            items, self._items = self._items, []
            if not controls:
                self._items = [item for item in items if isinstance(item, ControlArrived)]
                items = [item for item in items if not isinstance(item, ControlArrived)]
        return items

    @property
    def has_controls(self) -> bool:
        """Tells if an operator's request waits; in a replay, one that was not recorded."""
        return any(isinstance(item, ControlArrived) for item in list(self._items))

    @property
    def may_hold(self) -> bool:
        """True if the loop may leave inputs in the inbox; in a replay, the recording decides."""
        return True

    def waiting(self) -> List[Item]:
        """Returns the items that are not taken yet, in order of arrival; leaves them there."""
        with self._changed:
            return list(self._items)

    def end(self, reason: str) -> None:
        """Closes the queue, as the loop has ended: it takes those that are there, and no others."""
        self._end_reaction()
        with self._changed:
            self._end = reason
            self._items += self._backlog
            self._backlog.clear()
            self._in_backlog.clear()

    def wait(self, timeout: float) -> bool:
        """Waits until there is an item or a callback, or the inbox is closed.

        Args:
            timeout: Longest time to wait, in seconds.

        Returns:
            Whether one of these is the case.
        """
        if not self._items:
            self._end_reaction()
        with self._changed:
            has_something = self._changed.wait_for(self._has_something, timeout)
        if self._items and self._reacting_since is None:
            self._reacting_since = time.monotonic()
            self.pause_background_work(True)
        return has_something

    def _end_reaction(self) -> None:
        if self._reacting_since is not None:
            self._reacting_since = None
            self.pause_background_work(False)

    def _has_something(self) -> bool:
        return bool(self._items or self._callbacks or self._closed or self._backlog_has_room)
