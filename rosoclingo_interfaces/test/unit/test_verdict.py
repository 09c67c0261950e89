"""What a journal says of an announcement."""

from __future__ import annotations

from typing import List, NamedTuple, Optional

import pytest

from rosoclingo_interfaces.verdict import TAKEN, verdict


class Event(NamedTuple):
    """An event of the journal."""

    kind: str
    id: str
    text: str


MESSAGE = Event("message", "info", "blocked(c3,c4)")
OTHER = Event("message", "info", "blocked(c1,c2)")
DROPPED = Event("dropped", "", "id info, value blocked(c3,c4): it is unknown")
OTHER_DROPPED = Event("dropped", "", "id info, value blocked(c1,c2): it is unknown")
SOLVE = Event("command", "sat", "solve")
ASSIGN = Event("command", "", "assign_messages(4)")


@pytest.mark.parametrize(
    ("events", "said"),
    [
        ([], None),
        ([MESSAGE], None),
        ([MESSAGE, SOLVE], None),
        ([ASSIGN, DROPPED, MESSAGE], None),
        ([OTHER, OTHER_DROPPED, ASSIGN], None),
        ([MESSAGE, ASSIGN], TAKEN),
        ([OTHER, MESSAGE, OTHER_DROPPED, SOLVE, ASSIGN, DROPPED], TAKEN),
        ([MESSAGE, DROPPED], "it is unknown"),
        ([MESSAGE, OTHER, DROPPED, OTHER_DROPPED, ASSIGN], "it is unknown"),
    ],
)
def test_verdicts(events: List[Event], said: Optional[str]) -> None:
    assert verdict(events, "blocked(c3,c4)") == said
