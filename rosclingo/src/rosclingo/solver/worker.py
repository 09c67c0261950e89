"""Runs all requests in one thread, which owns the solver; newer requests preempt solve calls.

Requests run in order of arrival. A control request ends every solve call that is open, as the
manual has it, and so does a newer solve call (docs/protocol.md, section "Solving").
"""

from __future__ import annotations

import enum
import logging
import queue
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Callable, List, Optional, Sequence, Tuple, Union

from rosclingo.errors import OutOfMemoryError, SolverError, report
from rosclingo.solver.engine import Engine
from rosclingo.solver.memory import is_out_of_memory, out_of_memory
from rosclingo.wire import commands as wire

_LOG = logging.getLogger("rosout")

OUT_OF_MEMORY = "memory"
"""The command of a failure outside of every command: memory ran out, and the solver is dropped."""

RESTARTED = "restart"
"""The command of a failure outside of every command: the last restart was not the caller's own."""


class Stop(enum.Enum):
    """Why a solve call is to end early; its value is said to the client."""

    CANCELED = "canceled on request"
    REPLACED = "ended by a newer goal"
    CONTROL = "ended by a control request"
    SHUTDOWN = "the node is shutting down"


SHUTTING_DOWN = wire.Failure("commands", -1, Stop.SHUTDOWN.value)
"""The failure of a control request that a solver gets while it ends."""


@dataclass(frozen=True)
class Caller:
    """The client of a request.

    Attributes:
        name: Its name.
        only_own_restarts: Whether its requests are refused, but for a restart, unless the
            last restart was its own: what it has told the solver is gone then.
    """

    name: str = ""
    only_own_restarts: bool = False


_ANYBODY = Caller()


class Job:
    """A solve call and how its client learns of it; subclasses say the latter.

    The callbacks run in a thread of the worker, :meth:`started` first and one of :meth:`finished`
    and :meth:`failed` last. A job that was told to stop before its turn never starts.

    Attributes:
        assumptions: What to assume.
        caller: Who has asked for it.
        reason: Why the call was asked to end; None as long as it was not.
        ended_by: The name of the client that has asked for that; empty if it is not known.
        begun: Whether it is the job's turn.
        ended: Whether the worker is through with the job.
    """

    def __init__(self, assumptions: Sequence[wire.Assumed], caller: Caller = _ANYBODY) -> None:
        self.assumptions = tuple(assumptions)
        self.caller = caller
        self.reason: Optional[Stop] = None
        self.ended_by = ""
        self.begun = False
        self.ended = False

    def stop(self, reason: Stop, by: str = "") -> None:
        """Asks the call to end. Thread-safe, returns at once; the first reason counts.

        Args:
            reason: Why it is to end.
            by: The name of the client that wants it; empty if it is not known.
        """
        if self.reason is None:
            self.ended_by, self.reason = by, reason

    def stopped(self) -> bool:
        """Returns whether the call was told to stop."""
        return self.reason is not None

    def started(self) -> None:
        """The search begins."""

    def improved(self, improvement: wire.Improvement) -> None:
        """A better model was found while optimising."""

    def finished(self, outcome: wire.Outcome) -> None:
        """The search ended; ``outcome.interrupted`` tells whether ``reason`` ended it."""

    def failed(self, message: str) -> None:
        """The search was not possible."""


_Control = Tuple[Sequence[wire.Command], Caller, "Future[wire.Reply]"]


