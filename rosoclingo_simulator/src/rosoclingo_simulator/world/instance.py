"""Generates the planner's facts of a world."""

from __future__ import annotations

from typing import Iterable, List

from rosoclingo_simulator.world.description import World
from rosoclingo_simulator.world.text import numbers, origin

_PREDICATES = {
    "corridor": "corridor(W): W is a point of a corridor.",
    "open": "open(W): W is a point of the open area.",
    "office": "office(W): W is an office.",
}
_PER_LINE = 5


def instance(world: World) -> str:
    """Returns an instance: kinds of the waypoints, connections, starts and positions."""
    width, height = world.floor.size
    lines = [f"% The {world.name}: {world.about}.", f"% {origin(world)}"]
    points = world.waypoints.values()
    for kind, comment in _PREDICATES.items():
        facts = [f"{kind}({point.name})." for point in points if point.kind == kind]
        lines += _section(comment, facts)
    facts = [f"connection({first},{second})." for first, second in world.connections]
    lines += _section("connection(V,W): one can go from V to W and back.", facts)
    facts = [f"start({robot},{name})." for robot, name in world.starts.items()]
    lines += _section("start(R,W): robot R stands at W in the beginning.", facts)
    size = numbers(width, height).replace(" ", " m x ")
    comment = f"position(W,X,Y): W is at X and Y, in decimetres, on a floor of {size} m."
    facts = [
        f"position({point.name},{round(point.x * 10)},{round(point.y * 10)})." for point in points
    ]
    lines += _section(comment, facts)
    return "\n".join(lines) + "\n"


def _section(comment: str, facts: List[str]) -> Iterable[str]:
    if not facts:
        return
    yield ""
    yield f"% {comment}"
    for index in range(0, len(facts), _PER_LINE):
        yield " ".join(facts[index : index + _PER_LINE])
