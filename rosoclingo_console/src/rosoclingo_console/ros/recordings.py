"""Starts and stops recorders, each a process of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Callable, Dict, Set

from rosoclingo_console.web.operations import OperationReply

_SECONDS_TO_BEGIN = 60.0  # a signal that comes before the bag is open would leave none
_POLL_SECONDS = 0.05
_SECONDS_TO_END = 8.0  # a recorder waits for the last messages of a run that has ended
# What nodes/record.py of rosoclingo does.
_PROGRAM = (
    "import rosclingo.start\nfrom rosoclingo.bags.ros.recorder import main\n"
    "import sys\nsys.argv[0] = 'record.py'\nmain()"
)


class Recordings:
    """The recordings of systems, at most one of each. Thread-safe."""

    def __init__(self, folder: Path, show: Callable[[str, str], None]) -> None:
        """Prepares.

        Args:
            folder: Where bags are written.
            show: Called with a system's name and the bag that is recorded, or an empty text;
                thread-safe.
        """
        self._folder = folder
        self._show = show
        self._lock = threading.Lock()  # guards those below; no other is taken under it
        self._running: Dict[str, subprocess.Popen[bytes]] = {}
        self._files: Dict[int, Path] = {}  # by the processes' ids
        self._told: Set[int] = (
            set()
        )  # processes that are to end: a second signal would lose the bag

    def start(self, system: str) -> OperationReply:
        """Starts to record a system."""
        name = system.strip("/").replace("/", "_")
        file = self._folder / f"{name}_{time.strftime('%Y-%m-%d-%H-%M-%S')}.bag"
        with self._lock:
            if system in self._running:
                return OperationReply(False, "it is recorded already")
            try:
                self._folder.mkdir(parents=True, exist_ok=True)
                self._running[system] = subprocess.Popen(  # noqa: S603 (ourselves)
                    [sys.executable, "-c", _PROGRAM, "-o", str(file), f"rosoclingo:={system}"],
                    stdin=subprocess.DEVNULL,
                    start_new_session=True,  # Ctrl-C is for the console, which ends it
                )
            except OSError as err:
                return OperationReply(False, f"cannot record in {self._folder}: {err}; set ~bags")
            self._files[self._running[system].pid] = file
        self._show(system, str(file))
        return OperationReply(True, f"recording in {file}")

    def stop(self, system: str) -> OperationReply:
        """Ends the recording of a system."""
        with self._lock:
            process = self._running.get(system)
            if process is None:
                return OperationReply(False, "it is not recorded")
            file = self._files[process.pid]
        self._wait_for_bag(process, file, _SECONDS_TO_BEGIN)
        with self._lock:
            self._end(process)
        try:
            process.wait(_SECONDS_TO_END)
        except subprocess.TimeoutExpired:
            return OperationReply(True, "the recording ends when its bag is written")
        self.look()
        if not file.exists():
            return OperationReply(False, "the recorder wrote no bag; the console's log has more")
        return OperationReply(True, f"the bag is written: {file}")

    @staticmethod
    def _wait_for_bag(process: subprocess.Popen[bytes], file: Path, seconds: float) -> None:
        """Waits until a recorder has opened its bag, or has ended, so long at most."""
        end = time.monotonic() + seconds
        while process.poll() is None and not file.exists() and time.monotonic() < end:
            time.sleep(_POLL_SECONDS)

    def look(self) -> None:
        """Forgets recorders that have ended."""
        with self._lock:
            ended = [name for name, one in self._running.items() if one.poll() is not None]
            for name in ended:
                pid = self._running.pop(name).pid
                self._told.discard(pid)
                del self._files[pid]
        for name in ended:
            self._show(name, "")

    def close(self) -> None:
        """Ends all recordings, and waits for them; may be called twice."""
        with self._lock:
            running = list(self._running.values())
            files = dict(self._files)
        end = time.monotonic() + _SECONDS_TO_END
        for process in running:
            self._wait_for_bag(process, files[process.pid], end - time.monotonic())
        with self._lock:
            for process in running:
                self._end(process)
        for process in running:
            try:
                process.wait(max(0.0, end - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        if process.pid not in self._told:
            self._told.add(process.pid)
            process.send_signal(signal.SIGINT)
