"""The simulator's ROS node."""

from __future__ import annotations

import concurrent.futures
import sys
import threading
from typing import TYPE_CHECKING, Callable, NoReturn, Optional, Tuple, TypeVar

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from nav_msgs.srv import GetMap, GetMapResponse, GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from rosclingo.errors import RosclingoError
from rosclingo.low_latency import subscriber
from rosclingo.ros_node import init_node
from rosoclingo_gazebo.simulator import messages
from rosoclingo_gazebo.simulator.action import GoalServer
from rosoclingo_gazebo.simulator.calls import Calls
from rosoclingo_gazebo.simulator.costmap import Costmap
from rosoclingo_gazebo.simulator.errors import PhysicsError
from rosoclingo_gazebo.simulator.follower import Command
from rosoclingo_gazebo.simulator.kinematic import KinematicPhysics
from rosoclingo_gazebo.simulator.move_base import MoveBase
from rosoclingo_gazebo.simulator.obstacles import Obstacles
from rosoclingo_gazebo.simulator.occupancy import OccupancyMap, read_map
from rosoclingo_gazebo.simulator.pacer import Pacer
from rosoclingo_gazebo.simulator.physics import ROBOT_RADIUS, Physics
from rosoclingo_gazebo.simulator.planner import Planner
from rosoclingo_gazebo.simulator.publications import Publications
from rosoclingo_gazebo.simulator.settings import Settings, read_settings
from rosoclingo_gazebo.simulator.simulation import STEP_SECONDS, Simulation
from rosoclingo_gazebo.srv import Obstacle, ObstacleRequest, ObstacleResponse
from rosoclingo_interfaces.waypoints import read_waypoints

if TYPE_CHECKING:
    from rosoclingo_gazebo.simulator.camera import CameraPublisher

_USAGE = """usage: simulator.py [_PARAMETER:=VALUE]... [ROS remappings]

Simulates a robot with navigation: move_base, localisation, a map, a laser and obstacles.
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
        physics, self._camera = _physics(settings, world)
        self._planner = Planner(world)
        costmap = Costmap(world, self._planner.grid)
        move_base = MoveBase(self._planner, costmap, settings.limits, settings.progress_timeout)
        self._simulation = Simulation(physics, move_base)
        self._obstacles = Obstacles(world, waypoints, physics)
        self._calls = Calls()
        self._stop = threading.Event()
        self._stopped = threading.Event()
        self._pacer = Pacer(settings.speed, self._warn, sleep=self._stop.wait)
        self._about = (
            f"{settings.map.stem}, {settings.physics}, at {settings.speed:g} times real time"
        )
        self._map = messages.map_message(world)
        camera = self._camera.transforms() if self._camera is not None else ()
        parts = (*messages.robot_transforms(), *camera)
        self._publications = Publications(self._simulation, self._map, parts)
        self._goals = GoalServer(self._simulation, self._calls)
        self._subscribers = [
            subscriber("cmd_vel", Twist, self._on_command),
            subscriber("initialpose", PoseWithCovarianceStamped, self._on_initial_pose),
        ]
        self._services = [
            rospy.Service("move_base/make_plan", GetPlan, self._make_plan),
            rospy.Service("move_base/clear_costmaps", Empty, self._clear_costmaps),
            rospy.Service("static_map", GetMap, lambda _: GetMapResponse(self._map)),
            rospy.Service("~obstacle", Obstacle, self._obstacle),
        ]

    def run(self) -> None:
        """Runs the simulation until the node is shut down."""
        rospy.on_shutdown(self._end)
        rospy.loginfo("simulates %s", self._about)
        while not self._stop.is_set():
            self._calls.run()
            self._simulation.watched = self._publications.scan_is_wanted
            self._simulation.step()
            self._publications.publish()
            self._goals.update()
            if self._camera is not None:
                self._camera.update(self._simulation.time)
            self._pacer.wait(STEP_SECONDS)
        if self._camera is not None:
            self._camera.close()
        self._stopped.set()
        rospy.spin()  # until the master knows that this node is gone

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

    def _make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        try:
            goal = messages.pose_from(request.goal)
            start = None
            if request.start.header.frame_id:  # without a frame, the robot's own place is meant
                start = messages.pose_from(request.start)
        except messages.MessageError as err:
            raise rospy.ServiceException(str(err)) from err
        physics, costmap = self._simulation.physics, self._simulation.move_base.costmap
        pose, marked, time = self._ask(
            lambda: (physics.pose, costmap.marked, self._simulation.time)
        )
        # Not in the simulation's thread, which need not wait for it.
        path = self._planner.plan(start or pose, goal, marked, request.tolerance)
        stamp = rospy.Time.from_sec(time)
        return GetPlanResponse(messages.path_message(path, goal, stamp))

    def _clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        self._ask(self._simulation.move_base.costmap.clear)
        return EmptyResponse()

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

    def _on_initial_pose(self, _: PoseWithCovarianceStamped) -> None:
        rospy.logwarn("initialpose is ignored: the simulator knows where the robot is")
        self._calls.submit(self._publications.repeat_estimate)

    def _warn(self, speed: float) -> None:
        rospy.logwarn("too slow: simulated time goes %.2g times as fast as real time", speed)


def _physics(settings: Settings, world: OccupancyMap) -> Tuple[Physics, Optional[CameraPublisher]]:
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
        from rosoclingo_gazebo.simulator.camera import CameraPublisher  # noqa: PLC0415 - see above
        from rosoclingo_gazebo.simulator.mujoco_physics import MujocoPhysics  # noqa: PLC0415
    except ModuleNotFoundError as err:
        if err.name != "mujoco":
            raise
        raise PhysicsError("~physics:=mujoco needs MuJoCo; install it: pip install mujoco") from err
    physics = MujocoPhysics(settings.world, pose)
    return physics, CameraPublisher(physics)


def main() -> NoReturn:
    """Runs the node. The exit status is 0, or 2 if a parameter or a file is wrong."""
    init_node("simulator", usage=_USAGE)
    if not rospy.get_param("/use_sim_time", False):
        rospy.logwarn("/use_sim_time is not set: other nodes do not go by the simulator's clock")
    try:
        node = SimulatorNode(read_settings())
    except RosclingoError as err:
        rospy.logfatal("%s", err)
        rospy.signal_shutdown(str(err))
        sys.exit(2)
    node.run()
    sys.exit(0)
