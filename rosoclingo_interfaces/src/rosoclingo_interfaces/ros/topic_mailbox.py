"""Messages of a topic for actions that wait for them."""

from __future__ import annotations

import contextlib
import queue
import threading
from typing import Any, Iterator, List, Optional

from rosclingo.ros.low_latency import subscriber

_MOST_WAITING = 1_000  # messages of one action; of more, the oldest are dropped


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
        self._boxes: List[queue.Queue[Any]] = []
        self._subscriber = subscriber(name, kind, self._on_message)

    @property
    def name(self) -> str:
        """The topic's resolved name."""
        return str(self._subscriber.resolved_name)

    @property
    def has_publisher(self) -> bool:
        """True if somebody publishes the topic."""
        return bool(self._subscriber.get_num_connections())

    @contextlib.contextmanager
    def opened(self) -> Iterator[queue.Queue[Any]]:
        """A context in which messages come into a queue."""
        box: queue.Queue[Any] = queue.Queue()
        with self._lock:
            self._boxes.append(box)
        try:
            yield box
        finally:
            with self._lock:
                self._boxes.remove(box)

    def _on_message(self, message: Any) -> None:
        with self._lock:
            self.last = message
            for box in self._boxes:
                if box.qsize() >= _MOST_WAITING:
                    with contextlib.suppress(queue.Empty):
                        box.get_nowait()
                box.put(message)
