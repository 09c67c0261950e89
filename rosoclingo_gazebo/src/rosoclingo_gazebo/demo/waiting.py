"""Waits of the main thread."""

from __future__ import annotations

import threading
import time
from typing import Callable

import rospy

_POLL_SECONDS = 0.05  # how often the main thread looks at what it waits for


def wait_for(condition: Callable[[], bool], seconds: float) -> bool:
    """Waits until something holds, the node is shut down, or the time is over.

    Args:
        condition: What has to hold.
        seconds: Longest time to wait, of wall time.

    Returns:
        Whether it holds.
    """
    end = time.monotonic() + seconds
    pause = threading.Event()
    while not condition():
        if rospy.is_shutdown() or time.monotonic() > end:
            return False
        pause.wait(_POLL_SECONDS)
    return True
