"""Ports for ROS masters that run beside others. Needs no ROS."""

from __future__ import annotations

import errno
import random
import socket

# Below those that Linux gives to outgoing connections, which would take one before the master does.
_PORTS = range(15_000, 32_000)
_ATTEMPTS = 100


def free_port() -> int:
    """Returns a TCP port that is free now, and that only such masters use.

    Raises:
        OSError: Many ports were tried, and none is free.
    """
    for _ in range(_ATTEMPTS):
        port = random.choice(_PORTS)  # noqa: S311 (no secret)
        with socket.socket() as server:
            try:
                server.bind(("", port))
            except OSError as err:
                if err.errno not in (errno.EADDRINUSE, errno.EACCES):
                    raise
            else:
                return port
    raise OSError(errno.EADDRINUSE, f"no free TCP port among {_ATTEMPTS} from {_PORTS}")
