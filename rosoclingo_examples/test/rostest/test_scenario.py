"""The paper's three scenarios at the level of messages: the routes are those of the paper."""

from __future__ import annotations

import queue
import sys
import unittest
from typing import List

import rospy
import rostest
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from waiting import TIMEOUT, wait_for

from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.low_latency import publisher, subscriber
from rosoclingo.msg import ROSoClingoAction, ROSoClingoGoal, ROSoClingoIn, ROSoClingoOut

ROUTES = {
    1: "c6 c5 o9 pickup(1) c5 c6 open1 c1 c2 c3 o14 deliver(1)",
    2: "c6 c5 o9 pickup(1) c5 c6 c5 c4 c3 o14 deliver(1)",
    3: "c6 c5 c4 c6 open1 c1 c2 o2 pickup(2) c2 c1 o3 deliver(2) c1 c2 c3 c4 o7 pickup(1) "
    "c4 o11 deliver(1)",
}


class TestScenario(unittest.TestCase):
    def setUp(self) -> None:
        self.actions: queue.Queue[str] = queue.Queue()
        self.goals: List[ClientGoalHandle] = []
        self.client = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
        self.answers = publisher("rosoclingo/in", ROSoClingoIn)
        self.listener = subscriber(
            "rosoclingo/out", ROSoClingoOut, lambda message: self.actions.put(message.action)
        )
        self.assertTrue(self.client.wait_for_server(rospy.Duration.from_sec(TIMEOUT)))
        wait_for(lambda: self.answers.get_num_connections() > 0)

    def request(self, text: str) -> None:
        goal = self.client.send_goal(ROSoClingoGoal(text, []))
        self.goals.append(goal)
        # What is said next is heard later.
        wait_for(lambda: goal.get_comm_state() != CommState.WAITING_FOR_GOAL_ACK)

    def test_the_route(self) -> None:
        scenario = rospy.get_param("~scenario")
        if scenario in (1, 2):
            self.answers.publish("info", "blocked(c3,c4)")
        self.request("bring(o7,o11)" if scenario == 3 else "bring(o9,o14)")
        route = [word if "(" in word else f"go({word})" for word in ROUTES[scenario].split()]
        done: List[str] = []
        for number, expected in enumerate(route, 1):
            done.append(self.actions.get(timeout=TIMEOUT))
            self.assertEqual(done[-1], expected, done)
            if scenario == 3 and number == 1:
                self.request("bring(o2,o3)")
            if scenario == 2 and number == 6:
                self.answers.publish("info", "unblocked(c3,c4)")
            fails = scenario == 3 and number == 3
            self.answers.publish("mailbot", "failure" if fails else "success")
        for goal in self.goals:
            wait_for(lambda goal=goal: goal.get_comm_state() == CommState.DONE)  # type: ignore[misc]
            self.assertEqual(goal.get_terminal_state(), GoalStatus.SUCCEEDED)
        self.assertTrue(self.actions.empty())


if __name__ == "__main__":
    rospy.init_node("test_scenario")
    name = f"scenario_{rospy.get_param('~scenario')}_{rospy.get_param('~kind')}"
    rostest.rosrun("rosoclingo_examples", name, TestScenario, sys.argv)
