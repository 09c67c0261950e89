"""Processes on a ROS master of their own, all of which end with it. Needs a sourced workspace."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import time
from pathlib import Path
from types import TracebackType
from typing import Dict, List, NamedTuple, Optional, Type

from rosclingo.ros.ports import free_port
from rosoclingo.bags.replay.startup import Start
from rosoclingo.bags.replay.unpack import ReplayError

_START_SECONDS = 60.0  # how long a ROS master may take to answer on a busy machine
_POLL_SECONDS = 0.02
_LOG_LINES = 15  # of a process that failed, shown to the user
# How long a process has to end after each signal. roslaunch needs some seconds to end its nodes,
# and leaves them behind if it is killed.
_PATIENCE = ((signal.SIGINT, 20.0), (signal.SIGTERM, 3.0), (signal.SIGKILL, 3.0))


class _Process(NamedTuple):
    name: str
    process: subprocess.Popen[bytes]
    log: Path


class System:
    """A ROS master on a free port, and nodes; a context manager that ends what it has started.

    Not thread-safe.

    Attributes:
        uri: Where the master is.
    """

    def __init__(self, folder: Path) -> None:
        """Starts nothing yet.

        Args:
            folder: Where logs are written.
        """
        self._folder = folder
        self._processes: List[_Process] = []
        self._port = free_port()
        self.uri = f"http://localhost:{self._port}"

    def __enter__(self) -> System:
        """Starts the master and waits until it answers.

        Raises:
            ReplayError: It does not.
        """
        try:
            self.start(Start("rosmaster", ("rosmaster", "--core", "-p", str(self._port))))
            end = time.monotonic() + _START_SECONDS
            while not self._answers():
                if time.monotonic() > end or self.failure() is not None:
                    raise ReplayError(f"the ROS master does not start\n{self.log('rosmaster')}")
                time.sleep(_POLL_SECONDS)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        """Ends everything."""
        self.close()

    def start(self, start: Start) -> None:
        """Starts a process and returns at once.

        Raises:
            ReplayError: There is no such program.
        """
        log = self._folder / f"{len(self._processes)}.log"
        try:
            with log.open("wb") as output:
                # In a session of its own, so that Ctrl-C does not reach it first.
                process = subprocess.Popen(  # noqa: S603 (the command is made by startup.py)
                    start.command,
                    env=self._environment(start.namespace),
                    cwd=start.directory,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as err:
            raise ReplayError(
                f"{start.command[0]} cannot be started: {err.strerror}; source the workspace's "
                "setup.bash first"
            ) from err
        self._processes.append(_Process(start.name, process, log))

    def failure(self) -> Optional[str]:
        """Returns the name of a process that has ended by itself, if there is one."""
        for name, process, _ in self._processes:
            if process.poll() is not None:
                return name
        return None

    def log(self, name: str) -> str:
        """Returns the last lines that a process has printed."""
        for other, _, log in self._processes:
            if other == name:
                lines = log.read_text(errors="replace").splitlines()
                return "\n".join(lines[-_LOG_LINES:])
        return ""

    def pids(self) -> Dict[str, int]:
        """Returns the ids of the processes, by name."""
        return {name: process.pid for name, process, _ in self._processes}

    def close(self) -> None:
        """Ends all processes, the master last."""
        nodes = [one.process for one in self._processes[1:]]
        _end(nodes)
        _end([one.process for one in self._processes[:1]])
        self._processes.clear()

    def _answers(self) -> bool:
        with socket.socket() as connection:
            return connection.connect_ex(("localhost", self._port)) == 0

    def _environment(self, namespace: str) -> Dict[str, str]:
        environment = {
            **os.environ,
            "ROS_MASTER_URI": self.uri,
            "ROS_HOSTNAME": "localhost",
            "ROS_NAMESPACE": namespace,
            "ROS_LOG_DIR": str(self._folder / "log"),
            "PYTHONUNBUFFERED": "1",
        }
        environment.pop("ROS_IP", None)
        return environment


def _end(processes: List[subprocess.Popen[bytes]]) -> None:
    for number, seconds in _PATIENCE:
        running = [process for process in processes if process.poll() is None]
        for process in running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)  # each leads a group of its own
        end = time.monotonic() + seconds
        for process in running:
            try:
                process.wait(max(0.0, end - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue
