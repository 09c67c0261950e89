"""Interfaces through ROS: the test plays rosoclingo."""

from __future__ import annotations

import json
import sys
import unittest

import rospy
import rostest
from std_msgs.msg import String
from waiting import TIMEOUT

from planner import Planner, TokenPlanner
from rosoclingo.loop.execution.tokens import TOKENS_HEADER


class TestInterface(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.robot = Planner("/a/rosoclingo")
        cls.elsewhere = Planner("/elsewhere")
        cls.fulfill = Planner("/c/bot")
        cls.mailbot = Planner("/d/rosoclingo", interfaces=2)

    def test_answers(self) -> None:
        for action, answer in (
            ("go(c1)", "success"),
            ("go(c2)", "failure"),
            ("measure(depth,2)", "value(depth,3)"),
            ("fail", "failure"),
            ("nothing", "failure"),
            ("fly", "failure"),
            ("go(c1,c2)", "failure"),
            ("go(", "failure"),
            ("go(X)", "failure"),
            ("__init__", "failure"),
            ("sleep(1)", "failure"),
            ("abort", "none, because nothing runs"),
            ("go(c3)", "success"),
        ):
            if answer.startswith("none"):
                self.robot.send("robot", action)
            else:
                with self.subTest(action=action):
                    self.assertEqual(self.robot.ask("robot", action), answer)

    def test_actuators(self) -> None:
        self.assertEqual(self.robot.ask("arm(1)", "go(c1)"), "success")
        for other in ("solver", "arm(2)", "other", "", "X"):
            self.robot.send(other, "go(c1)")
        self.assertEqual(self.robot.ask("robot", "go(c1)"), "success")

    def test_about(self) -> None:
        """Each interface says what it does, also to who comes late."""
        for name, actuators in (("/a/robot", ["robot", "arm(1)"]), ("/b/robot", ["other"]),
                                ("/c/fulfill", [])):  # fmt: skip
            said = json.loads(rospy.wait_for_message(f"{name}/about", String, TIMEOUT).data)
            self.assertEqual((said["actuators"], said["messages"]), (actuators, []))

    def test_time_limit(self) -> None:
        before = rospy.get_time()
        self.assertEqual(self.robot.ask("robot", "wait"), "failure")
        self.assertGreater(rospy.get_time() - before, 0.29)
        self.assertEqual(self.robot.ask("robot", "go(c1)"), "success")

    def test_abort_and_replacement(self) -> None:
        planner = self.elsewhere  # without a time limit
        planner.send("other", "wait")
        self.assertEqual(planner.ask("other", "abort"), "failure")
        planner.send("other", "wait")
        self.assertEqual(planner.ask("other", "go(c1)"), "success")
        self.assertEqual(planner.ask("other", "go(c1)"), "success")
        self.assertEqual(planner.answers, [])

    def test_fulfill(self) -> None:
        planner = self.fulfill
        self.assertEqual(planner.ask("robot", "go(c1)"), "failure")
        planner.send("robot", "go(c1)")
        self.assertEqual(planner.ask("robot", "go(c2)"), "success")
        self.assertEqual(planner.ask("robot", "go(c2)"), "failure")
        self.assertEqual(planner.ask("robot", "go(c22)"), "success")
        self.assertEqual(planner.ask("second", "go(c22)"), "failure")
        planner.send("robot", "dream(9)")
        before = rospy.get_time()
        self.assertEqual(planner.ask("robot", "go(c3)"), "success")
        self.assertGreater(rospy.get_time() - before, 0.049)

    def test_tokens(self) -> None:
        """Each action is done once, whichever topics say it, and answered on both."""
        planner = TokenPlanner("/e/rosoclingo")
        planner.send((1, "robot", "measure(depth,2)", 0))
        for _ in range(2):  # as long as nobody says that it was taken
            planner.wait_for_answer(1, "value(depth,3)")
        self.assertEqual(planner.old.next(), ("robot", "value(depth,3)"))
        self.assertIn(TOKENS_HEADER, planner.old.headers[0])
        planner.send((2, "robot", "wait", 0))
        planner.send((2, "robot", "wait", 0), (3, "arm(1)", "go(c1)", 0))
        planner.wait_for_answer(3, "success")
        planner.send((2, "robot", "wait", 1), (3, "arm(1)", "go(c1)", 2))
        planner.wait_for_answer(2, "failure")
        planner.send((2, "robot", "wait", 0), (4, "arm(1)", "go(c2)", 0))
        planner.wait_for_answer(2, "failure")
        planner.wait_for_answer(4, "failure")
        self.assertEqual([planner.old.next() for _ in range(4)],
                         [("arm(1)", "success")] + [("robot", "failure")] * 2
                         + [("arm(1)", "failure")])  # fmt: skip
        self.assertEqual(planner.old.answers, [])

    def test_served_goals(self) -> None:
        """A method knows them, whether they come before the action or after it."""
        planner = TokenPlanner("/f/rosoclingo")
        planner.send((1, "robot", "pick(1)", 0))
        planner.serve(1, (1, "1", "dish(t3)", "client-1"))
        planner.wait_for_answer(1, "dish(t3)")
        planner.serve(2)
        planner.send((2, "robot", "pick(2)", 0))
        planner.wait_for_answer(2, "none")

    def test_two_nodes_share_an_actuator(self) -> None:
        for action in ("go(c1)", "pickup(1)", "go(c2)", "deliver(o1,o2)", "pickup(1)"):
            self.assertEqual(self.mailbot.ask("mailbot", action), "success")
        self.assertEqual(self.mailbot.answers, [])


if __name__ == "__main__":
    rospy.init_node("test_interface")
    rostest.rosrun("rosoclingo_interfaces", "test_interface", TestInterface, sys.argv)
