"""The description of a world, as values. Lengths are in metres, angles in radians."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Mapping, Tuple

WORLD_KINDS = ("open", "corridor", "office")
"""What a waypoint or a room can be."""

MOST_CELLS = 20_000_000
"""Cells of a map, which take seconds to read; a floor of 220 m square has as many of 5 cm."""

DEFAULT_FILES = {
    "instance": "{name}.lp",
    "waypoints": "{name}_waypoints.yaml",
    "map": "{name}_map.yaml",
    "gazebo": "{name}.world",
    "mujoco": "{name}.xml",
    "markers": "{name}_markers.yaml",
}
"""The files that are made of a description, and what they are called if it does not say so."""


@dataclass(frozen=True)
class Area:
    """A rectangle of the floor, along the axes."""

    west: float
    south: float
    east: float
    north: float

    @property
    def centre(self) -> Tuple[float, float]:
        """The point in the middle."""
        return (self.west + self.east) / 2, (self.south + self.north) / 2

    @property
    def size(self) -> Tuple[float, float]:
        """The lengths in x and in y."""
        return self.east - self.west, self.north - self.south

    def contains(self, x: float, y: float) -> bool:
        """Whether a point is inside, or on the edge."""
        return self.west <= x <= self.east and self.south <= y <= self.north

    def __str__(self) -> str:
        return f"[{self.west:g}, {self.south:g}, {self.east:g}, {self.north:g}]"


@dataclass(frozen=True)
class WorldWaypoint:
    """A place where a robot can be told to go.

    Attributes:
        kind: One of ``WORLD_KINDS``.
        theta: Where a robot looks there; 0 is east, and it grows to the left.
    """

    name: str
    kind: str
    x: float
    y: float
    theta: float


@dataclass(frozen=True)
class Room:
    """A part of the free floor.

    Attributes:
        kind: One of ``WORLD_KINDS``.
        areas: The room is all of them.
        doors: Openings in the walls of the room; an area from one side of the wall to the other.
    """

    name: str
    kind: str
    areas: Tuple[Area, ...]
    doors: Tuple[Area, ...]


@dataclass(frozen=True)
class World:
    """A world's description.

    Attributes:
        path: The file of the description.
        about: What it is, half a sentence.
        floor: What the map shows; walls stand on it, too.
        resolution: Metres per pixel of the map.
        thickness: How thick the walls are.
        height: How high they are.
        clearance: How far ways stay away from walls.
        waypoints: By their names, in the description's order, like everything here.
        connections: Pairs of waypoints next to each other.
        starts: For each robot, the waypoint where it begins.
        rooms: The free floor.
        files: For each kind of file, its path.
    """

    path: Path
    name: str
    about: str
    floor: Area
    resolution: float
    thickness: float
    height: float
    clearance: float
    waypoints: Mapping[str, WorldWaypoint]
    connections: Tuple[Tuple[str, str], ...]
    starts: Mapping[str, str]
    rooms: Tuple[Room, ...]
    files: Mapping[str, Path]

    @property
    def free(self) -> Tuple[Area, ...]:
        """All areas and doors."""
        return tuple(area for room in self.rooms for area in (*room.areas, *room.doors))
