"""Watchdog of a value that should change, such as a clock. Needs no ROS."""

from __future__ import annotations

import time
from typing import Any, Callable

SILENCE_SECONDS = 5.0
"""A clock that says the same for so long, in wall time, stands still."""


class Watchdog:
    """Watches a value in wall time, since a simulator's clock stops when the simulator ends."""

    def __init__(
        self, value: Callable[[], Any], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begins to watch.

        Args:
            value: Returns the value.
            clock: The time in seconds.
        """
        self._value = value
        self._clock = clock
        self._last = value()
        self._since = clock()

    def still(self) -> float:
        """Returns the seconds since the value has changed, as far as calls have seen."""
        value = self._value()
        if value != self._last:
            self._last, self._since = value, self._clock()
        return self._clock() - self._since
