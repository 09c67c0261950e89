"""Ends a node that the ROS master does not know any more."""

from __future__ import annotations

import atexit
import http.client
import os
import sys
import threading
import xmlrpc.client

import rosgraph
import rosgraph.masterapi
import rospy

STATUS = 3
"""The exit status of a node that has ended because its master does not know it."""

_SECONDS = 3.0  # between two questions
_unknown = threading.Event()  # set when the master does not know this node
_DOUBTS = 2  # answers in a row, so that no node ends because of one that was just beginning


def watch_master() -> None:
    """Asks the master now and then whether it knows this node, which is initialised.

    A master that was started again knows nobody, and nobody finds the node. So the node shuts down,
    with a message, and its exit status is :data:`STATUS` then. With ``respawn`` roslaunch starts it
    again. As long as the master does not answer at all, nothing happens.
    """
    # Called after what is registered later, and after the main thread's end.
    atexit.register(_end_process)
    threading.Thread(target=_watch, name="master", daemon=True).start()


def exit_status(status: int) -> int:
    """Returns :data:`STATUS` if that is why the node ends, else the status that is given."""
    return STATUS if _unknown.is_set() else status


def _watch() -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    doubts = 0
    while not ended.wait(_SECONDS):
        doubts = 0 if is_known() else doubts + 1
        if doubts == _DOUBTS:
            _unknown.set()
            reason = (
                f"the ROS master at {rosgraph.get_master_uri()} does not know {rospy.get_name()} "
                "any more, because it was started again; this node ends, so that it can be started "
                "again, too"
            )
            rospy.logfatal("%s", reason)
            rospy.signal_shutdown(reason)


def _end_process() -> None:
    if _unknown.is_set():
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(STATUS)


def is_known() -> bool:
    """Whether the master knows this node, as far as it answers."""
    try:
        rosgraph.Master(rospy.get_name()).lookupNode(rospy.get_name())
    except rosgraph.masterapi.MasterError:
        return False
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error, http.client.HTTPException):
        return True  # there is none, or it is just ending
    return True
