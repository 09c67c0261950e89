"""Two simulated robots without navigation and localisation: what they have, and what they lack."""

from __future__ import annotations

import sys
import unittest
from typing import Dict, List, Set

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from tf2_msgs.msg import TFMessage
from waiting import wait_for

from rosoclingo_simulator.srv import Obstacle

SPEED = 0.4  # m/s
ROBOTS = ("robot1", "robot2")
START = {"robot1": 7.0, "robot2": 23.0}

TOPICS = {"cmd_vel", "ground_truth", "odom", "scan", "simulator/touches"}
SERVICES = {"simulator/obstacle"}


class Robot:
    """Keeps what a robot says, and has it drive straight on while it is wanted."""

    def __init__(self, name: str) -> None:
        self.odometry: List[Odometry] = []
        self.truth: List[Odometry] = []
        self.scans: List[LaserScan] = []
        self.touches: List[bool] = []
        self._commands = rospy.Publisher(f"/{name}/cmd_vel", Twist, queue_size=1)
        self._topics = [
            rospy.Subscriber(f"/{name}/odom", Odometry, self.odometry.append),
            rospy.Subscriber(f"/{name}/ground_truth", Odometry, self.truth.append),
            rospy.Subscriber(f"/{name}/scan", LaserScan, self.scans.append),
            rospy.Subscriber(
                f"/{name}/simulator/touches", Bool, lambda said: self.touches.append(said.data)
            ),
        ]

    def push(self) -> None:
        """Tells the robot to drive for the next half second."""
        twist = Twist()
        twist.linear.x = SPEED
        self._commands.publish(twist)

    @property
    def is_heard(self) -> bool:
        """Whether there is a message of each of its topics."""
        return bool(self.odometry and self.truth and self.scans and self.touches)

    @property
    def way(self) -> float:
        """How far the wheels have brought it, in metres."""
        return self.odometry[-1].pose.pose.position.x if self.odometry else 0.0


class TestRobots(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.transforms: Dict[str, str] = {}  # parents by children
        cls.clock: List[float] = []
        cls.callers: Set[str] = set()
        cls.robots = {name: Robot(name) for name in ROBOTS}
        cls.subscribers = [
            rospy.Subscriber("/tf", TFMessage, cls.on_transforms),
            rospy.Subscriber("/tf_static", TFMessage, cls.on_transforms),
            rospy.Subscriber("/clock", Clock, cls.on_clock),
        ]
        wait_for(lambda: cls.callers and all(robot.is_heard for robot in cls.robots.values()))

    @classmethod
    def on_transforms(cls, message: TFMessage) -> None:
        for one in message.transforms:
            cls.transforms[one.child_frame_id] = one.header.frame_id

    @classmethod
    def on_clock(cls, message: Clock) -> None:
        cls.clock.append(message.clock.to_sec())
        cls.callers.add(message._connection_header["callerid"])

    def test_names(self) -> None:
        publications, subscriptions, services = (
            {name: set(nodes) for name, nodes in table}
            for table in rospy.get_master().getSystemState()[2]
        )
        for robot in ROBOTS:
            node, start = f"/{robot}/simulator", f"/{robot}/"

            def own(table: Dict[str, Set[str]], node: str = node, start: str = start) -> Set[str]:
                names = {name for name, nodes in table.items() if node in nodes}
                return {name[len(start) :] for name in names if name.startswith(start)}

            self.assertEqual(own(publications) | own(subscriptions), TOPICS)
            loggers = {f"simulator/{word}" for word in ("get_loggers", "set_logger_level")}
            self.assertEqual(own(services), SERVICES | loggers)
        self.assertEqual(publications["/clock"], {"/robot1/simulator"})

    def test_frames(self) -> None:
        frames = {f"{robot}/base_scan" for robot in ROBOTS}
        wait_for(lambda: frames <= set(self.transforms))
        self.assertEqual(
            self.transforms,
            {
                f"{robot}/{child}": f"{robot}/{parent}"
                for robot in ROBOTS
                for parent, child in (
                    ("odom", "base_footprint"),
                    ("base_footprint", "base_link"),
                    ("base_link", "base_scan"),
                )
            },
        )
        for name, robot in self.robots.items():
            self.assertEqual(robot.scans[-1].header.frame_id, f"{name}/base_scan")
            message = robot.odometry[-1]
            frame = (message.header.frame_id, message.child_frame_id)
            self.assertEqual(frame, (f"{name}/odom", f"{name}/base_footprint"))
            self.assertEqual(robot.truth[-1].header.frame_id, "map")

    def test_both_drive_by_one_clock(self) -> None:
        begin = {name: robot.way for name, robot in self.robots.items()}

        def both_have_driven() -> bool:
            for robot in self.robots.values():
                robot.push()
            return all(robot.way > begin[name] + 1.0 for name, robot in self.robots.items())

        first = {name: len(robot.odometry) for name, robot in self.robots.items()}
        wait_for(both_have_driven)
        self.assertEqual(self.callers, {"/robot1/simulator"})
        self.assertEqual(self.clock, sorted(self.clock))
        for name, robot in self.robots.items():
            stamps = [one.header.stamp.to_sec() for one in robot.odometry[first[name] :]]
            for before, after in zip(stamps, stamps[1:]):
                self.assertAlmostEqual(after - before, 0.05)  # no step is left out
            self.assertAlmostEqual(
                robot.truth[-1].pose.pose.position.x, START[name] + robot.way, delta=0.1
            )
            self.assertEqual(robot.touches, [False])
        # The second is no further than the clock.
        last = self.robots["robot2"].odometry[-1].header.stamp.to_sec()
        wait_for(lambda: self.clock[-1] >= last)

    def test_each_has_its_obstacles(self) -> None:
        answers = [
            rospy.ServiceProxy(f"/{robot}/simulator/obstacle", Obstacle)("block c1 o1")
            for robot in ROBOTS
        ]
        self.assertEqual([answer.success for answer in answers], [True, True])


if __name__ == "__main__":
    rospy.init_node("test_robots")
    rostest.rosrun("rosoclingo_simulator", "test_robots", TestRobots, sys.argv)
