"""Robots meet in corridors, in doors and where one of them stands: none touches, all arrive."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import pytest
from draws import draws

from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Fleet, Simulation
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import Pose

PACKAGE = Path(__file__).resolve().parents[2]
INSTANCE = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
WAYPOINTS = PACKAGE.parent / "rosoclingo_interfaces" / "config" / "graph_wg.yaml"
WAYS: List[Tuple[str, str]] = re.findall(
    r"connection\(([a-z]+\d+),([a-z]+\d+)\)", INSTANCE.read_text()
)
PLACES = {
    name: Pose(place.x, place.y, place.theta)
    for name, place in read_waypoints(WAYPOINTS).places.items()
}
AROUND: Dict[str, List[str]] = {name: [] for name in PLACES}
for one, other in WAYS:
    AROUND[one].append(other)
    AROUND[other].append(one)
LEAST = 0.37  # m, between the centres of two discs of 0.18 m radius
SLOW = 0.2  # m/s, on average over a way, besides
GRACE = 40.0  # simulated seconds, for turning and for others


class Drivers:
    """Robots, each of which drives from waypoint to waypoint without a break."""

    def __init__(
        self, office: OccupancyMap, planner: PathPlanner, routes: Sequence[List[str]]
    ) -> None:
        first, *rest = (PLACES[route[0]] for route in routes)
        body = KinematicPhysics(office, first)
        self.fleet = Fleet(
            [
                Simulation(
                    one, MoveBaseDriver(planner, Costmap(office, planner.grid), Limits(), 10.0)
                )
                for one in (body, *map(body.join, rest))
            ]
        )
        self._rest = [list(route) for route in routes]
        self._limits = [0.0] * len(routes)

    def run(self) -> None:
        """Drives to the end of all routes."""
        while not all(self._drives_no_more(number) for number in range(len(self._rest))):
            self.fleet.step()
            poses = self.fleet.robots[0].physics.robots
            for number, pose in enumerate(poses):
                assert all(pose.distance(other) > LEAST for other in poses[:number]), poses
                assert not self.fleet.robots[number].physics.touches, poses

    def _drives_no_more(self, number: int) -> bool:
        robot, rest = self.fleet.robots[number], self._rest[number]
        assert robot.move_base is not None
        outcome = robot.move_base.outcome
        if robot.move_base.goal is not None:
            assert robot.time < self._limits[number], (number, rest)
            return False
        assert outcome is None or outcome.end is End.SUCCEEDED, (number, rest, outcome)
        if len(rest) < 2:
            return True
        here, there = rest.pop(0), rest[0]
        metres = PLACES[here].distance(PLACES[there])
        self._limits[number] = robot.time + GRACE + metres / SLOW
        robot.move_base.start(PLACES[there])
        return False


@pytest.mark.costly
@pytest.mark.parametrize("way", [WAYS[2 * n] for n in draws([2, 4, 5, 11], 12)], ids="-".join)
def test_two_change_places(
    office: OccupancyMap, planner: PathPlanner, way: Tuple[str, str]
) -> None:
    Drivers(office, planner, [list(way), list(reversed(way))]).run()


@pytest.mark.costly
@pytest.mark.parametrize("way", WAYS[::5], ids="-".join)
def test_one_that_stands_makes_room(
    office: OccupancyMap, planner: PathPlanner, way: Tuple[str, str]
) -> None:
    drivers = Drivers(office, planner, [[way[1]], list(way)])
    drivers.run()
    assert drivers.fleet.robots[1].physics.pose.distance(PLACES[way[1]]) < 0.15


@pytest.mark.costly
@pytest.mark.parametrize("seed", draws([1, 2], 4))
@pytest.mark.parametrize("robots", [2, 3])
def test_encounters(office: OccupancyMap, planner: PathPlanner, robots: int, seed: int) -> None:
    Drivers(office, planner, random_routes(random.Random(seed), robots, ways=3)).run()


def random_routes(dice: random.Random, robots: int, ways: int) -> List[List[str]]:
    """Returns routes that begin at different waypoints near each other."""
    middle = dice.choice([name for name in PLACES if name.startswith("c")])
    near = {middle, *AROUND[middle], *(far for name in AROUND[middle] for far in AROUND[name])}
    routes = [[start] for start in dice.sample(sorted(near), robots)]
    for route in routes:
        for _ in range(ways):
            route.append(dice.choice(AROUND[route[-1]]))
    return routes