class Worker:
    """Runs control requests and solve calls on an engine, in a thread of its own.

    All methods are thread-safe. ``_lock`` guards ``_open`` and ``_closing``; it is held for the
    time of a list operation only, and no callback runs under it.
    """

    def __init__(
        self, engine: Engine, out_of_memory: Callable[[str], None] = lambda _: None
    ) -> None:
        """Starts the threads.

        Args:
            engine: The engine.
            out_of_memory: Called with the reason in the worker's thread when memory has run out,
                before the client learns of it.
        """
        self._engine = engine
        self._out_of_memory = out_of_memory
        self._requests: queue.Queue[Union[_Control, Job, None]] = queue.Queue()
        self._lock = threading.Lock()
        self._open: List[Job] = []
        self._stopped: queue.Queue[Optional[Job]] = queue.Queue()
        self._closing = False
        self._restarted_by: Optional[str] = None  # who was the last; only the thread uses it
        self._thread = threading.Thread(target=self._run, name="solver", daemon=True)
        self._thread.start()
        threading.Thread(target=self._end_stopped, name="recall", daemon=True).start()

    def control(self, commands: Sequence[wire.Command], caller: Caller = _ANYBODY) -> wire.Reply:
        """Ends open solve calls, runs the commands in order and returns when they are through."""
        reply: Future[wire.Reply] = Future()
        with self._lock:
            if self._closing:
                return wire.Reply(failure=SHUTTING_DOWN)
            self._stop_open(Stop.CONTROL, caller.name)
            self._requests.put((commands, caller, reply))
        return reply.result()

    def solve(self, job: Job) -> None:
        """Ends open solve calls and queues this one; returns at once."""
        with self._lock:
            if not self._closing:
                self._stop_open(Stop.REPLACED, job.caller.name)
                self._open.append(job)
                self._requests.put(job)
                return
        job.stop(Stop.SHUTDOWN)
        self._run_job(job)  # in the caller's thread, because the worker's may have ended

    def cancel(self, job: Job, by: str = "") -> None:
        """Ends a solve call; returns at once, and may be called under any lock.

        Args:
            job: The call.
            by: The name of the client that wants it; empty if it is not known.
        """
        job.stop(Stop.CANCELED, by)
        self._stopped.put(job)

    def close(self) -> None:
        """Ends open solve calls and lets the thread end after what is queued; returns at once."""
        with self._lock:
            self._closing = True
            self._stop_open(Stop.SHUTDOWN)
            self._requests.put(None)
            self._stopped.put(None)

    @property
    def waiting(self) -> int:
        """How many requests wait for their turn, about."""
        return self._requests.qsize()

    def join(self, timeout: float) -> bool:
        """Waits for the thread to end.

        Args:
            timeout: Longest time to wait, in seconds.

        Returns:
            Whether it has ended; it may not, because clingo cannot be interrupted while grounding.
        """
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _stop_open(self, reason: Stop, by: str = "") -> None:
        for job in self._open:
            job.stop(reason, by)
            self._stopped.put(job)

    def _end_stopped(self) -> None:
        """Ends the jobs that were told to stop before they began.

        The solver's thread may be busy for long, because clingo cannot be interrupted while it
        grounds.
        """
        while True:
            job = self._stopped.get()
            if job is None:
                return
            with self._lock:
                early = job in self._open and not job.begun
                if early:
                    self._open.remove(job)
            if early:
                self._run_job(job)

    def _run(self) -> None:
        while True:
            request = self._requests.get()
            if request is None:
                return
            if isinstance(request, Job):
                with self._lock:
                    if request not in self._open:
                        continue
                    request.begun = True
                self._run_job(request)
                with self._lock:
                    self._open.remove(request)
            else:
                commands, caller, reply = request
                reply.set_result(self._run_commands(commands, caller))

    def _run_commands(self, commands: Sequence[wire.Command], caller: Caller) -> wire.Reply:
        if self._closing:
            return wire.Reply(failure=SHUTTING_DOWN)
        restarts = [i for i, one in enumerate(commands) if isinstance(one, wire.Restart)]
        if not restarts:
            try:
                self._check_restarts(caller)
            except SolverError as err:
                return wire.Reply(failure=wire.Failure(RESTARTED, -1, str(err)))
        try:
            reply = self._engine.run(commands)
        except OutOfMemoryError as err:
            self._out_of_memory(str(err))
            return wire.Reply(failure=wire.Failure(OUT_OF_MEMORY, -1, str(err)))
        if restarts and (reply.failure is None or reply.failure.index > restarts[0]):
            self._restarted_by = caller.name
        return reply

    def _check_restarts(self, caller: Caller) -> None:
        if not caller.only_own_restarts or caller.name == self._restarted_by:
            return
        who = "it was started again"
        if self._restarted_by is not None:
            who = f"{self._restarted_by or 'somebody'} has restarted it"
        raise SolverError(f"{who}, so that nothing is left of what was said; begin with a restart")

    def _run_job(self, job: Job) -> None:
        try:
            if job.stopped():
                outcome = wire.Outcome(wire.Result.UNKNOWN, interrupted=True)
            else:
                self._check_restarts(job.caller)
                job.started()
                outcome = self._engine.solve(job.assumptions, job.stopped, job.improved)
            job.finished(outcome)
        except Exception as err:  # a bug must not end the node: the client learns of it
            if is_out_of_memory(err):  # to send what was found
                err = out_of_memory("answering")
            if isinstance(err, OutOfMemoryError):
                self._out_of_memory(str(err))
            try:
                job.failed(report(err, "while solving"))
            except Exception:
                _LOG.exception("internal error while telling the client of an error")
        job.ended = True
