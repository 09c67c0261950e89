"""How robots move in a task: ways as actions, with what they take and what has to be left."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import DefaultDict, Dict, Iterable, Iterator, List, Mapping, Sequence, Set, Tuple

from rosoclingo.engine.rows import level_of, unique
from rosoclingo.engine.task import Change, Kind, TaskAction
from rosoclingo.engine.ways import WayMap


class Moves:
    """Makes the ways of robots, as far as they may matter."""

    def __init__(
        self,
        ways: WayMap,
        limits: Mapping[str, int],
        actions: Sequence[TaskAction],
        *,
        robots: Sequence[Sequence[str]],
        draining: Sequence[Sequence[str]],
        reserving: Sequence[Sequence[str]],
        speeds: Sequence[Sequence[str]],
    ) -> None:
        """Reads rows.

        Args:
            ways: The map.
            limits: The largest level of each number.
            actions: All actions.
            robots: The robots that move on it.
            draining: For a robot, the number of which moving takes, and how much.
            reserving: For a robot, a number of which it keeps enough to get to where it refills.
            speeds: For a robot, how many percent of a way's length it needs in seconds.
        """
        self.robots = {row[0] for row in robots}
        self._map = ways
        drains: DefaultDict[str, DefaultDict[str, int]] = defaultdict(lambda: defaultdict(int))
        for robot, name, each in unique(draining):
            if name in limits:
                drains[robot][name] += max(0, int(each))
        self._drains = {robot: dict(each) for robot, each in drains.items()}
        self._reserves: Dict[str, Dict[str, Dict[str, int]]] = defaultdict(dict)
        for robot, name in reserving:
            drained = self._drains.get(robot, {}).get(name)
            refills = list(_refills(actions, robot, name, limits.get(name, -1)))
            if drained is not None and refills:
                jumps = list(_jumps(actions, robot))
                self._reserves[robot][name] = dict(ways.reserves(refills, drained, jumps))
        self._limits = limits
        self._percent: Dict[str, int] = {}
        for robot, percent in speeds:
            self._percent[robot] = max(self._percent.get(robot, 0), level_of(percent))

    @property
    def drained(self) -> Set[str]:
        """The numbers of which moving takes."""
        return {name for each in self._drains.values() for name in each}

    def numbers_of(self, robot: str) -> Iterable[str]:
        """Returns the numbers of which moving takes from a robot."""
        return self._drains.get(robot, {})

    def needed_at(self, robot: str, place: str) -> List[Tuple[str, int]]:
        """Returns what a robot has to have left at a place, of each number that it reserves."""
        return [
            (name, needed[place])
            for name, needed in self._reserves.get(robot, {}).items()
            if needed.get(place)
        ]

    def reserving(self, actions: Sequence[TaskAction]) -> Sequence[TaskAction]:
        """Returns actions that leave robots enough where they take them."""
        return [self._leaving(action) for action in actions] if self._reserves else actions

    def _leaving(self, action: TaskAction) -> TaskAction:
        bounds = {(kind, name): amount for kind, name, amount in action.numbers}
        for change in action.changes:
            robot = change.variable[3:-1]
            if robot in self._reserves and change.variable == f"at({robot})":
                for name, left in self.needed_at(robot, change.value):
                    needed = bounds.get((Kind.TAKES, name), 0) + left
                    key = Kind.LEAST, name
                    bounds[key] = max(bounds.get(key, 0), needed)
        numbers = tuple((kind, name, amount) for (kind, name), amount in bounds.items())
        return action if numbers == action.numbers else replace(action, numbers=numbers)

    def ways(self, robot: str, start: str, places: Iterable[str]) -> Iterator[TaskAction]:
        """Yields the ways of a robot from one place to others, as actions."""
        variable = f"at({robot})"
        distances = self._map.distances(start)
        for place in places:
            length = distances.get(place)
            if length is None or place == start:
                continue
            numbers = [
                (Kind.TAKES, name, each * length)
                for name, each in self._drains.get(robot, {}).items()
            ]
            takes = {name: amount for _, name, amount in numbers}
            numbers += [
                (Kind.LEAST, name, takes.get(name, 0) + left)
                for name, left in self.needed_at(robot, place)
            ]
            if all(amount <= self._limits[name] for _, name, amount in numbers):
                yield TaskAction(
                    robot, place, start, ((variable, start),),
                    changes=(Change(variable, place),), numbers=tuple(numbers), cost=length,
                    seconds=-(-length * self._percent.get(robot, 100) // 100),
                )  # fmt: skip


def _refills(actions: Sequence[TaskAction], robot: str, name: str, full: int) -> Iterator[str]:
    """Yields the places at which an action of a robot's position fills a number."""
    for action in actions:
        if (Kind.BECOMES, name, full) in action.numbers:
            yield from (place for variable, place in action.needs if variable == f"at({robot})")


def _jumps(actions: Sequence[TaskAction], robot: str) -> Iterator[Tuple[str, str]]:
    """Yields from where to where actions take a robot."""
    variable = f"at({robot})"
    for action in actions:
        starts = [place for name, place in action.needs if name == variable]
        for change in action.changes:
            if starts and change.variable == variable and not change.conditions:
                yield starts[0], change.value
