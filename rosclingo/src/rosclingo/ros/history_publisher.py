"""Publisher with a history: late subscribers get the last messages."""

from __future__ import annotations

import threading
import time
from collections import deque
from typing import Any, Callable, Deque, List

import rospy

from rosclingo.ros.low_latency import batch_of, publisher

_PAUSE_SECONDS = 0.02  # between two writes, at least


class HistoryPublisher:
    """Publishes to a topic, and keeps the last messages for subscribers that come later.

    A recorder that starts a little late misses nothing. Messages that come within 20 ms after a
    write are coalesced into the next one, since each write wakes a thread here and a process there;
    so a process that is killed takes with it what came in its last 20 ms. Thread-safe. A message
    that is published while a subscriber connects may reach it twice, so messages should be
    numbered.
    """

    def __init__(self, name: str, message: Any, length: int) -> None:
        """Opens the topic.

        Args:
            name: Name of the topic.
            message: Type of the messages.
            length: How many messages are kept.
        """
        # Guards all below and the topic: rospy does not guard what goes to one subscriber from
        # what goes to all. rospy's own lock is taken under it, and never the other way round.
        self._lock = threading.Lock()
        self._history: Deque[Any] = deque(maxlen=length)
        self._waiting: List[Any] = []
        self._has_waiting = threading.Event()
        self._written_at = 0.0
        self._batch = batch_of(message)
        self._publisher = publisher(name, message, on_subscriber=self._on_subscriber)
        threading.Thread(target=self._run, name=f"batches of {name}", daemon=True).start()
        rospy.on_shutdown(self._flush)

    def publish(self, message: Any, keep: bool = True) -> None:
        """Publishes a message, which must not be changed any more; does not wait.

        Args:
            message: The message.
            keep: Whether late subscribers get it, too.
        """
        with self._lock:
            if keep:
                self._history.append(message)
            if not self._publisher.get_num_connections():
                return
            self._waiting.append(message)
            is_alone = len(self._waiting) == 1 and self._pause <= 0.0
            if is_alone or rospy.core.is_shutdown_requested():
                self._write()
            else:
                self._has_waiting.set()

    @property
    def _pause(self) -> float:
        """How many seconds the next write has to wait; none if less than 0."""
        return self._written_at + _PAUSE_SECONDS - time.monotonic()

    def _run(self) -> None:
        while True:
            self._has_waiting.wait()
            time.sleep(max(0.0, self._pause))
            try:
                self._flush()
            except Exception:  # a bug must not end the thread
                rospy.logerr("internal error", exc_info=True)

    def _flush(self) -> None:
        with self._lock:
            self._write()

    def _write(self) -> None:
        self._has_waiting.clear()
        if self._waiting:
            waiting, self._waiting = self._waiting, []
            self._written_at = time.monotonic()
            self._publisher.publish(self._batch(waiting))

    def _on_subscriber(self, send: Callable[[Any], None]) -> None:
        with self._lock:
            waiting = set(map(id, self._waiting))  # who is new gets them with the others
            written = [message for message in self._history if id(message) not in waiting]
            if written:
                send(self._batch(written))
            self._write()
