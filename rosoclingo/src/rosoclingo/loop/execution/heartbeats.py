"""Heartbeats of interfaces: that they still execute an action, and how far it is."""

from __future__ import annotations

import threading
import time
from typing import Callable, Collection, Dict, NamedTuple, Optional


class Heartbeat(NamedTuple):
    """The last heartbeat of an action.

    Attributes:
        seconds: When it came, on the loop's clock.
        progress: The part of the action that is done, from 0 to 1; None if that is unknown.
    """

    seconds: float
    progress: Optional[float] = None


class Heartbeats:
    """Keeps the last heartbeat of each action. Thread-safe.

    Only live runs have them: what the loop makes of one that is missing is an input, as an answer
    is, so that a replay needs none.

    >>> heartbeats = Heartbeats(lambda: 3.0)
    >>> heartbeats.hear(1, 0.5)
    >>> heartbeats.last(1)
    Heartbeat(seconds=3.0, progress=0.5)
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """Has none.

        Args:
            now: The loop's clock, in seconds.
        """
        self._now = now
        self._lock = threading.Lock()  # guards the last ones; held for moments only
        self._last: Dict[int, Heartbeat] = {}

    def hear(self, number: int, progress: Optional[float] = None) -> None:
        """Takes the heartbeat of the action with the token of that number."""
        with self._lock:
            self._last[number] = Heartbeat(self._now(), progress)

    def last(self, number: int) -> Optional[Heartbeat]:
        """Returns an action's last heartbeat; None if it had none."""
        with self._lock:
            return self._last.get(number)

    def keep(self, numbers: Collection[int]) -> None:
        """Forgets the heartbeats of all other actions."""
        with self._lock:
            self._last = {one: last for one, last in self._last.items() if one in numbers}
