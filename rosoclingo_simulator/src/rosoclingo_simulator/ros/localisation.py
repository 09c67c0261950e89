"""Simulates map_server and amcl: publishes the map and each robot's known pose."""

from __future__ import annotations

from typing import Optional

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.occupancy import OccupancyMap
from rosoclingo_simulator.physics.physics import Pose, normal_angle
from rosoclingo_simulator.ros import messages

_MOVED_METRES, _MOVED_RADIANS = 0.2, 0.5  # after which it says where the robot is


class MapServer:
    """Simulated map_server: publishes the map."""

    def __init__(self, world: OccupancyMap) -> None:
        """Opens topics and service.

        Args:
            world: The map.
        """
        message = messages.map_message(world)
        self._maps = [
            publisher("map", OccupancyGrid, latch=True),
            publisher("map_metadata", MapMetaData, latch=True),
        ]
        self._maps[0].publish(message)
        self._maps[1].publish(message.info)
        self._service = rospy.Service("static_map", GetMap, lambda _: GetMapResponse(message))


class Localisation:
    """A robot's simulated amcl. The simulation's thread calls :meth:`publish`.

    Attributes:
        transform: Where the frame of the odometry is on the map; it stays there.
    """

    def __init__(self, simulation: Simulation, names: messages.RobotNames, calls: Calls) -> None:
        """Opens the topics.

        Args:
            simulation: What the robot is in.
            names: Those of the robot.
            calls: How to hand over to the simulation's thread.
        """
        self._simulation = simulation
        self._calls = calls
        self.transform: TransformStamped = messages.transform(
            messages.MAP, names.odom, simulation.physics.pose
        )
        self._told: Optional[Pose] = None
        self._pose = publisher(names.topic("amcl_pose"), PoseWithCovarianceStamped, latch=True)
        self._initial_pose = subscriber(
            names.topic("initialpose"), PoseWithCovarianceStamped, self._on_initial_pose
        )

    def publish(self, stamp: rospy.Time) -> None:
        """Says where the robot is, if it has moved."""
        pose, told = self._simulation.physics.pose, self._told
        if (
            told is None
            or told.distance(pose) > _MOVED_METRES
            or abs(normal_angle(told.theta - pose.theta)) > _MOVED_RADIANS
        ):
            self._pose.publish(messages.estimate(pose, stamp))
            self._told = pose

    def _on_initial_pose(self, _: PoseWithCovarianceStamped) -> None:
        rospy.logwarn("initialpose is ignored: the simulator knows where the robot is")
        self._calls.submit(self._repeat)

    def _repeat(self) -> None:
        """Makes the next step publish the pose, even if the robot has not moved."""
        self._told = None
