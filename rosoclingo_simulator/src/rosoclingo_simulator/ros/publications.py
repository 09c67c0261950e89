"""Publishes a robot's odometry, transforms and scans after each step."""

from __future__ import annotations

from functools import partial
from typing import Any, Optional

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from rosclingo.ros.low_latency import publisher
from rosoclingo_simulator.navigation.simulation import Simulation
from rosoclingo_simulator.physics.laser import Scan
from rosoclingo_simulator.ros import messages


class Publications:
    """Publishes a robot's changes. The simulation's thread uses it.

    Messages that nobody listens to are not made, and those of each step are made once and filled
    again: rospy has written them when ``publish`` returns.
    """

    def __init__(
        self,
        simulation: Simulation,
        names: messages.RobotNames,
    ) -> None:
        """Opens the topics.

        Args:
            simulation: What to tell of.
            names: Those of the robot.
        """
        self._simulation = simulation
        self._names = names
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

    def publish(self, stamp: rospy.Time) -> None:
        """Publishes the changes of a step."""
        pose, velocity = self._simulation.physics.pose, self._simulation.physics.velocity
        if _listened(self._tf) or _listened(self._odom):
            moved = self._simulation.odometry
            self._transform.header.stamp = stamp
            messages.set_transform(self._transform, moved)
            self._tf.publish([self._transform])
            messages.set_odometry(self._odom_message, moved, velocity, stamp)
            self._odom.publish(self._odom_message)
        if _listened(self._truth):
            velocity = self._simulation.true_velocity
            messages.set_odometry(self._truth_message, pose, velocity, stamp)
            self._truth.publish(self._truth_message)
        self._publish_scan()
        touches = self._simulation.physics.touches
        if touches != self._told_touches:
            self._touches.publish(touches)
            self._told_touches = touches

    def _publish_scan(self) -> None:
        scan = self._simulation.scan
        if scan is not None and scan is not self._told_scan:
            self._told_scan = scan
            if _listened(self._scan):
                stamp = rospy.Time.from_sec(self._simulation.begin + scan.time)
                self._scan.publish(messages.scan_message(scan, self._names.laser, stamp))


def _listened(topic: Any) -> bool:
    return bool(topic.get_num_connections())
