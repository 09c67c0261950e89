"""Robots in one world: they touch, see each other, and keep apart whatever they are told."""

from __future__ import annotations

import math
from pathlib import Path
from typing import List, Tuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rooms import RADIUS, beam, box_of, room

from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints
from rosoclingo_simulator.errors import ObstacleError
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.right_of_way import Neighbour, careful
from rosoclingo_simulator.navigation.simulation import Fleet, Simulation
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.laser import look
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import STEP_SECONDS, Box, Pose

OPEN = (
    (-1.0, -2.0, 7.0, -1.8), (-1.0, 3.8, 7.0, 4.0), (-1.0, -2.0, -0.8, 4.0), (6.8, -2.0, 7.0, 4.0),
)  # fmt: skip
HALL = room(OPEN)
FLOOR = room()
PLANNER, HALL_PLANNER = PathPlanner(FLOOR), PathPlanner(HALL)


def bodies(*poses: Pose, floor: OccupancyMap = HALL) -> List[KinematicPhysics]:
    first = KinematicPhysics(floor, poses[0])
    return [first, *map(first.join, poses[1:])]


def test_they_touch_and_do_not_pass_each_other() -> None:
    one, other = bodies(Pose(1, 1, 0), Pose(3, 1.1, 0))
    for _ in range(200):
        one.step(0.5, 0, STEP_SECONDS)
        assert one.pose.distance(other.pose) >= 2 * RADIUS - 1e-9
    assert one.touches
    assert other.touches
    assert one.velocity[0] == 0
    one.step(-0.5, 0, STEP_SECONDS)
    one.step(-0.5, 0, STEP_SECONDS)
    assert not other.touches


def test_all_share_the_boxes() -> None:
    one, other = bodies(Pose(1, 1, 0), Pose(5, 1, 3))
    other.put("box", Box(3, 1, 0, 0.4, 0.4))
    assert one.ranges(np.zeros(1), 10)[0] == pytest.approx(1.8)
    one.remove("box")
    assert one.robots == other.robots == (Pose(1, 1, 0), Pose(5, 1, 3))


@pytest.mark.costly
@settings(deadline=None)
@given(
    st.floats(-0.5, 6.5), st.floats(-1.5, 3.5), st.floats(-3, 3),
)  # fmt: skip
def test_the_laser_sees_another_robot(x: float, y: float, theta: float) -> None:
    here = Pose(2, 1, theta)
    assume(here.distance(Pose(x, y, 0)) >= 2 * RADIUS)
    one, _ = bodies(here, Pose(x, y, 0))
    towards = math.atan2(y - 1, x - 2) - theta
    (seen,) = one.ranges(np.array([towards]), 10.0)
    assert seen == pytest.approx(here.distance(Pose(x, y, 0)) - RADIUS)
    beside = math.asin(min(1.0, (RADIUS + 0.02) / here.distance(Pose(x, y, 0))))
    (missed,) = one.ranges(np.array([towards + beside]), 10.0)
    walls = [box_of(wall) for wall in OPEN]
    assert missed == pytest.approx(beam(2, 1, towards + beside + theta, walls, 10.0), abs=0.06)


def test_what_is_seen_of_a_robot_is_no_obstacle() -> None:
    one, other = bodies(Pose(1, 1, 0), Pose(3, 1, 0))
    one.put("box", Box(1, 3, 0, 0.4, 0.4))
    costmap = Costmap(HALL, HALL_PLANNER.grid)
    costmap.update(look(one, 0.0), [other.pose])
    marked = HALL_PLANNER.grid.points(*np.nonzero(costmap.marked))
    assert len(marked)
    assert (np.hypot(marked[:, 0] - 1, marked[:, 1] - 3) < 0.4).all()


def test_no_box_is_put_onto_any_of_them() -> None:
    places = {"a": Waypoint(1, 1, 0), "b": Waypoint(5, 1, 0)}
    waypoints = Waypoints(Path("places.yaml"), "map", places)
    one, _ = bodies(Pose(5, 3, 0), Pose(3, 1, 0))
    with pytest.raises(ObstacleError, match="a robot is where"):
        Obstacles(HALL, waypoints, one).obey("block a b")


COMMAND = st.tuples(st.floats(-0.5, 0.5), st.floats(-1.5, 1.5))


