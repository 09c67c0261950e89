"""Answers are sent again until they were taken, or until nobody waits for them."""

from __future__ import annotations

import queue

import pytest

from rosoclingo_interfaces.insistent import Insistent

TIMEOUT = 30.0  # seconds; no more than a bound for what never comes
FIRST, OTHER = ("robot", "a", 1), ("robot", "b", 1)


def test_an_answer_is_sent_until_it_was_taken() -> None:
    sent: queue.Queue[str] = queue.Queue()
    insistent = Insistent(sent.put, 0.001)
    insistent.keep([FIRST])
    insistent.add(FIRST, "success")
    assert [sent.get(timeout=TIMEOUT) for _ in range(3)] == ["success"] * 3
    insistent.keep([])
    while not sent.empty():  # one may have been on its way
        sent.get()
    with pytest.raises(queue.Empty):
        sent.get(timeout=0.2)


def test_an_answer_to_another_run_is_not_sent_again() -> None:
    """An action may end when the run in which it began is over."""
    sent: queue.Queue[str] = queue.Queue()
    insistent = Insistent(sent.put, 0.001)
    insistent.keep([FIRST])
    insistent.keep([OTHER])
    insistent.add(FIRST, "late")
    insistent.add(OTHER, "success")
    assert [sent.get(timeout=TIMEOUT) for _ in range(3)] == ["success"] * 3
