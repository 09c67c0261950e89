"""What rviz shows of the building: a visualization_msgs/MarkerArray in YAML."""

from __future__ import annotations

import json
from typing import Iterator, Sequence

from rosoclingo_gazebo.world.description import Area, World
from rosoclingo_gazebo.world.geometry import Grid
from rosoclingo_gazebo.world.text import FLOORS, WALL, Colour, numbers, origin

# Types of visualization_msgs/Marker, which is not needed to make the file.
_CUBE, _TEXT = 1, 9

_FLOOR_HEIGHT = 0.01  # m, below of the map
_WALL_HEIGHT = 0.4  # m; lower than it is, to look over it
_LETTERS = 0.5  # m
_INK: Colour = (0.35, 0.35, 0.4)


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
        lines += _shape(_sign(room.areas), 0.05, _LETTERS)
        lines.append(f"  text: {json.dumps(room.name)}")
    return "\n".join(lines) + "\n"


def _sign(areas: Sequence[Area]) -> Area:
    """Returns where a room's name stands: in its largest area, along the northern wall."""
    area = max(areas, key=lambda area: area.size[0] * area.size[1])
    return Area(area.west, max(area.south, area.north - 2 * _LETTERS), area.east, area.north)


def _marker(namespace: str, number: int, kind: int, colour: Colour) -> Iterator[str]:
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
