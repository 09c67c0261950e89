"""Sends a goal, listens to results when it has ended, sends another, and prints the results."""

from __future__ import annotations

import queue

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from rosclingo.msg import ROSClingoActionGoal, ROSClingoActionResult
from solver_test_case import TIMEOUT, wait_for

if __name__ == "__main__":
    rospy.init_node("late_client", disable_rosout=True)
    ended = set()

    def note(message: GoalStatusArray) -> None:
        ended.update(
            status.goal_id.id
            for status in message.status_list
            if status.status == GoalStatus.SUCCEEDED
        )

    rospy.Subscriber("solver/status", GoalStatusArray, note)
    goals = rospy.Publisher("solver/goal", ROSClingoActionGoal, queue_size=2)
    wait_for(goals.get_num_connections)
    goals.publish(ROSClingoActionGoal(goal_id=GoalID(id="before")))
    wait_for(lambda: "before" in ended)
    results: queue.Queue[ROSClingoActionResult] = queue.Queue()
    rospy.Subscriber("solver/result", ROSClingoActionResult, results.put)
    for _ in range(2):
        print(results.get(timeout=TIMEOUT).status.goal_id.id, flush=True)
        goals.publish(ROSClingoActionGoal(goal_id=GoalID(id="after")))
