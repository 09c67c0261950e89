"""Ends a node that the ROS master does not know any more."""

from __future__ import annotations

import atexit
import contextlib
import http.client
import os
import sys
import threading
import xmlrpc.client
from typing import Any, Dict

import rosgraph
import rosgraph.masterapi
import rospy

STATUS = 3
"""The exit status of a node that has ended because its master does not know it."""

RESPAWN_VARIABLE = "ROSCLINGO_RESPAWN"
"""The environment variable that is ``true`` where roslaunch starts a node again that has ended."""

_CLOCK = "/use_sim_time"
# From a master that there is not, or that is just ending.
_NO_ANSWER = (
    OSError,
    rosgraph.MasterException,
    xmlrpc.client.Error,
    http.client.HTTPException,
)
_SECONDS = 3.0  # between two questions
_kept: Dict[str, Any] = {}  # parameters that another master gets, by their names
_unknown = threading.Event()  # set when the master does not know this node
_DOUBTS = 2  # answers in a row, so that no node ends because of one that was just beginning


def watch_master() -> None:
    """Asks the master now and then whether it knows this node, which is initialised.

    A restarted master knows no node, and no node finds this one. So this node shuts down,
    with a message, and its exit status is :data:`STATUS` then. With ``respawn`` roslaunch starts it
    again. As long as the master does not answer at all, nothing happens.

    roslaunch gives the nodes that it starts again no parameters. So a node that is to be started
    again gives the other master those that it has begun with, but for what is set there already.
    """
    # Called after what is registered later, and after the main thread's end.
    atexit.register(_end_process)
    if is_respawned():
        names = (rospy.get_name(), _CLOCK)
        with contextlib.suppress(*_NO_ANSWER):
            _kept.update({name: rospy.get_param(name) for name in names if rospy.has_param(name)})
    threading.Thread(target=_watch, name="master", daemon=True).start()


def forget(name: str) -> None:
    """Deletes a private parameter of this node, which another master does not get, either.

    Args:
        name: Its name, without the node's.
    """
    rospy.delete_param(f"~{name}")
    own = _kept.get(rospy.get_name(), {})
    own.pop(name, None)


def is_respawned() -> bool:
    """Returns whether roslaunch starts the node again when it has ended, as launch files say it."""
    return os.environ.get(RESPAWN_VARIABLE, "").lower() == "true"


def exit_status(status: int) -> int:
    """Returns :data:`STATUS` if that is why the node ends, else the status that is given."""
    return STATUS if _unknown.is_set() else status


def _hand_over(master: rosgraph.Master, kept: Dict[str, Any]) -> None:
    """Sets parameters on a master, except those that it has."""
    for name, value in kept.items():
        if not master.hasParam(name):
            master.setParam(name, value)
        elif isinstance(value, dict):
            _hand_over(master, {f"{name}/{key}": below for key, below in value.items()})


def _watch() -> None:
    ended = threading.Event()
    rospy.on_shutdown(ended.set)
    doubts = 0
    while not ended.wait(_SECONDS):
        doubts = 0 if is_known() else doubts + 1
        if doubts == _DOUBTS:
            _unknown.set()
            with contextlib.suppress(*_NO_ANSWER):
                _hand_over(rosgraph.Master(rospy.get_name()), _kept)
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
    """Returns whether the master knows this node, as far as it answers."""
    try:
        rosgraph.Master(rospy.get_name()).lookupNode(rospy.get_name())
    except rosgraph.masterapi.MasterError:
        return False
    except _NO_ANSWER:
        return True
    return True
