"""Warnings about inputs that a node drops, few of them however many inputs there are."""

from __future__ import annotations

import threading
import time

import rospy

_SECONDS_BETWEEN = 1.0


class DroppedInputs:
    """A log of dropped inputs: a warning at once, then one a second at most. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._due = 0.0
        self._unsaid = 0

    def add(self, what: str, reason: str) -> None:
        """Warns that an input was dropped, and how many were since the last warning.

        Args:
            what: The kind of input and its sender, as a noun: ``a message of /door``.
            reason: A sentence that says why.
        """
        with self._lock:
            self._unsaid += 1
            if time.monotonic() < self._due:
                return
            self._due = time.monotonic() + _SECONDS_BETWEEN
            others, self._unsaid = self._unsaid - 1, 0
        more = f" ({others} other inputs were dropped before)" if others else ""
        rospy.logwarn("dropped %s: %s%s", what, reason, more)
