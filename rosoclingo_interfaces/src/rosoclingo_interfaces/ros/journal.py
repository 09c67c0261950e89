"""Reads rosoclingo's journal as a client."""

from __future__ import annotations

import time
from typing import Callable, List

from rosclingo.ros.low_latency import subscriber
from rosoclingo.loop.journal import Event, decode
from rosoclingo.msg import ROSoClingoEvent
from rosoclingo_interfaces.ros.topics import publishers, topic

WaitFor = Callable[[Callable[[], bool], float], bool]
"""Waits until a condition holds, for so many seconds of wall time; returns whether it holds."""

_SECONDS_TO_CONNECT = 2.0
_SECONDS_TO_SETTLE = 1.0  # at most, for what has happened before
_QUIET_SECONDS = 0.2  # after so long without an event, that has come


class JournalReader:
    """Collects the events. Make it after the node is initialised."""

    def __init__(self) -> None:
        """Subscribes."""
        self._events: List[Event] = []
        self._last = time.monotonic()
        self._ready = False
        self._subscriber = subscriber(topic("journal"), ROSoClingoEvent, self._on_event)
        self.name: str = self._subscriber.resolved_name

    def begin(self, wait_for: WaitFor) -> bool:
        """Drops the events until now.

        Args:
            wait_for: Waits, unless it is told to give up.

        Returns:
            Whether there is a journal.
        """
        if not self._subscriber.get_num_connections():
            self._ready = False
            seconds = _SECONDS_TO_CONNECT if publishers(self.name) else 0.0
            if not wait_for(lambda: self._subscriber.get_num_connections() > 0, seconds):
                return False
        if not self._ready:
            self._last = time.monotonic()
            wait_for(lambda: time.monotonic() - self._last > _QUIET_SECONDS, _SECONDS_TO_SETTLE)
            self._ready = True
        self._events = []
        return True

    def events(self) -> List[Event]:
        """Returns the events since :meth:`begin`."""
        return list(self._events)

    def close(self) -> None:
        """Unsubscribes."""
        self._subscriber.unregister()

    def _on_event(self, message: ROSoClingoEvent) -> None:
        self._last = time.monotonic()
        self._events.append(decode(message))
