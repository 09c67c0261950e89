"""Boxes that stand in the way between two waypoints."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple, Set

import numpy as np

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints
from rosoclingo_simulator.errors import ObstacleError
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, Box, SharedSpace

_LENGTH_METRES = 0.4  # of a box, along the way
_GAP_METRES = 0.1  # left on either side, too narrow for the robot
_STEP_METRES = 0.05
_MIDDLE = (0.25, 0.75)  # part of the way where a box may stand
_ALIKE_METRES = 0.1  # widths that differ less are the same
_ROBOT_GAP_METRES = 0.05  # to the robot


class PassageEnd(NamedTuple):
    """An end of a way that a box closes.

    Attributes:
        name: Its name, given by the caller.
        place: Where it is.
    """

    name: str
    place: Waypoint


@dataclass
class Obstacles:
    """Does the commands ``block c4 c5`` and ``unblock c4 c5``. One thread uses it.

    Attributes:
        world: Where the walls are.
        waypoints: The places that commands name.
        physics: Where the boxes are put.
    """

    world: OccupancyMap
    waypoints: Waypoints
    physics: SharedSpace
    _names: Set[str] = field(default_factory=set)  # of boxes, the same in both directions of a way

    def obey(self, command: str) -> str:
        """Does a command.

        Returns:
            What was done.

        Raises:
            RosclingoError: It cannot be done.
        """
        words = command.split()
        if len(words) != 3 or words[0] not in ("block", "unblock"):
            raise ObstacleError(
                "expected block or unblock and two waypoints, such as block c4 c5: "
                f"{quote(command)}"
            )
        ends = [PassageEnd(word, self._find(word)) for word in words[1:]]
        return self.block(*ends) if words[0] == "block" else self.unblock(*ends)

    def check(self, first: PassageEnd, second: PassageEnd) -> None:
        """Checks that a box can stand between two places if no robot does.

        Raises:
            ObstacleError: It cannot; the message says why.
        """
        self._box(_way(first, second), first.place, second.place)

    def block(self, first: PassageEnd, second: PassageEnd) -> str:
        """Puts a box between two places, and returns what was done.

        Raises:
            ObstacleError: It cannot stand there, or not now.
        """
        name, way = _box_name(first, second), _way(first, second)
        if name in self._names:
            return f"there is a box between {way} already"
        box = self._box(way, first.place, second.place)
        least = ROBOT_RADIUS + _ROBOT_GAP_METRES
        if any(box.distance(robot.x, robot.y) < least for robot in self.physics.robots):
            raise ObstacleError(
                f"a robot is where a box between {way} would stand; try again when it has left"
            )
        self.physics.put(name, box)
        self._names.add(name)
        return f"a box of {box.width:.2f} m stands between {way} at ({box.x:.2f}, {box.y:.2f})"

    def unblock(self, first: PassageEnd, second: PassageEnd) -> str:
        """Takes the box between two places away, and returns what was done.

        Raises:
            ObstacleError: There is none.
        """
        name, way = _box_name(first, second), _way(first, second)
        if name not in self._names:
            raise ObstacleError(f"there is no box between {way}")
        self.physics.remove(name)
        self._names.remove(name)
        return f"the box between {way} is gone"

    def _find(self, word: str) -> Waypoint:
        try:
            name = str(parse_term(word))
        except TermError as err:
            raise ObstacleError(f"{quote(word)} is no waypoint: {err}") from err
        return self.waypoints.find(name)

    def _box(self, way: str, first: Waypoint, second: Waypoint) -> Box:
        """Returns a box that closes the way where it is narrowest, or else in the middle."""
        dx, dy = second.x - first.x, second.y - first.y
        length = math.hypot(dx, dy)
        if length < 2 * _LENGTH_METRES:
            raise ObstacleError(f"{way} are too close together for a box between them")
        begin, direction = np.array((first.x, first.y)), np.array((dx, dy)) / length
        places = np.linspace(0.0, length, 1 + 2 * math.ceil(length / 2 / _STEP_METRES))
        if (self.world.distances_at(begin + places[:, None] * direction) == 0).any():
            raise ObstacleError(f"there is a wall on the straight way between {way}")
        side = np.array((-direction[1], direction[0]))
        # How far it is free to the left and to the right of each place, in metres.
        sides = np.array(
            [[self._free(begin + at * direction, to) for to in (side, -side)] for at in places]
        )
        widths = sides.sum(axis=1)
        middle = (places >= _MIDDLE[0] * length) & (places <= _MIDDLE[1] * length)
        narrow = places[middle & (widths < widths[middle].min() + _ALIKE_METRES)]
        place = float(narrow[np.abs(narrow - length / 2).argmin()])
        # As wide as it is free all along the box, which must not stand in a wall.
        left, right = sides[np.abs(places - place) <= _LENGTH_METRES / 2].min(axis=0)
        centre = begin + place * direction + (left - right) / 2 * side
        return Box(
            x=float(centre[0]),
            y=float(centre[1]),
            theta=math.atan2(dy, dx),
            length=_LENGTH_METRES,
            width=float(left + right) - 2 * _GAP_METRES,
        )

    def _free(self, place: np.ndarray, direction: np.ndarray) -> float:
        grid = self.world.grid
        step = grid.resolution / 2
        ways = np.arange(0.0, (grid.rows + grid.columns) * grid.resolution, step)
        solid = self.world.distances_at(place + ways[:, None] * direction) == 0
        return float(ways[int(solid.argmax())])


def _way(first: PassageEnd, second: PassageEnd) -> str:
    return f"{first.name} and {second.name}"


def _box_name(first: PassageEnd, second: PassageEnd) -> str:
    """Returns the name of a box, the same in both directions of a way."""
    return " ".join(sorted((first.name, second.name)))
