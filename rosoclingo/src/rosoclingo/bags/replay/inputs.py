"""The recorded inputs, with the loop's activity when it took them. Needs no ROS.

The latter matters where a replay goes another way than the recorded run; else the loop takes the
inputs by :mod:`rosoclingo.bags.replay.input_schedule`.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import List, Set

from rosclingo.errors import TermError
from rosoclingo.bags.read.run import Run
from rosoclingo.loop import journal
from rosoclingo.loop.inputs.replay_inbox import InputKey
from rosoclingo.loop.values.atoms import canonical

_QUIET_SECONDS = 1.0  # without any event, after which a loop that has no journal has waited


class LoopActivity(enum.Enum):
    """The activity of the loop when it took an input."""

    WAITING = "waiting"
    SEARCHING = "searching"
    BUSY = "busy"  # something else, or it took another input at the same time


@dataclass(frozen=True)
class RecordedInput:
    """A recorded input.

    Attributes:
        event: What it was.
        point: What the loop was doing.
        position: How many outputs there were before it.
        command: The last command before it.
        gap: Seconds since what it followed: an output, an input or the begin of the wait.
        answers: Whether it answers an action.
        restarts: How often the node with the loop was started again before it.
    """

    event: journal.Arrival
    point: LoopActivity
    position: int
    command: str
    gap: float
    answers: bool
    restarts: int = 0

    @property
    def key(self) -> InputKey:
        """The key that identifies the input in the journal."""
        return journal.key_of(self.event)


def inputs(run: Run) -> List[RecordedInput]:
    """Returns the inputs of a run that matter, in its order.

    Those that do not are cancel requests that came too late.
    """
    found: List[RecordedInput] = []
    count = restarts = 0
    command = ""
    acting: Set[str] = set()
    ended: Set[str] = set()  # goals
    waits = False  # the loop
    has_taken = False  # an input, and has done nothing since
    last = run.entries[0].seconds if run.entries else 0.0
    for entry, output in zip(run.entries, run.outputs):
        event = entry.event
        if isinstance(event, journal.StatusSet) and event.status is not journal.Status.ACCEPTED:
            ended.add(event.goal)
        if isinstance(event, journal.CancelArrived) and event.goal in ended:
            continue
        if isinstance(event, journal.ARRIVALS):
            gap = max(0.0, entry.seconds - last)
            if not run.has_journal:  # when the loop has waited is a guess
                waits, has_taken = not found or gap >= _QUIET_SECONDS, False
            point = _point(event, waits, has_taken)
            answers = isinstance(event, journal.MessageArrived) and event.source in acting
            found.append(RecordedInput(event, point, count, command, gap, answers, restarts))
            if isinstance(event, journal.MessageArrived):
                acting.discard(event.source)
            last, has_taken = entry.seconds, True
            continue
        has_taken &= isinstance(event, (journal.MessageDropped, journal.StatusSet))
        count += output is not None
        if isinstance(event, journal.ActionPublished):
            acting.add(event.actuator)
        elif isinstance(event, journal.CommandDone):
            command, waits = event.command, False
        elif begins_a_wait(event):
            waits = True
        elif isinstance(event, journal.NodeResumed) and event.node == journal.LOOP:
            waits = False
            restarts += 1
        if output is not None or begins_a_wait(event):
            last = entry.seconds
    return found


def _point(event: journal.Arrival, waits: bool, has_taken: bool) -> LoopActivity:
    """Returns the activity of the loop when it took an input."""
    if has_taken:
        return LoopActivity.BUSY
    if waits:
        return LoopActivity.WAITING
    return LoopActivity.SEARCHING if event.seconds > 0 else LoopActivity.BUSY


def begins_a_wait(event: journal.Event) -> bool:
    """Tells if an event says that the loop begins to wait, because it is idle."""
    return isinstance(event, journal.LoopWaits) and not event.for_a_replay


def is_refused(event: journal.Event) -> bool:
    """Tells if a goal was rejected before it came to the loop, because it is no ground term."""
    if not isinstance(event, journal.GoalArrived):
        return False
    try:
        canonical(event.request)
    except TermError:
        return True
    return False
