"""What a run has put out, as what two runs are compared by. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Optional, Sequence, Tuple

from rosclingo.wire.term_text import last_number
from rosoclingo.bags.model import Entry
from rosoclingo.loop.journal import RECALLED, SHUTDOWN, Event

INPUTS = ("goal", "cancel", "message")
"""The kinds of events that come from outside."""


@dataclass(frozen=True)
class Output:
    """Something that a run has put out.

    Attributes:
        kind: ``action``, ``status``, ``plan`` (a whole plan was published) or ``end``.
        id: The actuator or the goal; else empty.
        text: The action, the status, the plan's actions or the reason of the end.
        step: In which step; None if another thread than the loop's had a part in it, so that the
            step is a matter of chance.
    """

    kind: str
    id: str = ""
    text: str = ""
    step: Optional[int] = None

    @property
    def key(self) -> Tuple[str, str, str]:
        """What it is, whatever the step; the reason of an end does not count."""
        return self.kind, self.id, "" if self.kind == "end" else self.text


class Reader:
    """Finds the outputs among a journal's events, one by one."""

    def __init__(self, has_journal: bool = True) -> None:
        """Prepares to read a journal from its beginning.

        Args:
            has_journal: Whether there was a journal: else steps are not known, and plans are those
                that were published.
        """
        self._has_journal = has_journal
        self._plan: Sequence[str] = ()

    def output(self, event: Event) -> Optional[Output]:
        """Returns what an event puts out, if it does."""
        step = event.step if self._has_journal else None
        if event.kind == "action":
            return Output("action", event.id, event.text, step)
        if event.kind == "status":
            # Without a slot, the goal was recalled or rejected by the thread that took it.
            return Output("status", event.id, event.text, step if slot(event) else None)
        if event.kind == "end":
            return Output("end", text=event.text, step=step)
        if event.kind == "plan":
            self._plan = event.details
        published = event.text == "publish" if event.kind == "command" else event.kind == "plan"
        if published and (event.kind == "command") == self._has_journal:
            return Output("plan", text=", ".join(sorted(self._plan, key=_place)))
        return None


def matters(event: Event) -> bool:
    """Whether an event of a replay matters for its comparison with the recording."""
    if event.kind == "command":
        return event.text == "publish" or event.text.startswith("reset(")
    return event.kind in (*INPUTS, "action", "status", "plan", "end")


def tidy(entries: Sequence[Entry]) -> Tuple[Entry, ...]:
    """Returns a journal without what the end of the process has caused, in causal order.

    A cancel request that has recalled a goal, and the goal itself, are noted when the loop takes
    them, which may be after the status of the goal: here they come before it. Goals that came after
    the end are refused and have no entry, so their statuses are left out, and so is that of a goal
    which was recalled just before the journal ends.
    """
    entries = without_shutdown(entries)
    goals: Dict[str, Entry] = {}
    for entry in entries:
        if entry.event.kind == "goal":
            goals.setdefault(entry.event.id, entry)
    cancels = {entry.event.id for entry in entries if entry.event.kind == "cancel"}
    recalled = recalls(entries)
    ordered: Dict[int, Entry] = {}
    for entry in entries:
        if entry.event.kind == "status":
            is_without_cause = is_recall(entry.event) and entry.event.id not in cancels
            if entry.event.id not in goals or is_without_cause:
                continue
            if entry.number in recalled:
                for cause in (goals[entry.event.id], recalled[entry.number]):
                    ordered.setdefault(cause.number, cause)
        ordered.setdefault(entry.number, entry)
    return tuple(ordered.values())


def without_shutdown(entries: Sequence[Entry]) -> Sequence[Entry]:
    """Returns a journal without what the end of the process has caused."""
    return entries[: _shutdown(entries)]


def recalls(entries: Iterable[Entry]) -> Dict[int, Entry]:
    """Finds goals without a slot that were canceled before the loop took their cancel requests.

    Returns:
        The cancel requests, by the numbers of the statuses.
    """
    statuses: Dict[str, int] = {}
    found: Dict[int, Entry] = {}
    for entry in entries:
        event = entry.event
        if is_recall(event):
            statuses[event.id] = entry.number
        elif event.kind == "cancel" and event.id in statuses:
            found.setdefault(statuses[event.id], entry)
    return found


def outputs(entries: Iterable[Entry], has_journal: bool = True) -> List[Output]:
    """Returns all outputs of a journal, in its order."""
    reader = Reader(has_journal)
    found = (reader.output(entry.event) for entry in entries)
    return [output for output in found if output is not None]


def is_open(entries: Sequence[Entry]) -> bool:
    """Whether a tidy journal ends while the loop was at work, so that more was to come."""
    for entry in reversed(entries):
        kind = entry.event.kind
        if kind in ("waiting", "end"):
            return False
        if kind == "command":
            return entry.event.text != "publish"
        if kind in INPUTS:  # whether the loop took it as news is not known
            return True
    return True


def is_recall(event: Event) -> bool:
    """Whether a goal without a slot was canceled, which its cancel request does at once."""
    return event.kind == "status" and event.details[1:2] == (RECALLED,)


def slot(event: Event) -> str:
    """Returns the slot of the goal that a status belongs to, or nothing."""
    return event.details[0] if event.details else ""


def _shutdown(entries: Sequence[Entry]) -> Optional[int]:
    for place, entry in enumerate(entries):
        event = entry.event
        if event.kind == "end" and event.text == SHUTDOWN:
            return place
        if event.kind == "status" and SHUTDOWN in event.details:
            return place
    return None


def _place(atom: str) -> Tuple[int, str]:
    step = last_number(atom)
    return (0 if step is None else step), atom
