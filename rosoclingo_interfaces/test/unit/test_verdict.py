"""What a journal says of an announcement."""

from __future__ import annotations

from typing import List, Optional

import pytest

from rosoclingo.loop.journal import Event, Fields, decode
from rosoclingo_interfaces.announcements import TAKEN, has_come, verdict

MESSAGE = decode(Fields("message", "info", "blocked(c3,c4)"))
OTHER = decode(Fields("message", "info", "blocked(c1,c2)"))
DROPPED = decode(Fields("dropped", "", "id info, value blocked(c3,c4): it is unknown"))
OTHER_DROPPED = decode(Fields("dropped", "", "id info, value blocked(c1,c2): it is unknown"))
SOLVE = decode(Fields("command", "sat", "solve"))
ASSIGN = decode(Fields("command", "", "assign_messages(4)"))


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


def test_whether_an_announcement_has_come() -> None:
    elsewhere = decode(Fields("message", "mailbot", "blocked(c3,c4)"))
    assert not has_come([OTHER, elsewhere, ASSIGN], "blocked(c3,c4)")
    assert has_come([OTHER, MESSAGE, DROPPED], "blocked(c3,c4)")
