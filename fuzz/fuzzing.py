"""Gives a door many inputs, valid and damaged ones, and finds those that it does not stand.

An input is at fault if the door raises something else than its documented errors, an error whose
text is empty, too long or does not say where, or takes more processor time or memory than an input
may. Hypothesis draws the valid inputs; of each one come some that are damaged at random.
"""

from __future__ import annotations

import contextlib
import resource
import signal
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Type

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis.strategies import SearchStrategy, integers

from mutations import mutate
from rosclingo.errors import RosclingoError

SECONDS = 5.0
"""Processor time that an input may take; a busy machine changes it little."""

LONGEST_ERROR = 5000
"""Characters of an error's text."""

_MORE_MEMORY = 2**30  # bytes that a door may take, besides what the process has
_DAMAGED = 19  # inputs that come of a valid one
_REDUCTION_SECONDS = 3.0  # of processor time, in which an input at fault is made smaller
_ROOT = str(Path(__file__).resolve().parents[1])


class Door:
    """A way by which data of strangers get into the product; a context manager.

    Attributes:
        name: Its name on the command line.
        words: What means something to it, by which valid inputs are damaged.
        errors: All that it may raise.
        inputs: How many inputs CI gives it: 10,000, or what takes some seconds.
    """

    name = ""
    words: Sequence[bytes] = ()
    errors: Tuple[Type[Exception], ...] = (RosclingoError,)
    inputs = 10_000

    def __enter__(self) -> Door:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def valid(self) -> SearchStrategy[bytes]:
        """Returns valid inputs."""
        raise NotImplementedError

    def read(self, data: bytes) -> None:
        """Takes an input, as the product does.

        Raises:
            Exception: One of the door's errors: it refuses the input.
            AssertionError: What it has made of the input is wrong.
        """
        raise NotImplementedError

    def check(self, err: Exception) -> None:
        """Checks an error's text.

        Raises:
            AssertionError: It does not say where or what.
        """


class SlowInputError(BaseException):
    """An input has taken too much processor time; no door may catch it."""


@dataclass
class Fault:
    """An input that a door does not stand.

    Attributes:
        data: The input, made smaller.
        reason: The error's traceback.
    """

    data: bytes
    reason: str

    def __str__(self) -> str:
        shown = f"{self.data[:2000]!r}{'...' if len(self.data) > 2000 else ''}"
        return f"{self.reason}\ninput of {len(self.data)} bytes: {shown}"


@dataclass
class FuzzReport:
    """The outcome of inputs.

    Attributes:
        taken: How many the door has taken.
        refused: How many it has refused.
        seconds: Processor time.
        slowest: That of the slowest input.
        faults: The faults, one for each place in the code.
    """

    taken: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    faults: Dict[str, Fault] = field(default_factory=dict)

    @property
    def inputs(self) -> int:
        """How many inputs there were."""
        return self.taken + self.refused


def fuzz(
    door: Door, number: int, first: int, seen: Callable[[bytes], None] = lambda _: None
) -> FuzzReport:
    """Gives a door inputs.

    Args:
        door: The door, which is open.
        number: How many inputs, or some more.
        first: The seed; the same one gives the same inputs.
        seen: Called before each input.
    """
    report = FuzzReport()

    @seed(first)
    @settings(
        max_examples=max(1, number // (_DAMAGED + 1)),
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(door.valid(), integers(0, 2**32))
    def give(valid: bytes, chance: int) -> None:
        draw = Random(chance)
        data = valid
        for count in range(_DAMAGED + 1):
            if count:
                origin = data if draw.randrange(3) == 0 else valid
                data = mutate(origin, draw, door.words, draw.choice((1, 1, 2, 4)))
            seen(data)
            _try(door, data, report)

    began = time.process_time()
    give()
    report.seconds = time.process_time() - began
    return report


def _try(door: Door, data: bytes, report: FuzzReport) -> None:
    began = time.process_time()
    found = _fault(door, data, report)
    report.slowest = max(report.slowest, time.process_time() - began)
    if found is None or found[0] in report.faults:
        return
    key, reason = found
    is_slow = key.startswith((SlowInputError.__name__, MemoryError.__name__))
    report.faults[key] = Fault(data if is_slow else _reduced(door, data, key), reason)


def _fault(door: Door, data: bytes, report: FuzzReport) -> Optional[Tuple[str, str]]:
    """Returns the key of a fault, and its traceback; None if the door stands the input."""
    try:
        with _limited():
            door.read(data)
        report.taken += 1
    except door.errors as err:
        report.refused += 1
        try:
            text = str(err)
            assert text.strip(), "an error without a text"
            assert len(text) <= LONGEST_ERROR, f"an error of {len(text)} characters"
            door.check(err)
        except Exception as wrong:
            return _key(wrong, err), _traceback(wrong)
    except (Exception, SlowInputError) as err:
        report.refused += 1
        return _key(err, err), _traceback(err)
    return None


def _traceback(err: BaseException) -> str:
    lines = traceback.format_exception(type(err), err, err.__traceback__)
    return "".join(lines if len(lines) < 20 else [*lines[:6], "  ...\n", *lines[-6:]])[-4000:]


def _key(err: BaseException, place: BaseException) -> str:
    """Returns the kind of an error and the last line of the product that has to do with it."""
    frames = traceback.extract_tb(place.__traceback__)
    ours = [one for one in frames if one.filename.startswith(_ROOT)] or list(frames)
    return f"{type(err).__name__} {ours[-1].filename}:{ours[-1].lineno}"


def _reduced(door: Door, data: bytes, key: str) -> bytes:
    """Returns a shorter input with the same fault."""
    size, end = len(data) // 2, time.process_time() + _REDUCTION_SECONDS
    while size:
        begin = 0
        while begin < len(data):
            if time.process_time() > end:
                return data
            shorter = data[:begin] + data[begin + size :]
            found = _fault(door, shorter, FuzzReport())
            if found is not None and found[0] == key:
                data = shorter
            else:
                begin += size
        size //= 2
    return data


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """A context that ends by an error if it takes too much processor time."""
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


@contextlib.contextmanager
def limits() -> Iterator[None]:
    """A context in which inputs that take too much time or memory are faults; main thread only."""

    def stop(number: int, frame: Optional[FrameType]) -> None:
        raise SlowInputError(f"more than {SECONDS} s of processor time")

    handler: Any = signal.signal(signal.SIGPROF, stop)
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = pages * resource.getpagesize() + _MORE_MEMORY
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
        signal.signal(signal.SIGPROF, handler)


def faults_of(reports: Sequence[FuzzReport]) -> List[Fault]:
    """Returns the faults of some reports, one for each place."""
    found: Dict[str, Fault] = {}
    for report in reports:
        found.update(report.faults)
    return list(found.values())
