"""Letters that are due: which one is brought first, and how late it is said to be and is.

All seconds are those of the simulator, so that it does not matter how quick the machine is.
"""

from __future__ import annotations

import re
import sys
import unittest
from typing import List, Sequence

import rospy
import rostest
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from waiting import wait_for

from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.low_latency import subscriber
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoFeedback,
    ROSoClingoGoal,
    ROSoClingoPlan,
)

SLACK = 0.1  # of what is driven, by which what was said may be wrong
WHOLE = 1.0  # seconds; what is said are whole ones, and so are the times of the plan


class Letter:
    """A request, and what becomes of it.

    Attributes:
        sent: When it was sent, in seconds of simulated time.
        late: How late it was said to be, in seconds, each time.
        expected: When it was said to be there, each time; in seconds of simulated time.
        ended: When it was there, likewise; 0 before that.
    """

    def __init__(self, client: LowLatencyActionClient, request: str) -> None:
        self.sent = rospy.get_time()
        self.late: List[int] = []
        self.expected: List[float] = []
        self.ended = 0.0
        self.goal = client.send_goal(
            ROSoClingoGoal(request, []), self._on_transition, self._on_feedback
        )

    def _on_transition(self, goal: ClientGoalHandle) -> None:
        if goal.get_comm_state() == CommState.DONE:
            self.ended = rospy.get_time()

    def _on_feedback(self, _: ClientGoalHandle, feedback: ROSoClingoFeedback) -> None:
        late = re.fullmatch(r"late by (\d+) s", feedback.status)
        expected = re.fullmatch(r"expected in (\d+) s", feedback.status)
        if late:
            self.late.append(int(late[1]))
        if expected:
            self.expected.append(rospy.get_time() + int(expected[1]))


class TestDeadlines(unittest.TestCase):
    def setUp(self) -> None:
        self.client = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
        self.plans: List[Sequence[str]] = []
        self.topic = subscriber(
            "rosoclingo/plan", ROSoClingoPlan, lambda plan: self.plans.append(plan.actions)
        )
        wait_for(lambda: self.client.pub_goal.get_num_connections() > 0)
        wait_for(lambda: self.client.result_sub.get_num_connections() > 0)
        wait_for(lambda: self.client.feedback_sub.get_num_connections() > 0)
        wait_for(lambda: self.plans and rospy.get_time() > 0)

    def brought(self, letters: Sequence[Letter]) -> None:
        """Waits until all letters are there."""
        wait_for(lambda: all(letter.ended for letter in letters))
        for letter in letters:
            self.assertEqual(letter.goal.get_terminal_state(), GoalStatus.SUCCEEDED)

    def check(self, what: str, said: float, driven: float) -> None:
        print(f"{what}: said {said:.0f} s, driven {driven:.0f} s")
        self.assertLessEqual(abs(said - driven), SLACK * driven + WHOLE, what)

    def test_letters_that_are_due(self) -> None:
        first = Letter(self.client, "bring(o3,o1)")
        due = Letter(self.client, "bring(o2,o13,by(85))")  # it would be late as the second one
        self.brought([first, due])
        self.assertLess(due.ended, first.ended)
        self.assertEqual(due.late[-1], 0)
        self.check("the letter that is due", due.expected[0] - due.sent, due.ended - due.sent)

        limits = 20, 30
        both = [
            Letter(self.client, f"bring(o13,o2,by({limits[0]}))"),
            Letter(self.client, f"bring(o14,o4,by({limits[1]}))"),
        ]
        wait_for(lambda: both[1].late)  # there is a plan for both
        said = [(one.late[-1], one.expected[-1]) for one in both]
        wait_for(lambda: sum(term.startswith("expected(") for term in self.plans[-1]) == 2)
        terms = [term for term in self.plans[-1] if term.startswith("expected(")]
        shown = sorted(float(re.split("[,)]", term)[1]) for term in terms)
        self.brought(both)
        for one, limit, (late, expected) in zip(both, limits, said):
            self.assertGreater(late, 0)
            self.check(f"late, due in {limit} s", late, one.ended - one.sent - limit)
            self.check("expected", expected - one.sent, one.ended - one.sent)
        for one, time in zip(sorted(both, key=lambda one: one.ended), shown):
            self.check("shown on ~plan", time - one.sent, one.ended - one.sent)


if __name__ == "__main__":
    rospy.init_node("test_deadlines")
    rostest.rosrun("rosoclingo_gazebo", rospy.get_name().strip("/"), TestDeadlines, sys.argv)
