"""Generates the markers of a building for rviz: a visualization_msgs/MarkerArray in YAML."""

from __future__ import annotations

import json
from typing import Iterator

from rosoclingo_simulator.world.description import Area, Room, World
from rosoclingo_simulator.world.geometry import Grid
from rosoclingo_simulator.world.text import FLOORS, WALL, TextColour, numbers, origin

# Types of visualization_msgs/Marker, which is not needed to make the file.
_CUBE, _TEXT = 1, 9

_FLOOR_HEIGHT = 0.01  # m, below of the map
_WALL_HEIGHT = 0.4  # m; lower than it is, to look over it
_LETTERS = 0.5  # m
# How far along a room its name is: not where the names of waypoints and the numbers of steps are.
_PART = {"open": 0.3, "corridor": 0.6, "office": 0.25}
_INK: TextColour = (0.35, 0.35, 0.4)


def marker_file(world: World, grid: Grid) -> str:
    """Returns the file: walls, the rooms' floors and their names."""
    lines = [
        f"# The {world.name} for rviz, a visualization_msgs/MarkerArray.",
        f"# {origin(world)}",
        "markers:",
    ]
    for index, wall in enumerate(grid.boxes()):
        lines += _marker("walls", index, _CUBE, WALL)
        lines += _shape(wall, _WALL_HEIGHT / 2, _WALL_HEIGHT)
    floors = [(room, area) for room in world.rooms for area in (*room.areas, *room.doors)]
    for index, (room, area) in enumerate(floors):
        lines += _marker("floors", index, _CUBE, FLOORS[room.kind])
        lines += _shape(area, -_FLOOR_HEIGHT, _FLOOR_HEIGHT)
    for index, room in enumerate(world.rooms):
        lines += _marker("rooms", index, _TEXT, _INK)
        lines += _shape(_sign(room), 0.05, _LETTERS)
        lines.append(f"  text: {json.dumps(room.name)}")
    return "\n".join(lines) + "\n"


def _sign(room: Room) -> Area:
    """Returns where a room's name is: in its largest area, along the wall that has no door."""
    area = max(room.areas, key=lambda area: area.size[0] * area.size[1])
    (width, height), part = area.size, _PART[room.kind]
    if room.kind != "office" and height > width:
        x, y = area.centre[0], area.south + part * height
    else:
        x, y = area.west + max(part * width, 3 * _LETTERS), area.north - _LETTERS
        if room.doors and room.doors[0].centre[1] > area.centre[1]:
            y = area.south + _LETTERS
    return Area(x - _LETTERS, y - _LETTERS, x + _LETTERS, y + _LETTERS)


def _marker(namespace: str, number: int, kind: int, colour: TextColour) -> Iterator[str]:
    yield "- header: {frame_id: map}"
    yield f"  ns: {namespace}"
    yield f"  id: {number}"
    yield f"  type: {kind}"
    yield f"  color: {_vector('rgba', *colour, 1)}"


def _shape(area: Area, z: float, height: float) -> Iterator[str]:
    position = _vector("xyz", *area.centre, z)
    yield f"  pose: {{position: {position}, orientation: {{w: 1}}}}"
    yield f"  scale: {_vector('xyz', *area.size, height)}"


def _vector(names: str, *values: float) -> str:
    words = zip(names, numbers(*values).split())
    return "{" + ", ".join(f"{name}: {word}" for name, word in words) + "}"
