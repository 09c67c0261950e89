"""What the simulator tells the world after each step."""

from __future__ import annotations

import math
from typing import Any, Optional, Sequence

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped, Twist
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage

from rosclingo.low_latency import publisher
from rosoclingo_gazebo.simulator import messages
from rosoclingo_gazebo.simulator.laser import Scan
from rosoclingo_gazebo.simulator.physics import Pose, normal_angle
from rosoclingo_gazebo.simulator.simulation import SCAN_SECONDS, Simulation

_MOVED_METRES, _MOVED_RADIANS = 0.2, 0.5  # after which localisation says where the robot is


class Publications:
    """Publishes what has changed. The simulation's thread uses it.

    Messages that nobody listens to are not made, and those of each step are made once and filled
    again: rospy has written them when ``publish`` returns.
    """

    def __init__(
        self, simulation: Simulation, world: OccupancyGrid, parts: Sequence[TransformStamped]
    ) -> None:
        """Opens the topics, and publishes what does not change.

        Args:
            simulation: What to tell of.
            world: The map.
            parts: Where the parts of the robot are.
        """
        self._simulation = simulation
        self._start = simulation.physics.pose
        self._clock = publisher("/clock", Clock)
        self._tf = publisher("/tf", TFMessage)
        self._odom = publisher("odom", Odometry)
        self._truth = publisher("ground_truth", Odometry)
        self._scan = publisher("scan", LaserScan)
        self._commands = publisher("cmd_vel", Twist)
        self._plan = publisher("move_base/plan", Path, latch=True)
        self._pose = publisher("amcl_pose", PoseWithCovarianceStamped, latch=True)
        self._touches = publisher("~touches", Bool, latch=True)
        self._static = [
            publisher("/tf_static", TFMessage, latch=True),
            publisher("map", OccupancyGrid, latch=True),
            publisher("map_metadata", MapMetaData, latch=True),
        ]
        where = messages.transform(messages.MAP, messages.ODOM, self._start)
        self._static[0].publish([where, *parts])
        self._static[1].publish(world)
        self._static[2].publish(world.info)

        self._odom_message = messages.odometry(messages.ODOM)
        self._truth_message = messages.odometry(messages.MAP)
        self._transform = messages.transform(messages.ODOM, messages.FOOTPRINT, self._start)
        self._told_scan: Optional[Scan] = None
        self._told_path: Optional[np.ndarray] = None
        self._told_pose: Optional[Pose] = None
        self._told_touches: Optional[bool] = None
        self._told_active = False

    @property
    def scan_is_wanted(self) -> bool:
        """Whether somebody listens to the laser."""
        return _listened(self._scan)

    def publish(self) -> None:
        """Publishes what is new after a step; the clock comes last."""
        stamp = rospy.Time.from_sec(self._simulation.time)
        pose, velocity = self._simulation.physics.pose, self._simulation.physics.velocity
        if _listened(self._tf) or _listened(self._odom):
            moved = self._since_start(pose)
            self._transform.header.stamp = stamp
            messages.set_transform(self._transform, moved)
            self._tf.publish([self._transform])
            messages.set_odometry(self._odom_message, moved, velocity, stamp)
            self._odom.publish(self._odom_message)
        if _listened(self._truth):
            messages.set_odometry(self._truth_message, pose, velocity, stamp)
            self._truth.publish(self._truth_message)
        self._publish_estimate(pose, stamp)
        self._publish_scan()
        self._publish_navigation(stamp)
        touches = self._simulation.physics.touches
        if touches != self._told_touches:
            self._touches.publish(touches)
            self._told_touches = touches
        self._clock.publish(stamp)

    def repeat_estimate(self) -> None:
        """Says after the next step where the robot is, even if it has not moved."""
        self._told_pose = None

    def _publish_estimate(self, pose: Pose, stamp: rospy.Time) -> None:
        told = self._told_pose
        if (
            told is None
            or told.distance(pose) > _MOVED_METRES
            or abs(normal_angle(told.theta - pose.theta)) > _MOVED_RADIANS
        ):
            self._pose.publish(messages.estimate(pose, stamp))
            self._told_pose = pose

    def _publish_scan(self) -> None:
        scan = self._simulation.scan
        if scan is not None and scan is not self._told_scan:
            self._told_scan = scan
            if _listened(self._scan):
                stamp = rospy.Time.from_sec(scan.time)
                self._scan.publish(messages.scan_message(scan, stamp, SCAN_SECONDS))

    def _publish_navigation(self, stamp: rospy.Time) -> None:
        move_base = self._simulation.move_base
        goal, path = move_base.goal, move_base.path
        if path is not self._told_path and goal is not None:
            self._plan.publish(messages.path_message(path, goal, stamp))
        self._told_path = path
        # The last command is the stop. This node listens to the topic too.
        if (move_base.active or self._told_active) and self._commands.get_num_connections() > 1:
            twist = Twist()
            twist.linear.x, twist.angular.z = self._simulation.command
            self._commands.publish(twist)
        self._told_active = move_base.active

    def _since_start(self, pose: Pose) -> Pose:
        """Returns where the wheels have brought the robot."""
        start = self._start
        dx, dy = pose.x - start.x, pose.y - start.y
        cosine, sine = math.cos(start.theta), math.sin(start.theta)
        return Pose(
            cosine * dx + sine * dy,
            cosine * dy - sine * dx,
            normal_angle(pose.theta - start.theta),
        )


def _listened(topic: Any) -> bool:
    return bool(topic.get_num_connections())
