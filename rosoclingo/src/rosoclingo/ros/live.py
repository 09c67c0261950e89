"""Collects how a running system's nodes were started, for ``check.py --live``."""

from __future__ import annotations

from typing import Dict

import rosgraph
import rospy
from std_msgs.msg import String

from rosclingo.ros.init import init_node
from rosoclingo.encodings.about import Launched
from rosoclingo.errors import LaunchedError, LiveError

_ABOUT = "/about"
_SECONDS = 5.0  # until a latched message is there, if its node still is


def look() -> Dict[str, Launched]:
    """Returns how each node with a topic ``~about`` was started, by its name.

    Takes as long as nodes that are registered and do not answer: 5 s each.

    Raises:
        LiveError: There is no ROS master, or its address is invalid.
    """
    try:
        is_online = rosgraph.is_master_online()
    except (ValueError, OSError) as err:
        raise LiveError(
            f"--live: the address of the ROS master, ROS_MASTER_URI, is wrong: {err}"
        ) from err
    if not is_online:
        raise LiveError(
            f"--live: there is no ROS master at {rosgraph.get_master_uri()}; start the system"
        )
    init_node("check", anonymous=True)
    found: Dict[str, Launched] = {}
    for topic, kind in rospy.get_published_topics():
        if topic.endswith(_ABOUT) and kind == "std_msgs/String":
            try:
                said = rospy.wait_for_message(topic, String, _SECONDS).data
                node = topic[: -len(_ABOUT)]
                found[node] = Launched.decode(node, said)
            except (rospy.ROSException, LaunchedError) as err:
                rospy.logwarn("%s: %s", topic, err)
    rospy.signal_shutdown("all is seen")
    return found
