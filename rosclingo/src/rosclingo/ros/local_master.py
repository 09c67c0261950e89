"""A ROS master of one's own, and processes on it, all of which end with it.

    with LocalMaster(Path("logs")) as master:
        master.start("planner", ["rosrun", "rosclingo", "run.py", "-f", "a.lp"])

As ``roslaunch`` does it, each process has a session of its own, so that Ctrl-C does not end it
before its turn, and is ended by its id. Needs a sourced workspace; this process is no ROS node.

    python -m rosclingo.ros.local_master COMMAND... -- COMMAND...

runs commands in the same way: all but the last in the background, whose output is shown if the
last one fails. The exit status is that of the last one.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, Optional, Sequence

import rospkg
from roslib.packages import find_node

from rosclingo.errors import RosclingoError
from rosclingo.ros.master import Master
from rosclingo.ros.ports import reserve_port

_LOG_LINES = 15  # of a process that failed, shown to the user
# How long processes have to end after each signal. roslaunch needs some seconds to end its nodes,
# and leaves them behind if it is killed.
_PATIENCE = ((signal.SIGINT, 20.0), (signal.SIGTERM, 3.0), (signal.SIGKILL, 3.0))


class ProcessError(RosclingoError):
    """A process cannot be started, or has ended too early; the message has its last lines."""


class Process:
    """A command in a session of its own, with its output.

    Attributes:
        process: The process itself.
    """

    def __init__(
        self,
        command: Sequence[str],
        log: Path,
        environment: Mapping[str, str],
        directory: Optional[Path] = None,
    ) -> None:
        """Starts a command, and returns at once.

        Args:
            command: Program and arguments.
            log: Where its output goes.
            environment: Its environment variables.
            directory: Its working directory; None for this process's.

        Raises:
            ProcessError: There is no such program.
        """
        self._log = log
        try:
            with log.open("wb") as output:
                self.process = subprocess.Popen(  # noqa: S603 (whoever calls has made the command)
                    command,
                    env=environment,
                    cwd=directory,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )
        except OSError as err:
            raise ProcessError(
                f"{command[0]} cannot be started: {err.strerror}; source the workspace's "
                "setup.bash first"
            ) from err

    @property
    def output(self) -> str:
        """All that it has printed so far."""
        return self._log.read_text(errors="replace")

    @property
    def last_lines(self) -> str:
        """The last lines that it has printed."""
        return "\n".join(self.output.splitlines()[-_LOG_LINES:])


def executable(package: str, name: str) -> str:
    """Returns the file that ``rosrun`` would run, which takes as long as half a node's start.

    Args:
        package: Name of a ROS package.
        name: Name of its program.

    Raises:
        ProcessError: There is no such program.
    """
    try:
        found: List[str] = find_node(package, name)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise ProcessError(
            f"{package} has no program {name}, or is not there; source the workspace's setup.bash"
        )
    return found[0]


def end(processes: Iterable[Process]) -> None:
    """Ends processes that still run, with all that belongs to their sessions' first groups."""
    asked = [one.process for one in processes]
    for number, seconds in _PATIENCE:
        running = [process for process in asked if process.poll() is None]
        for process in running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, number)  # each leads a group of its own
        until = time.monotonic() + seconds
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(max(0.0, until - time.monotonic()))


class LocalMaster:
    """A ROS master on a port of its own, and processes; a context manager. Not thread-safe.

    Attributes:
        uri: Where the master is.
        processes: The processes by their names.
    """

    def __init__(self, folder: Path) -> None:
        """Prepares; entering the context starts the master.

        Args:
            folder: Where logs are written.
        """
        self.processes: Dict[str, Process] = {}
        self._folder = folder
        self._logs = 0
        self._master: Optional[Master] = None
        self._starter = ThreadPoolExecutor(1)
        self._reserved = reserve_port()
        self._port: int = self._reserved.getsockname()[1]
        self.uri = f"http://localhost:{self._port}"

    def __enter__(self) -> LocalMaster:
        """Starts the master, which answers at once.

        Raises:
            OSError: The port is in use.
        """
        try:
            self._master = Master(self._port)
        except OSError:
            self.close()  # __exit__ is not called
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Ends everything."""
        self.close()

    def environment(self, namespace: str = "/") -> Dict[str, str]:
        """Returns the environment variables of a process on this master.

        Args:
            namespace: ROS namespace of the process.
        """
        environment = {
            **os.environ,
            "ROS_MASTER_URI": self.uri,
            "ROS_HOSTNAME": "localhost",  # nothing to look up, nothing that leaves the machine
            "ROS_NAMESPACE": namespace,
            "ROS_LOG_DIR": str(self._folder / "log"),
            "PYTHONUNBUFFERED": "1",
        }
        environment.pop("ROS_IP", None)
        return environment

    def start(
        self,
        name: str,
        command: Sequence[str],
        *,
        namespace: str = "/",
        directory: Optional[Path] = None,
    ) -> Process:
        """Starts a process and returns at once.

        Args:
            name: What to call it.
            command: Program and arguments.
            namespace: ROS namespace of the process.
            directory: Its working directory; None for this process's.

        Raises:
            ProcessError: There is no such program.
        """
        log = self._folder / f"{self._logs}.log"
        self._logs += 1

        def begin() -> Process:
            self.processes[name] = Process(command, log, self.environment(namespace), directory)
            return self.processes[name]

        # A signal's handler interrupts the main thread, maybe when it has a process and no name.
        return self._starter.submit(begin).result()

    def failure(self) -> Optional[str]:
        """Returns the name of a process that has ended by itself, if there is one."""
        ended = (name for name, one in self.processes.items() if one.process.poll() is not None)
        return next(ended, None)

    def end(self, name: str) -> None:
        """Ends a process."""
        end([self.processes.pop(name)])

    def kill(self, name: str) -> None:
        """Kills a process by SIGKILL, and waits until it is gone."""
        process = self.processes.pop(name).process
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def close(self) -> None:
        """Ends all processes, then the master."""
        self._starter.shutdown()
        end(self.processes.values())
        self.processes.clear()
        if self._master is not None:
            self._master.close()
        self._reserved.close()


def main() -> int:
    """Runs the commands of the command line, and returns the exit status of the last one."""
    commands: List[List[str]] = [[]]
    for word in sys.argv[1:]:
        if word == "--":
            commands.append([])
        else:
            commands[-1].append(word)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that no process is left behind
    try:
        with tempfile.TemporaryDirectory() as folder, LocalMaster(Path(folder)) as master:
            for number, command in enumerate(commands[:-1]):
                master.start(str(number), command)
            status = subprocess.call(commands[-1], env=master.environment())  # noqa: S603 (given)
            for process in master.processes.values() if status else ():
                print(process.output, file=sys.stderr)
    except ProcessError as err:
        print(err, file=sys.stderr)
        status = 1
    except KeyboardInterrupt:
        status = 130
    return status


if __name__ == "__main__":
    sys.exit(main())
