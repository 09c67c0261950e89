"""Finds out whether a node runs, from the ROS master and the node's own port."""

from __future__ import annotations

import enum
import socket
from urllib.parse import urlsplit

import rosgraph
import rospy

_CONNECT_SECONDS = 1.0  # a host that is gone does not refuse a connection


class Presence(enum.Enum):
    """The presence of a node; the values are words for a message."""

    UNKNOWN = "no node of that name runs"
    ENDED = "it has ended without a word, as one does that was killed"
    RUNNING = "it runs, and is not ready yet"


def presence(node: str) -> Presence:
    """Looks for a node.

    Args:
        node: Resolved name of the node.
    """
    try:
        uri = urlsplit(rosgraph.Master(rospy.get_name()).lookupNode(node))
    except (OSError, rosgraph.MasterException):
        return Presence.UNKNOWN
    try:
        socket.create_connection((uri.hostname, uri.port), _CONNECT_SECONDS).close()
    except OSError:
        return Presence.ENDED
    return Presence.RUNNING
