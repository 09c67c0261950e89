"""Profiles ``plan.py``: the option ``--profile``."""

from __future__ import annotations

import os
import signal
import socket
import threading
from types import FrameType
from typing import Callable, Dict, Optional

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.terminal import ProgressPrinter
from rosoclingo.tools.profile.advice import advise
from rosoclingo.tools.profile.counting import CountingEngine, Counts, Steps, VariableValues, count
from rosoclingo.tools.profile.marking import Statement
from rosoclingo.tools.profile.measuring import MeasuredEngine, SolverTrace
from rosoclingo.tools.profile.text import Profile, largest

_INTERRUPTED = 128 + signal.SIGINT  # exit status of a process that Ctrl-C ends


class Profiler:
    """Measures one planner.

    Attributes:
        trace: What the planner's solver does.
    """

    def __init__(self, options: Options) -> None:
        """Prepares; measures from when the planner is made.

        Args:
            options: The planner's command line.
        """
        self._options = options
        self.trace = SolverTrace()

    def make_engine(self, options: Options, *, log: Callable[[str], None]) -> Engine:
        """Makes the planner's solver."""
        return MeasuredEngine(options, self.trace, log=log)

    def profile(self) -> Profile:
        """Counts ground instances, and advises; reports its progress."""
        trace, place = self.trace, ["counting"]
        with ProgressPrinter(lambda: place[0]):
            counts, engine = count(self._options, trace, lambda text: place.__setitem__(0, text))
            place[0] = "looking where most goes"
            values = {
                number: _values(counts, engine, counts.statements[number], counts.instances[number])
                for number in largest(counts)
            }
            advice = advise(
                counts, trace, lambda statement, steps: _values(counts, engine, statement, steps)
            )
        return Profile(trace, counts, values, advice)


def _values(
    counts: Counts, engine: CountingEngine, statement: Statement, steps: Steps
) -> Dict[str, VariableValues]:
    """Returns the values of the variables of a statement, in its busiest step."""
    found: Dict[str, VariableValues] = {}
    step = counts.busiest(steps) if statement.parameters else None
    for marker in statement.markers:
        for name, values in engine.values(marker, step).items():
            if name not in found or values.number > found[name].number:
                found[name] = values
    return found


class BlockTimeLimit:
    """A context that ends its block after some time, or by Ctrl-C.

    A second Ctrl-C ends the process at once. To be used in the main thread.

    Attributes:
        is_over: Whether it has ended something, and did not just wait for its end.
    """

    def __init__(self, seconds: float, end: Callable[[], None]) -> None:
        """Prepares a time limit.

        Args:
            seconds: After how long; 0 for never.
            end: Ends it; called in another thread.
        """
        self.is_over = False
        self._seconds = seconds
        self._end = end
        # A handler in Python would wait until clingo's search is over: a byte does not.
        self._read, self._write = socket.socketpair()
        self._write.setblocking(False)
        self._thread = threading.Thread(target=self._wait, name="time limit", daemon=True)

    def __enter__(self) -> BlockTimeLimit:
        self._handler = signal.signal(signal.SIGINT, _ignore)
        self._before = signal.set_wakeup_fd(self._write.fileno(), warn_on_full_buffer=False)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        signal.set_wakeup_fd(self._before)
        signal.signal(signal.SIGINT, self._handler)
        self._write.close()
        self._thread.join()
        self._read.close()

    def _wait(self) -> None:
        self._read.settimeout(self._seconds or None)
        try:
            if not self._read.recv(1):
                return
        except socket.timeout:
            pass
        self.is_over = True
        self._end()
        self._read.settimeout(None)
        if self._read.recv(1):
            os._exit(_INTERRUPTED)


def _ignore(number: int, frame: Optional[FrameType]) -> None:
    """Does nothing: the byte that the signal has written says it."""
