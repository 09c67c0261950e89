"""What both kinds of physics do alike."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Callable, List, Tuple

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rooms import RADIUS, RESOLUTION, WALLS, beam, box_of, gap, room, write_world

from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics
from rosoclingo_simulator.physics.physics import Box, Physics, Pose

STEP = 0.05  # s
# MuJoCo's contacts give way, most at a wall's corner, and then push back.
SOFT, PUSHED = 0.005, 0.55  # m, m/s
SOLID = [box_of(wall) for wall in WALLS]
ROBOT = Path(__file__).parents[2] / "models" / "turtlebot.xml"

Start = Callable[[Pose], Physics]


@pytest.fixture(scope="module", params=["kinematic", "mujoco"])
def start(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Start:
    """Makes physics of either kind in the room."""
    if request.param == "kinematic":
        floor = room()
        return lambda pose: KinematicPhysics(floor, pose)
    world = write_world(tmp_path_factory.mktemp("world") / "room.xml")
    return lambda pose: MujocoPhysics(world, pose, ROBOT)


def drive(physics: Physics, linear: float, angular: float, seconds: float) -> None:
    for _ in range(round(seconds / STEP)):
        physics.step(linear, angular, STEP)


def test_a_robot_that_is_told_nothing_stands(start: Start) -> None:
    physics = start(Pose(1, 1, 2))
    drive(physics, 0, 0, 1)
    assert physics.pose.distance(Pose(1, 1, 2)) < 1e-3
    assert physics.pose.theta == pytest.approx(2, abs=1e-3)
    assert physics.velocity == pytest.approx((0, 0), abs=1e-3)
    assert not physics.touches


def test_it_drives_as_fast_as_it_is_told_and_stops(start: Start) -> None:
    physics = start(Pose(0, 2, 0))
    drive(physics, 0.4, 0, 1)
    assert physics.velocity == pytest.approx((0.4, 0), abs=0.01)
    before = physics.pose
    drive(physics, 0.4, 0, 2)
    assert physics.pose.x - before.x == pytest.approx(0.8, abs=0.02)
    assert physics.pose.y == pytest.approx(2, abs=0.01)
    before = physics.pose
    drive(physics, 0, 0, 1)
    assert physics.velocity == pytest.approx((0, 0), abs=0.01)
    assert physics.pose.x - before.x == pytest.approx(0.4**2 / 2, abs=0.03)


def test_it_drives_backwards_and_in_a_circle(start: Start) -> None:
    physics = start(Pose(1.5, 2.5, 0))
    drive(physics, -0.3, 0, 2)
    assert physics.pose.x < 1.1
    physics.reset(Pose(1, 1.5, 0))
    drive(physics, 0.5, 1.0, 2)  # up to speed
    turned, places = 0.0, []
    for _ in range(round(2 * math.pi / STEP)):
        last = physics.pose.theta
        physics.step(0.5, 1.0, STEP)
        turned += math.remainder(physics.pose.theta - last, 2 * math.pi)
        places.append((physics.pose.x, physics.pose.y))
    assert turned == pytest.approx(2 * math.pi, abs=0.15)
    assert np.ptp(places, axis=0) == pytest.approx([1.0, 1.0], abs=0.05)
    assert not physics.touches


def test_speed_and_acceleration_have_limits(start: Start) -> None:
    physics = start(Pose(0, 0.5, 0))
    speeds: List[Tuple[float, float]] = [(0.0, 0.0)]
    for _ in range(60):
        physics.step(3, 9, STEP)
        speeds.append(physics.velocity)
    assert np.abs(np.diff(speeds, axis=0)).max(axis=0) == pytest.approx([0.05, 0.15], rel=0.15)
    assert max(speeds) == pytest.approx((0.5, 1.5), rel=0.02)


@pytest.mark.parametrize("aside", [0.0, 0.4])
def test_a_wall_stops_it_and_it_gets_away_again(start: Start, aside: float) -> None:
    physics = start(Pose(2.5, 2, aside))
    drive(physics, 0.5, 0, 4)
    assert physics.touches
    assert physics.pose.x == pytest.approx(3 - RADIUS, abs=0.003)
    drive(physics, -0.5, 0, 1)
    assert not physics.touches
    assert physics.pose.x < 2.7


def test_a_box_stops_it_until_it_is_gone(start: Start) -> None:
    physics = start(Pose(0, 2, 0))
    box = Box(1.5, 2.1, 0.5, 0.4, 1.0)
    physics.put("box", box)
    drive(physics, 0.5, 0, 4)
    assert physics.touches
    assert gap(physics.pose.x, physics.pose.y, [box]) == pytest.approx(RADIUS, abs=0.003)
    physics.remove("box")
    physics.remove("box")
    drive(physics, 0, 0, STEP)
    assert not physics.touches
    drive(physics, 0.5, 0, 2)
    assert physics.pose.x > 1.5


def test_a_box_moves_when_it_is_put_again(start: Start) -> None:
    physics = start(Pose(0, 2, 0))
    ahead = np.zeros(1)
    physics.put("box", Box(1.5, 2, 0, 0.4, 0.4))
    assert physics.ranges(ahead, 10)[0] == pytest.approx(1.3, abs=0.002)
    physics.put("box", Box(1.0, 2, 0, 0.4, 0.4))
    assert physics.ranges(ahead, 10)[0] == pytest.approx(0.8, abs=0.002)
    physics.remove("box")
    assert physics.ranges(ahead, 10)[0] == pytest.approx(3.0, abs=0.002)


def test_a_reset_puts_it_elsewhere_standing(start: Start) -> None:
    physics = start(Pose(0, 2, 0))
    drive(physics, 0.5, 1, 1)
    physics.reset(Pose(6, 1, -1))
    assert physics.velocity == pytest.approx((0, 0), abs=1e-6)
    drive(physics, 0, 0, 0.5)
    assert physics.pose.distance(Pose(6, 1, -1)) < 1e-3
    assert physics.pose.theta == pytest.approx(-1, abs=1e-3)


def test_what_is_beyond_the_range_is_infinitely_far(start: Start) -> None:
    physics = start(Pose(0, 0.5, 0))
    assert physics.ranges(np.zeros(1), 6.9)[0] == pytest.approx(6.8, abs=0.002)
    assert physics.ranges(np.zeros(1), 6.7)[0] == math.inf
    assert physics.ranges(np.zeros(0), 6.7).shape == (0,)


ANYWHERE = st.tuples(
    st.floats(-0.6, 6.6), st.floats(-1.6, 3.6), st.floats(-math.pi, math.pi)
).filter(lambda place: gap(place[0], place[1], SOLID) > RADIUS + 0.01)


@pytest.mark.costly
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(place=ANYWHERE, box=st.tuples(st.floats(-0.5, 6.5), st.floats(-1.5, 3.5), st.floats(0, 3)))
def test_the_laser_sees_walls_and_boxes(
    start: Start, place: Tuple[float, float, float], box: Tuple[float, float, float]
) -> None:
    obstacle = Box(*box, 0.5, 0.3)
    if gap(place[0], place[1], [obstacle]) < RADIUS + 0.01:
        return
    physics = start(Pose(*place))
    physics.put("box", obstacle)
    angles = np.linspace(-3, 3, 61)
    boxes = [*SOLID, obstacle]
    seen = physics.ranges(angles, 10)
    # Beams that just graze a corner, or a side all along, may pass it on either side.
    turns = (-0.01, -1e-5, 0, 1e-5, 0.01)
    for angle, found in zip(angles, seen):
        aside = [beam(*place[:2], place[2] + angle + turn, boxes, 10) for turn in turns]
        assert min(aside) - RESOLUTION / 10 <= found <= max(aside) + RESOLUTION / 10


@pytest.mark.costly
@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    place=ANYWHERE,
    box=ANYWHERE,
    commands=st.lists(st.tuples(st.floats(-1, 1), st.floats(-2, 2)), min_size=1, max_size=12),
)
@example(
    place=(2.0384569566384707, -0.1015625, 1.39453125),
    box=(0, 0, 0),
    commands=[(1, -1.154296875), (1, 0.826171875), (0, 0.84375), (-1, 1), (1, 0), (-1, 2), (-1, 2)],
)
def test_it_never_gets_into_anything(
    start: Start,
    place: Tuple[float, float, float],
    box: Tuple[float, float, float],
    commands: List[Tuple[float, float]],
) -> None:
    obstacle = Box(*box, 0.4, 0.6)
    if gap(place[0], place[1], [obstacle]) < RADIUS + 0.01:
        return
    physics = start(Pose(*place))
    physics.put("box", obstacle)
    solid = [*SOLID, obstacle]
    soft, fastest, step = 1e-6, 0.5001, STEP
    if isinstance(physics, MujocoPhysics):
        # In a longer step it may touch something and get away again.
        soft, fastest, step = SOFT, PUSHED, physics.model.opt.timestep
    for linear, angular in commands:
        for _ in range(round(1 / step)):
            before = physics.pose
            physics.step(linear, angular, step)
            pose = physics.pose
            left = gap(pose.x, pose.y, solid)
            assert left >= RADIUS - soft
            assert before.distance(pose) <= fastest * step  # nor jumps
            if physics.touches:
                assert left <= RADIUS + 0.003
