#!/usr/bin/env python3
"""Fault injection: runs a node's program and ends it at the point that another process names.

usage: mortal.py FATE PROGRAM [ARGUMENT]...

It is killed by SIGKILL, or ended in one of the polite ways, after which it still has its say.

A *point* is before or after what others can see of the process: a transaction of a store, fsync and
the replacing of a file, and what is written to a connection of ROS: publications, requests and
replies of services. What is repeated without anything being new, statuses and log messages, has
none. FATE is a file, see :class:`Fate`.
"""

from __future__ import annotations

import contextlib
import http.client
import mmap
import os
import runpy
import signal
import sqlite3
import struct
import sys
import threading
import time
import xmlrpc.client
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence

import rospy
from rospy.impl.tcpros_base import TCPROSTransport

WAYS = ("kill", "int", "term", "rosnode")
"""Ways to end a process: SIGKILL, SIGINT, SIGTERM, or a call as of ``rosnode kill``."""

_FORMAT = struct.Struct("=6I")
_NOTES = 64  # bytes for what the last point was


class Fate:
    """The injected fault of a process, in a file shared with the process that decides on it.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path) -> None:
        """Opens the file, or makes it."""
        self.path = path
        with path.open("a+b") as file:
            file.truncate(_FORMAT.size + _NOTES)
            self._shared = mmap.mmap(file.fileno(), _FORMAT.size + _NOTES)

    def arm(self, point: int, later: int = 0, delay: float = 0.0, way: str = WAYS[0]) -> None:
        """Arms a kill of the process, or another end.

        Args:
            point: At which of its next points, from 1; 0 for never.
            later: At which point of the process that is started then; 0 for never.
            delay: How many seconds after the first one; it goes on meanwhile.
            way: One of :data:`WAYS`.
        """
        self._shared[_FORMAT.size :] = bytes(_NOTES)
        self._write(point, later, round(delay * 1e6), 0, WAYS.index(way), self._read()[5])

    @property
    def left(self) -> int:
        """The number of points until it is killed; 0 if it is not to be."""
        return self._read()[0]

    @property
    def seen(self) -> int:
        """The number of points since :meth:`arm`, in all processes with this file."""
        return self._read()[3]

    @property
    def last(self) -> str:
        """The point of the last kill since :meth:`arm`; empty if there was none."""
        text: bytes = self._shared[_FORMAT.size :]
        return text.rstrip(b"\0").decode(errors="replace")

    @property
    def ends(self) -> bool:
        """Tells if the process is about to end in a polite way."""
        return bool(self._read()[5])

    def begin(self) -> None:
        """Notes that a process is started, which is the one to be ended next."""
        self._write(*self._read()[:5], 0)

    def pass_point(self, what: str) -> None:
        """Goes past a point, or ends there; called by the process, one thread at a time.

        A process that ends in a polite way goes on for a moment, and past points at which nothing
        is done to it.
        """
        left, later, delay, seen, way, ends = self._read()
        if ends or left != 1:
            self._write(left if ends else max(0, left - 1), later, delay, seen + 1, way, ends)
            return
        self._shared[_FORMAT.size :] = what.encode()[:_NOTES].ljust(_NOTES, b"\0")
        self._write(later, 0, 0, seen + 1, way, WAYS[way] != "kill")
        if not delay:
            _end(WAYS[way])
            return
        timer = threading.Timer(delay / 1e6, _end, [WAYS[way]])
        timer.daemon = True
        timer.start()

    def _read(self) -> Sequence[int]:
        return _FORMAT.unpack(self._shared[: _FORMAT.size])

    def _write(self, *values: int) -> None:
        self._shared[: _FORMAT.size] = _FORMAT.pack(*values)


def _end(way: str) -> None:
    """Ends this process; returns only from the polite ways, by which it goes on for a moment."""
    if way == "rosnode" and rospy.get_node_uri() and rospy.core.is_initialized():
        threading.Thread(target=_call_shutdown, daemon=True).start()
    elif way == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
        while True:  # until the signal is there
            time.sleep(1.0)
    else:
        os.kill(os.getpid(), signal.SIGINT if way == "int" else signal.SIGTERM)


def _call_shutdown() -> None:
    """Calls this node as rosnode would; its answer may be lost, since it ends with it."""
    with contextlib.suppress(OSError, xmlrpc.client.Error, http.client.HTTPException):
        xmlrpc.client.ServerProxy(rospy.get_node_uri()).shutdown("/judge", "rosnode kill")


_fate: Optional[Fate] = None
_lock = threading.Lock()  # guards the points


def _point(what: str) -> None:
    if _fate is not None:
        with _lock:
            _fate.pass_point(what)


def _between(what: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns a function that has a point before and one after it."""

    def call(*arguments: Any, **named: Any) -> Any:
        _point(f"before {what}")
        result = function(*arguments, **named)
        _point(f"after {what}")
        return result

    return call


class _Connection(sqlite3.Connection):
    """A connection to a store."""

    def execute(self, sql: str, *arguments: Any) -> sqlite3.Cursor:
        """Executes a statement."""
        if sql != "COMMIT":
            return super().execute(sql, *arguments)
        _point("before commit")
        cursor = super().execute(sql, *arguments)
        _point("after commit")
        return cursor


def _watch_files() -> None:
    connect = sqlite3.connect

    def connect_mortally(*arguments: Any, **named: Any) -> sqlite3.Connection:
        return connect(*arguments, **{"factory": _Connection, **named})

    sqlite3.connect = connect_mortally  # type: ignore[assignment]
    os.fsync = _between("fsync", os.fsync)
    os.replace = _between("replacement of a file", os.replace)


def _watch_connections() -> None:
    write = TCPROSTransport.write_data
    statuses: Dict[int, bytes] = {}

    def write_mortally(transport: Any, data: bytes) -> None:
        name = str(transport.name)
        if name.endswith("/status"):
            news = data[20:]  # without length, number, time and frame
            is_news = statuses.get(id(transport)) != news
            statuses[id(transport)] = news
        else:
            is_news = name != "/rosout"
        (_between(name, write) if is_news else write)(transport, data)

    TCPROSTransport.write_data = write_mortally


def main(arguments: List[str]) -> None:
    """Runs the program."""
    global _fate  # noqa: PLW0603 (one for the process)
    _fate = Fate(Path(arguments[0]))
    _fate.begin()
    sys.argv = arguments[1:]
    sys.path.insert(0, os.path.dirname(os.path.abspath(sys.argv[0])))
    _watch_files()
    _watch_connections()
    runpy.run_path(sys.argv[0], run_name="__main__")


if __name__ == "__main__":
    main(sys.argv[1:])
