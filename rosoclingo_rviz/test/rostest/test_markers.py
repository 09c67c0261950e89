"""The markers of a running node: the test plays rosoclingo and an announcement."""

from __future__ import annotations

import subprocess
import sys
import unittest
from typing import Any, Callable, List, Optional

import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus
from visualization_msgs.msg import Marker, MarkerArray
from waiting import TIMEOUT, wait_for

from rosoclingo.msg import (
    ROSoClingoActionGoal,
    ROSoClingoActionResult,
    ROSoClingoDispatch,
    ROSoClingoGoal,
    ROSoClingoHeartbeat,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoPlan,
    ROSoClingoToken,
)


class Rviz:
    """What rviz makes of the markers."""

    def __init__(self) -> None:
        self._shown: List[Marker] = []
        self._subscriber = rospy.Subscriber(
            "/a/graph_markers/markers", MarkerArray, self._on_markers
        )

    def _on_markers(self, message: MarkerArray) -> None:
        first, *rest = message.markers
        assert first.action == Marker.DELETEALL
        self._shown = rest

    def group(self, name: str) -> List[Marker]:
        return [marker for marker in self._shown if marker.ns == name]

    def wait(self, condition: Callable[[], Any]) -> None:
        wait_for(condition, lambda: self._shown)


class TestMarkers(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.rviz = Rviz()
        cls.topics = {
            name: rospy.Publisher(f"/a/rosoclingo/{name}", kind, latch=latch, queue_size=10)
            for name, kind, latch in (
                ("in", ROSoClingoIn, False),
                ("out", ROSoClingoOut, True),
                ("dispatch", ROSoClingoDispatch, True),
                ("heartbeat", ROSoClingoHeartbeat, False),
                ("plan", ROSoClingoPlan, True),
                ("goal", ROSoClingoActionGoal, False),
                ("result", ROSoClingoActionResult, False),
            )
        }
        wait_for(lambda: all(topic.get_num_connections() for topic in cls.topics.values()))

    def test_a_delivery_with_a_blocked_way(self) -> None:
        rviz, topics = self.rviz, self.topics
        rviz.wait(lambda: rviz.group("names"))
        self.assertEqual(len(rviz.group("names")), 23)
        self.assertGreater(len(rviz.group("walls")), 40)
        self.assertEqual(len(rviz.group("ways")[0].points), 2 * 23)
        self.assertEqual(rviz.group("blocked ways"), [])
        (robot,) = rviz.group("robots")
        self.assertEqual(robot.header.frame_id, "mailbot/base_link")
        self.assertTrue(robot.frame_locked)

        topics["in"].publish("info", "blocked(c3,c4)")
        rviz.wait(lambda: rviz.group("blocked ways"))
        (blocked,) = rviz.group("blocked ways")
        self.assertEqual(
            sorted((point.x, point.y) for point in blocked.points), [(32, -17), (32, -8)]
        )
        self.assertGreater(blocked.color.r, 0.8)
        self.assertLess(blocked.color.g, 0.2)
        self.assertEqual(len(rviz.group("ways")[0].points), 2 * 22)

        topics["in"].publish("info", "blocked(")  # ignored
        goal = GoalID(id="goal")
        topics["goal"].publish(
            ROSoClingoActionGoal(goal_id=goal, goal=ROSoClingoGoal(request="bring(open1,c1)"))
        )
        rviz.wait(lambda: self.package() is not None)
        self.assertEqual(self.package().header.frame_id, "map")
        topics["plan"].publish(1, 3, ["do(mailbot,pickup(1),1)", "do(mailbot,go(c1),2)"])
        rviz.wait(lambda: rviz.group("plan"))
        (arrow,) = rviz.group("plan")
        self.assertEqual([(point.x, point.y) for point in arrow.points], [(7, -8), (16, -8)])
        steps = {marker.text for marker in rviz.group("plan's steps")}
        self.assertEqual(steps, {"2", "1 pickup(1)"})

        token = ROSoClingoToken(number=7, id="mailbot", action="pickup(1)")
        topics["dispatch"].publish("run", [token])
        rviz.wait(lambda: topics["heartbeat"].publish("run", 7, 0.4) or rviz.group("progress"))
        (progress,) = rviz.group("progress")
        self.assertEqual((progress.text, progress.header.frame_id), ("40%", "mailbot/base_link"))
        token.state = ROSoClingoToken.ANSWERED
        topics["dispatch"].publish("run", [token])
        rviz.wait(lambda: not rviz.group("progress"))

        self.act("pickup(1)")
        rviz.wait(lambda: self.package().header.frame_id == "mailbot/base_link")
        self.act("go(c1)")
        rviz.wait(lambda: not rviz.group("plan"))
        topics["result"].publish(
            ROSoClingoActionResult(status=GoalStatus(goal_id=goal, status=GoalStatus.SUCCEEDED))
        )
        rviz.wait(lambda: self.package().header.frame_id == "map")
        self.assertAlmostEqual(self.package().pose.position.x, 16, delta=1)
        self.assertGreater(self.package().color.g, self.package().color.r)

        topics["in"].publish("info", "unblocked(c4,c3)")
        rviz.wait(lambda: not rviz.group("blocked ways"))

    def act(self, action: str) -> None:
        self.topics["out"].publish("mailbot", action)
        self.topics["in"].publish("mailbot", "success")

    def package(self) -> Optional[Marker]:
        packages = self.rviz.group("packages") + self.rviz.group("carried packages")
        boxes = [box for box in packages if box.type == Marker.CUBE]
        return boxes[0] if boxes else None

    def test_wrong_parameters_end_the_node(self) -> None:
        instances, script = (rospy.get_param(f"/markers/{name}") for name in ("instances", "node"))
        good = f"_instance:={instances}/graph_wg.lp"
        for number, (arguments, message) in enumerate(
            (
                ([], "/instance: name the instance's files"),
                (["_instance:=/none.lp"], "there is no file /none.lp; check the path"),
                ([f"_instance:={instances}/graph_bench.lp"], "no coordinates of 1, 2"),
                ([good, "_world:=/none.yaml"], "cannot read /none.yaml"),
                (
                    [good, f"_world:={instances}/graph_wg.lp"],
                    "is no visualization_msgs/MarkerArray",
                ),
                ([good, "_frame:=3"], "frame: expected a text: 3"),
            )
        ):
            ended = subprocess.run(
                [sys.executable, script, f"__name:=wrong{number}", *arguments],
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
                check=False,
            )
            self.assertEqual(ended.returncode, 2, ended)
            self.assertIn(message, ended.stdout + ended.stderr)
            self.assertNotIn("Traceback", ended.stderr)


if __name__ == "__main__":
    rospy.init_node("test_markers")
    rostest.rosrun("rosoclingo_rviz", "markers", TestMarkers)
