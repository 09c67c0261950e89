"""Driving to goals, with the kinematic physics."""

from __future__ import annotations

from typing import Callable, List, Tuple

import pytest
from rooms import RADIUS, WALLS, box_of, gap, room

from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import DriveOutcome, End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.physics import Box, Pose

FLOOR = room()
PLANNER = PathPlanner(FLOOR)
SOLID = [box_of(wall) for wall in WALLS]
TIMEOUT = 5.0  # s, without progress
WEST, EAST = Pose(0, 0.5, 0), Pose(5, 0.5, 1)

Start = Callable[..., Simulation]


@pytest.fixture
def start() -> Start:
    def start_at(pose: Pose = WEST, limits: Limits = Limits()) -> Simulation:  # noqa: B008 - frozen
        move_base = MoveBaseDriver(PLANNER, Costmap(FLOOR, PLANNER.grid), limits, TIMEOUT)
        return Simulation(KinematicPhysics(FLOOR, pose), move_base)

    return start_at


@pytest.fixture
def simulation(start: Start) -> Simulation:
    return start()


def run(simulation: Simulation, seconds: float = 120.0) -> List[Tuple[float, float]]:
    """Runs until the goal has ended or the time is over, and returns where the robot was."""
    end = simulation.time + seconds
    places = []
    while simulation.move_base.active and simulation.time < end:
        simulation.step()
        pose = simulation.physics.pose
        places.append((pose.x, pose.y))
        assert gap(pose.x, pose.y, SOLID) > RADIUS
        assert not simulation.physics.touches
    return places


def outcome(simulation: Simulation) -> DriveOutcome:
    assert not simulation.move_base.active
    assert simulation.move_base.outcome is not None
    return simulation.move_base.outcome


def settle(simulation: Simulation) -> None:
    for _ in range(20):
        simulation.step()
    assert simulation.physics.velocity == (0, 0)


@pytest.mark.parametrize("begin", [Pose(0, 0.5, 0), Pose(0, 0.5, 3), Pose(2.8, 3.6, 1.5)])
@pytest.mark.parametrize("goal", [EAST, Pose(6.5, -1.5, -2), Pose(0, 3, 3)])
def test_it_gets_there_and_stands(start: Start, begin: Pose, goal: Pose) -> None:
    simulation = start(begin)
    simulation.move_base.start(goal)
    run(simulation)
    assert outcome(simulation) == DriveOutcome(End.SUCCEEDED, "Goal reached.")
    place = simulation.physics.pose
    settle(simulation)
    assert simulation.physics.pose.distance(place) < 0.02
    assert simulation.physics.pose.distance(goal) < 0.15
    assert abs(simulation.physics.pose.theta - goal.theta) < 0.3
    assert simulation.time < 15 + begin.distance(goal) / 0.3


def test_tolerances_and_speed_are_settings(start: Start) -> None:
    slow, exact = start(limits=Limits(speed=0.2)), start(limits=Limits(yaw_tolerance=0.05))
    for simulation in (slow, exact):
        simulation.move_base.start(EAST)
        run(simulation)
        assert outcome(simulation).end is End.SUCCEEDED
    assert slow.time > 5 / 0.2 > 20 > exact.time
    assert exact.physics.pose.theta == pytest.approx(EAST.theta, abs=0.06)


def test_a_goal_nearby_takes_no_drive(simulation: Simulation) -> None:
    simulation.move_base.start(Pose(0.1, 0.5, 3))
    run(simulation)
    assert outcome(simulation).end is End.SUCCEEDED
    assert simulation.physics.pose.distance(WEST) == 0


def test_without_a_path_it_gives_up_at_once(simulation: Simulation) -> None:
    simulation.move_base.start(Pose(5.15, 2.15, 0))
    run(simulation)
    assert outcome(simulation).end is End.ABORTED
    assert outcome(simulation).text == "no path to (5.15, 2.15) from (0.00, 0.50)"
    assert simulation.physics.pose == WEST


