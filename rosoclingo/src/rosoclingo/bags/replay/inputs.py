"""The recorded inputs, with what the loop was doing when it took them. Needs no ROS."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import List, Sequence, Set, Tuple

from rosoclingo.bags.compare.outputs import INPUTS, Output, Reader
from rosoclingo.bags.model import Entry
from rosoclingo.loop.journal import FOR_A_REPLAY, Event

_QUIET_SECONDS = 1.0  # of a bag without a journal: so long without any event, and the loop waits

Key = Tuple[str, str, str]
"""What identifies an input or an output, whenever it comes."""


class Point(enum.Enum):
    """What the loop was doing when it took an input."""

    WAITING = "waiting"
    SEARCHING = "searching"
    BUSY = "busy"  # something else, or it took another input at the same time


@dataclass(frozen=True)
class Input:
    """A recorded input.

    Attributes:
        event: What it was.
        point: What the loop was doing.
        before: The outputs since the input before.
        position: How many outputs there were before it in all.
        command: The last command before it.
        gap: Seconds since what it followed: an output, an input or the begin of the wait.
        answers: Whether it answers an action.
    """

    event: Event
    point: Point
    before: Tuple[Output, ...]
    position: int
    command: str
    gap: float
    answers: bool

    @property
    def key(self) -> Key:
        """What identifies it in the journal."""
        return input_key(self.event)


def inputs(entries: Sequence[Entry], has_journal: bool = True) -> List[Input]:
    """Returns the inputs of a tidy journal that matter, in its order.

    Those that do not are cancel requests that came too late.

    Args:
        entries: The journal.
        has_journal: Whether there was one; else what the loop was doing is inferred from how long
            nothing had happened.
    """
    found: List[Input] = []
    reader = Reader(has_journal)
    before: List[Output] = []
    count = 0
    command = ""
    acting: Set[str] = set()
    ended: Set[str] = set()  # goals
    waits = False
    together = False  # the loop has done nothing since the input before
    last = entries[0].seconds if entries else 0.0
    for entry in entries:
        event = entry.event
        if event.kind == "status" and event.text != "accepted":
            ended.add(event.id)
        if event.kind == "cancel" and event.id in ended:
            continue
        if event.kind in INPUTS:
            if not has_journal:
                waits = not found or entry.seconds - last >= _QUIET_SECONDS
                together = False
            if waits and not together:
                point = Point.WAITING
            else:
                is_search = event.seconds > 0 and not together
                point = Point.SEARCHING if is_search else Point.BUSY
            gap = max(0.0, entry.seconds - last)
            answers = event.kind == "message" and event.id in acting
            found.append(Input(event, point, tuple(before), count, command, gap, answers))
            if event.kind == "message":
                acting.discard(event.id)
            before, together, last = [], True, entry.seconds
            continue
        output = reader.output(event)
        if output is not None:
            count += 1
            if output.kind != "end":  # what the loop took when it had ended, had come before
                before.append(output)
        if event.kind == "action":
            acting.add(event.id)
        elif event.kind == "waiting":
            waits |= begins_a_wait(event)
        elif event.kind == "command":
            command, waits = event.text, False
        together = together and event.kind in ("dropped", "status")
        if output is not None or begins_a_wait(event):
            last = entry.seconds
    return found


def begins_a_wait(event: Event) -> bool:
    """Whether the loop waits from now on, because it has nothing to do."""
    return event.kind == "waiting" and event.text != FOR_A_REPLAY


def input_key(event: Event) -> Key:
    """Returns what identifies an input in the journal."""
    return event.kind, event.id, event.text if event.kind == "message" else ""
