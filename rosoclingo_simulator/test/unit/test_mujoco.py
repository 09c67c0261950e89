"""MuJoCo's physics where it differs from the kinematic one, and the camera's pictures."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Callable, Iterator

import numpy as np
import pytest

from rosoclingo_simulator.errors import ObstacleError, PhysicsError
from rosoclingo_simulator.physics.faulty import Disturbance, FaultyPhysics
from rosoclingo_simulator.physics.mujoco.mujoco_physics import BOXES, MujocoPhysics
from rosoclingo_simulator.physics.mujoco.rendering import Eye, focal_length, mounting
from rosoclingo_simulator.physics.physics import Box, Pose

PACKAGE = Path(__file__).parents[2]
ROBOT = PACKAGE / "models" / "turtlebot.xml"
RADIUS = 0.18  # m, of the robot
NORTH, EAST = 3.0, 3.0  # m, where the walls are
WIDTH, HEIGHT = 160, 120  # pixels
WORLD = f"""
<mujoco>
  <option timestep="0.1" gravity="0 0 -9.81"/>
  <worldbody>
    <geom type="plane" size="20 20 1" rgba="0.8 0.8 0.8 1"/>
    <geom type="box" pos="{EAST + 0.5} 0 0.5" size="0.5 5 1" rgba="0.2 0.2 0.9 1"/>
    <geom type="box" pos="0 {NORTH + 0.5} 0.5" size="5 0.5 1" rgba="0.9 0.2 0.2 1"/>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def world(tmp_path: Path) -> Path:
    path = tmp_path / "world & walls.xml"
    path.write_text(WORLD)
    return path


@pytest.fixture
def robot(world: Path) -> MujocoPhysics:
    return MujocoPhysics(world, Pose(0, 0, 0), ROBOT)


@pytest.fixture
def look(robot: MujocoPhysics) -> Iterator[Callable[[], Eye]]:
    eyes = []

    def open_eye() -> Eye:
        eyes.append(Eye(robot, WIDTH, HEIGHT))
        return eyes[-1]

    yield open_eye
    for eye in eyes:
        eye.close()


