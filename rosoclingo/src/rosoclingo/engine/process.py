"""Runs the search in a process of its own, in the background.

:func:`prepare_search` starts the process of the next search in advance, so that the search itself
need not wait until Python and its modules are there.
"""

import atexit
import contextlib
import marshal
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple, Union

from rosoclingo import engine
from rosoclingo.engine.flat import FlatTask
from rosoclingo.engine.worker import LENGTH_BYTES, SearchEnd
from rosoclingo.errors import SearchProcessError

_WORKER = str(Path(__file__).with_name("worker.py"))
_MOMENT_SECONDS = 0.15  # of work
_SPARE_SECONDS = 5  # of processor time, beside the search; a search ends itself before


def _command() -> List[str]:
    """Returns the command of the process.

    Raises:
        SearchProcessError: The search is not compiled, and Cython is not installed.
    """
    cython = ""
    compiled = find_spec("rosoclingo.engine.search")
    if compiled is None or (compiled.origin or "").endswith(".py"):
        found = find_spec("cython")
        if found is None or found.origin is None:
            raise SearchProcessError(
                "the search for plans is not compiled: build the workspace, or install Cython in "
                "the Python of the node"
            )
        cython = str(Path(found.origin).parent)
    return [sys.executable, "-I", "-S", _WORKER, str(os.getpid()), cython, *engine.__path__]


