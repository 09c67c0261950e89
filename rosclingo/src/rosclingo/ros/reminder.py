"""How often a wait says what it waits for."""

from __future__ import annotations

import time

_SECONDS_BETWEEN = 5.0


class Reminder:
    """Is due some time after a wait has begun, and then every five seconds. Not thread-safe."""

    def __init__(self, patience: float = 1.0) -> None:
        """Begins the wait.

        Args:
            patience: When it is due first, in seconds of the wall clock.
        """
        self._due = time.monotonic() + patience

    def due(self) -> bool:
        """Whether it is to be said now what is waited for."""
        now = time.monotonic()
        if now < self._due:
            return False
        self._due = now + _SECONDS_BETWEEN
        return True
