"""Shortest ways on the map of a task, and what a robot has to keep to get to where it refills."""

from __future__ import annotations

import heapq
from collections import defaultdict
from typing import DefaultDict, Dict, Iterable, List, Mapping, Sequence, Tuple


class WayMap:
    """Ways between places, some of which may be closed."""

    def __init__(self, ways: Mapping[Tuple[str, str], int]) -> None:
        """Makes a map.

        Args:
            ways: The length of the way from one place to another.
        """
        self._next: DefaultDict[str, List[Tuple[str, int]]] = defaultdict(list)
        self._before: DefaultDict[str, List[Tuple[str, int]]] = defaultdict(list)
        for (start, end), length in ways.items():
            self._next[start].append((end, length))
            self._before[end].append((start, length))
        self._known: Dict[str, Dict[str, int]] = {}

    def distances(self, start: str) -> Mapping[str, int]:
        """Returns how long the shortest ways from a place are, to all to which there is one."""
        if start not in self._known:
            self._known[start] = _shortest(self._next, [(0, start)])
        return self._known[start]

    def reserves(
        self, refills: Iterable[str], each: int, jumps: Sequence[Tuple[str, str]]
    ) -> Mapping[str, int]:
        """Returns how much a robot needs to get from a place to where it refills.

        Args:
            refills: Where that is.
            each: How much a way of length 1 takes.
            jumps: Pairs of places, from the first of which an action takes it to the second.
        """
        before = {
            place: [(start, length * each) for start, length in starts]
            for place, starts in self._before.items()
        }
        for start, end in jumps:
            before.setdefault(end, []).append((start, 0))
        return _shortest(before, [(0, place) for place in refills])


def _shortest(
    graph: Mapping[str, Sequence[Tuple[str, int]]], starts: Sequence[Tuple[int, str]]
) -> Dict[str, int]:
    """Returns the distances from the nearest of some places, by Dijkstra's algorithm."""
    found: Dict[str, int] = {}
    waiting = list(starts)
    heapq.heapify(waiting)
    while waiting:
        distance, place = heapq.heappop(waiting)
        if place not in found:
            found[place] = distance
            for other, length in graph.get(place, ()):
                if other not in found:
                    heapq.heappush(waiting, (distance + length, other))
    return found
