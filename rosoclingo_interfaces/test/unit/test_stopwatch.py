"""Time on a clock that jumps."""

from __future__ import annotations

import threading
from typing import List

import clingo
import pytest

from rosoclingo_interfaces.execution import ActionExecution, Stopwatch


class Times:
    """A clock that says what a test gives, and the last of it for ever."""

    def __init__(self, *seconds: float) -> None:
        self._seconds: List[float] = list(seconds)
        self.looks = 0

    def __call__(self) -> float:
        self.looks += 1
        return self._seconds.pop(0) if len(self._seconds) > 1 else self._seconds[0]


def test_time_adds_up() -> None:
    watch = Stopwatch(Times(100.0, 101.0, 101.0, 104.5))
    assert [watch.seconds() for _ in range(3)] == pytest.approx([1.0, 1.0, 4.5])


def test_a_step_back_counts_for_nothing() -> None:
    watch = Stopwatch(Times(1686.0, 1687.0, 0.5, 2.5))
    assert [watch.seconds() for _ in range(3)] == pytest.approx([1.0, 1.0, 3.0])


def test_the_first_time_that_comes_is_the_beginning() -> None:
    watch = Stopwatch(Times(0.0, 0.0, 500.0, 501.0))
    assert [watch.seconds() for _ in range(3)] == pytest.approx([0.0, 0.0, 1.0])


def test_a_wait_goes_on_after_a_step_back() -> None:
    clock = Times(1686.0, 1686.0, 1688.0, 0.5, 2.5, 3.7, 9.0)
    execution = ActionExecution("robot", clingo.Function("wait"), clock)
    assert not execution.wait_until(threading.Event(), execution.seconds + 5.0)
    assert clock.looks == 6  # 2 s before the step back, and 3.2 s after it
    assert execution.seconds > 5.0
