"""Delivery statuses of the last messages to a planner, as the journal tells them.

>>> run = RunModel()
>>> table = MessageTable(run)
>>> for event in MessageArrived("info", "close(9)"), MessageDropped("id info, value close(9): no"):
...     _ = run.apply(journal.Entry(event, number=7))
...     table.hear(event, 12.5)
>>> table.fate("info", "close(9)")
MessageFate(number=7, dropped='no')
>>> table.last_dropped
{'time': 12.5, 'text': 'id info, value close(9): no'}
"""

from __future__ import annotations

from typing import Dict, NamedTuple, Optional, Tuple

from rosclingo.errors import shorten
from rosoclingo.bags.run_model import RunModel, TrackedMessage
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Event, MessageArrived, MessageDropped
from rosoclingo_console.model.board import Row

_MOST = 1000  # messages; one is dropped soon after it has come
_LONGEST = 300  # characters of a text
_DIGITS = 3  # of seconds


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

    def __init__(self, run: RunModel) -> None:
        """Begins before the first event of a run."""
        self._run = run
        self._last: Dict[Tuple[str, str], TrackedMessage] = {}  # by source and value, in order
        self.last_dropped: Optional[Row] = None

    def hear(self, event: Event, time: float) -> None:
        """Takes an event of the journal, which the run has taken."""
        if isinstance(event, MessageDropped):
            self.last_dropped = {
                "time": round(time, _DIGITS),
                "text": shorten(event.reason, _LONGEST),
            }
        elif isinstance(event, MessageArrived):
            self._last.pop((event.source, event.value), None)
            self._last[event.source, event.value] = self._run.messages[-1]
            if len(self._last) > _MOST:
                del self._last[next(iter(self._last))]

    def fate(self, source: str, value: str) -> Optional[MessageFate]:
        """Returns what has become of a message; None if none like it was heard. Thread-safe."""
        message = self._last.get((source, value))
        if message is None:
            return None
        words, why = journal.naming(source, value), message.dropped
        if why and why.startswith(words):
            why = why[len(words) :]
        return MessageFate(message.number, why)
