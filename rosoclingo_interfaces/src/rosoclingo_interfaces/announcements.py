"""Parses a user's announcements of blocked paths, and tracks their acceptance. Needs no ROS."""

from __future__ import annotations

from typing import Iterable, Optional

from rosclingo.solver.terms import parse_term, quote
from rosoclingo.loop.journal import (
    CommandDone,
    Event,
    MessageArrived,
    MessageDropped,
    naming,
)
from rosoclingo.loop.words import INFO
from rosoclingo_interfaces.errors import LineError

TAKEN = ""
"""The verdict on an announcement that the planner was told."""

_WORDS = {"b": "blocked", "u": "unblocked"}


def parse_line(line: str) -> str:
    """Returns the announcement of a line, such as ``blocked(c3,c4)`` for ``b c3 c4``.

    Raises:
        LineError: The line is none of ``b FROM TO`` and ``u FROM TO``.
        TermError: A waypoint is no term.
    """
    words = line.split()
    if len(words) != 3 or words[0] not in _WORDS:
        raise LineError(f"expected b FROM TO or u FROM TO, such as b c3 c4, not {quote(line)}")
    begin, end = (parse_term(word) for word in words[1:])
    return f"{_WORDS[words[0]]}({begin},{end})"


def verdict(events: Iterable[Event], value: str) -> Optional[str]:
    """Returns the planning loop's reaction to an announcement, from the journal.

    Args:
        events: What has happened since it was published.
        value: What was announced.

    Returns:
        :data:`TAKEN`, the reason for which it was dropped, or None if that is not known yet.
    """
    dropped = naming(INFO, value)
    heard = False
    for event in events:
        if isinstance(event, MessageArrived):
            heard |= (event.source, event.value) == (INFO, value)
        elif heard and isinstance(event, MessageDropped) and event.reason.startswith(dropped):
            return event.reason[len(dropped) :]
        elif heard and isinstance(event, CommandDone) and event.name == "assign_messages":
            return TAKEN
    return None


def has_come(events: Iterable[Event], value: str) -> bool:
    """Returns whether the planning loop has received an announcement, even if it is dropped.

    Args:
        events: What has happened since it was published.
        value: What was announced.
    """
    arrived = (event for event in events if isinstance(event, MessageArrived))
    return any((event.source, event.value) == (INFO, value) for event in arrived)
