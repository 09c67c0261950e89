"""The worker process that answers questions: ``python -m rosoclingo.why.serving FD NICE``.

It gives way to everything else on the machine, so that nothing waits for it: by the nice value 19,
it gets idle time only, and it is the first to be ended if memory is short. It ends with
the process that has started it, however that ends. Both speak through a socket, whose number is FD:
a pickled :class:`.task.QuestionTask` comes, and a :class:`.question.WhyReply` goes as JSON.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import NoReturn

READY = b"ready"
"""The message that the process sends when it is ready."""

LOWEST = 19
"""The nice value with which it runs when no other process wants to."""

_PR_SET_PDEATHSIG = 1  # of linux/prctl.h
_FIRST_TO_END = 1000  # if memory is short


def main() -> NoReturn:
    """Answers questions until the parent process has ended, or memory has run out."""
    connection = Connection(int(sys.argv[1]))
    never_rest_alone()
    give_way(int(sys.argv[2]))
    # To load these takes a while, in which it has to give way already.
    from rosclingo.solver.memory import RESERVE  # noqa: PLC0415 (see above)
    from rosoclingo.why.task import answer  # noqa: PLC0415

    RESERVE.keep()

    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(connection, tasks), name="listen", daemon=True).start()
    connection.send_bytes(READY)
    while True:
        connection.send_bytes(answer(tasks.get()))
        if RESERVE.is_free:  # the next question starts a process with more room
            os._exit(1)


def never_rest_alone() -> None:
    """Resumes this process if its parent ends while it is paused, so that it ends, too."""
    with contextlib.suppress(OSError, AttributeError):  # another system than Linux
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGCONT)


def give_way(nice: int) -> None:
    """Lowers this process's priority, as far as the system allows.

    The process has to be the only one of its session: Linux weighs sessions (autogroups) against
    each other, and priorities count within one of them only.

    Args:
        nice: How much, from 0, as others do, to 19, by which it runs when no other one wants to.
    """
    if nice == LOWEST:
        with contextlib.suppress(OSError, AttributeError):  # another system than Linux
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    os.nice(nice)
    for name, value in (("autogroup", nice), ("oom_score_adj", _FIRST_TO_END)):
        with contextlib.suppress(OSError), open(f"/proc/self/{name}", "w") as file:
            file.write(str(value))


def _listen(connection: Connection, tasks: SimpleQueue[bytes]) -> None:
    """Receives tasks, also while clingo works, so that the end of the parent ends this process."""
    with contextlib.suppress(OSError, EOFError):
        while True:
            tasks.put(connection.recv_bytes())
    os._exit(0)


if __name__ == "__main__":
    main()
