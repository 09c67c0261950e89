"""Kills nodes at random, and so shows that the run goes on."""

from __future__ import annotations

import os
import random
import signal
import threading
import xmlrpc.client
from pathlib import Path
from typing import Any, Callable, Optional, Sequence
from urllib.parse import urlparse

import rosgraph
import rospy

_SECONDS = (2.0, 5.0)  # of wall time, at least and at most, until the next one is killed
_POLL_SECONDS = 0.05  # how often is looked whether a node is there


class Killer:
    """Kills one of some nodes every few seconds, by SIGKILL, when they are there again.

    A node is killed only if it runs on this machine, and its process says itself, by the argument
    ``__name`` that roslaunch gives it, that it is this node.
    """

    def __init__(self, nodes: Sequence[str], seed: int, killed: Callable[[str], None]) -> None:
        """Begins in a thread of its own.

        Args:
            nodes: The nodes, resolved like any other name.
            seed: For the random numbers: with equal ones, the same nodes are killed after the same
                times.
            killed: Called with a node that was killed, in that thread.
        """
        self._nodes = list(nodes)
        self._random = random.Random(seed)  # noqa: S311 (no secret)
        self._killed = killed
        self._ended = threading.Event()
        threading.Thread(target=self._run, name="killer", daemon=True).start()

    def end(self) -> None:
        """Stops killing nodes."""
        self._ended.set()

    def _run(self) -> None:
        while not self._ended.wait(self._random.uniform(*_SECONDS)):
            node = self._random.choice(self._nodes)
            process = self._find(node)
            if process is not None:
                os.kill(process, signal.SIGKILL)
                self._killed(node)
                self._find(node, process)  # the time counts from when it is there again

    def _find(self, node: str, killed: int = 0) -> Optional[int]:
        """Waits for the process of a node, which is another one than that which was killed."""
        while not self._ended.wait(_POLL_SECONDS):
            process = local_process(rospy.resolve_name(node))
            if process not in (None, killed):
                return process
        return None


def local_process(node: str) -> Optional[int]:
    """Returns the process of a node that roslaunch has started here, if there is one.

    Args:
        node: Its resolved name.
    """
    try:
        uri = rosgraph.Master(rospy.get_name()).lookupNode(node)
        if not rosgraph.network.is_local_address(urlparse(uri).hostname):
            return None
        api: Any = xmlrpc.client.ServerProxy(uri)
        number = int(api.getPid(rospy.get_name())[2])
        words = Path(f"/proc/{number}/cmdline").read_bytes().split(b"\0")
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return None  # it has just ended, or begins
    return number if f"__name:={node.rpartition('/')[2]}".encode() in words else None