class Spare:
    """Holds the process of the next search, which waits for its task. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: Optional[subprocess.Popen[bytes]] = None
        self._parent = 0  # who has started it; after a fork, the child has none

    @property
    def pid(self) -> Optional[int]:
        """The number of the process; None without one."""
        process = self._process
        return None if process is None else process.pid

    def fill(self) -> None:
        """Starts a process, unless there is one."""
        with self._lock:
            if self._process is None or self._parent != os.getpid():
                self._process, self._parent = _start(), os.getpid()

    def take(self) -> "Optional[subprocess.Popen[bytes]]":
        """Returns the process; None if there is none, or if it has ended."""
        with self._lock:
            process, self._process = self._process, None
            is_mine = self._parent == os.getpid()
        return process if process is not None and is_mine and process.poll() is None else None

    def end(self) -> None:
        """Ends the process."""
        process = self.take()
        if process is not None:
            process.kill()
            process.communicate()


_SPARE = Spare()
atexit.register(_SPARE.end)


def prepare_search() -> None:
    """Starts the process of the next search, unless it is there. Thread-safe.

    It waits for its task, and ends at the latest when this process ends. Nothing happens if it
    cannot be started: the search says why.
    """
    with contextlib.suppress(OSError, SearchProcessError):
        _SPARE.fill()


def _start() -> "subprocess.Popen[bytes]":
    """Starts a process that waits for its task.

    Raises:
        OSError: It cannot be started.
        SearchProcessError: The search is not compiled, and Cython is not installed.
    """
    return subprocess.Popen(  # noqa: S603 (this package's program)
        _command(),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # so that Ctrl-C does not reach it
    )


def _read(read: Callable[[int], bytes]) -> Union[str, List[int], Tuple[int, ...]]:
    """Reads a record; :attr:`SearchEnd.LOST` after the last one, if that is not the reason."""
    size = int.from_bytes(read(LENGTH_BYTES), "little")
    data = read(size)
    if not size or len(data) < size:
        return SearchEnd.LOST
    return marshal.loads(data)  # noqa: S302 (of our process)


class SearchProcess:
    """A search that begins at once. Thread-safe.

    It ends at the latest when this process ends.
    """

    def __init__(
        self,
        task: FlatTask,
        *,
        seconds: float,
        improve_seconds: float,
        bytes: int,  # noqa: A002
        plan: Optional[Sequence[int]] = None,
        standing: Optional[Tuple[List[int], List[List[int]]]] = None,
        improve_evaluations: Optional[int] = None,
    ) -> None:
        """Starts the process, or takes the one that was started in advance.

        Args:
            task: The task.
            seconds: Processor time of the search for a first plan.
            improve_seconds: Processor time of the search for better plans, after the first.
            bytes: Address space that the process may have.
            plan: A plan that is known, so that only better ones are searched for.
            standing: What better plans keep of that one, if anything: ``names`` and ``begun`` of
                :class:`~rosoclingo.engine.standing.Standing`.
            improve_evaluations: How many states that search may look at; None for as many as the
                search for the first plan, or for none if that has taken more than a moment.

        Raises:
            OSError: The process cannot be started.
            SearchProcessError: The search is not compiled, and Cython is not installed.
        """
        self._lock = threading.Lock()
        self._gone = threading.Event()
        self._plans: List[List[int]] = []
        self._partial: Tuple[int, ...] = ()
        self._why_ended = ""
        self._is_closing = False
        self._seconds = 0.0
        self._began = time.monotonic()
        known = None if plan is None else list(plan)
        options = {
            "seconds": seconds,
            "improve_seconds": improve_seconds,
            "improve_evaluations": improve_evaluations,
            "moment": task.evaluations(_MOMENT_SECONDS),
            "plan": known,
            "standing": standing,
        }
        self._input = marshal.dumps((tuple(task), options))
        self._process = _SPARE.take() or _start()
        most = int(seconds + improve_seconds) + _SPARE_SECONDS
        with contextlib.suppress(ProcessLookupError):  # it has ended already
            resource.prlimit(self._process.pid, resource.RLIMIT_CPU, (most, most + 1))
            resource.prlimit(self._process.pid, resource.RLIMIT_AS, (bytes, bytes))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        assert self._process.stdin
        assert self._process.stdout
        with contextlib.suppress(OSError), self._process.stdin as stdin:
            stdin.write(self._input)
        self._input = b""
        reason = ""
        with self._process.stdout as stdout:
            while not reason:
                record = _read(stdout.read)
                if isinstance(record, str):
                    reason = record
                elif isinstance(record, tuple):
                    self._partial = record
                else:
                    with self._lock:
                        self._plans.append(record)
        self._end(reason)

    def _end(self, reason: str) -> None:
        """Waits for the end of the process, and notes the reason and the processor time."""
        os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOWAIT)
        with self._lock:  # so that close does not kill another process of this number
            _, status, usage = os.wait4(self._process.pid, 0)
            signaled = os.WIFSIGNALED(status)
            code = -os.WTERMSIG(status) if signaled else os.WEXITSTATUS(status)
            self._process.returncode = code
            self._seconds = usage.ru_utime + usage.ru_stime
            if reason == SearchEnd.LOST and code == -signal.SIGXCPU:
                reason = SearchEnd.OUT_OF_TIME
            elif reason == SearchEnd.LOST and self._is_closing:
                reason = SearchEnd.CLOSED
            self._why_ended = reason
            self._gone.set()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def has_ended(self) -> bool:
        """True once the process has ended, with or without a plan."""
        return self._gone.is_set()

    def wait(self, seconds: float) -> bool:
        """Waits until the process has ended, for some time at most; tells whether it has."""
        return self._gone.wait(seconds)

    @property
    def why_ended(self) -> str:
        """The reason for the end.

        A constant of :class:`~rosoclingo.engine.worker.SearchEnd`; empty while the process runs.
        """
        return self._why_ended

    @property
    def plans_found(self) -> int:
        """The number of plans until now, each better than those before."""
        return len(self._plans)

    def latest(self) -> Optional[List[int]]:
        """Returns the indices of the best plan's actions; None without a plan."""
        with self._lock:
            return list(self._plans[-1]) if self._plans else None

    @property
    def partial(self) -> Tuple[int, ...]:
        """A plan that meets some of the requests, found before one for all; empty without one."""
        return self._partial

    @property
    def seconds(self) -> float:
        """The processor time that the process has used, also for its start, in seconds."""
        with self._lock:
            if not self._gone.is_set():
                stat = Path(f"/proc/{self._process.pid}/stat").read_text()
                ticks = stat.rpartition(")")[2].split()[11:13]
                self._seconds = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
            return self._seconds

    def has_used(self, seconds: float) -> bool:
        """Tells whether it has used more processor time than that.

        It has not as long as less time has passed at all, so that nothing has to be read then.
        """
        return time.monotonic() - self._began > seconds and self.seconds > seconds

    def close(self) -> None:
        """Ends the process. May be called several times."""
        with self._lock:
            self._is_closing = True
            if not self._gone.is_set():
                os.kill(self._process.pid, signal.SIGKILL)
        self._thread.join()
