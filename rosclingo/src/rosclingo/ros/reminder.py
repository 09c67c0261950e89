"""Paces the log messages of a wait."""

from __future__ import annotations

import time

_SECONDS_BETWEEN = 5.0


class Reminder:
    """A timer for log messages of a wait: first after some time, then every five seconds."""

    def __init__(self, patience: float = 1.0) -> None:
        """Begins the wait.

        Args:
            patience: When it is due first, in seconds of the wall clock.
        """
        self._due = time.monotonic() + patience

    def due(self) -> bool:
        """Whether a message is due; restarts the timer if so."""
        now = time.monotonic()
        if now < self._due:
            return False
        self._due = now + _SECONDS_BETWEEN
        return True
