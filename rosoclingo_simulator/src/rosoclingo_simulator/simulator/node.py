"""The simulator's ROS node."""

from __future__ import annotations

import concurrent.futures
import sys
import threading
from typing import TYPE_CHECKING, Callable, NoReturn, Optional, Tuple, TypeVar, Union

import rospy
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Clock

from rosclingo.errors import RosclingoError
from rosclingo.ros.init import give_up, init_node, spin
from rosclingo.ros.low_latency import subscriber
from rosoclingo_interfaces.navigation.waypoints import read_waypoints
from rosoclingo_interfaces.topics import publishers
from rosoclingo_simulator.errors import PhysicsError
from rosoclingo_simulator.simulator import messages
from rosoclingo_simulator.simulator.action import GoalServer
from rosoclingo_simulator.simulator.calls import Calls
from rosoclingo_simulator.simulator.costmap import Costmap
from rosoclingo_simulator.simulator.followed_clock import FollowedClock
from rosoclingo_simulator.simulator.follower import Command
from rosoclingo_simulator.simulator.kinematic import KinematicPhysics
from rosoclingo_simulator.simulator.localisation import Localisation
from rosoclingo_simulator.simulator.move_base import MoveBase
from rosoclingo_simulator.simulator.navigation import Navigation
from rosoclingo_simulator.simulator.obstacles import Obstacles
from rosoclingo_simulator.simulator.occupancy import OccupancyMap, read_map
from rosoclingo_simulator.simulator.pacer import Pacer
from rosoclingo_simulator.simulator.physics import ROBOT_RADIUS, Physics
from rosoclingo_simulator.simulator.planner import Planner
from rosoclingo_simulator.simulator.publications import Publications
from rosoclingo_simulator.simulator.settings import Settings, read_settings
from rosoclingo_simulator.simulator.simulation import STEP_SECONDS, Simulation
from rosoclingo_simulator.srv import Obstacle, ObstacleRequest, ObstacleResponse

if TYPE_CHECKING:
    from rosoclingo_simulator.simulator.camera import CameraPublisher

_USAGE = """usage: simulator.py [_PARAMETER:=VALUE]... [ROS remappings]

Simulates a robot with a laser, obstacles and, unless told otherwise, localisation and move_base.
Parameters, such as _speed:=10, are described in the package's README."""

_SECONDS_TO_ANSWER = 10.0  # of wall time, for the simulation's thread
_SECONDS_TO_END = 1.0  # likewise, for its last step
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
        frames = messages.Frames(settings.frame_prefix)
        physics, self._camera = _physics(settings, world, frames)
        move_base = _move_base(settings, world) if settings.navigation else None
        self._simulation = Simulation(physics, move_base)
        self._obstacles = Obstacles(world, waypoints, physics)
        self._calls = Calls()
        self._stop = threading.Event()
        self._stopped = threading.Event()
        fixed = list(messages.robot_transforms(frames))
        if self._camera is not None:
            fixed += self._camera.transforms()
        self._localisation: Optional[Localisation] = None
        if settings.localisation:
            self._localisation = Localisation(self._simulation, world, frames, self._calls)
            fixed.append(self._localisation.transform)
        self._navigation: Optional[Navigation] = None
        self._goals: Optional[GoalServer] = None
        if move_base is not None:
            self._navigation = Navigation(self._simulation, move_base, self._ask)
            self._goals = GoalServer(self._simulation, move_base, self._calls)
        self._publications = Publications(self._simulation, frames, fixed, settings.clock)
        self._subscribers = [subscriber("cmd_vel", Twist, self._on_command)]
        self._service = rospy.Service("~obstacle", Obstacle, self._obstacle)
        self._pace: Union[Pacer, FollowedClock]
        if settings.clock:
            self._pace = Pacer(settings.speed, self._on_slow, sleep=self._stop.wait)
        else:
            self._pace = followed = FollowedClock(rospy.logwarn)
            self._subscribers.append(
                subscriber("/clock", Clock, lambda message: followed.tell(message.clock.to_sec()))
            )

    def run(self) -> None:
        """Runs the simulation until the node is shut down."""
        rospy.on_shutdown(self._end)
        # A shutdown that began before calls nobody any more.
        while not (self._stop.is_set() or rospy.is_shutdown()):
            jump = self._pace.wait(STEP_SECONDS)
            self._calls.run()
            if jump is not None:
                self._simulation.begin += jump
                self._step()
        if self._camera is not None:
            self._camera.close()
        self._stopped.set()
        spin()  # until the master knows that this node is gone

    def _step(self) -> None:
        """Lets one step of time pass, and tells of it."""
        simulation = self._simulation
        simulation.watched = self._publications.scan_is_wanted
        simulation.step()
        stamp = rospy.Time.from_sec(simulation.now)
        if self._localisation is not None:
            self._localisation.publish(stamp)
        if self._navigation is not None:
            self._navigation.publish(stamp)
        self._publications.publish(stamp)
        if self._goals is not None:
            self._goals.update()
        if self._camera is not None:
            self._camera.update(simulation.time, stamp)

    def _end(self) -> None:
        """Waits for the last step: rospy closes the topics next."""
        self._stop.set()
        self._stopped.wait(_SECONDS_TO_END)

    def _ask(self, function: Callable[..., _Returned], *arguments: object) -> _Returned:
        """Has the simulation's thread call a function; a service returns its value."""
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

    def _on_command(self, message: Twist) -> None:
        if message._connection_header["callerid"] == rospy.get_name():
            return  # what this node has told the wheels itself
        try:
            command = messages.command_from(message)
        except messages.MessageError as err:
            rospy.logwarn_throttle(5.0, f"command ignored: {err}")
            return
        self._calls.submit(self._drive, command)

    def _drive(self, command: Command) -> None:
        if not self._simulation.drive(command):
            rospy.logwarn_throttle(5.0, "commands are ignored while the robot drives to a goal")

    def _on_slow(self, speed: float) -> None:
        rospy.logwarn("too slow: simulated time goes %.2g times as fast as real time", speed)


