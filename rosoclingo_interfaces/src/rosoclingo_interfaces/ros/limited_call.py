"""Service calls with a time limit."""

from __future__ import annotations

import threading
from typing import List, Optional

import rospy


def call_within(service: rospy.ServiceProxy, seconds: float) -> Optional[str]:
    """Calls a service without arguments, with a time limit.

    A call itself has no time limit, and a server that hangs accepts it like any other.

    Args:
        service: Has no arguments, and a result that is ignored.
        seconds: Longest time to wait, of wall time.

    Returns:
        Why it is not known to be done; None if it is done.
    """
    ended = threading.Event()
    faults: List[str] = []

    def call() -> None:
        try:
            service()
        except (rospy.ServiceException, rospy.ROSException, OSError) as err:
            faults.append(str(err))
        ended.set()

    threading.Thread(target=call, name=service.resolved_name, daemon=True).start()
    if not ended.wait(seconds):
        return f"{service.resolved_name} has not answered yet"
    return faults[0] if faults else None
