"""Sends what changes to all pages: at once, and then at most twenty times a second.

The more there is to send, the longer it is gathered, so that this takes a part of the time only,
and the planning loop on the same machine is held up little by those who watch it.

rospy's threads and the event loop of the web server meet here, and nowhere else.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections import deque
from typing import Any, Callable, Deque, Dict, List, Mapping, Optional, Sequence, Set, Tuple

from rosoclingo_console.model.goals import GoalFate
from rosoclingo_console.model.messages import MessageFate
from rosoclingo_console.model.metrics import Sample
from rosoclingo_console.model.system import SystemModel

FLUSH_SECONDS = 0.05  # between two messages to a page, at least
_MOST_HEARD = 100_000  # messages until the next flush
_SHARE = 0.1  # of the time, at most, in which messages are made and sent
_BEAT_SECONDS = 1.0  # between two signs of life

Heard = Callable[[SystemModel], None]
"""A message of a system, as what it does to the model."""

_LOG = logging.getLogger(__name__)


class Subscriber:
    """Whoever wants to know of changes, such as a page; subclasses override the methods."""

    def send(self, text: str) -> None:
        """Takes a message, which is JSON; does not wait."""
        raise NotImplementedError

    def close(self) -> None:
        """The hub says nothing more."""


class Hub:
    """The models of all systems. Only :meth:`post` is for other threads than the event loop's."""

    def __init__(self, systems: Sequence[str], clock: Callable[[], Mapping[str, float]]) -> None:
        """Makes empty models.

        Args:
            systems: The names of the planning nodes.
            clock: Returns what time it is: ``now`` in seconds of wall time, ``ros`` in those of
                ROS's time, which differ if a simulator has the clock, ``rate`` if it is a recorded
                run's.
        """
        # Read by the event loop's thread only, as all that is not said to be thread-safe.
        self.models: Dict[str, SystemModel] = {name: SystemModel() for name in systems}
        self.slow = 0
        self._clock = clock
        # Thread-safe. Where more comes than can be taken, the oldest is lost, and missed events are
        # counted.
        self._heard: Deque[Tuple[str, Heard]] = deque(maxlen=_MOST_HEARD)
        self._loop: Optional[asyncio.AbstractEventLoop] = None
        self._is_woken = False  # set by whoever wakes the loop, reset by a flush
        self._subscribers: Set[Subscriber] = set()
        self._next_flush = 0.0  # not before, by the loop's clock

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begins to take what was posted; called by the event loop's thread."""
        self._loop = loop
        self._is_woken = True
        self._wake()
        self._beat_on()

    def post(self, system: str, heard: Heard) -> None:
        """Has a message of a system taken. Thread-safe; does not wait."""
        self._heard.append((system, heard))
        loop = self._loop
        # Whoever reads False here wakes the loop; twice does no harm, and never is impossible:
        # a flush resets it before it takes what there is.
        if loop is not None and not self._is_woken:
            self._is_woken = True
            try:
                loop.call_soon_threadsafe(self._wake)
            except RuntimeError:  # it is closed
                self._heard.clear()

    def _wake(self) -> None:
        """Has all that was posted taken, as soon as there may be a message to the pages again."""
        assert self._loop is not None
        self._loop.call_at(max(self._loop.time(), self._next_flush), self._flush)

    def _flush(self) -> None:
        assert self._loop is not None
        self._is_woken = False
        for _ in range(len(self._heard)):  # and no more, however fast others come
            system, heard = self._heard.popleft()
            try:
                heard(self.models[system])
            except Exception:  # a bug must not stop all that comes later
                _LOG.exception("a message of %s was not understood", system)
        began = self._loop.time()
        for name, model in self.models.items():
            changes = model.changes()
            if changes:
                self._send({"system": name, **changes})
        took = self._loop.time() - began
        self._next_flush = began + max(FLUSH_SECONDS, took / _SHARE)

    def beat(self) -> None:
        """Sends what time it is; called by the event loop's thread."""
        self._send({"beat": self._clock()})

    def _beat_on(self) -> None:
        assert self._loop is not None
        self.beat()
        self._loop.call_later(_BEAT_SECONDS, self._beat_on)

    def _send(self, message: Mapping[str, Any]) -> None:
        if self._subscribers:
            text = encode(message)
            for one in list(self._subscribers):
                one.send(text)

    def subscribe(self, subscriber: Subscriber) -> None:
        """Subscribes a page: to the present state, and then to changes."""
        for name, model in self.models.items():
            subscriber.send(encode({"system": name, **model.snapshot()}))
        subscriber.send(encode({"beat": self._clock()}))
        self._subscribers.add(subscriber)

    def unsubscribe(self, subscriber: Subscriber) -> None:
        """Ends that; nothing if it has not begun."""
        self._subscribers.discard(subscriber)

    def close(self) -> None:
        """Ends all connections; called by the event loop's thread."""
        for one in list(self._subscribers):
            one.close()

    def goal_fate(self, system: str, identifier: str) -> Optional[GoalFate]:
        """Returns what has become of a goal, as far as the journal was heard. Thread-safe."""
        return self.models[system].goals.fate(identifier)

    def message_fate(self, system: str, source: str, value: str) -> Optional[MessageFate]:
        """Returns the outcome of a message to a system. Thread-safe."""
        return self.models[system].messages.fate(source, value)

    def samples(self) -> Dict[str, List[Sample]]:
        """Returns the metrics of each system, and with an empty name the console's own."""
        return {
            **{name: model.samples() for name, model in self.models.items()},
            "": [
                Sample("rosoclingo_console_pages", len(self._subscribers)),
                Sample("rosoclingo_console_slow_pages_total", self.slow),
            ],
        }


def encode(message: Mapping[str, Any]) -> str:
    """Returns a message as JSON, in ASCII."""
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
