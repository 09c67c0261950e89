"""Out of memory: how clingo and Python report it, how a client is told, and a reserve for that.

>>> is_out_of_memory(MemoryError("bad_alloc")), is_out_of_memory(RuntimeError("no such option"))
(True, False)
"""

from __future__ import annotations

import contextlib
import mmap
import resource
import threading
from typing import Optional

import clingo

from rosclingo.errors import OutOfMemoryError

_BEGIN = "out of memory"
_RESERVE_BYTES = 2**25  # of addresses: no page of it is ever used
# Of RuntimeErrors: clingo's for C++'s exceptions, and Python's in scripts and for new threads.
_SIGNS = (
    "bad_alloc",
    "MemoryError",
    "can't start new thread",
    "Cannot allocate memory",
    "Resource temporarily unavailable",  # a thread of clingo's has no room
)


def is_out_of_memory(err: BaseException) -> bool:
    """Whether an error of clingo's or Python's says that memory has run out."""
    if isinstance(err, MemoryError):
        return True
    return isinstance(err, RuntimeError) and any(sign in str(err) for sign in _SIGNS)


_PREPARED = threading.local()


class _Reserve:
    """Addresses that are free as soon as memory has run out."""

    def __init__(self) -> None:
        self._pages: Optional[mmap.mmap] = None

    def keep(self) -> None:
        """Takes them, as far as a limit allows."""
        if self._pages is None:
            with contextlib.suppress(OSError, ValueError, MemoryError):
                flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS
                self._pages = mmap.mmap(-1, _RESERVE_BYTES, flags)

    @property
    def is_free(self) -> bool:
        """Whether memory has run out since they were taken last."""
        return self._pages is None

    def free(self) -> None:
        """Gives them back."""
        if self._pages is not None:
            self._pages.close()
            self._pages = None


RESERVE = _Reserve()
"""The reserve of the process, whatever the number of its solvers.

What clingo frees is in pieces, and a new solver, a thread or a message needs larger ones.
"""


def prepare_thread() -> None:
    """Has clingo throw an exception, once in each thread.

    The first one allocates the thread's data of the C++ library. If there is no memory for that,
    glibc ends the process: the first exception must not be the one that says so.
    """
    if not hasattr(_PREPARED, "done"):
        with contextlib.suppress(RuntimeError):
            clingo.parse_term("(", lambda *_: None)
        _PREPARED.done = True


def out_of_memory(doing: str) -> OutOfMemoryError:
    """Returns the error to raise, and frees the reserve.

    Args:
        doing: What ran out of memory, such as ``grounding``.
    """
    RESERVE.free()
    return OutOfMemoryError(
        f"{_BEGIN} while {doing}{_limit()}; ask for less at a time, or give the solver more memory"
    )


def says_out_of_memory(message: str) -> bool:
    """Whether the message of a failure, or of an aborted goal, is that of such an error."""
    return message.startswith(_BEGIN)


def _limit() -> str:
    """Returns words for the limit of this process's memory; none if it has no limit."""
    limits = (resource.RLIMIT_AS, resource.RLIMIT_DATA)
    least = min(
        (soft for soft, _ in map(resource.getrlimit, limits) if soft != resource.RLIM_INFINITY),
        default=None,
    )
    return "" if least is None else f" (the process is limited to {least / 2**20:.0f} MB)"
