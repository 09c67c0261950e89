"""ROS's time as the systems have it, also that of a simulator that begins after the console."""

from __future__ import annotations

import time
from typing import Dict, Optional

import rospy
from rosgraph_msgs.msg import Clock

_PARAMETER = "/use_sim_time"


class SystemsClock:
    """Knows wall time and ROS's time. Thread-safe, as one thread sets the number that others read.

    rospy looks only once, when a node begins, whether there is a simulator's time.
    """

    def __init__(self) -> None:
        self._simulated: Optional[float] = None
        self._topic: Optional[rospy.Subscriber] = None

    def look(self) -> None:
        """Looks whether there is a simulator's time; called by one thread now and then."""
        if self._topic is None and rospy.get_param(_PARAMETER, False) is True:
            self._topic = rospy.Subscriber("/clock", Clock, self._on_clock, queue_size=1)

    def _on_clock(self, message: Clock) -> None:
        self._simulated = message.clock.to_sec()

    def now(self) -> Dict[str, float]:
        """Returns what time it is: ``now`` of wall time, ``ros`` of ROS's time, in seconds.

        Without a simulator's time, both are the same number.
        """
        now, simulated = time.time(), self._simulated
        return {"now": now, "ros": now if simulated is None else simulated}
