"""A map of mailbots as an instance of their encodings: made, written, and measured."""

from __future__ import annotations

import heapq
from typing import Dict, Iterable, List, Tuple

from rosoclingo_aspprograms.validator import Edge, Map, arguments


class InstanceMap(Map):
    """A map that tests write as an instance, and know the distances of."""

    @classmethod
    def grid(cls, x: int, y: int) -> InstanceMap:
        """Returns the map of ``graph_bench.lp``."""
        made = cls(starts={"mailbot": "c(1)"})
        for node in range(1, x * y + 1):
            made.offices.add(str(node))
            made.edges.add(frozenset((f"c({node})", str(node))))
            if node % x:
                made.edges.add(frozenset((f"c({node})", f"c({node + 1})")))
            if node + x <= x * y:
                made.edges.add(frozenset((f"c({node})", f"c({node + x})")))
        return made

    def facts(self) -> str:
        """Returns the instance that :meth:`read` reads."""
        facts = [f"office({office})." for office in sorted(self.offices)]
        facts += ["connection({},{}).".format(*sorted(edge)) for edge in self.edges]
        facts += [f"start({robot},{place})." for robot, place in self.starts.items()]
        facts += ["length({},{},{}).".format(*sorted(e), n) for e, n in self.lengths.items()]
        facts += [f"duration({action},{n})." for action, n in self.durations.items()]
        return "\n".join(sorted(facts))

    def seconds(self, place: str, action: str) -> int:
        """Returns how long an action takes: with one for all, the steps.

        Args:
            place: Where the robot is.
            action: The action, such as ``go(o1)``.
        """
        target = arguments(action, "go")
        if target:
            return self.lengths.get(frozenset((place, target[0])), 1)
        return self.durations.get(action.partition("(")[0], 1)

    def distances(self, source: str, blocked: Iterable[Edge] = ()) -> Dict[str, int]:
        """Returns how long it takes from a waypoint to each that can be reached."""
        neighbours: Dict[str, List[Tuple[str, int]]] = {}
        for edge in self.edges.difference(blocked):
            first, second = edge
            length = self.lengths.get(edge, 1)
            neighbours.setdefault(first, []).append((second, length))
            neighbours.setdefault(second, []).append((first, length))
        found: Dict[str, int] = {}
        heap = [(0, source)]
        while heap:
            distance, here = heapq.heappop(heap)
            if here in found:
                continue
            found[here] = distance
            for there, length in neighbours.get(here, ()):
                heapq.heappush(heap, (distance + length, there))
        return found
