"""An existing stack for the adapter: an action server, a service and topics."""

from __future__ import annotations

import math
import threading
from typing import List, Tuple

import rospy
from actionlib import SimpleActionServer
from actionlib.msg import TestRequestAction, TestRequestGoal, TestRequestResult
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse
from waiting import wait_for


class Stack:
    """A base that drives, a gripper, and a door, in a namespace.

    Attributes:
        goals: Where the base was sent: x, y and the heading.
        outcomes: How the next drives end, such as ``abort``; empty for success.
        under_way: Set while a drive ``waits``.
        preempted: How many drives were cancelled.
        commands: What the door was told.
        states: What the door says next.
        grips: What the gripper was told.
        responses: What it responds next.
        served: What was published when a dish was served.
        reached: Where the arm was sent; it aborts there with the result that the goal names.
    """

    def __init__(self, name: str = "") -> None:
        self.goals: List[Tuple[float, float, float]] = []
        self.outcomes: List[str] = []
        self.under_way = threading.Event()
        self.preempted = 0
        self.commands: List[str] = []
        self.states: List[int] = []
        self.grips: List[bool] = []
        self.responses: List[SetBoolResponse] = []
        self.served: List[str] = []
        self.reached: List[TestRequestGoal] = []
        self._server = SimpleActionServer(f"{name}base", MoveBaseAction, self._drive, False)
        self._server.start()
        self._arm = SimpleActionServer(f"{name}arm", TestRequestAction, self._reach, False)
        self._arm.start()
        self._door = rospy.Publisher(f"{name}door_d1/state", Int32, queue_size=10)
        self._kept = [
            rospy.Service(f"{name}gripper", SetBool, self._grip),
            rospy.Subscriber(f"{name}door_d1/command", String, self._on_command),
            rospy.Subscriber(f"{name}served", String, lambda said: self.served.append(said.data)),
        ]

    def _drive(self, goal: MoveBaseGoal) -> None:
        pose = goal.target_pose.pose
        assert goal.target_pose.header.frame_id == "map"
        assert goal.target_pose.header.stamp.to_sec() > 0
        heading = 2 * math.atan2(pose.orientation.z, pose.orientation.w)
        self.goals.append((pose.position.x, pose.position.y, round(heading, 3)))
        outcome = self.outcomes.pop(0) if self.outcomes else ""
        feedback = MoveBaseFeedback()
        feedback.base_position.pose.position.x = 0.5
        self._server.publish_feedback(feedback)
        if outcome == "wait":
            self.under_way.set()
            wait_for(self._server.is_preempt_requested)
            self.preempted += 1
            self._server.set_preempted(MoveBaseResult(), "stopped")
        elif outcome == "abort":
            self._server.set_aborted(MoveBaseResult(), "there is a chair in the way")
        else:
            self._server.set_succeeded()

    def _reach(self, goal: TestRequestGoal) -> None:
        self.reached.append(goal)
        self._arm.set_aborted(TestRequestResult(goal.the_result, False), "it cannot get there")

    def _grip(self, request: SetBoolRequest) -> SetBoolResponse:
        self.grips.append(request.data)
        return self.responses.pop(0) if self.responses else SetBoolResponse(True, "")

    def _on_command(self, message: String) -> None:
        self.commands.append(message.data)
        for state in self.states or [1, 2]:
            self._door.publish(state)
