"""What becomes of an announcement, as rosoclingo's journal tells. Needs no ROS."""

from __future__ import annotations

from typing import Iterable, Optional, Protocol

from rosclingo.errors import shorten
from rosoclingo_interfaces.announcements import SOURCE

TAKEN = ""
"""The verdict on an announcement that the planner was told."""


class Event(Protocol):
    """What is needed of a message ``ROSoClingoEvent``."""

    kind: str
    id: str
    text: str


def verdict(events: Iterable[Event], value: str) -> Optional[str]:
    """Looks for what the planning loop did with an announcement.

    Args:
        events: What has happened since it was published.
        value: What was announced.

    Returns:
        :data:`TAKEN`, the reason for which it was dropped, or None if that is not known yet.
    """
    dropped = f"id {SOURCE}, value {shorten(value)}: "
    heard = False
    for event in events:
        if event.kind == "message":
            heard |= (event.id, event.text) == (SOURCE, value)
        elif heard and event.kind == "dropped" and event.text.startswith(dropped):
            return event.text[len(dropped) :]
        elif heard and event.kind == "command" and event.text.startswith("assign_messages("):
            return TAKEN
    return None
