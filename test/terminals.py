"""Runs the manual's commands as a user does: each in a terminal, on a ROS master of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Set, cast
from xmlrpc.client import ServerProxy

import pytest

from rosclingo.ros.ports import free_port

TIMEOUT = 60.0  # seconds; no more than a bound for what never comes
POLL = 0.05  # seconds


class Terminal:
    """A running command and what it has printed."""

    def __init__(self, command: List[str], environment: Dict[str, str], log: Path) -> None:
        self.command = " ".join(command)
        self._log = log
        with log.open("wb") as output:
            # In a session of its own, so that a Ctrl-C of the tester does not reach it first.
            self.process = subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def output(self) -> str:
        """What the command has printed so far."""
        return self._log.read_text(errors="replace")

    def wait_for(self, text: str) -> None:
        """Waits until the command has printed a text."""
        end = time.monotonic() + TIMEOUT
        while text not in self.output and self.process.poll() is None and time.monotonic() < end:
            time.sleep(POLL)
        assert text in self.output, self.output

    def interrupt(self) -> None:
        """Presses Ctrl-C, which reaches all that belongs to the command."""
        os.killpg(self.process.pid, signal.SIGINT)

    def wait(self, timeout: float = TIMEOUT) -> int:
        """Waits until the command has ended and returns its exit status."""
        return self.process.wait(timeout)

    def close(self) -> None:
        """Ends the command if it still runs."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if self.process.poll() is None:
                os.killpg(self.process.pid, number)
                try:
                    self.process.wait(10.0)
                except subprocess.TimeoutExpired:
                    continue
            return


class Terminals:
    """Starts commands, and ends those that still run when it is closed."""

    def __init__(self, folder: Path) -> None:
        self._port = free_port()
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://localhost:{self._port}",
            "PYTHONUNBUFFERED": "1",
        }
        self._folder = folder
        self._open: List[Terminal] = []

    def start(self, *command: str) -> Terminal:
        """Starts a command and returns at once."""
        log = self._folder / f"{len(self._open)}.log"
        terminal = Terminal(list(command), self.environment, log)
        self._open.append(terminal)
        return terminal

    def run(self, *command: str) -> Terminal:
        """Runs a command to its end."""
        terminal = self.start(*command)
        terminal.wait()
        return terminal

    def start_master(self) -> Terminal:
        """Starts roscore and waits until it answers."""
        master = self.start("roscore", "-p", str(self._port))
        wait_for(lambda: "/rosout" in self.names())
        return master

    def names(self) -> Set[str]:
        """Returns the nodes, topics and services that the master knows; none without a master."""
        master = ServerProxy(self.environment["ROS_MASTER_URI"])
        try:
            _, _, state = cast(Any, master.getSystemState("/test"))
        except OSError:
            return set()
        return {name for part in state for named, nodes in part for name in [named, *nodes]}

    def close(self) -> None:
        """Ends what still runs, the last first; prints all output, for pytest to show."""
        for terminal in reversed(self._open):
            terminal.close()
        for terminal in self._open:
            print(f"--- {terminal.command}\n{terminal.output}")


@pytest.fixture
def terminals(tmp_path: Path) -> Iterator[Terminals]:
    """Terminals with a running master."""
    opened = Terminals(tmp_path)
    try:
        opened.start_master()
        yield opened
    finally:
        opened.close()


def package(name: str) -> Path:
    """Returns the folder of a ROS package."""
    return Path(subprocess.check_output(["rospack", "find", name], text=True).strip())


def wait_for(condition: Callable[[], bool]) -> None:
    """Waits until a condition holds that nothing announces."""
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end, "timeout"
        time.sleep(POLL)
