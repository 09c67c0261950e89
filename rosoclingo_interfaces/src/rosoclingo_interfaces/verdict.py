"""What becomes of an announcement, as rosoclingo's journal tells. Needs no ROS."""

from __future__ import annotations

from typing import Iterable, Optional

from rosoclingo.loop.journal import CommandDone, Event, MessageArrived, MessageDropped, naming
from rosoclingo_interfaces.announcements import SOURCE

TAKEN = ""
"""The verdict on an announcement that the planner was told."""


def verdict(events: Iterable[Event], value: str) -> Optional[str]:
    """Looks for what the planning loop did with an announcement.

    Args:
        events: What has happened since it was published.
        value: What was announced.

    Returns:
        :data:`TAKEN`, the reason for which it was dropped, or None if that is not known yet.
    """
    dropped = naming(SOURCE, value)
    heard = False
    for event in events:
        if isinstance(event, MessageArrived):
            heard |= (event.source, event.value) == (SOURCE, value)
        elif heard and isinstance(event, MessageDropped) and event.reason.startswith(dropped):
            return event.reason[len(dropped) :]
        elif heard and isinstance(event, CommandDone) and event.name == "assign_messages":
            return TAKEN
    return None
