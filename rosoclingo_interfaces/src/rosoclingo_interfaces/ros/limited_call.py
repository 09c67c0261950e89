"""Service calls that can be waited for with a limit."""

from __future__ import annotations

import threading
from typing import Any, List, Optional

import rospy


class RunningCall:
    """A call of a service, in a thread of its own.

    A call itself has no time limit, and a server that hangs accepts it like any other. It cannot be
    cancelled, so its thread may outlive the wait for it.

    Attributes:
        ended: Set when the call has ended.
    """

    def __init__(self, service: rospy.ServiceProxy, *request: Any) -> None:
        """Calls the service.

        Args:
            service: The service.
            request: Its request; none for a service without arguments.
        """
        self.ended = threading.Event()
        self._response: Any = None
        self._fault: List[str] = []

        def call() -> None:
            try:
                self._response = service(*request)
            except (rospy.ServiceException, rospy.ROSException, OSError) as err:
                self._fault.append(str(err))
            finally:
                self.ended.set()

        threading.Thread(target=call, name=service.resolved_name, daemon=True).start()

    @property
    def response(self) -> Any:
        """The response, once the call has ended; None if it has failed."""
        return self._response

    @property
    def fault(self) -> Optional[str]:
        """Why the call has failed; None if it has not."""
        return self._fault[0] if self._fault else None


def call_within(service: rospy.ServiceProxy, seconds: float) -> Optional[str]:
    """Calls a service without arguments, with a time limit.

    Args:
        service: Has no arguments, and a result that is ignored.
        seconds: Longest time to wait, of wall time.

    Returns:
        Why it is not known to be done; None if it is done.
    """
    call = RunningCall(service)
    if not call.ended.wait(seconds):
        return f"{service.resolved_name} has not answered yet"
    return call.fault
