"""Runs the process that answers questions, supervises it, and restarts it.

clingo cannot be interrupted while it grounds, and a thread of this process would hold up the others
even so. The other process gives way to everything else (:mod:`.serving`).
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from multiprocessing import Pipe
from typing import Callable, Iterator, Optional, Sequence

from rosoclingo.why.question import MORE_TIME, ReplyStatus, WhyReply, read_reply
from rosoclingo.why.serving import LOWEST, READY
from rosoclingo.why.task import QuestionTask

_COMMAND = (sys.executable, "-m", "rosoclingo.why.serving")
_SECONDS_TO_START = 30.0  # it gets only idle time
_SECONDS_MORE = 1.0  # than the answer may take, until the process is ended
_SECONDS_TO_END = 0.5  # so long after it has closed its socket
_LONGEST_REPLY = 2**26  # bytes

CLOSED = WhyReply(ReplyStatus.UNANSWERED, "the node is shutting down")
"""The reply to a question that comes after :meth:`AnsweringProcess.close`."""

CANCELED = WhyReply(ReplyStatus.UNANSWERED, "another question came first")
"""The reply to a background question while a client waits."""


class AnsweringProcess:
    """A worker process that answers one question after the other.

    It is started with the first question, and again if it has ended or had to be ended. One thread
    asks; all may use :meth:`rest`, :meth:`client_waits` and :meth:`close`.
    """

    def __init__(
        self,
        warn: Callable[[str], None],
        *,
        nice: int = LOWEST,
        command: Sequence[str] = _COMMAND,
        seconds_to_start: float = _SECONDS_TO_START,
        seconds_more: float = _SECONDS_MORE,
    ) -> None:
        """Prepares; the first question starts the process.

        Args:
            warn: Called with what has gone wrong.
            nice: How much the process gives way to others, see :func:`.serving.give_way`.
            command: Starts the process; the number of its socket and the nice value are added.
            seconds_to_start: How long it may take until it can answer.
            seconds_more: For how much longer than an answer may take it is waited for.
        """
        self._warn = warn
        self._nice = nice
        self._command = tuple(command)
        self._seconds_to_start = seconds_to_start
        self._seconds_more = seconds_more
        self._child: Optional[_Child] = None
        self._is_closed = False
        self._lock = threading.Lock()  # guards these two; held while a process is made
        self._rests = False
        self._asked: Optional[_Child] = None  # whom a question was put to
        self._is_background = False  # that question
        self._clients = 0  # that wait
        self._rest_lock = threading.Lock()  # guards these four; held for moments only

    def rest(self, rests: bool) -> None:
        """Pauses or resumes the process if it computes an answer. Thread-safe, does not block."""
        with self._rest_lock:
            if rests is not self._rests:
                self._rests = rests
                if self._asked is not None:
                    self._asked.rest(rests)

    def ask(self, task: QuestionTask, *, is_background: bool = False) -> WhyReply:
        """Sends a question to the process, and waits for the reply; raises nothing.

        Args:
            task: The question.
            is_background: Whether it gives way to clients: the reply is CANCELED if one waits.
        """
        with self._rest_lock:
            self._is_background = is_background
            if is_background and self._clients:
                return CANCELED
        try:
            return self._ask(task)
        finally:
            self._ask_to(None)

    @contextlib.contextmanager
    def client_waits(self) -> Iterator[None]:
        """A context in which a client waits, so that background questions are cancelled."""
        with self._rest_lock:
            self._clients += 1
            self._give_way()
        try:
            yield
        finally:
            with self._rest_lock:
                self._clients -= 1

    def _give_way(self) -> None:
        """Cancels a background question if a client waits; called with the lock."""
        if self._asked is not None and self._is_background and self._clients:
            self._asked.cancel()

    def _ask_to(self, child: Optional[_Child]) -> None:
        """Sets the process that computes an answer, and pauses it if requested."""
        with self._rest_lock:
            if self._asked is not None and self._rests:
                self._asked.rest(False)
            self._asked = child
            if child is not None and self._rests:
                child.rest(True)
            self._give_way()

    def _ask(self, task: QuestionTask) -> WhyReply:
        old = child = self._child
        if old is not None and old.has_ended():
            return self._ask_another(old, task)
        try:
            if child is None:
                child = self._start()
                if child is None:
                    return CLOSED
                self._ask_to(child)
                if child.ask(None, self._seconds_to_start) != READY:
                    raise ValueError("it is no process that answers")
                child.may_rest = True
            self._ask_to(child)
            # The shortest ways: the node's other threads wait for this one.
            return read_reply(child.ask(pickle.dumps(task), task.seconds + self._seconds_more))
        except (OSError, EOFError, TypeError, ValueError) as err:
            is_ended = isinstance(err, (OSError, EOFError))
            if old is not None and is_ended and not (old.is_late or old.is_canceled):
                return self._ask_another(old, task)  # it was about to end when it was asked
            return self._give_up(child, err, task)

    @property
    def pid(self) -> Optional[int]:
        """The process; None if there is none now."""
        child = self._child
        return None if child is None else child.process.pid

    def close(self) -> None:
        """Ends the process, and cancels its question. Thread-safe."""
        with self._lock:
            self._is_closed = True
            if self._child is not None:
                self._child.end()

    def _start(self) -> Optional[_Child]:
        with self._lock:
            if not self._is_closed:
                self._child = _Child(self._command, self._nice)
            return self._child

    def _ask_another(self, old: _Child, task: QuestionTask) -> WhyReply:
        """Asks a new process in place of one that ends by itself."""
        old.end(_SECONDS_TO_END)
        with self._lock:
            self._child = None
            if self._is_closed:
                return CLOSED
        self._warn(f"the process that answers questions has ended{old.how()}; another starts")
        return self._ask(task)

    def _give_up(self, child: Optional[_Child], err: Exception, task: QuestionTask) -> WhyReply:
        """Ends a process that answers wrongly."""
        if child is not None and not child.is_late:
            child.end(_SECONDS_TO_END)
        with self._lock:
            self._child = None
            if self._is_closed:
                return CLOSED
        if child is not None and child.is_canceled:
            return CANCELED
        if child is None:
            reason = f"the process that answers cannot be started: {err}"
        elif child.is_late:
            reason = (
                f"there was no answer within {task.seconds:g} s; the process that looks for it has "
                f"no time on this machine, or grounds a large program, and was ended; {MORE_TIME}"
            )
        elif isinstance(err, (TypeError, ValueError)):
            reason = f"the process that looks for the answer sends what nobody can read: {err}"
        else:
            reason = f"the process that looks for the answer has ended{child.how()}"
        self._warn(f"why {task.question}: {reason}; the next question starts another one")
        is_late = child is not None and child.is_late
        return WhyReply(ReplyStatus.UNANSWERED, reason, is_late=is_late)


class _Child:
    """A child process, and the socket to it.

    Attributes:
        process: The process.
        is_late: Whether it was ended because it took too long.
        is_canceled: Whether it was ended because its answer is not wanted now.
        may_rest: Whether it can be paused. While it starts, it would stay paused for ever if this
            process were killed.
    """

    may_rest = False

    def __init__(self, command: Sequence[str], nice: int) -> None:
        self._connection, other = Pipe()
        with other:
            self.process = subprocess.Popen(  # noqa: S603 (the node's own command)
                [*command, str(other.fileno()), str(nice)],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                cwd="/",  # the first place where it looks for modules
                env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                start_new_session=True,  # so that it gives way, and Ctrl-C does not reach it
            )
        self.is_late = self.is_canceled = False

    def cancel(self) -> None:
        """Ends the process, as its answer is not wanted now."""
        self.is_canceled = True
        self.process.kill()

    def ask(self, message: Optional[bytes], seconds: float) -> bytes:
        """Sends a message, if there is one, and returns the next one received.

        Raises:
            OSError: The process has ended, or was ended because it took too long.
            EOFError: The process has ended, or was ended because it took too long.
        """
        timer = threading.Timer(seconds, self._end_late)
        timer.daemon = True
        timer.start()
        try:
            if message is not None:
                self._connection.send_bytes(message)
            return self._connection.recv_bytes(_LONGEST_REPLY)
        finally:
            timer.cancel()

    def rest(self, rests: bool) -> None:
        """Pauses or resumes the process; does nothing to one that has ended."""
        if self.may_rest:
            self.process.send_signal(signal.SIGSTOP if rests else signal.SIGCONT)

    def has_ended(self) -> bool:
        """Returns whether the process has ended."""
        return self.process.poll() is not None

    def how(self) -> str:
        """Returns words for the way in which it has ended."""
        status = self.process.returncode
        if status is not None and status < 0:
            return f" by {signal.Signals(-status).name}"
        return f" with exit status {status}"

    def end(self, seconds: float = 0.0) -> None:
        """Ends the process, unless it ends by itself within a time. Thread-safe."""
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()  # does nothing to one that has ended meanwhile
            self.process.wait()

    def _end_late(self) -> None:
        self.is_late = True
        self.end()
