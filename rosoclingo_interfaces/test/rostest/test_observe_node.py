"""observe.py through ROS: each kind of observer, and 10,000 messages that make no sense."""

from __future__ import annotations

import contextlib
import json
import math
import os
import random
import sys
import unittest
from pathlib import Path
from typing import IO, Any, Dict, List, Tuple

import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import BatteryState, LaserScan
from std_msgs.msg import Bool, Empty, Int32, String
from tf2_msgs.msg import TFMessage
from waiting import wait_for

from hostile import draw
from rosoclingo.msg import ROSoClingoIn
from rosoclingo_interfaces.errors import ReadingError
from rosoclingo_interfaces.observation.observers import read_observers
from rosoclingo_interfaces.observation.transforms import TransformTree
from rosoclingo_interfaces.ros.message_types import slots

FILE = Path(__file__).with_name("observers.yaml")
TYPES = {
    "/battery": BatteryState, "/text": String, "/number": Int32, "/door": Bool,
    "/pose": PoseWithCovarianceStamped, "/odom": Odometry, "/scan": LaserScan,
    "/grid": OccupancyGrid, "/tf": TFMessage,
}  # fmt: skip
MESSAGES = int(os.environ.get("HOSTILE", "10000"))


class Garbled(String):
    """A text that is no UTF-8, and shorter than it says."""

    def serialize(self, buff: IO[bytes]) -> None:
        buff.write(b"\x09\0\0\0\xff\xfe\xfdstop")


def transform(frame: str, child: str, x: float, y: float) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = frame
    message.transform.translation.x, message.transform.translation.y = x, y
    message.transform.rotation.w = 1.0
    return message


def pose(x: float, y: float, variance: float) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "map"
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[0] = variance
    return message


def odometry(x: float, y: float) -> Odometry:
    message = Odometry()
    message.header.frame_id = "map"
    message.pose = pose(x, y, 0.0).pose
    return message


def scan(reach: float) -> LaserScan:
    """A round wall about the scanner."""
    message = LaserScan(
        angle_min=0.0, angle_increment=math.radians(1), range_min=0.1, range_max=20.0,
        ranges=[reach] * 360,
    )  # fmt: skip
    message.header.frame_id = "scanner"
    return message


def grid(value: int) -> OccupancyGrid:
    message = OccupancyGrid(data=[value] * 40_000)
    message.header.frame_id = "map"
    message.info.width = message.info.height = 200
    message.info.resolution = 0.1
    message.info.origin.position.y = -10.0
    message.info.origin.orientation.w = 1.0
    return message


class TestObserve(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.told: List[Tuple[str, str]] = []
        cls.log: List[str] = []
        cls.listeners = [
            rospy.Subscriber("/rosout", Log, lambda message: cls.log.append(message.msg)),
            rospy.Subscriber(
                "/rosoclingo/in", ROSoClingoIn,
                lambda message: cls.told.append((message.id, message.value)),
            ),
        ]  # fmt: skip
        # Without a queue, publish returns when the message is on its way: nothing is left out.
        cls.publishers: Dict[str, rospy.Publisher] = {
            name: rospy.Publisher(name, kind, queue_size=None) for name, kind in TYPES.items()
        }
        cls.heart = rospy.Publisher("/heartbeat", Empty, queue_size=10)
        for publisher in (*cls.publishers.values(), cls.heart):
            wait_for(lambda one=publisher: one.get_num_connections())
        wait_for(cls.listeners[1].get_num_connections)

    def send(self, topic: str, *messages: Any) -> None:
        for message in messages:
            self.publishers[topic].publish(message)

    def check_told(self, topic: str, message: Any, *terms: str, by: str = "info") -> None:
        """A message has these terms told."""
        del self.told[:]
        self.send(topic, message)
        wait_for(
            lambda: all((by, term) in self.told for term in terms),
            lambda: (terms, self.told, self.log[-20:]),
            timeout=60.0,
        )

    def check_change(
        self, topic: str, before: Any, after: Any, *terms: str, by: str = "info"
    ) -> None:
        """Two messages follow each other, and the second one has these terms told."""
        self.send(topic, before)
        self.check_told(topic, after, *terms, by=by)

    def check_all(self) -> None:
        """Each observer tells what it should."""
        self.send("/tf", TFMessage([transform("map", "scanner", 10, 2)]))
        low, full = (BatteryState(percentage=value) for value in (0.1, 0.9))
        low.cell_voltage, full.cell_voltage = [4.0, 5.5], [4.0, 4.0]
        self.check_change("/battery", full, low, "low", "high_cell")
        self.check_change("/text", String("go on"), String("stop it"), "stop")
        self.check_change("/number", Int32(1), Int32(7), "seven")
        self.check_change("/pose", pose(50, 50, 0.1), pose(10, 0.5, 4), "at(pose,c3)", "lost")
        self.check_change("/odom", odometry(50, 50), odometry(10, -7.5), "at(odom,c(4))")
        self.check_change("/grid", grid(0), grid(100), "closed(grid)")
        self.check_change("/scan", scan(19.0), scan(5.0), "closed(scan)")
        robots = [TFMessage([transform("map", "robot", x, 0)]) for x in (10, 50)]
        # Transforms are looked at some times in a second, so that one has to wait in between.
        self.check_told("/tf", robots[0], "at(tf,c3)")
        self.check_told("/tf", robots[1], "left(tf)")

    def test_1_each_kind(self) -> None:
        self.check_all()

    def test_2_the_end_of_a_condition(self) -> None:
        self.check_change("/door", Bool(False), Bool(True), "closed(door)", by="doors")
        self.check_change("/door", Bool(True), Bool(False), "open(door)", by="doors")

    def test_3_silence(self) -> None:
        wait_for(lambda: self.heart.publish() or ("info", "alive") in self.told)
        del self.told[:]
        wait_for(lambda: ("info", "silent") in self.told)

    def test_4_about(self) -> None:
        said = json.loads(rospy.wait_for_message("/observe/about", String).data)
        self.assertEqual(said["messages"], ["doors", "info"])
        self.assertNotIn("actuators", said)

    def test_5_hostile_messages(self) -> None:
        """None of them ends the node; here, each raises nothing but an error of readings."""
        dice = random.Random(7)
        tree = TransformTree()
        observers = read_observers(FILE, tree)
        for one in observers:
            if one.needs_type:
                one.check(TYPES[f"/{one.topic}"]._type, slots)
        for number in range(MESSAGES):
            name = dice.choice(list(TYPES))
            message = draw(TYPES[name]._type, dice)
            if name == "/grid" and dice.random() < 0.5:
                message.info.width, message.info.height = len(message.data), 1
            if name == "/tf":
                for index, one in enumerate(message.transforms):
                    one.child_frame_id = f"{one.child_frame_id[:50]}_{index}"
                    with contextlib.suppress(ReadingError):
                        tree.add(one)
            for observer in observers:
                if f"/{observer.topic}" == name or (name == "/tf" and not observer.topic):
                    with contextlib.suppress(ReadingError):
                        observer.hear(None if name == "/tf" else message, number / 100)
                    observer.tick(number / 100)
            self.send(name, message)
        self.send("/text", Garbled())
        self.check_all()
        self.assertFalse([line for line in self.log if "cannot be read" in line])
        self.assertTrue(any("what was known before counts" in line for line in self.log))


if __name__ == "__main__":
    rospy.init_node("test_observe")
    rostest.rosrun("rosoclingo_interfaces", "observers", TestObserve, sys.argv)
