"""The topics, services and action of one robot in the simulator's node."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, List, Optional, Union

import rospy
from geometry_msgs.msg import TransformStamped, Twist

from rosclingo.ros.low_latency import subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.follower import VelocityCommand
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.ros import messages
from rosoclingo_simulator.ros.localisation import Localisation
from rosoclingo_simulator.ros.navigation import Navigation
from rosoclingo_simulator.ros.publications import Publications

if TYPE_CHECKING:
    from rosoclingo_simulator.ros.camera import CameraPublisher


class Robot:
    """Connects a robot with ROS. All methods are for the simulation's thread.

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
        self._parts: List[Union[Localisation, Navigation, Publications]] = []
        if localisation:
            known = Localisation(simulation, names, calls, ask)
            self.fixed += known.fixed
            self._parts.append(known)
        self._navigation: Optional[Navigation] = None
        if simulation.move_base is not None:
            self._navigation = Navigation(simulation, simulation.move_base, names, calls, ask)
            self._parts.append(self._navigation)
        self._parts.append(Publications(simulation, names))
        self._subscriber = subscriber(names.topic("cmd_vel"), Twist, self._on_command)

    def publish(self, stamp: rospy.Time) -> None:
        """Tells of a step."""
        for part in self._parts:
            part.publish(stamp)

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
