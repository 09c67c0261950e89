"""The simulator's ROS node."""

from __future__ import annotations

import concurrent.futures
import importlib
import threading
import time
from functools import partial
from typing import (
    TYPE_CHECKING,
    Callable,
    Dict,
    List,
    NoReturn,
    Optional,
    Sequence,
    Tuple,
    TypeVar,
    Union,
)

import rospy
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from rosclingo.errors import RosclingoError
from rosclingo.libraries import install_command
from rosclingo.ros.init import init_node, run_node
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_interfaces.navigation.waypoints import Waypoints, read_waypoints
from rosoclingo_interfaces.ros.topics import publishers
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.errors import PhysicsError
from rosoclingo_simulator.faults.injector import FaultInjector
from rosoclingo_simulator.faults.reader import read_faults
from rosoclingo_simulator.followed_clock import FollowedClock
from rosoclingo_simulator.navigation.costmap import Costmap
from rosoclingo_simulator.navigation.move_base import MoveBaseDriver
from rosoclingo_simulator.navigation.planner import PathPlanner
from rosoclingo_simulator.navigation.simulation import Fleet, Simulation
from rosoclingo_simulator.pacer import Pacer
from rosoclingo_simulator.physics.kinematic import KinematicPhysics
from rosoclingo_simulator.physics.obstacles import Obstacles
from rosoclingo_simulator.physics.occupancy import OccupancyMap, read_map
from rosoclingo_simulator.physics.physics import ROBOT_RADIUS, STEP_SECONDS, Pose
from rosoclingo_simulator.ros import messages
from rosoclingo_simulator.ros.faults import FaultPublisher
from rosoclingo_simulator.ros.localisation import MapServer
from rosoclingo_simulator.ros.robot import Robot
from rosoclingo_simulator.ros.settings import Settings, read_settings
from rosoclingo_simulator.srv import Obstacle, ObstacleRequest, ObstacleResponse

if TYPE_CHECKING:
    from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics
    from rosoclingo_simulator.ros.camera import CameraPublisher

_USAGE = """usage: simulator.py [_PARAMETER:=VALUE]... [ROS remappings]

Simulates robots with lasers, obstacles and, unless told otherwise, localisation and move_base.
Parameters, such as _speed:=10, are described in the package's README."""

_SLOW = "too slow: simulated time goes %.2g times as fast as real time"
_SECONDS_TO_ANSWER = 10.0  # of wall time, for the simulation's thread
_SECONDS_TO_END = 1.0  # of wall time, for its last step
# Of wall time, from one message of /clock to the next, at least: at speed 10, those of every fourth
# step. Each of them wakes all nodes, which take longer than this for what they do.
_CLOCK_SECONDS = 0.02
_Returned = TypeVar("_Returned")


class SimulatorNode:
    """Runs the simulation and connects it with ROS. Make it after the node is initialised."""

    def __init__(self, settings: Settings) -> None:
        """Opens topics and services; nothing moves before :meth:`run`.

        Args:
            settings: What the parameters say.

        Raises:
            RosclingoError: A file cannot be read, or the physics cannot start.
        """
        world = read_map(settings.map)
        waypoints = read_waypoints(settings.waypoints)
        names = [messages.RobotNames(name, f"{name}/") for name in settings.fleet] or [
            messages.RobotNames("", settings.frame_prefix)
        ]
        bodies = _bodies(settings, world, _starts(settings, world, waypoints), names)
        planner = PathPlanner(world)
        self._obstacles = Obstacles(world, waypoints, bodies[0][0])
        self._calls = Calls()
        self._stop = threading.Event()
        self._stopped = threading.Event()
        simulations = [
            Simulation(physics, _move_base(settings, world, planner)) for physics, _ in bodies
        ]
        self._fleet = Fleet(simulations)
        self._faults: Optional[FaultPublisher] = None
        if settings.faults is not None:  # before others look at the robots
            plan = read_faults(settings.faults, waypoints)
            robots = {name.robot: robot for name, robot in zip(names, simulations)}
            injector = FaultInjector(plan, robots, world, self._obstacles)
            self._faults = FaultPublisher(injector, names)
        self._robots = [
            Robot(
                simulation,
                name,
                camera,
                localisation=settings.localisation,
                calls=self._calls,
                ask=self._ask,
            )
            for simulation, (_, camera), name in zip(simulations, bodies, names)
        ]
        self._maps = MapServer(world) if settings.localisation else None
        self._static = publisher("/tf_static", TFMessage, latch=True)
        self._static.publish([transform for robot in self._robots for transform in robot.fixed])
        self._clock = publisher("/clock", Clock) if settings.clock else None
        self._told_clock = 0.0  # when, in wall time
        self._service = rospy.Service("~obstacle", Obstacle, self._obstacle)
        self._pace: Union[Pacer, FollowedClock]
        if settings.clock:
            self._pace = Pacer(settings.speed, partial(rospy.logwarn, _SLOW), sleep=self._stop.wait)
        else:
            self._pace = followed = FollowedClock(rospy.logwarn)
            self._followed = subscriber(
                "/clock", Clock, lambda message: followed.tell(message.clock.to_sec())
            )

    def run(self) -> None:
        """Runs the simulation until the node is shut down."""
        rospy.on_shutdown(self._end)
        # A shutdown that began before makes no more calls.
        while not (self._stop.is_set() or rospy.is_shutdown()):
            jump = self._pace.wait(STEP_SECONDS)
            self._calls.run()
            if jump is not None:
                self._step(jump)
        for robot in self._robots:
            robot.close()
        self._stopped.set()

    def _step(self, jump: float) -> None:
        """Simulates and publishes one step; the clock comes after the messages that it stamps."""
        for robot in self._robots:
            robot.simulation.begin += jump
        self._fleet.step()
        first = self._robots[0].simulation
        stamp = rospy.Time.from_sec(first.now)
        if self._faults is not None:
            self._faults.update(first.time, stamp)
        for robot in self._robots:
            robot.publish(stamp)
        wall = time.monotonic()
        if self._clock is not None and wall - self._told_clock >= _CLOCK_SECONDS:
            self._clock.publish(stamp)
            self._told_clock = wall
        for robot in self._robots:
            robot.answer(stamp)

    def _end(self) -> None:
        """Waits for the last step: rospy closes the topics next."""
        self._stop.set()
        self._stopped.wait(_SECONDS_TO_END)

    def _ask(self, function: Callable[..., _Returned], *arguments: object) -> _Returned:
        """Calls a function in the simulation's thread and waits, as services need it."""
        try:
            return self._calls.submit(function, *arguments).result(_SECONDS_TO_ANSWER)
        except concurrent.futures.TimeoutError as err:
            raise rospy.ServiceException("the simulator is busy or shutting down") from err

    def _obstacle(self, request: ObstacleRequest) -> ObstacleResponse:
        try:
            message = self._ask(self._obstacles.obey, request.command)
        except RosclingoError as err:
            return ObstacleResponse(False, str(err))
        rospy.loginfo("%s", message)
        return ObstacleResponse(True, message)


