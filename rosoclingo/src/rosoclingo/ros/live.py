"""Collects the ``~about`` of a running system's nodes, for ``check.py --live``."""

from __future__ import annotations

import json
from typing import Any, Dict

import rosgraph
import rospy
from std_msgs.msg import String

from rosclingo.ros.init import init_node
from rosoclingo.errors import LiveError

_ABOUT = "/about"
_SECONDS = 5.0  # until a latched message is there, if its node still is


def look() -> Dict[str, Dict[str, Any]]:
    """Returns the ``~about`` of each node, by its name.

    Takes as long as nodes that are registered and do not answer: 5 s each.

    Raises:
        LiveError: There is no ROS master.
    """
    if not rosgraph.is_master_online():
        raise LiveError(
            f"--live: there is no ROS master at {rosgraph.get_master_uri()}; start the system"
        )
    init_node("check", anonymous=True)
    found: Dict[str, Dict[str, Any]] = {}
    for topic, kind in rospy.get_published_topics():
        if topic.endswith(_ABOUT) and kind == "std_msgs/String":
            try:
                said = json.loads(rospy.wait_for_message(topic, String, _SECONDS).data)
            except (rospy.ROSException, ValueError) as err:
                rospy.logwarn("%s: %s", topic, err)
                continue
            if isinstance(said, dict):
                found[topic[: -len(_ABOUT)]] = said
    rospy.signal_shutdown("all is seen")
    return found
