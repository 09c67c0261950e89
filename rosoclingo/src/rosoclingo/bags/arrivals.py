"""What a recorder has received, and the journal's order in it. Needs no ROS."""

from __future__ import annotations

import struct
from typing import List, NamedTuple, Tuple

from rosoclingo.bags.writer import Source

_EVENT = struct.Struct("<III")  # how a ROSoClingoEvent begins: the time and the number


class Received(NamedTuple):
    """A message, and when it was received, in ns since 1970."""

    source: Source
    time: int
    data: bytes


class Journal:
    """Puts the events of a journal in order and drops those that come twice.

    A subscriber that connects while events are published gets some of them from the backlog and
    directly, and newer ones before older ones.
    """

    def __init__(self) -> None:
        self._known = bytearray()  # for each number, whether the event was there
        self._newest = (0, 0)
        self._time = 0

    def sort(self, events: List[Received]) -> List[Received]:
        """Returns the events that were not there before, in the order of their numbers.

        Args:
            events: What has come since the last call.
        """
        sorted_events = []
        for _, event in sorted(((_stamp(event), event) for event in events), key=_order):
            seconds, nanoseconds, number = _stamp(event)
            is_newer = (seconds, nanoseconds) > self._newest
            if is_newer and number <= len(self._known) and self._known[number - 1]:
                self._known.clear()  # the node was started again and counts anew
            self._newest = max(self._newest, (seconds, nanoseconds))
            if not self._is_known(number):
                # Who plays the bag goes by the times.
                self._time = max(self._time, event.time)
                sorted_events.append(event._replace(time=self._time))
        return sorted_events

    def _is_known(self, number: int) -> bool:
        self._known.extend(bytes(max(0, number - len(self._known))))
        is_known = bool(self._known[number - 1])
        self._known[number - 1] = 1
        return is_known


def _stamp(event: Received) -> Tuple[int, int, int]:
    seconds, nanoseconds, number = _EVENT.unpack_from(event.data)
    return seconds, nanoseconds, number


def _order(stamped: Tuple[Tuple[int, int, int], Received]) -> Tuple[int, int, int]:
    return stamped[0]
