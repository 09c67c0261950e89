"""The length of the shortest plan for one robot, found without a solver."""

from __future__ import annotations

from itertools import permutations
from typing import Iterable, Optional, Sequence, Tuple

from instance_map import InstanceMap

from rosoclingo_aspprograms.validator import Edge


def shortest(
    graph: InstanceMap,
    position: str,
    target: Optional[str],
    jobs: Sequence[Tuple[str, str]],
    blocked: Iterable[Edge],
) -> int:
    """Returns how many actions it takes to deliver all that can be reached.

    Args:
        graph: The map.
        position: Where the robot is.
        target: Where to deliver what it carries.
        jobs: Origin and destination of each package that waits.
        blocked: The edges that are blocked.
    """
    blocked = list(blocked)
    reachable = graph.distances(position, blocked)
    if target is not None and target not in reachable:
        return 0
    jobs = [job for job in jobs if reachable.keys() >= set(job)]
    distances = {
        place: graph.distances(place, blocked)
        for place in {position, *([target] if target else []), *(job[1] for job in jobs)}
    }
    between = {job: graph.distances(job[0], blocked)[job[1]] for job in jobs}
    best = None
    for order in permutations(jobs):
        here = position
        length = 0
        if target is not None:
            length += distances[here][target] + 1
            here = target
        for origin, destination in order:
            length += distances[here][origin] + between[origin, destination] + 2
            here = destination
        best = length if best is None else min(best, length)
    return best or 0
