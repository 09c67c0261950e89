"""Faults of simulated robots: when they come, what they do, and how they end."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
import pytest
from rooms import room

from rosoclingo_interfaces.navigation.waypoints import Waypoint, Waypoints
from rosoclingo_simulator.errors import FaultError
from rosoclingo_simulator.faults.injector import FaultInjector
from rosoclingo_simulator.faults.reader import read_faults
from rosoclingo_simulator.faults.schedule import report_faults
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.estimator import PoseEstimator
from rosoclingo_simulator.navigation.follower import Limits
from rosoclingo_simulator.navigation.move_base import End, MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Fleet, Simulation
from rosoclingo_simulator.physics.faulty import Disturbance, FaultyPhysics
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.laser import ANGLES, MOST_METRES
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.physics import (
    STEP_SECONDS,
    WHEEL_DISTANCE,
    Pose,
    compose,
    normal_angle,
    relative,
)

FLOOR = room()
PLANNER = PathPlanner(FLOOR)
PLACES = Waypoints(
    Path("places.yaml"),
    "map",
    {
        "hall": Waypoint(1, 0.5, 0),
        "room": Waypoint(5, 0.5, 0),
        "north": Waypoint(1, 3.2, 0),
        "corner": Waypoint(5, 3.5, 0),
        "wall": Waypoint(3.1, 2.0, 0),
    },
)
WEST = Pose(0, 0.5, 0)


class Scene:
    """Robots in the room that have faults; the first one is told to drive."""

    def __init__(self, *faults: Dict[str, Any], seed: int = 1, robots: int = 1) -> None:
        first = KinematicPhysics(FLOOR, WEST)
        bodies = [first, *(first.join(Pose(0, -1 + 3 * n, 0)) for n in range(robots - 1))]
        names = ["robot1", "robot2", "robot3"][:robots] if robots > 1 else [""]
        self.obstacles = Obstacles(FLOOR, PLACES, first)
        self.all = [Simulation(body, self._move_base()) for body in bodies]
        self.robot = self.all[0]
        plan = read_faults({"seed": seed, "faults": list(faults)}, PLACES)
        self.injector = FaultInjector(plan, dict(zip(names, self.all)), FLOOR, self.obstacles)
        self.fleet = Fleet(self.all)
        self.changes: List[Tuple[float, str, bool]] = []

    @staticmethod
    def _move_base() -> MoveBaseDriver:
        return MoveBaseDriver(PLANNER, Costmap(FLOOR, PLANNER.grid), Limits(), 5.0)

    def run(
        self, seconds: float, linear: Optional[float] = None, angular: float = 0.0
    ) -> Simulation:
        """Lets time pass; without a speed, the robot drives to its goal if it has one."""
        for _ in range(round(seconds / STEP_SECONDS)):
            if linear is not None:
                self.robot.drive((linear, angular))
            self.fleet.step()
            for state in self.injector.update():
                time = round(self.robot.time, 2)
                self.changes.append((time, state.fault.kind, state.active))
        return self.robot

    @property
    def body(self) -> FaultyPhysics:
        physics = self.robot.physics
        assert isinstance(physics, FaultyPhysics)
        return physics

    @property
    def estimator(self) -> PoseEstimator:
        assert self.robot.estimator is not None
        return self.robot.estimator

    def drive(self, goal: Pose, seconds: float = 60.0) -> End:
        """Drives to a goal, and returns how that ends."""
        driver = self.robot.move_base
        assert driver is not None
        driver.start(goal)
        end = self.robot.time + seconds
        while driver.active and self.robot.time < end:
            self.run(STEP_SECONDS)
        assert driver.outcome is not None, "it still drives"
        return driver.outcome.end


def test_poses_compose() -> None:
    origin, pose = Pose(1, 2, 2.0), Pose(-3, 0.5, 3.0)
    seen = relative(origin, pose)
    back = compose(origin, seen)
    assert (back.x, back.y, back.theta) == pytest.approx((-3, 0.5, 3.0))
    assert seen.theta == pytest.approx(1.0)
    ahead = compose(Pose(1, 2, math.pi / 2), Pose(3, 1, 0))
    assert (ahead.x, ahead.y) == pytest.approx((0, 5))


def test_without_an_active_fault_nothing_changes() -> None:
    scene = Scene({"fault": "slip", "when": {"time": 1000}})
    plain = Simulation(KinematicPhysics(FLOOR, WEST), scene._move_base())
    for angular in (0.0, 0.7, -0.4):
        scene.run(2.0, 0.4, angular)
        for _ in range(40):
            plain.drive((0.4, angular))
            plain.step()
    assert scene.robot.physics.pose == plain.physics.pose == scene.robot.estimate
    odometry, wanted = scene.robot.odometry, plain.odometry
    assert (odometry.x, odometry.y, odometry.theta) == pytest.approx(
        (wanted.x, wanted.y, wanted.theta)
    )
    assert scene.robot.physics.velocity == plain.physics.velocity


def test_slip_is_not_noticed_by_odometry() -> None:
    scene = Scene({"fault": "slip", "loss": 0.5, "when": {"time": 2}, "lasts": 4})
    robot = scene.run(2.5, 0.3)
    before, told = robot.physics.pose.x, robot.odometry.x
    scene.run(2.0, 0.3)
    assert robot.odometry.x - told == pytest.approx(0.6, abs=0.02)
    assert robot.physics.pose.x - before == pytest.approx(0.3, abs=0.02)
    assert robot.physics.velocity[0] == pytest.approx(0.3)
    assert robot.true_velocity[0] == pytest.approx(0.15)
    assert robot.estimate == robot.physics.pose  # the localisation sees walls
    scene.run(2.0, 0.3)
    assert scene.changes == [(2.0, "slip", True), (6.0, "slip", False)]
    assert robot.true_velocity[0] == pytest.approx(0.3)


def test_without_any_grip_it_stands() -> None:
    robot = Scene({"fault": "slip", "loss": 1}).run(3.0, 0.3)
    assert robot.physics.pose.x == pytest.approx(0, abs=0.01)
    assert robot.odometry.x > 0.7


@pytest.mark.parametrize(("wheel", "side"), [("left", 1), ("right", -1)])
def test_a_robot_turns_around_the_wheel_that_sticks(wheel: str, side: int) -> None:
    scene = Scene({"fault": "stuck_wheel", "wheel": wheel})
    centre = compose(WEST, Pose(0, side * WHEEL_DISTANCE / 2, 0))
    for _ in range(30):
        robot = scene.run(0.1, 0.15)
        assert robot.physics.pose.distance(centre) == pytest.approx(WHEEL_DISTANCE / 2, abs=0.02)
    # Its encoders notice.
    odometry, seen = robot.odometry, relative(WEST, robot.physics.pose)
    assert (odometry.x, odometry.y) == pytest.approx((seen.x, seen.y))
    turning = robot.physics.velocity[1]
    assert turning == pytest.approx(side * 0.15 / WHEEL_DISTANCE)


def test_with_both_wheels_stuck_it_stands() -> None:
    robot = Scene({"fault": "stuck_wheel", "wheel": "both"}).run(2.0, 0.5, 1.0)
    assert robot.physics.pose.distance(WEST) < 0.05


def test_disturbances_add_up() -> None:
    both = Disturbance(slip=0.5, left_stuck=True, laser_sigma=3, dropout=0.5) + Disturbance(
        slip=0.5, right_stuck=True, laser_sigma=4, dropout=0.2, odometry_sigma=1
    )
    wanted = Disturbance(
        0.75, left_stuck=True, right_stuck=True, laser_sigma=5, dropout=0.6, odometry_sigma=1
    )
    assert both == wanted
    scene = Scene(
        {"fault": "slip", "loss": 0.5},
        {"fault": "slip", "loss": 0.5, "lasts": 2},
    )
    scene.run(1.0)
    assert scene.body.disturbance.slip == 0.75
    scene.run(2.0)
    assert scene.body.disturbance.slip == 0.5


def test_laser_noise() -> None:
    scene = Scene({"fault": "laser_noise", "sigma": 0.1, "dropout": 0.25, "when": {"time": 1}})
    true = scene.body.body.ranges(ANGLES, MOST_METRES)
    assert np.array_equal(scene.body.ranges(ANGLES, MOST_METRES), true)
    scene.run(1.2)
    assert scene.changes == [(1.0, "laser_noise", True)]
    seen = np.array([scene.body.ranges(ANGLES, MOST_METRES) for _ in range(20)])
    assert np.isinf(seen).mean() == pytest.approx(0.25, abs=0.03)
    errors = (seen - true)[np.isfinite(seen)]
    assert errors.std() == pytest.approx(0.1, abs=0.01)
    assert errors.mean() == pytest.approx(0, abs=0.01)
    assert seen.min() >= 0


def test_odometry_noise_grows_with_the_way() -> None:
    ends = []
    for seed in range(40):
        scene = Scene({"fault": "odometry_noise", "sigma": 0.1}, seed=seed)
        robot = scene.run(5.5, 0.4)
        assert robot.estimate == robot.physics.pose
        ends.append(robot.odometry.x - robot.physics.pose.x)
    assert np.std(ends) == pytest.approx(0.1 * math.sqrt(2.1), rel=0.4)
    told = robot.odometry
    scene.run(2.0)  # it brakes, and stands
    braked = robot.odometry
    assert told != braked
    scene.run(2.0)
    assert robot.odometry == braked


def test_a_carried_robot_drives_by_the_pose_that_it_believes() -> None:
    scene = Scene(
        {"fault": "wrong_pose", "when": {"place": "hall", "within": 0.3}, "carried_to": "room"}
    )
    robot = scene.run(4.0, 0.3)
    assert scene.changes[0][1:] == ("wrong_pose", True)
    scene.run(1.0)
    assert robot.physics.pose.x == pytest.approx(5.4, abs=0.3)
    assert robot.estimate.x - 0.7 == pytest.approx(robot.physics.pose.x - 5, abs=0.1)
    assert robot.odometry.x == pytest.approx(robot.estimate.x - WEST.x)
    estimator = scene.estimator
    assert estimator.lost
    assert not estimator.unsure
    # It arrives where it believes, which is elsewhere; and where it sees no door, it does not.
    assert scene.drive(Pose(-0.3, 3.0, 0)) is End.SUCCEEDED
    assert robot.estimate.distance(Pose(-0.3, 3.0, 0)) < 0.2
    assert robot.physics.pose.distance(Pose(4.0, 3.0, 0)) < 0.5
    assert scene.drive(Pose(5, 0.5, 0)) is End.ABORTED
    # Somebody who is wrong does not help.
    assert not estimator.relocalise(Pose(1, 0.5, 0))
    scene.run(0.1)
    assert estimator.lost
    assert robot.estimate.distance(Pose(1, 0.5, 0)) < 0.05
    true = robot.physics.pose
    assert estimator.relocalise(Pose(true.x + 0.5, true.y - 0.5, normal_angle(true.theta + 0.3)))
    scene.run(0.1)
    assert robot.estimate == robot.physics.pose
    assert scene.changes[-1][1:] == ("wrong_pose", False)
    driver = robot.move_base
    assert driver is not None
    driver.costmap.clear()
    assert scene.drive(Pose(6, 0, 0)) is End.SUCCEEDED
    assert robot.physics.pose.distance(Pose(6, 0, 0)) < 0.2
    # The frame of the odometry has moved on the map.
    where = compose(estimator.odometry_frame, robot.odometry)
    assert where.distance(robot.physics.pose) < 1e-6


@pytest.mark.parametrize("far", [50.0, 1e9, 1e308])
def test_an_initial_pose_off_the_map_ends_drives_only(far: float) -> None:
    scene = Scene({"fault": "slip", "when": {"time": 1000}})
    estimator = scene.estimator
    assert not estimator.relocalise(Pose(far, -far, 3.0))
    with np.errstate(over="ignore"):
        assert scene.drive(Pose(2, 0.5, 0)) is End.ABORTED
    assert estimator.relocalise(scene.robot.physics.pose)
    assert scene.drive(Pose(2, 0.5, 0)) is End.SUCCEEDED


def test_a_robot_that_turns_around_finds_its_place_if_it_searches() -> None:
    scene = Scene({"fault": "wrong_pose", "when": {"time": 1}, "carried_to": "room"})
    robot = scene.run(2.0)
    estimator = scene.estimator
    scene.run(8.0, 0.0, 1.0)
    assert estimator.lost  # nobody has told it to search
    before = robot.estimate
    estimator.search()
    assert estimator.unsure
    assert robot.estimate == before
    # To and fro counts, and standing still does not.
    scene.run(2.0)
    scene.run(2.5, 0.0, 1.0)
    scene.run(2.5, 0.0, -1.0)
    assert estimator.lost
    assert len(scene.changes) == 1
    scene.run(3.0, 0.0, 1.0)
    assert not estimator.lost
    assert not estimator.unsure
    assert robot.estimate == robot.physics.pose
    assert scene.changes[-1][1:] == ("wrong_pose", False)


def test_an_initial_pose_ends_a_search() -> None:
    scene = Scene({"fault": "slip", "when": {"time": 1000}})
    estimator = scene.estimator
    estimator.search()
    wrong = Pose(6, 0, 0)
    assert not estimator.relocalise(wrong)
    assert not estimator.unsure
    scene.run(10.0, 0.0, 1.0)
    assert estimator.lost


def test_a_pose_jumps_and_comes_back() -> None:
    scene = Scene(
        {
            "fault": "wrong_pose",
            "when": {"time": 1},
            "lasts": 2,
            "by": {"x": 1, "y": -0.5, "theta": 0.5},
            "lost": True,
        }
    )
    robot = scene.run(2.0)
    pose, estimator = robot.estimate, scene.estimator
    assert (pose.x, pose.y, pose.theta) == pytest.approx((1, 0, 0.5))
    assert estimator.unsure
    assert robot.physics.pose == WEST
    scene.run(2.0)
    assert robot.estimate == WEST
    assert not estimator.unsure
    assert scene.changes == [(1.0, "wrong_pose", True), (3.0, "wrong_pose", False)]


def test_nobody_is_carried_onto_another_robot() -> None:
    scene = Scene(
        {"fault": "wrong_pose", "robot": "robot2", "carried_to": {"x": 0, "y": 0.5}}, robots=2
    )
    scene.run(1.0)
    assert not scene.changes
    scene.run(3.0, 0.4)
    assert [change[1:] for change in scene.changes] == [("wrong_pose", True)]
    assert scene.all[1].physics.pose == WEST


def test_a_door_closes_when_nobody_is_in_it_and_opens_again() -> None:
    scene = Scene({"fault": "door_closes", "between": ["hall", "room"], "lasts": 5})
    scene.robot.physics.reset(Pose(3.1, 0.5, 0))
    scene.run(2.0)
    assert not scene.changes  # the robot is in the door
    scene.run(3.0, 0.4)
    ((begun, kind, active),) = scene.changes
    assert (kind, active) == ("door_closes", True)
    behind = scene.body.ranges(np.array([math.pi]), 10.0)[0]
    assert behind < 1.5
    scene.run(6.0)
    assert scene.changes[-1] == (round(begun + 5, 2), "door_closes", False)
    assert scene.body.ranges(np.array([math.pi]), 10.0)[0] > 3


def test_a_door_stays_closed_as_long_as_one_fault_closes_it() -> None:
    scene = Scene(
        {"fault": "door_closes", "between": ["hall", "room"], "lasts": 2},
        {"fault": "door_closes", "between": ["room", "hall"], "lasts": 4},
        # Of another name.
        {"fault": "door_closes", "between": [{"x": 1, "y": 0.4}, {"x": 5, "y": 0.4}], "lasts": 6},
    )
    for seconds, closed in ((1.0, True), (2.0, True), (2.0, True), (2.0, False)):
        scene.run(seconds)
        assert (scene.body.ranges(np.zeros(1), 10.0)[0] < 3.1) == closed


def test_an_empty_battery_stops_the_robot_until_it_is_charged() -> None:
    scene = Scene(
        {
            "fault": "battery",
            "level": 0.5,
            "per_second": 0.02,
            "per_metre": 0.2,
            "charging_place": "room",
            "charging": 0.1,
        }
    )
    robot, battery = scene.robot, scene.injector.batteries[""]
    scene.run(2.0)
    assert battery.level == pytest.approx(0.46)
    scene.run(2.0, 0.4)
    assert battery.level == pytest.approx(0.42 - 0.2 * robot.physics.pose.x)
    scene.run(6.0, 0.4)
    assert battery.empty
    assert [change[1:] for change in scene.changes] == [("battery", True)]
    stood = robot.physics.pose
    scene.run(2.0, 0.4)
    assert robot.physics.pose == stood
    scene.body.reset(Pose(5, 0.5, 0))  # somebody carries it to the charger
    scene.run(0.3, 0.4)
    assert battery.charging
    assert robot.physics.pose == Pose(5, 0.5, 0)  # not yet enough
    scene.run(2.0, 0.4)
    assert scene.changes[-1][1:] == ("battery", False)
    assert robot.physics.pose.x > 5.1
    scene.body.reset(Pose(5, 0.5, 0))
    scene.run(12.0)
    assert battery.level == 1.0


def test_a_place_and_how_often() -> None:
    scene = Scene(
        {
            "fault": "slip",
            "loss": 0.1,
            "lasts": 0.5,
            "when": {"place": "hall", "within": 0.5, "times": 2},
        }
    )
    for _ in range(4):  # back and forth
        scene.run(5.0, 0.4)
        scene.run(5.0, -0.4)
    begun = [time for time, _, active in scene.changes if active]
    assert len(begun) == 2
    assert begun[1] - begun[0] > 5  # it has to leave before it comes again
    assert [active for _, _, active in scene.changes] == [True, False, True, False]


@pytest.mark.parametrize("per", ["second", "metre"])
def test_probabilities(per: str) -> None:
    """Of many faults, so many have begun after a while as chance has it."""
    chance = {"probability": 0.2, "per": per}
    scene = Scene(*[{"fault": "slip", "loss": 0, "when": chance} for _ in range(300)])
    scene.run(3.0)
    wanted = 0.0 if per == "metre" else 1 - 0.8**3
    assert len(scene.changes) / 300 == pytest.approx(wanted, abs=0.08 if wanted else 0)
    scene.run(7.0, 0.4)
    metres = scene.robot.physics.pose.x
    wanted = 1 - 0.8 ** (10 if per == "second" else metres)
    assert len(scene.changes) / 300 == pytest.approx(wanted, abs=0.08)


@pytest.mark.costly
def test_a_seed_repeats_everything() -> None:
    def history(seed: int, *more: Dict[str, Any]) -> Tuple[object, ...]:
        scene = Scene(
            {"fault": "laser_noise", "sigma": 0.05, "dropout": 0.1},
            {"fault": "odometry_noise"},
            {"fault": "slip", "when": {"probability": 0.3, "times": 9}, "lasts": 0.5},
            *more,
            seed=seed,
            robots=2,
        )
        scene.drive(Pose(5, 0.5, 1))
        scans = [tuple(robot.scan.ranges) for robot in scene.all if robot.scan is not None]
        return tuple(scene.changes), scene.robot.odometry, scans

    assert history(7) == history(7)
    assert history(7) != history(8)
    # One more fault leaves the others as they are.
    changes, _, _ = history(7, {"fault": "slip", "loss": 0, "when": {"probability": 0.5}})
    slips = [change for change in history(7)[0] if change[1] == "slip"]  # type: ignore[attr-defined]
    assert slips
    assert set(slips) <= set(changes)  # type: ignore[call-overload]


def test_each_robot_has_its_own_faults() -> None:
    scene = Scene(
        {"fault": "slip", "when": {"probability": 0.5}},
        {"fault": "laser_noise", "sigma": 0.1, "robot": "robot2"},
        robots=3,
    )
    scene.run(10.0)
    states = report_faults(scene.injector.states)
    begun = {state["robot"]: state["begun"] for state in states if state["fault"] == "slip"}
    assert len({str(times) for times in begun.values()}) == 3
    noisy = [state["robot"] for state in states if state["fault"] == "laser_noise"]
    assert noisy == ["robot2"]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (
            {"fault": "slip", "robot": "robot7"},
            r"^~faults: fault 1 \(slip\): robot: there is no robot 'robot7'; there are robot1, ",
        ),
        (
            {"fault": "door_closes", "between": ["north", "corner"]},
            r"fault 1 \(door_closes\): between: there is a wall on the straight way",
        ),
        (
            {"fault": "door_closes", "between": ["room", {"x": 1e6, "y": 0}]},
            r"between: \(1e\+06, 0\) is in a wall or outside of the map; choose places on",
        ),
        (
            {"fault": "wrong_pose", "carried_to": "wall"},
            r"carried_to: \(3.1, 2\) is in a wall or outside of the map; choose a place",
        ),
    ],
)
def test_faults_that_cannot_be_in_this_world(fault: Dict[str, Any], message: str) -> None:
    with pytest.raises(FaultError, match=message):
        Scene(fault, robots=2)


def test_a_robot_without_a_name_and_one_with_two_batteries() -> None:
    with pytest.raises(FaultError, match="there is no robot 'mailbot'; leave it out, as there is"):
        Scene({"fault": "slip", "robot": "mailbot"})
    with pytest.raises(FaultError, match=r"fault 2 \(battery\): the robot has a battery already"):
        Scene({"fault": "battery"}, {"fault": "battery"})
