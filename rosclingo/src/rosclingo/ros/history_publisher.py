"""Publisher with a history: late subscribers get the last messages."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any, Callable, Deque

from rosclingo.ros.low_latency import publisher


class HistoryPublisher:
    """Publishes to a topic, and keeps the last messages for subscribers that come later.

    A recorder that starts a little late misses nothing. Thread-safe. A message that is published
    while a subscriber connects may reach it twice, so messages should be numbered.
    """

    def __init__(self, name: str, message: Any, length: int) -> None:
        """Opens the topic.

        Args:
            name: Name of the topic.
            message: Type of the messages.
            length: How many messages are kept.
        """
        # Guards the history and the topic: rospy does not guard what goes to one subscriber from
        # what goes to all. rospy's own lock is taken under it, and never the other way round.
        self._lock = threading.Lock()
        self._history: Deque[Any] = deque(maxlen=length)
        self._publisher = publisher(name, message, on_subscriber=self._on_subscriber)

    def publish(self, message: Any, keep: bool = True) -> None:
        """Publishes a message, which must not be changed any more; does not wait.

        Args:
            message: The message.
            keep: Whether late subscribers get it, too.
        """
        with self._lock:
            if keep:
                self._history.append(message)
            if self._publisher.get_num_connections():
                self._publisher.publish(message)

    def _on_subscriber(self, send: Callable[[Any], None]) -> None:
        with self._lock:
            for message in self._history:
                send(message)