def _about(settings: Settings) -> str:
    """Describes the simulation for the log."""
    pace = f"at {settings.speed:g} times real time" if settings.clock else "by /clock"
    navigation = "" if settings.navigation else ", without navigation"
    localisation = "" if settings.localisation else ", without localisation"
    robots = f", {', '.join(settings.fleet)}" if settings.fleet else ""
    return f"{settings.map.stem}, {settings.physics}, {pace}{navigation}{localisation}{robots}"


def _move_base(
    settings: Settings, world: OccupancyMap, planner: PathPlanner
) -> Optional[MoveBaseDriver]:
    if not settings.navigation:
        return None
    costmap = Costmap(world, planner.grid)
    return MoveBaseDriver(planner, costmap, settings.limits, settings.progress_timeout)


def _warn_of_another_clock() -> None:
    """Warns if another node publishes the time, too."""
    others = [name for name in publishers("/clock") if name != rospy.get_name()]
    if others:
        rospy.logwarn(
            "%s publishes /clock, too: start one of them with _clock:=false", " and ".join(others)
        )


def _starts(settings: Settings, world: OccupancyMap, waypoints: Waypoints) -> List[Pose]:
    """Returns where the robots are at first, in order."""
    places = {
        "the robot": ("~initial_pose, or ROBOT_INITIAL_POSE with a launch file", settings.pose)
    }
    if settings.fleet:
        fleet = settings.fleet.items()
        places = {name: ("~fleet", waypoints.find(waypoint)) for name, waypoint in fleet}
    starts: Dict[str, Pose] = {}
    for name, (remedy, pose) in places.items():
        if world.clearance(pose.x, pose.y) < ROBOT_RADIUS:
            raise PhysicsError(
                f"{name} cannot stand at ({pose.x:g}, {pose.y:g}), which is in a wall or outside "
                f"of the map {settings.map}; set {remedy}"
            )
        for other, place in starts.items():
            if pose.distance(place) < 2 * ROBOT_RADIUS:
                raise PhysicsError(f"{other} and {name} cannot be at the same place: set ~fleet")
        starts[name] = pose
    return list(starts.values())


def _bodies(
    settings: Settings,
    world: OccupancyMap,
    starts: Sequence[Pose],
    names: Sequence[messages.RobotNames],
) -> List[Tuple[Union[KinematicPhysics, MujocoPhysics], Optional[CameraPublisher]]]:
    """Starts the kind of physics that is wanted, for each robot, and cameras if it has them."""
    if settings.physics == "kinematic":
        first = KinematicPhysics(world, starts[0])
        return [(first, None), *((first.join(start), None) for start in starts[1:])]
    if len(starts) > 1:
        raise PhysicsError("~physics:=mujoco has one robot: for ~fleet, set ~physics:=kinematic")
    try:
        importlib.import_module("mujoco")
    except ImportError as err:
        raise PhysicsError(
            f"~physics:=mujoco needs MuJoCo, which cannot be loaded ({err}); install it: "
            f"{install_command('mujoco>=3.1')}"
        ) from err
    # MuJoCo is optional, so the modules that import it are loaded here.
    from rosoclingo_simulator.physics.mujoco.mujoco_physics import MujocoPhysics  # noqa: PLC0415
    from rosoclingo_simulator.ros.camera import CameraPublisher  # noqa: PLC0415

    physics = MujocoPhysics(settings.world, starts[0])
    return [(physics, CameraPublisher(physics, names[0]))]


def main() -> NoReturn:
    """Runs the node. The exit status is 0, or 2 if a parameter or a file is wrong."""
    init_node("simulator", usage=_USAGE)
    if not rospy.get_param("/use_sim_time", False):
        rospy.logwarn("/use_sim_time is not set: other nodes do not go by the simulator's clock")
    run_node(_simulate)


def _simulate() -> None:
    settings = read_settings()
    if settings.clock:
        _warn_of_another_clock()
    node = SimulatorNode(settings)
    rospy.loginfo("simulates %s", _about(settings))
    node.run()
