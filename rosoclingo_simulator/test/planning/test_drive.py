"""The robot drives along each way of the office, in both directions, also with a box in the way."""

from __future__ import annotations

import re
from pathlib import Path
from typing import List, Tuple

import pytest
from draws import draws

from rosoclingo_interfaces.navigation.waypoints import Waypoints, read_waypoints
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import Pose

PACKAGE = Path(__file__).resolve().parents[2]
INSTANCE = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
WAYPOINTS = PACKAGE.parent / "rosoclingo_interfaces" / "config" / "graph_wg.yaml"
LEAST_GAP = 0.2  # m, between the robot and any wall
ALONG, AROUND = 35.0, 200.0  # simulated seconds for a way, and for the whole loop

WAYS: List[Tuple[str, str]] = [
    way
    for one, other in re.findall(r"connection\(([a-z]+\d+),([a-z]+\d+)\)", INSTANCE.read_text())
    for way in ((one, other), (other, one))
]
# With a box, which stands at the same place from both sides: 23 ways, each from one of them.
WITH_A_BOX = [WAYS[number] for number in draws((2 * n + n % 2 for n in range(23)), 46)]
LOOP = {"c1", "c2", "c3", "c4", "c5", "c6", "open1"}


@pytest.fixture(scope="module")
def waypoints() -> Waypoints:
    return read_waypoints(WAYPOINTS)


class Drive:
    """A drive from one waypoint to another."""

    def __init__(
        self, office: OccupancyMap, planner: PathPlanner, waypoints: Waypoints, way: Tuple[str, str]
    ) -> None:
        start, goal = (waypoints.find(name) for name in way)
        self.goal = Pose(goal.x, goal.y, goal.theta)
        self._office = office
        physics = KinematicPhysics(office, Pose(start.x, start.y, start.theta))
        move_base = MoveBaseDriver(planner, Costmap(office, planner.grid), Limits(), 10.0)
        self.simulation = Simulation(physics, move_base)
        self.obstacles = Obstacles(office, waypoints, physics)

    def run(self, seconds: float) -> End:
        """Drives to the end, touching nothing, and returns how it was."""
        self.simulation.move_base.start(self.goal)
        while self.simulation.move_base.active:
            self.simulation.step()
            assert self.simulation.time < seconds
            pose = self.simulation.physics.pose
            assert self._office.clearance(pose.x, pose.y) > LEAST_GAP + 0.18, pose
            assert not self.simulation.physics.touches, pose
        assert self.simulation.move_base.outcome is not None
        return self.simulation.move_base.outcome.end


@pytest.mark.costly
@pytest.mark.parametrize("way", WAYS, ids="-".join)
def test_a_way(
    office: OccupancyMap, planner: PathPlanner, waypoints: Waypoints, way: Tuple[str, str]
) -> None:
    drive = Drive(office, planner, waypoints, way)
    assert drive.run(ALONG) is End.SUCCEEDED
    assert not drive.simulation.move_base.costmap.marked.any()  # it has seen nothing but the map
    assert drive.simulation.physics.pose.distance(drive.goal) < 0.15


@pytest.mark.costly
@pytest.mark.parametrize("way", WITH_A_BOX, ids="-".join)
def test_a_way_with_a_box(
    office: OccupancyMap, planner: PathPlanner, waypoints: Waypoints, way: Tuple[str, str]
) -> None:
    drive = Drive(office, planner, waypoints, way)
    drive.obstacles.obey("block {} {}".format(*way))
    direct = drive.simulation.physics.pose.distance(drive.goal)
    if set(way) <= LOOP:
        assert drive.run(AROUND) is End.SUCCEEDED
        assert drive.simulation.time > 3 * direct / 0.5
    else:
        assert drive.run(AROUND) is End.ABORTED
        assert drive.simulation.physics.pose.distance(drive.goal) > 1.0
    # Whoever clears the costmap and takes the box away gets through.
    drive = Drive(office, planner, waypoints, way)
    drive.obstacles.obey("block {} {}".format(*way))
    drive.simulation.is_watched = lambda: True
    drive.simulation.step()
    drive.obstacles.obey("unblock {1} {0}".format(*way))
    drive.simulation.move_base.costmap.clear()
    assert drive.run(ALONG) is End.SUCCEEDED


def test_all_ways_are_there() -> None:
    assert len(WAYS) == len(set(WAYS)) == 46
    assert {frozenset(way) for way in WITH_A_BOX} == {frozenset(way) for way in WAYS}
