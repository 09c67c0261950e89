"""Small parts of the simulator: obstacles, pace, settings and calls from other threads."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import List

import numpy as np
import pytest
from rooms import WALLS, box_of, gap, room

from rosclingo.errors import RosclingoError
from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.errors import ObstacleError
from rosoclingo_simulator.pacer import Pacer
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.physics import Box, Pose
from rosoclingo_simulator.ros.settings import DEFAULT_POSE, parse_pose

FLOOR = room()
SOLID = [box_of(wall) for wall in WALLS]
WAYPOINTS = Waypoints(
    Path("places.yaml"),
    "map",
    {
        "hall": Waypoint(1, 0.5, 0),
        "room": Waypoint(5, 0.5, 0),
        "north": Waypoint(1, 3.2, 0),
        "corner": Waypoint(5, 3.5, 0),
        "c(1)": Waypoint(1.2, 0.5, 0),
    },
)


class Boxes(KinematicPhysics):
    """Physics that remembers its boxes."""

    def __init__(self, pose: Pose) -> None:
        super().__init__(FLOOR, pose)
        self.boxes: List[Box] = []

    def put(self, name: str, box: Box) -> None:
        super().put(name, box)
        self.boxes.append(box)

    def remove(self, name: str) -> None:
        super().remove(name)
        self.boxes.clear()


@pytest.fixture
def physics() -> Boxes:
    return Boxes(Pose(0, 0.5, 0))


@pytest.fixture
def obstacles(physics: Boxes) -> Obstacles:
    return Obstacles(FLOOR, WAYPOINTS, physics)


def test_a_box_closes_the_door(obstacles: Obstacles, physics: Boxes) -> None:
    message = obstacles.obey("block hall room")
    assert "between hall and room" in message
    (box,) = physics.boxes
    assert (box.x, box.y, box.width) == pytest.approx((3.1, 0.5, 0.8), abs=0.11)
    for part in range(-10, 11):  # nothing of it is in a wall
        assert gap(box.x, box.y + part / 20 * box.width, SOLID) > 0
    ahead = physics.ranges(np.zeros(1), 10)[0]
    assert ahead == pytest.approx(3.1 - box.length / 2, abs=0.06)


def test_blocking_twice_and_in_the_other_direction_is_harmless(
    obstacles: Obstacles, physics: Boxes
) -> None:
    obstacles.obey("block hall room")
    for command in ("block hall room", " block  room hall "):
        assert "already" in obstacles.obey(command)
    assert len(physics.boxes) == 1
    assert "gone" in obstacles.obey("unblock room hall")
    assert not physics.boxes
    with pytest.raises(ObstacleError, match="there is no box between hall and room"):
        obstacles.obey("unblock hall room")


def test_a_box_between_walls_that_are_far_apart_is_as_wide(
    obstacles: Obstacles, physics: Boxes
) -> None:
    obstacles.obey("block hall north")
    (box,) = physics.boxes
    assert box.y == pytest.approx(1.85, abs=0.06)
    assert box.width == pytest.approx(3.8 - 0.2, abs=0.1)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("", "expected block or unblock and two waypoints, such as block c4 c5: ''"),
        ("block hall", "expected block or unblock"),
        ("block hall room corner", "expected block or unblock"),
        ("remove hall room", "expected block or unblock.*'remove hall room'"),
        ("block hall X", "'X' is no waypoint"),
        ("block hall cellar", r"no waypoint cellar in places\.yaml; there are hall, room"),
        ("unblock cellar hall", "no waypoint cellar"),
        ("block north corner", "there is a wall on the straight way between north and corner"),
        ("block hall c(1)", "too close together"),
        ("block hall hall", "too close together"),
    ],
)
def test_commands_that_cannot_be_done(obstacles: Obstacles, command: str, message: str) -> None:
    with pytest.raises(RosclingoError, match=message):
        obstacles.obey(command)


def test_no_box_onto_the_robot(obstacles: Obstacles, physics: Boxes) -> None:
    physics.reset(Pose(2.8, 0.5, 0))
    with pytest.raises(ObstacleError, match=r"a robot is where a box .* would stand"):
        obstacles.obey("block hall room")
    assert not physics.boxes
    physics.reset(Pose(0, 0.5, 0))
    assert "stands" in obstacles.obey("block hall room")


class Wall:
    """A clock that only waiting and working move on."""

    def __init__(self) -> None:
        self.now = 100.0
        self.warnings: List[float] = []

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.now += seconds

    def pacer(self, speed: float) -> Pacer:
        return Pacer(speed, self.warnings.append, lambda: self.now, self.sleep)


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_simulated_time_keeps_pace(speed: float) -> None:
    wall = Wall()
    pacer = wall.pacer(speed)
    for step in range(1000):
        wall.now += 0.001 * (step % 5)  # work, now more, now less
        pacer.wait(0.05)
    assert wall.now - 100 == pytest.approx(1000 * 0.05 / speed, abs=0.01)
    assert not wall.warnings


def test_a_short_delay_is_caught_up_and_a_long_one_is_lost() -> None:
    for delay, lost in ((0.2, 0.0), (5.0, 5.0)):
        wall = Wall()
        pacer = wall.pacer(1.0)
        wall.now += delay
        for _ in range(100):
            pacer.wait(0.05)
        assert wall.now - 100 == pytest.approx(5.0 + lost, abs=0.06)


def test_it_says_once_in_a_while_what_speed_is_reached() -> None:
    wall = Wall()
    pacer = wall.pacer(10.0)
    for _ in range(3000):
        wall.now += 0.01  # twice as long as there is
        pacer.wait(0.05)
    assert wall.warnings == pytest.approx([5.0] * len(wall.warnings), rel=0.1)
    assert 2 <= len(wall.warnings) <= 3


def test_the_manuals_pose() -> None:
    assert parse_pose(DEFAULT_POSE) == Pose(7, -8, 0)
    assert parse_pose("-x 1.5 -Y -0.5") == Pose(1.5, -8, -0.5)
    assert parse_pose("-x 1 -y 2 -x 3") == Pose(3, 2, 0)
    assert parse_pose("") == Pose(7, -8, 0)


@pytest.mark.parametrize("text", ["7 -8", "-x", "-x one", "-x nan", "-q 1", "-x 1 2", "-x -y 1"])
def test_a_text_that_is_no_pose(text: str) -> None:
    with pytest.raises(ValueError, match="expected a"):
        parse_pose(text)


def test_calls_run_in_order_in_the_thread_that_runs_them() -> None:
    calls = Calls()
    threads: List[int] = []

    def double(number: int) -> int:
        threads.append(threading.get_ident())
        return 2 * number

    futures = [calls.submit(double, number) for number in range(3)]
    fails = calls.submit(int, "three")
    assert not any(future.done() for future in futures)
    runner = threading.Thread(target=calls.run)
    runner.start()
    runner.join()
    assert [future.result(0) for future in futures] == [0, 2, 4]
    assert set(threads) == {runner.ident}
    with pytest.raises(ValueError, match="three"):
        fails.result(0)
