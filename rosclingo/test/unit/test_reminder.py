"""How often a wait says what it waits for."""

from __future__ import annotations

import time

import pytest

from rosclingo.ros.reminder import Reminder


def test_first_after_the_patience_and_then_every_five_seconds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times = iter([100.0, *(100.0 + quarter / 4 for quarter in range(60))])
    monkeypatch.setattr(time, "monotonic", lambda: next(times))
    reminder = Reminder(2.0)
    assert [quarter / 4 for quarter in range(60) if reminder.due()] == [2.0, 7.0, 12.0]