def _about(settings: Settings) -> str:
    """Returns what is simulated."""
    pace = f"at {settings.speed:g} times real time" if settings.clock else "by /clock"
    navigation = "" if settings.navigation else ", without navigation"
    localisation = "" if settings.localisation else ", without localisation"
    return f"{settings.map.stem}, {settings.physics}, {pace}{navigation}{localisation}"


def _move_base(settings: Settings, world: OccupancyMap) -> MoveBase:
    planner = Planner(world)
    costmap = Costmap(world, planner.grid)
    return MoveBase(planner, costmap, settings.limits, settings.progress_timeout)


def _warn_of_another_clock() -> None:
    """Says so if another node publishes the time, too."""
    others = [name for name in publishers("/clock") if name != rospy.get_name()]
    if others:
        rospy.logwarn(
            "%s publishes /clock, too: start one of them with _clock:=false", " and ".join(others)
        )


def _physics(
    settings: Settings, world: OccupancyMap, frames: messages.Frames
) -> Tuple[Physics, Optional[CameraPublisher]]:
    """Starts the kind of physics that is wanted, and its camera if it has one."""
    pose = settings.pose
    if world.clearance(pose.x, pose.y) < ROBOT_RADIUS:
        raise PhysicsError(
            f"the robot cannot stand at ({pose.x:g}, {pose.y:g}), which is in a wall or outside of "
            f"the map {settings.map}; set ~initial_pose, or ROBOT_INITIAL_POSE with a launch file"
        )
    if settings.physics == "kinematic":
        return KinematicPhysics(world, pose), None
    try:
        # MuJoCo is optional, so what imports it comes late.
        from rosoclingo_simulator.simulator.camera import CameraPublisher  # noqa: PLC0415 - see above
        from rosoclingo_simulator.simulator.mujoco_physics import MujocoPhysics  # noqa: PLC0415
    except ModuleNotFoundError as err:
        if err.name != "mujoco":
            raise
        raise PhysicsError("~physics:=mujoco needs MuJoCo; install it: pip install mujoco") from err
    physics = MujocoPhysics(settings.world, pose)
    return physics, CameraPublisher(physics, frames)


def main() -> NoReturn:
    """Runs the node. The exit status is 0, or 2 if a parameter or a file is wrong."""
    init_node("simulator", usage=_USAGE)
    if not rospy.get_param("/use_sim_time", False):
        rospy.logwarn("/use_sim_time is not set: other nodes do not go by the simulator's clock")
    try:
        settings = read_settings()
        if settings.clock:
            _warn_of_another_clock()
        node = SimulatorNode(settings)
    except RosclingoError as err:
        give_up(err)
    rospy.loginfo("simulates %s", _about(settings))
    node.run()
    sys.exit(0)
