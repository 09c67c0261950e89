"""Parses a description's file; :mod:`.checks` checks what it says about space."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Tuple

import yaml

from rosclingo import strict_yaml
from rosclingo.errors import shorten
from rosoclingo_simulator.errors import WorldError
from rosoclingo_simulator.world.checks import check
from rosoclingo_simulator.world.description import (
    DEFAULT_FILES,
    WORLD_KINDS,
    Area,
    Room,
    World,
    WorldWaypoint,
)

_NAME = re.compile(r"_*[a-z]\w*", re.ASCII)  # a constant of clingo

_REQUIRED = ("name", "floor", "waypoints", "connections", "rooms")
_OPTIONAL = ("about", "resolution", "walls", "clearance", "start", "files")


def read_world(path: Path) -> World:
    """Reads and checks a description.

    Raises:
        WorldError: The file cannot be read, or something in it is wrong.
    """
    try:
        return _world(path)
    except OSError as err:
        raise WorldError(f"{path}: {err.strerror}; check the path") from err
    except UnicodeDecodeError as err:
        raise WorldError(f"{path} is not UTF-8 text: {err}; save it as UTF-8") from err
    except yaml.YAMLError as err:
        raise WorldError(f"{path} is not YAML: {err}") from err
    except WorldError as err:
        raise WorldError(f"{path}: {shorten(str(err), 1000)}") from err


def _world(path: Path) -> World:
    text = path.read_text(encoding="utf-8")
    top = _mapping(strict_yaml.load(text), "the description", _REQUIRED, _OPTIONAL)
    walls = _mapping(top.get("walls", {}), "walls", (), ("thickness", "height"))
    connections = _connections(top["connections"])
    waypoints = _waypoints(top["waypoints"], connections)
    name = _text(top["name"], "name")
    files = _mapping(top.get("files", {}), "files", (), tuple(DEFAULT_FILES))
    world = World(
        path=path,
        name=name,
        about=_text(top.get("about", name), "about"),
        floor=_area(top["floor"], "floor"),
        resolution=_positive(top.get("resolution", 0.05), "resolution"),
        thickness=_positive(walls.get("thickness", 0.2), "walls: thickness"),
        height=_positive(walls.get("height", 2.0), "walls: height"),
        clearance=_positive(top.get("clearance", 0.4), "clearance"),
        waypoints=waypoints,
        connections=connections,
        starts=_starts(top.get("start", {})),
        rooms=_rooms(top["rooms"]),
        files={
            kind: path.parent / _text(files.get(kind, default.format(name=name)), f"files: {kind}")
            for kind, default in DEFAULT_FILES.items()
        },
    )
    check(world)
    return world


def _waypoints(value: Any, connections: Tuple[Tuple[str, str], ...]) -> Dict[str, WorldWaypoint]:
    entries = {
        _constant(name, "waypoints"): _mapping(
            entry, f"waypoint {name}", ("kind", "at"), ("theta",)
        )
        for name, entry in _mapping(value, "waypoints").items()
    }
    places = {
        name: _numbers(entry["at"], 2, f"waypoint {name}: at") for name, entry in entries.items()
    }
    found = {}
    for name, entry in entries.items():
        kind = _kind(entry["kind"], f"waypoint {name}")
        theta = entry.get("theta")
        if theta is None:
            theta = _into(name, places, connections) if kind == "office" else 0.0
        theta = _number(theta, f"waypoint {name}: theta")
        x, y = places[name]
        found[name] = WorldWaypoint(name, kind, x, y, theta)
    return found


def _into(
    name: str, places: Mapping[str, List[float]], connections: Tuple[Tuple[str, str], ...]
) -> float:
    """Returns where a robot looks that comes to an office by the first connection."""
    for ends in connections:
        if name in ends:
            other = ends[0] if ends[1] == name else ends[1]
            if other in places:
                (x, y), (from_x, from_y) = places[name], places[other]
                return round(math.atan2(y - from_y, x - from_x), 4)
    return 0.0


def _connections(value: Any) -> Tuple[Tuple[str, str], ...]:
    found: List[Tuple[str, str]] = []
    for entry in _list(value, "connections"):
        if not isinstance(entry, list) or len(entry) != 2:
            raise WorldError(f"connections: expected pairs such as [c1, c2], not {entry!r}")
        first, second = (_constant(name, f"connection {entry}") for name in entry)
        if first == second:
            raise WorldError(f"connection {entry}: a waypoint is not next to itself; remove it")
        if {first, second} in [set(other) for other in found]:
            raise WorldError(
                f"connection {entry} is there twice; remove one, it counts in both directions"
            )
        found.append((first, second))
    return tuple(found)


def _starts(value: Any) -> Dict[str, str]:
    return {
        _constant(robot, "start"): _constant(waypoint, f"start: {robot}")
        for robot, waypoint in _mapping(value, "start").items()
    }


def _rooms(value: Any) -> Tuple[Room, ...]:
    rooms = []
    for name, entry in _mapping(value, "rooms").items():
        where = f"room {name}"
        room = _mapping(entry, where, ("kind", "areas"), ("doors",))
        areas, doors = (
            tuple(_area(area, f"{where}: {part}") for area in _list(room.get(part, []), where))
            for part in ("areas", "doors")
        )
        if not areas:
            raise WorldError(f"{where}: it has no area; give at least one")
        rooms.append(Room(str(name), _kind(room["kind"], where), areas, doors))
    return tuple(rooms)


def _mapping(
    value: Any,
    where: str,
    required: Tuple[str, ...] = (),
    optional: Optional[Tuple[str, ...]] = None,
) -> Dict[Any, Any]:
    """Returns a mapping after a check for missing keys and, with ``optional``, unknown ones."""
    if not isinstance(value, dict):
        raise WorldError(f"{where}: expected names with values (NAME: VALUE), not {value!r:.80}")
    for key in required:
        if key not in value:
            raise WorldError(f"{where}: {key} is missing; add it")
    if optional is not None:
        known = (*required, *optional)
        for key in value:
            if key not in known:
                raise WorldError(
                    f"{where}: there is no entry {key!r}; there are {', '.join(known)}"
                )
    return value


def _list(value: Any, where: str) -> List[Any]:
    if not isinstance(value, list):
        raise WorldError(f"{where}: expected a list, not {value!r:.80}")
    return value


def _number(value: Any, where: str) -> float:
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (good and math.isfinite(value)):
        raise WorldError(f"{where}: expected a number, not {value!r:.80}")
    return float(value)


def _positive(value: Any, where: str) -> float:
    number = _number(value, where)
    if number <= 0:
        raise WorldError(f"{where}: expected a number above 0, not {value}")
    return number


def _numbers(value: Any, count: int, where: str) -> List[float]:
    if not isinstance(value, list) or len(value) != count:
        raise WorldError(f"{where}: expected a list of {count} numbers, not {value!r:.80}")
    return [_number(number, where) for number in value]


def _area(value: Any, where: str) -> Area:
    area = Area(*_numbers(value, 4, where))
    if not (area.west < area.east and area.south < area.north):
        raise WorldError(f"{where}: {area} has no inside; the order is [west, south, east, north]")
    return area


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise WorldError(f"{where}: expected a text, not {value!r:.80}")
    return value.strip()


def _constant(value: Any, where: str) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        raise WorldError(
            f"{where}: {value!r} is no name; a name has letters and digits, and begins with a "
            "small letter"
        )
    return value


def _kind(value: Any, where: str) -> str:
    if value not in WORLD_KINDS:
        raise WorldError(f"{where}: there is no kind {value!r}; there are {', '.join(WORLD_KINDS)}")
    return str(value)
