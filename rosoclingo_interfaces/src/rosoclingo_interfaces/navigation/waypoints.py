"""Reads a waypoint file: the poses on the map of an encoding's waypoints. Needs no ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Mapping

import yaml

from rosclingo import strict_yaml
from rosclingo.errors import TermError, shorten
from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.errors import WaypointError

_FARTHEST = 1e6  # metres of a place from the origin of its frame
_COORDINATES = ("x", "y", "theta")


@dataclass(frozen=True)
class Waypoint:
    """A place on the map, and the heading there.

    Attributes:
        x: In metres.
        y: In metres.
        theta: Direction in radians, counterclockwise from the x axis.
    """

    x: float
    y: float
    theta: float

    def distance(self, other: Waypoint) -> float:
        """Returns the distance between two waypoints, in metres."""
        return math.hypot(other.x - self.x, other.y - self.y)


@dataclass(frozen=True)
class Waypoints:
    """The content of a waypoint file.

    Attributes:
        file: Where it was read from.
        frame: The coordinates' frame, such as ``map``.
        places: The waypoints by their names, terms as clingo prints them.
    """

    file: Path
    frame: str
    places: Mapping[str, Waypoint]

    def find(self, name: str) -> Waypoint:
        """Returns the waypoint of a name.

        Raises:
            WaypointError: There is none; the message names those that there are.
        """
        try:
            return self.places[name]
        except KeyError:
            known = shorten(", ".join(self.places), 1000)
            raise WaypointError(
                f"there is no waypoint {shorten(name)} in {self.file}; there are {known}"
            ) from None


def read_waypoints(file: Path) -> Waypoints:
    """Reads a waypoint file: YAML with ``frame`` and ``waypoints``, as the package's README has it.

    Raises:
        WaypointError: The file cannot be read, or is no waypoint file; the message says where.
    """
    try:
        content = strict_yaml.load(file.read_text(encoding="utf-8"), strict_yaml.Texts)
        return _waypoints(file, content)
    except (OSError, UnicodeDecodeError) as err:
        text = shorten(str(err), 500)
        raise WaypointError(
            f"cannot read the waypoint file {shorten(str(file), 1000)}: {text}"
        ) from err
    except yaml.YAMLError as err:
        raise WaypointError(f"the waypoint file {file} is no YAML: {err}") from err
    except WaypointError as err:
        raise WaypointError(f"the waypoint file {file}: {err}") from err


def _waypoints(file: Path, content: Any) -> Waypoints:
    if not isinstance(content, dict) or set(content) != {"frame", "waypoints"}:
        raise WaypointError("expected the keys frame and waypoints, and no others")
    frame, entries = content["frame"], content["waypoints"]
    if not isinstance(frame, str) or not frame:
        raise WaypointError("frame: expected the name of a frame, such as map")
    if not isinstance(entries, dict) or not entries:
        raise WaypointError("waypoints: expected name: {x: 1.0, y: 2.0, theta: 0.0}, once or more")
    places: Dict[str, Waypoint] = {}
    for key, entry in entries.items():
        name = _name(key)
        if name in places:
            raise WaypointError(f"waypoints: {quote(name)} is there twice; remove one")
        places[name] = _waypoint(name, entry)
    return Waypoints(file, frame, places)


def _name(key: Any) -> str:
    try:
        return str(parse_term(str(key)))
    except TermError as err:
        raise WaypointError(
            f"waypoints: a name has to be a term such as c3 or c(1): {err}"
        ) from err


def _waypoint(name: str, entry: Any) -> Waypoint:
    if not isinstance(entry, dict) or set(entry) != set(_COORDINATES):
        raise WaypointError(f"waypoint {shorten(name)}: expected x, y and theta, and no others")
    return Waypoint(*(_number(name, word, entry[word]) for word in _COORDINATES))


def _number(name: str, word: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        unit = "radians" if word == "theta" else "metres"
        what = f"waypoint {shorten(name)}: {word}"
        raise WaypointError(f"{what}: expected a number of {unit}: {value!s:.80}")
    if word != "theta" and abs(number) > _FARTHEST:
        raise WaypointError(
            f"waypoint {shorten(name)}: {word}: expected at most {_FARTHEST:g} m: {value!s:.80}"
        )
    return number
