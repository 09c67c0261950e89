"""Warns while ROS's clock stands still, with the reason."""

from __future__ import annotations

import threading
from typing import Callable

import rospy

from rosclingo.ros.init import on_shutdown
from rosoclingo_interfaces.ros.topics import publishers
from rosoclingo_interfaces.watchdog import SILENCE_SECONDS, Watchdog

_POLL_SECONDS = 0.5  # how often the clock is read, in wall time
_REMINDER_SECONDS = 10.0  # how often the warning is repeated, in wall time


def watch(waits: Callable[[], bool]) -> None:
    """Starts to warn when something waits and the clock of ROS stands still.

    Make the node first. If ROS's clock is the wall clock, there is nothing to watch.

    Args:
        waits: Whether anything waits by the clock; called in a thread of this module's.
    """
    if not rospy.rostime.is_wallclock():
        threading.Thread(target=_watch, args=(waits,), name="clock", daemon=True).start()


def reason() -> str:
    """Returns why the clock stands still, as far as known, and the remedy."""
    nodes = publishers(rospy.resolve_name("/clock"))
    if nodes:
        return (
            f"{', '.join(nodes)}, which publishes /clock, has ended or pauses: "
            "start it again, or let it go on"
        )
    return (
        "/use_sim_time is true, and nobody publishes /clock: start the simulator that should, or, "
        "if there is none, type rosparam delete /use_sim_time and then start this node again, "
        "which reads it only at its start"
    )


def _watch(waits: Callable[[], bool]) -> None:
    watchdog = Watchdog(rospy.get_rostime)
    end = threading.Event()
    on_shutdown(end.set)
    warn_at = SILENCE_SECONDS
    while not end.wait(_POLL_SECONDS):
        still = watchdog.still()
        if still < SILENCE_SECONDS:
            warn_at = SILENCE_SECONDS
        elif still >= warn_at and waits():
            warn_at = still + _REMINDER_SECONDS
            rospy.logwarn(
                "the clock of ROS has stood still for %.0f s at %.1f; the actions wait with it: %s",
                still,
                rospy.get_time(),
                reason(),
            )
