"""Ports for ROS masters that run beside others. Needs no ROS."""

from __future__ import annotations

import errno
import random
import socket

# Below those that Linux gives to outgoing connections, which would take one before the master does.
_PORTS = range(15_000, 32_000)
_ATTEMPTS = 100


def reserve_port() -> socket.socket:
    """Reserves a TCP port for a master.

    As long as the socket is open, no other search for a free port returns this one; a master can
    still listen on it, as servers in Python may share a port with a socket that does not listen.

    Returns:
        A socket that is bound to the port.

    Raises:
        OSError: Many ports were tried, and none is free.
    """
    for _ in range(_ATTEMPTS):
        port = random.choice(_PORTS)  # noqa: S311 (no secret)
        reserved = socket.socket()
        try:
            reserved.bind(("", port))
        except OSError as err:
            reserved.close()
            if err.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise
        else:
            reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            return reserved
    raise OSError(errno.EADDRINUSE, f"no free TCP port among {_ATTEMPTS} from {_PORTS}")