def drive(robot: MujocoPhysics, linear: float, angular: float, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        robot.step(linear, angular, 0.05)


def tilt(robot: MujocoPhysics) -> float:
    """Returns how far from upright the robot is, in degrees."""
    return math.degrees(math.acos(min(1.0, robot.data.body("robot").xmat[8])))


def test_time_that_is_no_multiple_of_a_step_is_not_lost(robot: MujocoPhysics) -> None:
    for _ in range(1000):
        robot.step(0, 0, 0.0013)
    assert robot.data.time == pytest.approx(1.3, abs=0.006)


def test_the_robot_stays_upright_and_at_its_height(robot: MujocoPhysics) -> None:
    for linear, angular in ((0.5, 0), (-0.5, 1.5), (0.5, -1.5), (0, 1.5), (0, 0)):
        drive(robot, linear, angular, 1)
        assert tilt(robot) < 0.1
        assert robot.data.qpos[2] == pytest.approx(0, abs=0.001)


def test_speed_comes_at_the_accelerations_and_does_not_overshoot(robot: MujocoPhysics) -> None:
    linear, angular = [], []
    for _ in range(100):
        robot.step(0.5, 1.5, 0.01)
        linear.append(robot.velocity[0])
        angular.append(robot.velocity[1])
    assert np.diff(linear).max() < 1.05 * 0.01
    assert np.diff(angular).max() < 3.15 * 0.01
    assert (linear[59], angular[59]) == pytest.approx((0.5, 1.5), rel=0.03)
    assert max(linear) < 0.502
    assert max(angular) < 1.505
    assert np.std(linear[80:]) < 1e-4


def test_the_wheels_do_not_slip_when_they_drive_and_brake(robot: MujocoPhysics) -> None:
    gone = 0.0
    for wanted in (0.5, 0.0, 0.5, -0.5, 0.0):
        for _ in range(200):
            robot.step(wanted, 0, 0.005)
            gone += robot.velocity[0] * 0.005
    assert abs(gone) > 0.2
    assert robot.pose.x == pytest.approx(gone, abs=0.003)


def test_wheels_that_a_wall_stops_stand_still_and_turn_back_at_once(robot: MujocoPhysics) -> None:
    robot.reset(Pose(EAST - 0.5, 0, 0))
    drive(robot, 0.5, 0, 10)
    assert robot.touches
    assert robot.velocity == pytest.approx((0, 0), abs=0.005)
    assert robot.pose.x == pytest.approx(EAST - RADIUS, abs=0.001)
    drive(robot, -0.5, 0, 0.4)
    assert not robot.touches
    assert robot.velocity[0] < -0.15


def test_a_robot_that_pushes_against_a_corner_stays_upright_and_outside(
    robot: MujocoPhysics,
) -> None:
    post = Box(1, 0, 0, 0.2, 2)  # with a corner at (0.9, 1)
    robot.put("post", post)
    for y in np.arange(0.9, 1.15, 0.05):
        robot.reset(Pose(0.4, y, 0))
        for linear, angular in ((0.5, 0.0), (0.0, -1.0), (0.5, -1.0), (0.5, 1.5)):
            for _ in range(20):
                robot.step(linear, angular, 0.05)
                assert post.distance(robot.pose.x, robot.pose.y) > RADIUS - 0.004
                assert tilt(robot) < 2


def test_a_box_takes_another_size_and_place(robot: MujocoPhysics) -> None:
    for length in (0.05, 2.0, 0.3):
        robot.reset(Pose(-3, 0, 0))
        robot.put("box", Box(0.5, 0, 0, length, length))
        drive(robot, 0.5, 0, 10)
        assert robot.pose.x == pytest.approx(0.5 - length / 2 - RADIUS, abs=0.002)
        assert robot.touches
    robot.put("box", Box(0.5, 2, 0, 0.5, 0.5))
    assert not robot.touches


def test_a_turned_box_is_as_turned_for_laser_and_hull(robot: MujocoPhysics) -> None:
    robot.put("box", Box(1.5, 0, math.pi / 4, 0.2, 4))
    front = 1.5 - 0.1 * math.sqrt(2)
    assert robot.ranges(np.zeros(1), 10)[0] == pytest.approx(front, abs=0.001)
    hit = math.pi / 2 - math.atan2(1, 1)  # square to it
    assert robot.ranges(np.full(1, hit), 10)[0] == pytest.approx(front / math.sqrt(2), abs=0.001)


def test_a_box_on_the_robot_pushes_it_away_gently(robot: MujocoPhysics) -> None:
    drive(robot, 0, 0, 0.5)
    robot.put("box", Box(0.1, 0.05, 0.3, 0.5, 0.5))
    assert robot.touches
    drive(robot, 0, 0, 2)
    assert not robot.touches
    assert robot.pose.distance(Pose(0, 0, 0)) < 1
    assert tilt(robot) < 1
    assert robot.velocity == pytest.approx((0, 0), abs=0.01)


def test_there_is_a_last_box(robot: MujocoPhysics) -> None:
    for number in range(BOXES):
        robot.put(f"box {number}", Box(-2 - number, 0, 0, 0.5, 0.5))
    with pytest.raises(ObstacleError, match=r"'box 9'.* remove one of box 0, box 1"):
        robot.put("box 9", Box(-1, 0, 0, 0.5, 0.5))
    robot.put("box 0", Box(-1, 0, 0, 0.5, 0.5))
    assert robot.ranges(np.full(1, math.pi), 10)[0] == pytest.approx(0.75, abs=0.001)
    robot.remove("box 0")
    robot.remove("box 0")
    assert robot.ranges(np.full(1, math.pi), 10)[0] == pytest.approx(2.75, abs=0.001)
    robot.put("box 9", Box(-1, 0, 0, 0.5, 0.5))


def test_boxes_stay_when_the_robot_is_put_elsewhere(robot: MujocoPhysics) -> None:
    robot.put("box", Box(1.5, 0, 0, 0.5, 0.5))
    drive(robot, 0.5, 0, 1)
    robot.reset(Pose(0.25, 0, 0))
    assert robot.velocity == (0, 0)
    assert robot.ranges(np.zeros(1), 10)[0] == pytest.approx(1.0, abs=0.001)


def test_a_world_that_is_none_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo logs what is wrong with a model
    with pytest.raises(PhysicsError, match=r"nowhere\.xml"):
        MujocoPhysics(tmp_path / "nowhere.xml", Pose(0, 0, 0), ROBOT)
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody><geom type='cube'/></worldbody></mujoco>")
    with pytest.raises(PhysicsError, match=r"broken\.xml.*cube"):
        MujocoPhysics(broken, Pose(0, 0, 0), ROBOT)


def test_depth_is_the_distance_from_the_camera(
    robot: MujocoPhysics, look: Callable[[], Eye]
) -> None:
    eye = look()
    ahead, _, _ = mounting(robot)[0]
    for distance in (1.0, 2.5, 5.5):
        robot.reset(Pose(EAST - distance, 0, 0))
        _, depth = eye.look()
        assert depth.shape == (HEIGHT, WIDTH)
        # Along the axis, so the same all over a wall which is square to it.
        middle = depth[HEIGHT // 2 - 2, 20:-20]
        assert middle == pytest.approx(np.full(WIDTH - 40, distance - ahead), abs=0.01)
    robot.reset(Pose(0, 0, math.pi))
    _, depth = eye.look()
    assert np.isnan(depth[0]).all()  # the sky


def test_the_floor_is_where_the_focal_length_says(
    robot: MujocoPhysics, look: Callable[[], Eye]
) -> None:
    robot.reset(Pose(0, 0, math.pi))
    _, depth = look().look()
    height = mounting(robot)[0][2]
    expected = height * focal_length(robot, HEIGHT) / ((HEIGHT - 1) / 2)
    assert depth[-1] == pytest.approx(np.full(WIDTH, expected), abs=0.01)


def test_color_shows_what_is_ahead(robot: MujocoPhysics, look: Callable[[], Eye]) -> None:
    eye = look()
    east, _ = eye.look()
    assert east.shape == (HEIGHT, WIDTH, 3)
    assert east.dtype == np.uint8
    assert east[HEIGHT // 2, WIDTH // 2].argmax() == 2  # a blue wall
    robot.reset(Pose(0, 0, math.pi / 2))
    north, _ = eye.look()
    assert north[HEIGHT // 2, WIDTH // 2].argmax() == 0  # a red wall
    robot.put("box", Box(-0.3, 1.2, 0, 0.3, 0.3))
    with_box, _ = eye.look()
    changed = (with_box != north).any(axis=2)
    assert changed[:, : WIDTH // 2].any()
    assert not changed[:, WIDTH // 2 :].any()  # it is on the left


@pytest.mark.parametrize("kind", ["nonsense", "glfw", "egl"])
def test_physics_works_whatever_mujoco_gl_is_and_the_camera_says_what_helps(
    world: Path, kind: str
) -> None:
    program = (
        "import sys; from pathlib import Path\n"
        "from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics\n"
        "from rosoclingo_simulator.physics.physics import Pose\n"
        "from rosoclingo_simulator.physics.mujoco.rendering import Eye\n"
        "from rosoclingo_simulator.physics.mujoco.headless import OpenGLError\n"
        "robot = MujocoPhysics(Path(sys.argv[1]), Pose(1, 0, 0), Path(sys.argv[2]))\n"
        "robot.step(0, 0, 0.1)\n"
        "try:\n"
        "    Eye(robot, 16, 12).close()\n"
        "except OpenGLError as err:\n"
        "    print(err)\n"
        "print(round(robot.pose.x))\n"
    )
    # A folder without drivers is a machine without OpenGL.
    nothing = {"__EGL_VENDOR_LIBRARY_DIRS": str(world.parent / "nothing")}
    run = subprocess.run(
        [sys.executable, "-c", program, world, ROBOT],
        env={**os.environ, **nothing, "MUJOCO_GL": kind, "PYTHONPATH": ":".join(sys.path)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=60,
    )
    complaint, place = run.stdout.splitlines()
    assert f"by {kind}" in complaint
    assert "libegl1" in complaint
    assert place == "1"


def test_faults_disturb_it_like_the_kinematic_one(robot: MujocoPhysics) -> None:
    faulty = FaultyPhysics(robot, (1, 0))
    faulty.disturbance = Disturbance(slip=0.5)
    for _ in range(60):
        faulty.step(0.4, 0.0, 0.05)
    assert faulty.odometry.x == pytest.approx(1.2, abs=0.1)
    assert robot.pose.x == pytest.approx(0.6, abs=0.1)
    faulty.disturbance = Disturbance(left_stuck=True)
    faulty.reset(Pose(-1, -1, 0))
    for _ in range(60):
        faulty.step(0.1, 0.0, 0.05)
    assert robot.pose.distance(Pose(-1, -1, 0)) < 0.26  # around the wheel, at 0.115 m
    assert abs(robot.velocity[0] - robot.velocity[1] * 0.115) < 0.02
    assert robot.velocity[1] > 0.3
