"""Simulates map_server and amcl: publishes the map and each robot's known pose."""

from __future__ import annotations

from typing import Any, Callable, List, Optional

import rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo_simulator.calls import Calls
from rosoclingo_simulator.navigation.estimator import PoseEstimator
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

    Without faults it knows where the robot is, and the frame of the odometry stays where it is on
    the map. With faults, that moves, an initial pose counts, and a global localisation searches.

    Attributes:
        fixed: The transforms that stay.
    """

    def __init__(
        self,
        simulation: Simulation,
        names: messages.RobotNames,
        calls: Calls,
        ask: Callable[..., Any],
    ) -> None:
        """Opens the topics.

        Args:
            simulation: What the robot is in.
            names: Those of the robot.
            calls: How to hand over to the simulation's thread.
            ask: Has that call a function, and returns its value.
        """
        self._simulation = simulation
        self._calls = calls
        self._ask = ask
        self._transform = messages.transform(messages.MAP, names.odom, simulation.physics.pose)
        self.fixed: List[TransformStamped] = []
        if simulation.estimator is None:
            self.fixed.append(self._transform)
        else:
            self._tf = publisher("/tf", TFMessage)
        self._told: Optional[Pose] = None
        self._told_unsure = False
        self._pose = publisher(names.topic("amcl_pose"), PoseWithCovarianceStamped, latch=True)
        self._initial_pose = subscriber(
            names.topic("initialpose"), PoseWithCovarianceStamped, self._on_initial_pose
        )
        self._service = rospy.Service(
            names.topic("global_localization"), Empty, self._on_global_localization
        )

    def publish(self, stamp: rospy.Time) -> None:
        """Says where the robot is, if it has moved."""
        pose, told, estimator = self._simulation.estimate, self._told, self._simulation.estimator
        unsure = estimator is not None and estimator.unsure
        if estimator is not None:
            self._transform.header.stamp = stamp
            messages.set_transform(self._transform, estimator.odometry_frame)
            self._tf.publish([self._transform])
        if (
            told is None
            or unsure != self._told_unsure
            or told.distance(pose) > _MOVED_METRES
            or abs(normal_angle(told.theta - pose.theta)) > _MOVED_RADIANS
        ):
            self._pose.publish(messages.estimate(pose, stamp, unsure))
            self._told, self._told_unsure = pose, unsure

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        estimator = self._simulation.estimator
        if estimator is None:
            rospy.logwarn("initialpose is ignored: the simulator knows where the robot is")
            self._calls.submit(self._repeat)
            return
        try:
            pose = messages.pose_from(PoseStamped(message.header, message.pose.pose))
        except messages.MessageError as err:
            rospy.logwarn("initialpose is ignored: %s", err)
            return
        self._calls.submit(self._relocalise, estimator, pose)

    def _on_global_localization(self, _: EmptyRequest) -> EmptyResponse:
        self._ask(self._search)
        return EmptyResponse()

    def _search(self) -> None:
        if self._simulation.estimator is not None:
            self._simulation.estimator.search()
        self._repeat()

    def _relocalise(self, estimator: PoseEstimator, pose: Pose) -> None:
        near = estimator.relocalise(pose)
        rospy.loginfo(
            "initialpose (%.2f, %.2f): the robot %s",
            pose.x,
            pose.y,
            "knows where it is" if near else "is far from there, and does not know it",
        )
        self._repeat()

    def _repeat(self) -> None:
        """Makes the next step publish the pose, even if the robot has not moved."""
        self._told = None
