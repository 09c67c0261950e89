"""Turns a situation into shapes. Needs no ROS. Lengths are in metres."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass
from typing import DefaultDict, Iterator, List, Tuple

from rosoclingo.drawing.situation import MapSituation, Package
from rosoclingo.encodings.graph import Graph, MapPoint

Colour = Tuple[float, float, float]

EDGE: Colour = (0.45, 0.55, 0.75)
WAYPOINT: Colour = (0.15, 0.3, 0.65)
NAME: Colour = (0.05, 0.1, 0.3)
BLOCKED: Colour = (0.9, 0.05, 0.05)
PLAN: Colour = (0.95, 0.5, 0.0)
ROBOT_COLOUR: Colour = (0.2, 0.2, 0.22)
PACKAGE: Colour = (0.5, 0.25, 0.05)
DELIVERED: Colour = (0.1, 0.65, 0.2)

_LETTERS = 0.6
_ABOVE = 0.6  # where texts are: higher than the walls that rviz shows
_ROBOT_RADIUS, _ROBOT_HEIGHT = 0.18, 0.4
_BOX = 0.3
_PROGRESS_AT = (-1.0, 0.0, _ABOVE)  # behind the robot; packages' names are before it
_ASIDE = 0.5  # how far a step's number is to the right of its arrow


@dataclass(frozen=True)
class Shape:
    """A shape to draw: lines, a box or a text, say.

    Attributes:
        group: What it belongs to; can be hidden in rviz. All of a group move with robots, or none
            does: rviz ends when a marker of a group and number ceases to move along.
        kind: ``lines`` (from each point to the next, in pairs), ``dots``, ``arrow`` (from the first
            point to the second), ``box``, ``cylinder`` or ``text`` (each at the first point).
        points: x, y and z.
        size: Width of lines, diameter of dots, edge of a box, height of letters.
        height: Of a cylinder.
        robot: The robot whose frame the points are in; empty for the map.
    """

    group: str
    kind: str
    points: Tuple[Tuple[float, float, float], ...]
    size: float
    colour: Colour
    text: str = ""
    height: float = 0.0
    robot: str = ""


def draw(graph: Graph, situation: MapSituation) -> List[Shape]:
    """Returns the shapes of a situation; waypoints outside of the graph are left out."""
    middle, size = ((0.0, 0.0, _ROBOT_HEIGHT / 2),), 2 * _ROBOT_RADIUS
    return [
        *_graph(graph, situation),
        *_plan(graph, situation),
        *(
            Shape(
                "robots", "cylinder", middle, size, ROBOT_COLOUR, height=_ROBOT_HEIGHT, robot=robot
            )
            for robot in situation.positions
        ),
        *(
            Shape("progress", "text", (_PROGRESS_AT,), _LETTERS, PLAN, f"{done:.0%}", robot=robot)
            for robot, done in situation.progress.items()
        ),
        *_packages(graph, situation),
    ]


def _graph(graph: Graph, situation: MapSituation) -> Iterator[Shape]:
    places = graph.places
    for group, blocked, size, colour in (
        ("ways", False, 0.08, EDGE),
        ("blocked ways", True, 0.25, BLOCKED),
    ):
        points = tuple(
            (*places[end], 0.06)
            for edge in graph.edges
            if (frozenset(edge) in situation.blocked) is blocked
            for end in edge
        )
        if points:
            yield Shape(group, "lines", points, size, colour)
    dots = tuple((x, y, 0.1) for x, y in places.values())
    yield Shape("waypoints", "dots", dots, 0.35, WAYPOINT)
    for name, (x, y) in places.items():
        yield Shape("names", "text", ((x - 0.5, y + 0.5, _ABOVE),), _LETTERS, NAME, name)


def _plan(graph: Graph, situation: MapSituation) -> Iterator[Shape]:
    """Draws an arrow for each move, and the numbers of all steps that use it."""
    moves: DefaultDict[Tuple[str, str], List[int]] = defaultdict(list)
    errands: DefaultDict[str, List[str]] = defaultdict(list)
    positions = dict(situation.positions)
    for step in situation.steps:
        here = positions.get(step.robot)
        if here is None or here not in graph.places:
            continue
        if not step.action.match("go", 1):
            errands[here].append(f"{step.number} {step.action}")
            continue
        there = str(step.action.arguments[0])
        if there in graph.places and there != here:
            moves[here, there].append(step.number)
            positions[step.robot] = there
    for (here, there), numbers in moves.items():
        begin, end = graph.places[here], graph.places[there]
        yield Shape("plan", "arrow", ((*begin, 0.15), (*end, 0.15)), 0.15, PLAN)
        x, y = _beside(begin, end)
        text = " ".join(str(number) for number in numbers)
        yield Shape("plan's steps", "text", ((x, y, _ABOVE),), _LETTERS, PLAN, text)
    for waypoint, lines in errands.items():
        x, y = graph.places[waypoint]
        text = "\n".join(lines)
        at = (x + 1.9, y + 0.6, _ABOVE)  # beside the name, above packages
        yield Shape("plan's steps", "text", (at,), _LETTERS, PLAN, text)


def _beside(begin: MapPoint, end: MapPoint) -> MapPoint:
    """Returns a point to the right of the middle of an arrow: the way back has its own."""
    x, y = end[0] - begin[0], end[1] - begin[1]
    aside = _ASIDE / (math.hypot(x, y) or 1.0)
    return (begin[0] + end[0]) / 2 + y * aside, (begin[1] + end[1]) / 2 - x * aside


def _packages(graph: Graph, situation: MapSituation) -> Iterator[Shape]:
    heaps: DefaultDict[Tuple[str, str], List[Package]] = defaultdict(list)
    for package in situation.packages:
        if package.robot or package.place in graph.places:
            heaps[package.place, package.robot].append(package)
    for (waypoint, robot), heap in heaps.items():
        for index, package in enumerate(heap):
            if robot:
                x, y, z = 0.0, 0.0, _ROBOT_HEIGHT + (index + 0.5) * _BOX
            else:
                x, y = graph.places[waypoint]
                x, y, z = x + 0.6, y - index * 1.5 * _LETTERS, _BOX / 2
            colour = DELIVERED if package.delivered else PACKAGE
            group = "carried packages" if robot else "packages"
            yield Shape(group, "box", ((x, y, z),), _BOX, colour, robot=robot)
            at = (x + 1.5, y, max(z, _ABOVE))
            yield Shape(group, "text", (at,), _LETTERS, colour, package.label, robot=robot)
