"""Messages of a topic for actions that wait for them."""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from typing import Any, Deque, Iterator, List, Optional

from rosclingo.ros.low_latency import subscriber

_MOST_WAITING = 1_000  # messages of one action; of more, the oldest are dropped


class MessageQueue:
    """The messages that have come for one action. Thread-safe."""

    def __init__(self) -> None:
        self._messages: Deque[Any] = deque(maxlen=_MOST_WAITING)
        self._changed = threading.Condition()

    def add(self, message: Any) -> None:
        """Adds a message behind the others."""
        with self._changed:
            self._messages.append(message)
            self._changed.notify_all()

    def clear(self) -> None:
        """Forgets all messages."""
        with self._changed:
            self._messages.clear()

    def take(self, seconds: float) -> Optional[Any]:
        """Takes the first message; None if there is none within some seconds of wall time."""
        with self._changed:
            self._changed.wait_for(lambda: self._messages, seconds)
            return self._messages.popleft() if self._messages else None


class TopicMailbox:
    """A subscription to a topic whose messages several threads can wait for. Thread-safe.

    Attributes:
        type: The type of its messages.
        last: The last message; None if none has come.
    """

    def __init__(self, name: str, kind: Any) -> None:
        """Subscribes.

        Args:
            name: The topic.
            kind: The class of its messages.
        """
        self.type: str = kind._type
        self.last: Optional[Any] = None
        self._lock = threading.Lock()  # guards the two others; held for moments only
        self._queues: List[MessageQueue] = []
        self._subscriber = subscriber(name, kind, self._on_message)

    @property
    def name(self) -> str:
        """The topic's resolved name."""
        return str(self._subscriber.resolved_name)

    @property
    def has_publisher(self) -> bool:
        """True if the topic has a publisher."""
        return bool(self._subscriber.get_num_connections())

    @contextlib.contextmanager
    def opened(self) -> Iterator[MessageQueue]:
        """A context in which messages come into a queue."""
        messages = MessageQueue()
        with self._lock:
            self._queues.append(messages)
        try:
            yield messages
        finally:
            with self._lock:
                self._queues.remove(messages)

    def _on_message(self, message: Any) -> None:
        with self._lock:
            self.last = message
            for messages in self._queues:
                messages.add(message)
