"""Sorts and deduplicates the journal's events that a recorder receives. Needs no ROS."""

from __future__ import annotations

import struct
from typing import Dict, List, Tuple

from rosoclingo.bags.wire import Message

_EVENT = struct.Struct("<III")  # how a ROSoClingoEvent begins: the time and the number
_REMEMBERED = 10_000  # events that may come again; a history has 2,000


class Journal:
    """Sorts the events of a journal, and drops duplicates.

    A subscriber that connects while events are published gets some of them from the history and
    directly, and newer ones before older ones. The time and the number tell events apart: a node
    that is started again counts anew. Whatever has no number is kept; readers say that it has none.
    """

    def __init__(self) -> None:
        self._known: Dict[bytes, None] = {}  # the oldest first
        self._time = 0

    def sort(self, events: List[Message]) -> List[Message]:
        """Returns the new events, in the order of their numbers.

        Args:
            events: What has come since the last call.
        """
        sorted_events = []
        for event in sorted(events, key=_stamp):
            if self._is_new(event.data[: _EVENT.size]):
                # Who plays the bag goes by the times.
                self._time = max(self._time, event.time)
                sorted_events.append(event._replace(time=self._time))
        return sorted_events

    def _is_new(self, event: bytes) -> bool:
        if event in self._known:
            return False
        self._known[event] = None
        if len(self._known) > _REMEMBERED:
            del self._known[next(iter(self._known))]
        return True


def _stamp(event: Message) -> Tuple[int, int, int]:
    begin = event.data[: _EVENT.size].ljust(_EVENT.size, b"\0")
    seconds, nanoseconds, number = _EVENT.unpack(begin)
    return seconds, nanoseconds, number
