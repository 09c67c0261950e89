"""Threads with a stack that is deep enough for clingo.

clingo recurses over terms and syntax trees without a bound, and writes a term that nests 700,000
deep, which a short program can make, with 160 bytes of stack for each level.
"""

from __future__ import annotations

import threading

STACK_BYTES = 2**30
"""Address space of a stack; only what is used is ever resident."""

_LEAST = 2**26


def start(thread: threading.Thread, size: int = STACK_BYTES) -> None:
    """Starts a thread with a stack of this size, or of what the process's limits leave for it.

    Raises:
        RuntimeError: The system starts no more threads.
    """
    old = threading.stack_size(size)
    try:
        thread.start()
    except RuntimeError:  # of ``ulimit -v``, or of a system that promises no memory it has not
        if size <= _LEAST:
            raise
        start(thread, size // 2)
    finally:
        threading.stack_size(old)
