"""With MuJoCo's physics, the robot drives along all ways of the office and touches nothing."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Callable, List, Tuple

import pytest
import yaml
from draws import draws

from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import Pose

PACKAGE = Path(__file__).resolve().parents[2]
INSTANCE = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
WAYPOINTS = PACKAGE.parent / "rosoclingo_interfaces" / "config" / "graph_wg.yaml"
TIMEOUT = 60.0  # simulated seconds, what the mailbot allows for a way
TOLERANCE = 0.15  # m
RADIUS = 0.18  # m, of the robot

PLACES = {
    name: Pose(place["x"], place["y"], place["theta"])
    for name, place in yaml.safe_load(WAYPOINTS.read_text())["waypoints"].items()
}
WAYS = [
    way
    for one, other in re.findall(r"connection\((\w+),(\w+)\)", INSTANCE.read_text())
    if one in PLACES
    for way in ((one, other), (other, one))
]
# Each way in one direction; test_drive.py drives all in both, without MuJoCo.
DRIVEN = [WAYS[number] for number in draws((2 * n + (n + 1) % 2 for n in range(23)), 46)]


@pytest.fixture
def start(office: OccupancyMap, planner: PathPlanner) -> Callable[[str], Simulation]:
    def start_at(name: str) -> Simulation:
        world, robot = PACKAGE / "worlds" / "office.xml", PACKAGE / "models" / "turtlebot.xml"
        physics = MujocoPhysics(world, PLACES[name], robot)
        return Simulation(
            physics, MoveBaseDriver(planner, Costmap(office, planner.grid), Limits(), TIMEOUT)
        )

    return start_at


def drive(simulation: Simulation, office: OccupancyMap, goal: str, seconds: float) -> List[Pose]:
    """Drives until the goal is reached or the time is over, and returns where the robot was."""
    simulation.move_base.start(PLACES[goal])
    end = simulation.time + seconds
    poses = []
    while simulation.move_base.active and simulation.time < end:
        simulation.step()
        pose = simulation.physics.pose
        poses.append(pose)
        assert not simulation.physics.touches, f"touches something at {pose}"
        assert office.clearance(pose.x, pose.y) > RADIUS, pose
    return poses


def test_there_are_ways_to_all_offices() -> None:
    assert {f"o{number}" for number in range(1, 15)} <= {end for _, end in WAYS}
    assert len(WAYS) == 46
    assert {frozenset(way) for way in DRIVEN} == {frozenset(way) for way in WAYS}


@pytest.mark.costly
@pytest.mark.parametrize("way", DRIVEN, ids="-".join)
def test_a_way(
    start: Callable[[str], Simulation], office: OccupancyMap, way: Tuple[str, str]
) -> None:
    simulation = start(way[0])
    poses = drive(simulation, office, way[1], TIMEOUT)
    outcome = simulation.move_base.outcome
    assert outcome is not None
    assert outcome.end is End.SUCCEEDED, outcome.text
    assert poses[-1].distance(PLACES[way[1]]) < TOLERANCE + 0.05


@pytest.mark.costly
def test_new_goals_while_the_robot_drives(
    start: Callable[[str], Simulation], office: OccupancyMap
) -> None:
    simulation = start("o9")
    for goal in ("o12", "o9", "o8", "c4", "o11", "c5", "o9"):
        drive(simulation, office, goal, 7)  # so that it turns round at speed, and in doors
    assert simulation.physics.pose.distance(PLACES["o9"]) > 1


@pytest.mark.costly
def test_a_box_right_in_front_of_the_robot_is_not_touched(
    start: Callable[[str], Simulation], office: OccupancyMap
) -> None:
    simulation = start("c5")
    obstacles = Obstacles(office, read_waypoints(WAYPOINTS), simulation.physics)
    middle = (PLACES["c5"].x + PLACES["c4"].x) / 2
    while simulation.physics.pose.x < middle - 0.9:
        drive(simulation, office, "c4", 0.05)
    assert simulation.physics.velocity[0] > 0.4
    obstacles.obey("block c5 c4")
    poses = drive(simulation, office, "c4", 20)
    assert middle - 0.8 < max(pose.x for pose in poses) < middle
