"""Sends a goal, listens to a topic when it has ended, sends another, and prints whose is heard.

Usage: late_client.py SERVER TOPIC, such as solver result.
"""

from __future__ import annotations

import queue
import sys

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from waiting import TIMEOUT, wait_for

from rosclingo.msg import ROSClingoActionFeedback, ROSClingoActionGoal, ROSClingoActionResult

KINDS = {"feedback": ROSClingoActionFeedback, "result": ROSClingoActionResult}

if __name__ == "__main__":
    server, topic = sys.argv[1:]
    rospy.init_node("late_client", anonymous=True, disable_rosout=True)
    ended = set()

    def note(message: GoalStatusArray) -> None:
        ended.update(
            status.goal_id.id
            for status in message.status_list
            if status.status == GoalStatus.SUCCEEDED
        )

    rospy.Subscriber(f"{server}/status", GoalStatusArray, note)
    goals = rospy.Publisher(f"{server}/goal", ROSClingoActionGoal, queue_size=2)
    wait_for(goals.get_num_connections)
    heard: queue.Queue[str] = queue.Queue()
    for name in (f"before_{topic}", f"after_{topic}"):
        goals.publish(ROSClingoActionGoal(goal_id=GoalID(id=name)))
        if name.startswith("before"):
            wait_for(lambda: f"before_{topic}" in ended)
            rospy.Subscriber(
                f"{server}/{topic}", KINDS[topic], lambda m: heard.put(m.status.goal_id.id)
            )
        said = ""
        while said != name:
            said = heard.get(timeout=TIMEOUT)
            print(said, flush=True)
