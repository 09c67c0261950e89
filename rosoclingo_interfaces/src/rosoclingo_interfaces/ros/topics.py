"""rosoclingo's topics, opened by interfaces and clients."""

from __future__ import annotations

import time
from typing import Callable, List

import rosgraph
import rospy

from rosclingo.ros.reminder import Reminder

_POLL_SECONDS = 0.01  # how often a wait looks whether a connection is there
_SECONDS_FOR_OTHERS = 2.0  # for known subscribers to connect, when others are there already


def topic(name: str) -> str:
    """Returns the name of a topic of rosoclingo's, such as ``in``, ``out`` or ``journal``.

    That is ``rosoclingo/in`` in the node's namespace. Remappings of ``rosoclingo``, of
    ``rosoclingo/in`` and of ``~in`` lead elsewhere.
    """
    private = rospy.resolve_name(f"~{name}")
    if private != f"{rospy.get_name()}/{name}":
        return private
    return f"{rospy.remap_name('rosoclingo')}/{name}"


def wait_for_node(publisher: rospy.Publisher, node: str) -> None:
    """Waits for a short time until a node has subscribed."""
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
        say: Called with the missing nodes, every five seconds.
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
    while time.monotonic() < end and not stopped():
        known = _nodes(1, publisher.resolved_name)
        if all(publisher.impl.has_connection(node) for node in known):
            break
        time.sleep(_POLL_SECONDS)
    return True


def publishers(name: str) -> List[str]:
    """Returns the nodes that publish to a topic of a resolved name, as far as the master knows."""
    return _nodes(0, name)


def _nodes(part: int, name: str) -> List[str]:
    """Returns the nodes of a topic in one part of the master's state."""
    try:
        state = rosgraph.Master(rospy.get_name()).getSystemState()
    except (OSError, rosgraph.MasterException):
        return []  # unknown without a master
    return sorted(dict(state[part]).get(name, ()))
