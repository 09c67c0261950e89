"""Keeps simulated time in step with wall time."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Callable

_LAG_SECONDS = 0.25  # wall time that is caught up; what is more is lost
_WARN_SECONDS = 10.0  # wall time between two warnings
_SLOW = 0.9  # part of the wanted speed; less is worth a warning


@dataclass
class Pacer:
    """Waits after each step of simulated time, so that it does not go too fast; begins now.

    Attributes:
        speed: How many seconds of simulated time go by in one of wall time.
        warn: Called with the speed that was reached, if that is less, once in a while.
        clock: Returns wall time, in seconds.
        sleep: Waits for seconds of wall time.
    """

    speed: float
    warn: Callable[[float], None]
    clock: Callable[[], float] = time.monotonic
    sleep: Callable[[float], object] = time.sleep

    def __post_init__(self) -> None:
        self._due = self._checked = self.clock()
        self._passed = 0.0

    def wait(self, seconds: float) -> float:
        """Waits until the next step is due.

        Args:
            seconds: How long a step is in simulated time.

        Returns:
            How far the clock has jumped, which is not at all.
        """
        self._due += seconds / self.speed
        self._passed += seconds
        now = self.clock()
        if now < self._due:
            self.sleep(self._due - now)
        elif now - self._due > _LAG_SECONDS:
            self._due = now
        if now - self._checked >= _WARN_SECONDS:
            reached = self._passed / (now - self._checked)
            if reached < _SLOW * self.speed:
                self.warn(reached)
            self._checked, self._passed = now, 0.0
        return 0.0
