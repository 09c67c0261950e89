"""Runs the search in a process of its own, in the background."""

import contextlib
import marshal
import os
import resource
import signal
import subprocess
import sys
import threading
from importlib.util import find_spec
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Union

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


def _read(read: Callable[[int], bytes]) -> Union[str, List[int]]:
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
        improve_evaluations: Optional[int] = None,
        on_news: Callable[[], None] = lambda: None,
    ) -> None:
        """Starts the process.

        Args:
            task: The task.
            seconds: Processor time of the search for a first plan.
            improve_seconds: Processor time of the search for better plans, after the first.
            bytes: Address space that the process may have.
            plan: A plan that is known, so that only better ones are searched for.
            improve_evaluations: How many states that search may look at; None for as many as the
                search for the first plan, or for none if that has taken more than a moment.
            on_news: Called by a thread of this object, without a lock, whenever a plan was found,
                and when the process has ended.

        Raises:
            OSError: The process cannot be started.
            SearchProcessError: The search is not compiled, and Cython is not installed.
        """
        self._on_news = on_news
        self._lock = threading.Lock()
        self._plans: List[List[int]] = []
        self._why_ended = ""
        self._is_closing = False
        self._is_gone = False
        self._seconds = 0.0
        known = None if plan is None else list(plan)
        options = {
            "seconds": seconds,
            "improve_seconds": improve_seconds,
            "improve_evaluations": improve_evaluations,
            "moment": task.evaluations(_MOMENT_SECONDS),
            "plan": known,
        }
        self._input = marshal.dumps((tuple(task), options))
        self._process = subprocess.Popen(  # noqa: S603 (this package's program)
            _command(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that Ctrl-C does not reach it
        )
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
                else:
                    with self._lock:
                        self._plans.append(record)
                    self._on_news()
        self._end(reason)
        self._on_news()

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
            self._is_gone = True

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    @property
    def has_ended(self) -> bool:
        """True once the process has ended, with or without a plan."""
        return self._is_gone

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
    def seconds(self) -> float:
        """The processor time that the process has used, in seconds."""
        with self._lock:
            if not self._is_gone:
                stat = Path(f"/proc/{self._process.pid}/stat").read_text()
                ticks = stat.rpartition(")")[2].split()[11:13]
                self._seconds = sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
            return self._seconds

    def close(self) -> None:
        """Ends the process. May be called several times, also from ``on_news``."""
        with self._lock:
            self._is_closing = True
            if not self._is_gone:
                os.kill(self._process.pid, signal.SIGKILL)
        if threading.current_thread() is not self._thread:
            self._thread.join()
