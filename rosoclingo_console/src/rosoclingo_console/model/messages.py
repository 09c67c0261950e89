"""Delivery statuses of the last messages to a planner, as the journal tells them.

>>> table = MessageTable()
>>> table.arrive(7, "info", "close(9)")
>>> table.drop("id info, value close(9): it is unknown", 12.5)
>>> table.fate("info", "close(9)")
MessageFate(number=7, dropped='it is unknown')
>>> table.last_dropped
{'time': 12.5, 'text': 'id info, value close(9): it is unknown'}
"""

from __future__ import annotations

from typing import Dict, NamedTuple, Optional, Tuple

from rosclingo.errors import shorten
from rosoclingo.loop.journal import naming
from rosoclingo_console.model.board import Row

_MOST = 1000  # messages; one is dropped soon after it has come
_LONGEST = 300  # characters of a text


class MessageFate(NamedTuple):
    """The delivery status of a message.

    Attributes:
        number: That of its arrival in the journal.
        dropped: Why it was dropped; empty if the planner was told; None if that is not known yet.
    """

    number: int
    dropped: Optional[str] = None


class MessageTable:
    """The last messages. Not thread-safe, but for :meth:`fate`.

    Attributes:
        last_dropped: When a message was dropped last, in seconds of wall time, and why.
    """

    def __init__(self) -> None:
        self._fates: Dict[Tuple[str, str], MessageFate] = {}  # by source and value, in order
        self._open: Dict[Tuple[str, str], None] = {}  # those without an outcome, by the same keys
        self.last_dropped: Optional[Row] = None

    def arrive(self, number: int, source: str, value: str) -> None:
        """The loop has taken a message."""
        self._fates.pop((source, value), None)
        self._fates[source, value] = MessageFate(number)
        self._open[source, value] = None
        if len(self._fates) > _MOST:
            oldest = next(iter(self._fates))
            del self._fates[oldest]
            self._open.pop(oldest, None)

    def drop(self, reason: str, time: float) -> None:
        """The loop has dropped a message, which the reason names."""
        self.last_dropped = {"time": time, "text": shorten(reason, _LONGEST)}
        for key in self._open:
            words = naming(*key)
            if reason.startswith(words):
                self._close(key, reason[len(words) :])
                del self._open[key]
                return

    def tell(self) -> None:
        """The planner was told all messages that were not dropped."""
        for key in self._open:
            self._close(key, "")
        self._open.clear()

    def _close(self, key: Tuple[str, str], dropped: str) -> None:
        self._fates[key] = self._fates[key]._replace(dropped=dropped)

    def fate(self, source: str, value: str) -> Optional[MessageFate]:
        """Returns what has become of a message; None if none like it was heard. Thread-safe."""
        return self._fates.get((source, value))
