"""Time that has gone by on a clock that may jump. Needs no ROS."""

from __future__ import annotations

import threading
from typing import Callable

Clock = Callable[[], float]


class Stopwatch:
    """Adds up what goes by between two looks at a clock. Thread-safe.

    A simulator that is started again sets its clock back: the step back counts for nothing, and
    time goes on from there. ROS's clock says 0 until the first time has come: the step from there
    counts for nothing either.
    """

    def __init__(self, clock: Clock) -> None:
        """Begins now.

        Args:
            clock: The time in seconds.
        """
        self._clock = clock
        self._lock = threading.Lock()  # guards the two below; held for moments only
        self._last = clock()
        self._sum = 0.0

    def seconds(self) -> float:
        """Returns how much time has gone by; never less than before."""
        with self._lock:
            now = self._clock()
            if 0 < self._last < now:
                self._sum += now - self._last
            self._last = now
            return self._sum
