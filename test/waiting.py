"""Waits for conditions that nothing announces; rostests import it, too, and run without pytest."""

from __future__ import annotations

import time
from typing import Any, Callable

TIMEOUT = 180.0  # seconds of wall time; no more than a bound for what never comes
POLL = 0.05  # seconds; conditions that ask a ROS master take some milliseconds

Within = Callable[[float, Callable[[], Any]], Any]
"""Calls a function and returns its value, but fails if that takes too long, in seconds."""


def wait_for(
    condition: Callable[[], Any],
    about: Callable[[], object] = str,
    *,
    timeout: float = TIMEOUT,
    poll: float = POLL,
) -> None:
    """Waits until a condition holds.

    Args:
        condition: It is looked at often in the beginning, later less often.
        about: Says what is there instead, for an error message.
        timeout: Longest time to wait, in seconds of wall time.
        poll: Longest pause between two looks, in seconds.
    """
    end = time.monotonic() + timeout
    pause = min(0.002, poll)
    while not condition():
        assert time.monotonic() < end, f"timeout: {about()}"
        time.sleep(pause)
        pause = min(1.5 * pause, poll)
