"""Runs the manual's commands as a user does: each in a terminal, on a ROS master of their own."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Set, Tuple, cast
from xmlrpc.client import ServerProxy

import pytest
from topics import Listener, Publisher
from waiting import TIMEOUT, wait_for

from rosclingo.ros.local_master import executable
from rosclingo.ros.master import Master
from rosclingo.ros.ports import reserve_port

# By which rosrun finds executables.
SEARCHED = ("CMAKE_PREFIX_PATH", "PATH", "ROS_PACKAGE_PATH")


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
        wait_for(
            lambda: text in self.output or self.process.poll() is not None, lambda: self.output
        )
        assert text in self.output, self.output

    def interrupt(self) -> None:
        """Presses Ctrl-C, which reaches all that belongs to the command."""
        os.killpg(self.process.pid, signal.SIGINT)

    def wait(self, timeout: float = TIMEOUT) -> int:
        """Waits until the command has ended and returns its exit status."""
        return self.process.wait(timeout)

    def close(self) -> None:
        """Ends the command if it still runs, which may have been interrupted before."""
        for number in (None, signal.SIGTERM, signal.SIGKILL):
            if self.process.poll() is None:
                if number is not None:
                    os.killpg(self.process.pid, number)
                try:
                    self.process.wait(10.0)
                except subprocess.TimeoutExpired:
                    continue
            return


class Terminals:
    """Starts commands, and ends those that still run when it is closed."""

    def __init__(self, folder: Path) -> None:
        with reserve_port() as reserved:
            self._port: int = reserved.getsockname()[1]
        logs = folder / "log"
        logs.mkdir()
        self.environment = {
            **os.environ,
            "ROS_MASTER_URI": f"http://localhost:{self._port}",
            "ROS_LOG_DIR": str(logs),  # roslaunch looks how much there is
            "PYTHONUNBUFFERED": "1",
        }
        self._folder = folder
        self._open: List[Terminal] = []
        self._listeners: List[Listener] = []
        self._publishers: List[Publisher] = []
        self._master: Optional[Master] = None

    def start(self, *command: str) -> Terminal:
        """Starts a command and returns at once."""
        log = self._folder / f"{len(self._open)}.log"
        terminal = Terminal(self.without_rosrun(command), self.environment, log)
        self._open.append(terminal)
        return terminal

    def without_rosrun(self, command: Sequence[str]) -> List[str]:
        """Returns a command in which the file stands that rosrun would run."""
        is_here = all(self.environment.get(name) == os.environ.get(name) for name in SEARCHED)
        if command[0] != "rosrun" or not is_here:
            return list(command)
        return [executable(*command[1:3]), *command[3:]]

    def run(self, *command: str) -> Terminal:
        """Runs a command to its end."""
        terminal = self.start(*command)
        terminal.wait()
        return terminal

    def start_master(self) -> None:
        """Starts what roscore starts, and waits until it answers."""
        self._master = Master(self._port)
        self.start("rosrun", "rosout", "rosout")
        wait_for(lambda: "/rosout" in self.names())

    def restart_master(self) -> None:
        """Has another master in the place of the one that runs, which knows no node."""
        assert self._master is not None
        self._master.close()
        self._master = Master(self._port)

    @property
    def master(self) -> Any:
        """What to ask the master, which answers with a status, a text, and what was asked for."""
        return ServerProxy(self.environment["ROS_MASTER_URI"])

    def names(self) -> Set[str]:
        """Returns the nodes, topics and services that the master knows; none without a master."""
        return {name for part in self._state() for named, nodes in part for name in [named, *nodes]}

    def subscribers(self, topic: str) -> Set[str]:
        """Returns the nodes that listen to a topic."""
        return set(dict(self._state()[1]).get(topic, []))

    def publishers(self, topic: str) -> Set[str]:
        """Returns the nodes that publish a topic."""
        return set(dict(self._state()[0]).get(topic, []))

    def receivers(self, node: str, topic: str) -> Set[str]:
        """Returns the nodes that have a connection on which a node sends them a topic."""
        if node not in self.names():
            return set()
        connections = self._ask(node).getBusInfo("/test")[2]
        return {to for _, to, way, _, of, *_ in connections if (way, of) == ("o", topic)}

    def wait_until_hears(self, node: str, *expected: str) -> None:
        """Waits until a node has a connection from whoever publishes what it subscribes to.

        Args:
            node: The name of the node.
            expected: Topics that somebody has to publish first.
        """

        def hears() -> bool:
            if not all(map(self.publishers, expected)):
                return False
            publishers, subscribers, _ = self._state()
            topics = {topic for topic, nodes in subscribers if node in nodes}
            return all(
                node in self.receivers(publisher, topic)
                for topic, nodes in publishers
                if topic in topics
                for publisher in nodes
            )

        wait_for(hears)

    def listen(self, node: str, topic: str) -> Listener:
        """Hears a topic, from when its node sends here."""
        name = f"/listener{len(self._listeners)}"
        wait_for(lambda: node in self.publishers(topic))
        self._listeners.append(Listener(self._ask(node), topic, name))
        wait_for(lambda: name in self.receivers(node, topic))
        return self._listeners[-1]

    def publish(self, topic: str, kind: str, text: str) -> None:
        """Sends a message, which is written as YAML, to all who listen, now or later."""
        name = f"/publisher{len(self._publishers)}"
        publisher = Publisher(self.master, topic, kind, text, name)
        self._publishers.append(publisher)
        wait_for(publisher.has_told_all)

    def latched(self, topic: str) -> str:
        """Waits until somebody publishes a topic that is latched, and returns the last message."""
        wait_for(lambda: bool(self.publishers(topic)))
        (node,) = self.publishers(topic)
        heard = self.listen(node, topic)
        heard.wait_for("---")
        return heard.output.partition("---")[0]

    def pid(self, node: str) -> int:
        """Waits for a node, and returns its process."""
        wait_for(lambda: node in self.names())
        return int(self._ask(node).getPid("/test")[2])

    def _ask(self, node: str) -> Any:
        return ServerProxy(self.master.lookupNode("/test", node)[2])

    def _state(self) -> List[List[Tuple[str, List[str]]]]:
        """Returns publishers, subscribers and services, by what they are of."""
        try:
            return cast(List[Any], self.master.getSystemState("/test")[2])
        except OSError:
            return [[], [], []]

    def close(self) -> None:
        """Ends what still runs, all at once; prints all output, for pytest to show."""
        for terminal in self._open:
            if terminal.process.poll() is None:
                terminal.interrupt()
        for terminal in reversed(self._open):
            terminal.close()
        for one in (*self._listeners, *self._publishers):
            one.close()
        if self._master is not None:
            self._master.close()
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


def catches_interrupts(pid: int) -> bool:
    """Whether Ctrl-C lets a process say goodbye; a node that is known, but begins, ends at once."""
    status = Path(f"/proc/{pid}/status").read_text()
    (caught,) = (line.split()[1] for line in status.splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught, 16) >> (signal.SIGINT - 1) & 1)
