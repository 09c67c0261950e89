"""A ROS master in a thread of this process: it is there at once, and roscore in a second."""

from __future__ import annotations

import logging
import threading
import uuid

from rosgraph.xmlrpc import ThreadingXMLRPCServer
from rosmaster.master_api import ROSMasterHandler

_WORKERS = 3  # threads that tell the nodes of changes, as many as roscore has
_POLL = 0.02  # seconds that it takes to end

# They log whenever a node that is told of a change has just ended, or is killed while it asks;
# roscore keeps that in a file. With this, Python prints it only where logging was set up.
for _name in ("rosmaster", "xmlrpc"):
    logging.getLogger(_name).addHandler(logging.NullHandler())


class Master:
    """ROS's own master, which runs from when it is made until it is closed. Thread-safe."""

    def __init__(self, port: int) -> None:
        """Starts it.

        Args:
            port: The TCP port on which it listens.

        Raises:
            OSError: The port is taken.
        """
        # First, since the handler begins threads.
        self._server = ThreadingXMLRPCServer(("", port), log_requests=0)
        self._handler = ROSMasterHandler(_WORKERS)
        self._server.register_multicall_functions()
        self._server.register_instance(self._handler)
        self._handler._ready(f"http://localhost:{port}/")
        # Two roslaunch that start at the same time would each set another one.
        self._handler.setParam("/test", "/run_id", str(uuid.uuid4()))
        thread = threading.Thread(target=self._server.serve_forever, args=(_POLL,), daemon=True)
        thread.start()

    def close(self) -> None:
        """Ends it, whether or not nodes still know it."""
        self._server.shutdown()
        self._server.server_close()
        self._handler._shutdown()
