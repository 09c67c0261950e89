"""rosoclingo's topics, as seen from the other side."""

from __future__ import annotations

import time
from typing import Callable

import rosgraph
import rospy

from rosclingo.ros.reminder import Reminder

_POLL_SECONDS = 0.01  # how often a wait looks whether a connection is there
_SECONDS_FOR_OTHERS = 2.0  # for known subscribers to connect, when others are there already


def topic(name: str) -> str:
    """Returns the name of rosoclingo's topic ``in``, ``out`` or ``journal``.

    That is ``rosoclingo/in`` in the node's namespace. Remappings of ``rosoclingo``, of
    ``rosoclingo/in`` and of ``~in`` lead elsewhere.
    """
    private = rospy.resolve_name(f"~{name}")
    if private != f"{rospy.get_name()}/{name}":
        return private
    return f"{rospy.remap_name('rosoclingo')}/{name}"


def wait_for_node(publisher: rospy.Publisher, node: str) -> None:
    """Waits, for a short time, until a node has subscribed to what is published."""
    end = time.monotonic() + _SECONDS_FOR_OTHERS
    while not publisher.impl.has_connection(node) and not rospy.is_shutdown():
        if time.monotonic() > end:
            rospy.logwarn("%s does not listen to %s", node, publisher.resolved_name)
            return
        time.sleep(_POLL_SECONDS)


def wait_for_subscribers(
    publisher: rospy.Publisher, say: Callable[[str], None], stopped: Callable[[], bool]
) -> bool:
    """Waits until all nodes that have subscribed to a topic are connected, and there is one.

    Args:
        publisher: Publishes to the topic.
        say: Called with what is waited for, every five seconds.
        stopped: Whether to give up.

    Returns:
        Whether there is a subscriber.
    """
    reminder = Reminder()
    while not publisher.get_num_connections():
        if stopped():
            return False
        if reminder.due():
            say(f"waiting for a subscriber of {publisher.resolved_name}; is rosoclingo running?")
        time.sleep(_POLL_SECONDS)
    end = time.monotonic() + _SECONDS_FOR_OTHERS
    while not _all_connected(publisher) and time.monotonic() < end and not stopped():
        time.sleep(_POLL_SECONDS)
    return True


def _all_connected(publisher: rospy.Publisher) -> bool:
    try:
        subscribers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[1])
    except (OSError, rosgraph.MasterException):
        return True  # nobody knows of others
    nodes = subscribers.get(publisher.resolved_name, ())
    return all(publisher.impl.has_connection(node) for node in nodes)
