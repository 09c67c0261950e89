"""Watchdog of ROS's clock, or of another value that should change; says why it stands still."""

from __future__ import annotations

import threading
import time
from typing import Any, Callable

import rospy

from rosclingo.ros.init import on_shutdown
from rosoclingo_interfaces.topics import publishers

SILENCE_SECONDS = 5.0
"""A clock that says the same for so long, in wall time, stands still."""

_POLL_SECONDS = 0.5  # how often it is looked at, in wall time
_REMINDER_SECONDS = 10.0  # how often it is said that it stands still, likewise


class Watchdog:
    """Watches a value in wall time, because a simulator's clock stands still when it ends."""

    def __init__(
        self, value: Callable[[], Any], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begins to watch.

        Args:
            value: Returns the value.
            clock: The time in seconds.
        """
        self._value = value
        self._clock = clock
        self._last = value()
        self._since = clock()

    def still(self) -> float:
        """Returns for how many seconds the value has not changed, as far as calls have seen."""
        value = self._value()
        if value != self._last:
            self._last, self._since = value, self._clock()
        return self._clock() - self._since


def watch(waits: Callable[[], bool]) -> None:
    """Warns, from now on, while something waits and the clock of ROS stands still.

    Make the node first. If ROS's clock is the wall clock, there is nothing to watch.

    Args:
        waits: Whether anything waits by the clock; called in a thread of this module's.
    """
    if not rospy.rostime.is_wallclock():
        threading.Thread(target=_watch, args=(waits,), name="clock", daemon=True).start()


def reason() -> str:
    """Returns why the clock stands still, as far as that is known, and what to do."""
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
