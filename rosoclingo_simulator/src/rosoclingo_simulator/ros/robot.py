"""The topics, services and action of one robot in the simulator's node."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Union

import rospy
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.follower import VelocityCommand
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.ros import messages
from rosoclingo_simulator.ros.localisation import Localisation
from rosoclingo_simulator.ros.navigation import Navigation

if TYPE_CHECKING:
    from rosoclingo_simulator.ros.camera import CameraPublisher


class Robot:
    """Connects a robot with ROS. All methods are for the simulation's thread.

    Messages without subscribers are not made, and those of each step are made once and filled
    again: rospy has written them when ``publish`` returns.

    Attributes:
        simulation: What drives it.
        fixed: Transforms that stay as they are.
    """

    def __init__(
        self,
        simulation: Simulation,
        names: messages.RobotNames,
        camera: Optional[CameraPublisher],
        *,
        localisation: bool,
        calls: Calls,
        ask: Callable[..., Any],
    ) -> None:
        """Opens topics and services.

        Args:
            simulation: What drives the robot.
            names: Those of the robot.
            camera: Publishes what it sees; None if it has no camera.
            localisation: Whether it knows its place on the map.
            calls: How to hand over to the simulation's thread.
            ask: Has that call a function, and returns its value.
        """
        self.simulation = simulation
        self.fixed: List[TransformStamped] = list(messages.robot_transforms(names))
        self._names = names
        self._calls = calls
        self._camera = camera
        if camera is not None:
            self.fixed += camera.transforms()
        self._parts: List[Union[Localisation, Navigation]] = []
        if localisation:
            known = Localisation(simulation, names, calls, ask)
            self.fixed += known.fixed
            self._parts.append(known)
        self._navigation: Optional[Navigation] = None
        if simulation.move_base is not None:
            self._navigation = Navigation(simulation, simulation.move_base, names, calls, ask)
            self._parts.append(self._navigation)
        self._tf = publisher("/tf", TFMessage)
        self._odom = publisher(names.topic("odom"), Odometry)
        self._truth = publisher(names.topic("ground_truth"), Odometry)
        self._scan = publisher(names.topic("scan"), LaserScan)
        simulation.is_watched = partial(_listened, self._scan)
        self._touches = publisher(names.topic("~touches"), Bool, latch=True)
        self._odom_message = messages.odometry(names.odom, names.footprint)
        self._truth_message = messages.odometry(messages.MAP, names.footprint)
        self._transform = messages.transform(names.odom, names.footprint, simulation.odometry)
        self._told_scan: Optional[Scan] = None
        self._told_touches: Optional[bool] = None
        self._subscriber = subscriber(names.topic("cmd_vel"), Twist, self._on_command)

    def publish(self, stamp: rospy.Time) -> None:
        """Publishes the state after a step."""
        for part in self._parts:
            part.publish(stamp)
        pose, velocity = self.simulation.physics.pose, self.simulation.physics.velocity
        if _listened(self._tf) or _listened(self._odom):
            moved = self.simulation.odometry
            self._transform.header.stamp = stamp
            messages.set_transform(self._transform, moved)
            self._tf.publish([self._transform])
            messages.set_odometry(self._odom_message, moved, velocity, stamp)
            self._odom.publish(self._odom_message)
        if _listened(self._truth):
            velocity = self.simulation.true_velocity
            messages.set_odometry(self._truth_message, pose, velocity, stamp)
            self._truth.publish(self._truth_message)
        self._publish_scan()
        touches = self.simulation.physics.touches
        if touches != self._told_touches:
            self._touches.publish(touches)
            self._told_touches = touches

    def _publish_scan(self) -> None:
        scan = self.simulation.scan
        if scan is not None and scan is not self._told_scan:
            self._told_scan = scan
            if _listened(self._scan):
                stamp = rospy.Time.from_sec(self.simulation.begin + scan.time)
                self._scan.publish(messages.scan_message(scan, self._names.laser, stamp))

    def answer(self, stamp: rospy.Time) -> None:
        """Sends results of goals, and publishes images, after the clock."""
        if self._navigation is not None:
            self._navigation.update()
        if self._camera is not None:
            self._camera.update(self.simulation.time, stamp)

    def close(self) -> None:
        """Releases OpenGL."""
        if self._camera is not None:
            self._camera.close()

    def _on_command(self, message: Twist) -> None:
        if message._connection_header["callerid"] == rospy.get_name():
            return  # what this node has told the wheels itself
        try:
            command = messages.command_from(message)
        except messages.MessageError as err:
            rospy.logwarn_throttle(5.0, f"command ignored: {err}")
            return
        self._calls.submit(self._drive, command)

    def _drive(self, command: VelocityCommand) -> None:
        if not self.simulation.drive(command):
            rospy.logwarn_throttle(5.0, "commands are ignored while the robot drives to a goal")


def _listened(topic: Any) -> bool:
    return bool(topic.get_num_connections())
