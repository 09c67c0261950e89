"""A simulated robot with faults: what it says, what is true, and how it finds its place again."""

from __future__ import annotations

import json
import math
import sys
import unittest
from typing import Any, Dict, List, Optional

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from waiting import wait_for

from rosoclingo_simulator.srv import Obstacle

START, CARRIED = (7.0, -8.0), (23.0, -17.0)  # open1 and c5


def near(pose: Optional[Pose], place: Any, metres: float = 0.1) -> bool:
    if pose is None:
        return False
    return math.hypot(pose.position.x - place[0], pose.position.y - place[1]) < metres


def initial_pose(x: float, y: float) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "map"
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.w = 1.0
    return message


class TestFaults(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.faults: Dict[str, Dict[str, Any]] = {}
        cls.truth: Optional[Pose] = None
        cls.estimate: Optional[PoseWithCovarianceStamped] = None
        cls.batteries: List[BatteryState] = []
        cls.scans: List[LaserScan] = []
        cls.frame: Optional[Any] = None  # of the odometry, on the map
        cls.topics = [
            rospy.Subscriber("simulator/faults", String, cls.on_faults),
            rospy.Subscriber("ground_truth", Odometry, cls.on_truth),
            rospy.Subscriber("amcl_pose", PoseWithCovarianceStamped, cls.on_estimate),
            rospy.Subscriber("battery_state", BatteryState, cls.batteries.append),
            rospy.Subscriber("scan", LaserScan, cls.scans.append),
            rospy.Subscriber("/tf", TFMessage, cls.on_transforms),
        ]
        cls.initial = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=5)

    @classmethod
    def on_faults(cls, message: String) -> None:
        cls.faults = {fault["fault"]: fault for fault in json.loads(message.data)["faults"]}

    @classmethod
    def on_truth(cls, message: Odometry) -> None:
        cls.truth = message.pose.pose

    @classmethod
    def on_estimate(cls, message: PoseWithCovarianceStamped) -> None:
        cls.estimate = message

    @classmethod
    def on_transforms(cls, message: TFMessage) -> None:
        for one in message.transforms:
            if one.header.frame_id == "map":
                assert one.child_frame_id == "odom"
                cls.frame = one.transform.translation

    @classmethod
    def is_active(cls, fault: str) -> bool:
        return bool(cls.faults.get(fault, {}).get("active"))

    def believes(self, place: Any) -> bool:
        return self.estimate is not None and near(self.estimate.pose.pose, place)

    def test_a_robot_that_was_carried_is_lost_until_somebody_says_where_it_is(self) -> None:
        wait_for(lambda: self.is_active("wrong_pose"))
        self.assertEqual(self.faults["wrong_pose"]["begun"], [1.0])
        wait_for(lambda: near(self.truth, CARRIED))
        wait_for(lambda: self.estimate is not None and self.estimate.pose.covariance[0] > 0.5)
        self.assertTrue(self.believes(START))
        wait_for(lambda: self.frame is not None and abs(self.frame.x - START[0]) < 0.1)
        wait_for(lambda: self.initial.get_num_connections() > 0)
        # Messages that are no poses, and a wrong one, do not help.
        self.initial.publish(initial_pose(math.nan, 0.0))
        self.initial.publish(PoseWithCovarianceStamped())
        self.initial.publish(initial_pose(16.0, -8.0))
        wait_for(lambda: self.believes((16.0, -8.0)))
        self.assertTrue(self.is_active("wrong_pose"))
        self.assertTrue(near(self.truth, CARRIED))
        self.initial.publish(initial_pose(CARRIED[0] + 0.5, CARRIED[1] - 0.3))
        wait_for(lambda: "wrong_pose" in self.faults and not self.is_active("wrong_pose"))
        wait_for(lambda: self.believes(CARRIED))
        assert self.estimate is not None
        self.assertLess(self.estimate.pose.covariance[0], 0.01)
        wait_for(lambda: self.frame is not None and abs(self.frame.x - CARRIED[0]) < 0.1)
        # It drives again.
        client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        wait_for(lambda: client.wait_for_server(rospy.Duration(1)))
        goal = MoveBaseGoal(PoseStamped())
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.pose = initial_pose(24.0, -17.0).pose.pose
        client.send_goal(goal)
        wait_for(lambda: client.get_state() == GoalStatus.SUCCEEDED)
        self.assertTrue(near(self.truth, (24.0, -17.0), 0.3))

    def test_the_battery_runs_down(self) -> None:
        wait_for(lambda: len(self.batteries) > 5)
        first, last = self.batteries[0], self.batteries[-1]
        self.assertLess(last.percentage, first.percentage)
        self.assertLess(0.5, last.percentage)
        self.assertAlmostEqual(last.charge, last.percentage * last.capacity, places=5)
        self.assertTrue(last.present)
        self.assertEqual(last.power_supply_status, BatteryState.POWER_SUPPLY_STATUS_DISCHARGING)
        self.assertTrue(math.isnan(last.voltage))
        self.assertGreater(last.header.stamp, first.header.stamp)
        self.assertNotIn("battery", self.faults)  # it is not empty

    def test_the_laser_misses_beams(self) -> None:
        wait_for(lambda: self.is_active("laser_noise") and len(self.scans) > 3)
        missed = sum(math.isinf(distance) for distance in self.scans[-1].ranges)
        self.assertTrue(30 < missed < 300, missed)

    def test_others_came_and_went(self) -> None:
        wait_for(lambda: self.is_active("door_closes") and "slip" in self.faults)
        wait_for(lambda: not self.is_active("slip"))
        self.assertEqual(self.faults["slip"]["begun"], [0.5])
        self.assertEqual(self.faults["slip"]["ended"], [1.5])
        door = rospy.ServiceProxy("simulator/obstacle", Obstacle)
        self.assertIn("already", door("block c5 o9").message)


if __name__ == "__main__":
    rospy.init_node("test_faults")
    rostest.rosrun("rosoclingo_simulator", "test_faults", TestFaults, sys.argv)