def test_it_gives_up_at_a_box_that_closes_the_door(simulation: Simulation) -> None:
    simulation.physics.put("box", Box(3.1, 0.5, 0, 0.4, 0.9))
    simulation.move_base.start(EAST)
    run(simulation)
    assert outcome(simulation).end is End.ABORTED
    assert "no path to (5.00, 0.50)" in outcome(simulation).text
    settle(simulation)


def test_it_goes_around_a_box_that_comes_while_it_drives(simulation: Simulation) -> None:
    simulation.move_base.start(EAST)
    run(simulation, 3)
    box = Box(2.0, 0.5, 0.3, 0.3, 0.8)
    simulation.physics.put("box", box)
    places = run(simulation)
    assert outcome(simulation).end is End.SUCCEEDED
    assert min(gap(x, y, [box]) for x, y in places) > RADIUS


def test_it_stops_before_a_box_right_in_front_of_it(simulation: Simulation) -> None:
    simulation.move_base.start(EAST)
    while simulation.physics.pose.x < 2.2:
        simulation.step()
    simulation.physics.put("box", Box(3.0, 0.5, 0, 0.4, 0.9))
    run(simulation)
    assert outcome(simulation).end is End.ABORTED
    assert simulation.physics.pose.x < 2.8 - RADIUS


def test_a_box_that_is_gone_is_no_trouble_once_the_costmap_is_cleared(
    simulation: Simulation,
) -> None:
    simulation.physics.put("box", Box(3.1, 0.5, 0, 0.4, 0.9))
    simulation.move_base.start(EAST)
    run(simulation)
    simulation.physics.remove("box")
    simulation.move_base.costmap.clear()
    simulation.move_base.start(EAST)
    run(simulation)
    assert outcome(simulation).end is End.SUCCEEDED


def test_without_progress_it_gives_up_in_time(simulation: Simulation) -> None:
    simulation.move_base.start(EAST)
    simulation.physics.step = lambda *_: None  # type: ignore[method-assign] - stuck wheels
    run(simulation, 60)
    assert outcome(simulation).end is End.ABORTED
    assert outcome(simulation).text == "no progress to (5.00, 0.50) within 5 s"
    assert simulation.time == pytest.approx(TIMEOUT, abs=0.2)


def test_a_cancelled_goal_stops_it(simulation: Simulation) -> None:
    simulation.move_base.start(EAST)
    run(simulation, 3)
    simulation.move_base.cancel()
    assert outcome(simulation).end is End.PREEMPTED
    settle(simulation)
    assert simulation.physics.pose.distance(EAST) > 2
    simulation.move_base.cancel()  # again, which does nothing
    assert outcome(simulation).end is End.PREEMPTED


def test_a_new_goal_takes_the_place_of_the_old_one(simulation: Simulation) -> None:
    simulation.move_base.start(EAST)
    run(simulation, 4)
    simulation.move_base.start(Pose(0, 3, 0))
    places = run(simulation)
    assert outcome(simulation).end is End.SUCCEEDED
    assert simulation.physics.pose.distance(Pose(0, 3, 0)) < 0.15
    assert max(x for x, _ in places) < 3


def test_commands_count_for_half_a_second_and_not_while_there_is_a_goal(
    simulation: Simulation,
) -> None:
    assert simulation.drive((0.3, 0.0))
    for _ in range(10):
        simulation.step()
    assert simulation.physics.velocity == pytest.approx((0.3, 0))
    settle(simulation)
    simulation.move_base.start(EAST)
    assert not simulation.drive((-0.5, 0.0))
    run(simulation)
    assert outcome(simulation).end is End.SUCCEEDED


def test_the_laser_looks_only_when_it_is_of_use(simulation: Simulation) -> None:
    simulation.step()
    assert simulation.scan is None
    simulation.is_watched = lambda: True
    times = set()
    for _ in range(21):
        simulation.step()
        assert simulation.scan is not None
        times.add(simulation.scan.time)
    assert len(times) == 6
