"""Checks that a robot can drive in a world as its description says."""

from __future__ import annotations

import itertools
from typing import Iterable, Tuple

from rosoclingo_simulator.errors import WorldError
from rosoclingo_simulator.world.description import MOST_CELLS, Area, World, WorldWaypoint
from rosoclingo_simulator.world.geometry import Grid, distance

_NEARLY = 1e-6  # m; what numbers such as 0.1 + 0.2 may be off


def check(world: World) -> None:
    """Checks that a world can be built and driven in.

    Raises:
        WorldError: There is such a thing; the message names it and the remedy.
    """
    _check_names(world)
    _check_grid(world)
    _check_rooms(world)
    _check_doors(world)
    for point in world.waypoints.values():
        _check_waypoint(world, point)
    _check_ways(world, Grid(world).boxes())


def _check_names(world: World) -> None:
    named = [
        (f"connection [{', '.join(ends)}]", name) for ends in world.connections for name in ends
    ]
    named += [(f"start of {robot}", name) for robot, name in world.starts.items()]
    for where, name in named:
        if name not in world.waypoints:
            raise WorldError(
                f"{where}: there is no waypoint {name}; add it to waypoints, or correct the name"
            )


def _check_grid(world: World) -> None:
    unit = world.resolution
    width, height = (length / unit for length in world.floor.size)
    if width * height > MOST_CELLS:
        raise WorldError(
            f"floor: {world.floor} has more than {MOST_CELLS} cells of {unit:g} m; correct it, or "
            "resolution"
        )
    _on_grid("floor", world.floor.size, unit)
    _on_grid("walls: thickness", (world.thickness,), unit)
    for room in world.rooms:
        for area in (*room.areas, *room.doors):
            floor = world.floor
            edges = (area.west - floor.west, area.south - floor.south, *area.size)
            _on_grid(f"room {room.name}: {area}", edges, unit)
    for point in world.waypoints.values():
        # Instances have coordinates in decimetres, because clingo has integers only.
        _on_grid(f"waypoint {point.name}: at", (point.x, point.y), 0.1)


def _on_grid(where: str, lengths: Iterable[float], unit: float) -> None:
    for length in lengths:
        count = length / unit
        if (
            not abs(count) < MOST_CELLS
            or abs(count - round(count)) > _NEARLY
            or abs(length - round(count) * unit) > _NEARLY  # 8 m are no multiple of 10,000 km
        ):
            raise WorldError(f"{where}: {length:g} is no multiple of {unit:g} m; round it")


def _check_rooms(world: World) -> None:
    floor, wall = world.floor, world.thickness
    inside = Area(floor.west + wall, floor.south + wall, floor.east - wall, floor.north - wall)
    for room in world.rooms:
        for area in room.areas:
            if not (
                inside.contains(area.west + _NEARLY, area.south + _NEARLY)
                and inside.contains(area.east - _NEARLY, area.north - _NEARLY)
            ):
                raise WorldError(
                    f"room {room.name}: {area} and its walls of {wall:g} m do not fit on the floor "
                    f"{floor}; keep to {inside}"
                )
    for office, room in itertools.permutations(world.rooms, 2):
        for area, other in itertools.product(office.areas, room.areas):
            if office.kind == "office" and _gap(area, other) < wall - _NEARLY:
                raise WorldError(
                    f"room {office.name}: {area} leaves no room for a wall to {other} of "
                    f"{room.name}; keep {wall:g} m between them"
                )


def _check_doors(world: World) -> None:
    for room in world.rooms:
        others = [area for other in world.rooms if other is not room for area in other.areas]
        for door in room.doors:
            for areas, what in ((room.areas, "this room"), (others, "any other room")):
                if all(_gap(door, area) > _NEARLY for area in areas):
                    raise WorldError(
                        f"room {room.name}: the door {door} does not touch {what}; a door reaches "
                        "from one side of the wall to the other"
                    )


def _gap(first: Area, second: Area) -> float:
    """Returns how far two areas are apart in x or in y, whichever is more; below 0 if not."""
    return max(
        first.west - second.east,
        second.west - first.east,
        first.south - second.north,
        second.south - first.north,
    )


def _check_waypoint(world: World, point: WorldWaypoint) -> None:
    where = f"waypoint {point.name} at [{point.x:g}, {point.y:g}]"
    rooms = [room for room in world.rooms if any(a.contains(point.x, point.y) for a in room.areas)]
    if not rooms:
        raise WorldError(f"{where} is in no room, but in a wall or outside; move it")
    kinds = sorted({room.kind for room in rooms})
    if point.kind not in kinds:
        raise WorldError(
            f"{where} has the kind {point.kind}, and {rooms[0].name}, where it is, has the kind "
            f"{kinds[0]}; move it, or change a kind"
        )


def _check_ways(world: World, walls: Tuple[Area, ...]) -> None:
    points = world.waypoints
    ways = [(f"waypoint {name}", name, name) for name in points]
    ways += [(f"connection [{a}, {b}]: the straight way", a, b) for a, b in world.connections]
    for what, first, second in ways:
        begin, end = ((points[name].x, points[name].y) for name in (first, second))
        gap, wall = min(((distance(begin, end, wall), wall) for wall in walls), key=lambda p: p[0])
        if gap >= world.clearance - _NEARLY:
            continue
        if gap == 0:
            raise WorldError(
                f"{what} crosses the wall {wall} outside of a door; move the door or a waypoint"
            )
        raise WorldError(
            f"{what} is {gap:.2f} m from the wall {wall}, less than the clearance of "
            f"{world.clearance:g} m; move the door or a waypoint, or widen the door"
        )
