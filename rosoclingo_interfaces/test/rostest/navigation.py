"""A move_base whose drives end as a test says, in the test's process or one of its own."""

from __future__ import annotations

import queue

import rospy
from actionlib import ServerGoalHandle
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from rosclingo.ros.action_server import LowLatencyActionServer


class Navigation:
    def __init__(self, name: str) -> None:
        self.goals: queue.Queue[ServerGoalHandle] = queue.Queue()
        self.canceled: queue.Queue[str] = queue.Queue()
        self.cleared: queue.Queue[EmptyRequest] = queue.Queue()
        self._service = rospy.Service(f"{name}/clear_costmaps", Empty, self._on_clear)
        # actionlib's own goes no further when the clock begins anew.
        self._server = LowLatencyActionServer(
            name, MoveBaseAction, self._on_goal, self._on_cancel, MoveBaseResult()
        )
        self._server.start()

    def _on_goal(self, goal: ServerGoalHandle) -> None:
        goal.set_accepted()
        self.goals.put(goal)

    def _on_cancel(self, goal: ServerGoalHandle) -> None:
        goal.set_canceled()
        self.canceled.put(goal.get_goal_id().id)

    def _on_clear(self, request: EmptyRequest) -> EmptyResponse:
        self.cleared.put(request)
        return EmptyResponse()


def is_at(goal: ServerGoalHandle, x: float, y: float) -> None:
    """Tells the drive's client where the robot is."""
    feedback = MoveBaseFeedback()
    feedback.base_position.pose.position.x = x
    feedback.base_position.pose.position.y = y
    goal.publish_feedback(feedback)


if __name__ == "__main__":
    rospy.init_node("navigation")
    navigation = Navigation("move_base")
    rospy.spin()
