"""adapter.py through ROS: a robot of action servers, services and topics, by a file."""

from __future__ import annotations

import json
import sys
import unittest
from typing import List

import rospy
import rostest
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float32, String
from std_srvs.srv import SetBoolResponse, Trigger
from waiting import wait_for

from planner import TokenPlanner
from rosclingo.ros.action_client import LowLatencyActionClient
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoDispatch,
    ROSoClingoGoal,
    ROSoClingoHeartbeat,
    ROSoClingoIn,
)
from stack import Stack


class TestAdapter(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.stack, cls.other = Stack(), Stack("b/")
        cls.log: List[str] = []
        cls.actions: List[str] = []
        cls.told: List[str] = []
        cls.progress: List[float] = []
        cls.listeners = [
            rospy.Subscriber("/rosout", Log, lambda said: cls.log.append(said.msg)),
            rospy.Subscriber("/rosoclingo/dispatch", ROSoClingoDispatch, cls.on_dispatch),
            rospy.Subscriber("/rosoclingo/in", ROSoClingoIn, lambda said: cls.told.append(
                f"{said.id}: {said.value}")),
            rospy.Subscriber("/b/rosoclingo/heartbeat", ROSoClingoHeartbeat,
                             lambda said: cls.progress.append(said.progress)),
        ]  # fmt: skip
        cls.client = LowLatencyActionClient("/rosoclingo", ROSoClingoAction)
        cls.client.wait_for_server()

    @classmethod
    def on_dispatch(cls, message: ROSoClingoDispatch) -> None:
        for one in message.actions:
            if one.number > len(cls.actions):
                cls.actions.append(one.action)

    def serve(self, table: str) -> str:
        """Asks for a dish, waits until it is served, and returns the goal's id."""
        handle = self.begin(table)
        self.end(handle)
        return str(handle.comm_state_machine.action_goal.goal_id.id)

    def begin(self, table: str) -> object:
        return self.client.send_goal(ROSoClingoGoal(f"dish({table})", ["no salt"]))

    def end(self, handle: object) -> None:
        wait_for(lambda: handle.get_comm_state() == 7, lambda: self.log[-20:])  # type: ignore[attr-defined]
        self.assertEqual(handle.get_terminal_state(), 3)  # type: ignore[attr-defined]  # SUCCEEDED

    def test_1_a_dish(self) -> None:
        """All kinds of entries do their part, with the request's table."""
        goal_id = self.serve("t2")
        self.assertEqual(self.actions, ["open(d1)", "pick(1)", "go(t2)", "put(1)"])
        self.assertEqual(self.stack.commands, ["open d1"])
        self.assertEqual(self.stack.grips, [True])
        self.assertEqual(self.stack.goals, [(4.0, 1.0, 1.5)])
        wait_for(lambda: self.stack.served)
        self.assertEqual(self.stack.served, [f"dish(t2) by waiter at 4 for {goal_id}: no salt"])

    def test_2_failures(self) -> None:
        """A drive that fails, and a grip that does, are tried again."""
        del self.actions[4:]
        self.stack.outcomes = ["abort"]
        self.stack.responses = [SetBoolResponse(False, "slipped")]
        self.serve("t1")
        wait_for(lambda: any("base ended as ABORTED: there is a chair" in one for one in self.log))
        wait_for(lambda: any("gripper said: slipped" in one for one in self.log))
        self.assertEqual(self.told.count("waiter: failure"), 2)
        self.assertEqual(self.stack.goals[-1], (2.5, -1.0, 3.142))

    def test_3_cancel(self) -> None:
        """An operator halts the run: the drive is cancelled; then it goes on."""
        self.stack.outcomes = ["wait"]
        handle = self.begin("t2")
        self.assertTrue(self.stack.under_way.wait(180))
        rospy.ServiceProxy("/rosoclingo/halt", Trigger)()
        wait_for(lambda: self.stack.preempted)
        rospy.ServiceProxy("/rosoclingo/resume", Trigger)()
        self.end(handle)

    def test_4_announcements(self) -> None:
        publisher = rospy.Publisher("/battery", Float32, queue_size=None)
        wait_for(publisher.get_num_connections)
        for part in (0.52, 0.53, 0.18):
            publisher.publish(part)
        wait_for(lambda: "info: battery(20)" in self.told)
        told = [one for one in self.told if one.startswith("info: battery")]
        self.assertIn(told, (["info: battery(50)", "info: battery(20)"], ["info: battery(20)"]))
        said = json.loads(rospy.wait_for_message("/adapter/about", String).data)
        self.assertEqual((said["actuators"], said["messages"]), (["waiter"], ["info"]))

    def test_5_answers(self) -> None:
        """Words by rules; what does not fit; a cancel of each kind."""
        planner, stack = TokenPlanner("/b/rosoclingo"), self.other
        number = 0

        def answer(action: str, request: str = "") -> str:
            nonlocal number
            number += 1
            served = [(number, "1", request, "a")] if request else []
            planner.serve(number, *served)
            planner.send((number, "waiter", action, 0))
            while True:
                _, answered, value = planner.tokened.get(timeout=180)
                if answered == number:
                    return value

        stack.responses = [SetBoolResponse(True, "out of plates")]
        self.assertEqual(answer("pick(1)", "dish(t1)"), "gone")
        stack.states = [1, 9, 2]
        self.assertEqual(answer("open(d1)"), "jammed")
        for joint, value in ((0, "failure"), (5, "stuck"), (10, "too(far)")):
            self.assertEqual(answer(f"reach(shelf,{joint})"), value)
        goal = stack.reached[-1]
        said = (goal.result_text, goal.the_result, goal.delay_terminate.to_sec())
        self.assertEqual(said, ("reach shelf", 10, 0.5))
        for action, request, reason in (
            ("go(t7)", "", "there is no place t7 in"),
            ("pick(1)", "", "it names no slot of a goal"),
            ("pick(1)", "drink(t1)", "fits the goal for which it is done: drink(t1) in slot 1"),
            ("put(1)", "dish(t9)", "there is no place t9 in"),
            ("open((1,2))", "", "'door_(1,2)/command' is no name of ROS"),
            ("wave", "", "it has taken more than 0.3 s (within, line 38 of adapter.yaml)"),
            ("ring(2)", "", "line 42: fields.data: expected true or false (bool), not '2'"),
            (
                "fly(t1)",
                "",
                "there are go(W), pick(ID), open(D), put(ID), wave, ring(X), reach",
            ),
        ):
            with self.subTest(action=action):
                self.assertEqual(answer(action, request), "failure")
                wait_for(lambda why=reason: any(why in one for one in self.log), lambda: self.log)
        stack.states, stack.outcomes = [1], ["wait"]
        for action, begun in (
            ("go(t1)", stack.under_way.is_set),
            ("open(d1)", lambda: len(stack.commands) == 2),
        ):
            number += 1
            planner.serve(number)
            planner.send((number, "waiter", action, 0))
            wait_for(begun, lambda: self.log[-20:])
            if action == "go(t1)":
                wait_for(lambda: 0.5 in self.progress)
            planner.send((number, "waiter", action, 1))
            planner.wait_for_answer(number, "failure")
        wait_for(lambda: stack.commands[-1] == "stop" and stack.preempted == 1)


if __name__ == "__main__":
    rospy.init_node("test_adapter")
    rostest.rosrun("rosoclingo_interfaces", "adapters", TestAdapter, sys.argv)
