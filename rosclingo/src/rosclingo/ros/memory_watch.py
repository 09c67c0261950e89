"""Ends a node that has no memory left for a thread, so that roslaunch starts it again.

Each connection with another node needs a thread: without one, the node runs, and is deaf. A search
may use all memory for a moment, so the node is asked for while its solver is idle.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import NoReturn

import rospy

from rosclingo.ros.master_watch import exit_status, is_respawned
from rosclingo.solver.activity import IDLE, SolverActivity

_SECONDS = 3.0  # between two looks
_SECONDS_TO_SEND = 0.5  # which answers that are on their way have


def watch_memory(activity: SolverActivity) -> None:
    """Ends the process when no thread can be started while a solver is idle.

    Does nothing in a node that is not started again when it ends.

    Args:
        activity: What the solver does.
    """
    if is_respawned():
        threading.Thread(target=_watch, args=(activity,), name="memory", daemon=True).start()


def end_without_memory(reason: str) -> NoReturn:
    """Says why, and ends the process as a crash would, which needs next to no memory."""
    rospy.logfatal("%s; this node ends, to be started again", reason)
    time.sleep(_SECONDS_TO_SEND)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(exit_status(1))


def _watch(activity: SolverActivity) -> None:
    while not rospy.is_shutdown():
        time.sleep(_SECONDS)
        if activity.doing[0] == IDLE and not _can_start_threads() and activity.doing[0] == IDLE:
            end_without_memory("there is not enough memory to start a thread")


def _can_start_threads() -> bool:
    try:
        threading.Thread(target=lambda: None, name="probe", daemon=True).start()
    except (RuntimeError, MemoryError):
        return False
    return True