@pytest.mark.costly
@settings(deadline=None, max_examples=60)
@given(st.lists(st.lists(COMMAND, min_size=3, max_size=3), min_size=5, max_size=25))
def test_careful_robots_never_touch(orders: List[List[Tuple[float, float]]]) -> None:
    """Whatever they would do, each order for half a second; at first they drive to one place."""
    three = bodies(Pose(2.2, 1, 0), Pose(3.6, 1.2, math.pi), Pose(3, 0, math.pi / 2))
    for order in [[(0.5, 0.0)] * 3] * 3 + orders:
        for _ in range(10):
            for body, command in zip(three, order):
                others = [
                    Neighbour(one.pose, one.velocity, None, True, False)
                    for one in three
                    if one is not body
                ]
                body.step(*careful(command, body.pose, body.velocity, others), STEP_SECONDS)
            for number, body in enumerate(three):
                for other in three[:number]:
                    assert body.pose.distance(other.pose) > 2 * RADIUS + 0.01


def test_a_refuge_is_out_of_the_way() -> None:
    way = np.stack((np.linspace(0, 6, 61), np.full(61, 0.5)), axis=-1)
    nothing = np.zeros(PLANNER.grid.shape, bool)
    path = PLANNER.refuge(Pose(2, 0.5, 0), nothing, np.array([[0.5, 0.5]]), way)
    assert path is not None
    assert abs(path[-1][1] - 0.5) > 2 * RADIUS
    assert np.hypot(*(path[0] - (2, 0.5))) < 0.1
    everywhere = FLOOR.framed.points(*np.nonzero(~FLOOR.solid))[::7]
    assert PLANNER.refuge(Pose(2, 0.5, 0), nothing, np.array([[0.5, 0.5]]), everywhere) is None


def fleet(*poses: Pose) -> Fleet:
    return Fleet(
        [
            Simulation(body, MoveBaseDriver(PLANNER, Costmap(FLOOR, PLANNER.grid), Limits(), 5.0))
            for body in bodies(*poses, floor=FLOOR)
        ]
    )


def test_the_first_one_has_right_of_way_in_the_door() -> None:
    robots = fleet(Pose(0, 0.5, 0), Pose(6, 0.5, math.pi))
    first, second = (robot.move_base for robot in robots.robots)
    assert first is not None
    assert second is not None
    first.start(Pose(6, 0.5, 0))
    second.start(Pose(0, 0.5, math.pi))
    gave_way = [False, False]
    while first.goal is not None or second.goal is not None:
        robots.step()
        for number, base in enumerate((first, second)):
            gave_way[number] |= base.goal is not None and base.manners.since is not None
        if first.goal is not None:
            assert not gave_way[0]
        assert robots.robots[0].time < 60
        assert not any(robot.physics.touches for robot in robots.robots)
    assert first.outcome is not None
    assert second.outcome is not None
    assert first.outcome.end is second.outcome.end is End.SUCCEEDED
    assert gave_way[1]


def test_one_that_cannot_make_room_holds_up_the_other_until_it_gives_up() -> None:
    """It has no navigation, and stands where the other one is to go."""
    robots = fleet(Pose(0, 0.5, 0), Pose(5, 0.5, 0))
    robots.robots[1].move_base = None
    base = robots.robots[0].move_base
    assert base is not None
    base.start(Pose(5, 0.5, 0))
    while base.goal is not None:
        robots.step()
        assert robots.robots[0].time < 60
        assert not robots.robots[0].physics.touches
    assert base.outcome is not None
    assert base.outcome.end is End.ABORTED
    assert "no progress to (5.00, 0.50) within 5 s" in base.outcome.text


def test_one_that_somebody_drives_goes_as_told_beside_others() -> None:
    robots = fleet(Pose(0, 0.5, 0), Pose(6, 0.5, 0))
    told, other = robots.robots
    assert other.move_base is not None
    other.move_base.start(Pose(1, 0.5, 0))
    for _ in range(20):
        assert told.drive((0.2, 0.0))
        robots.step()
    assert other.move_base.ahead is not None
    assert told.physics.velocity[0] == pytest.approx(0.2)


def test_a_new_goal_is_not_given_up_because_of_room_that_was_made_before() -> None:
    robots = fleet(Pose(2, 0.5, 0), Pose(4, 0.5, math.pi))
    first, second = (robot.move_base for robot in robots.robots)
    assert first is not None
    assert second is not None
    second.manners.since, second.manners._looked = -100.0, 0.0  # it has just looked
    second.start(Pose(5, 0.5, 0))
    robots.step()
    assert second.goal is not None
