"""The process in which questions are answered: ``python -m rosoclingo.why.serving FD``.

It gives way to everything else on the machine, so that nothing waits for it: it gets the time that
nobody wants, and is the first to be ended if memory is short. It ends with the process that has
started it, however that ends. Both speak through a socket, whose number is the argument: a pickled
:class:`.task.Task` comes, and a :class:`.question.Reply` goes as JSON.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import NoReturn

READY = b"ready"
"""What is sent first."""

_LOWEST = 19  # the nice value
_FIRST_TO_END = 1000  # if memory is short


def main() -> NoReturn:
    """Answers until the other process has ended."""
    connection = Connection(int(sys.argv[1]))
    give_way()
    # To load these takes a while, in which it has to give way already.
    from rosoclingo.why.task import answer  # noqa: PLC0415 (see above)

    tasks: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(connection, tasks), name="listen", daemon=True).start()
    connection.send_bytes(READY)
    while True:
        connection.send_bytes(answer(tasks.get()))


def give_way() -> None:
    """Has this process run when no other one wants to, as far as the system knows how.

    The process has to be the only one of its session: Linux weighs sessions (autogroups) against
    each other, and priorities count within one of them only.
    """
    with contextlib.suppress(OSError, AttributeError):  # another system than Linux
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    os.nice(_LOWEST)
    for name, value in (("autogroup", _LOWEST), ("oom_score_adj", _FIRST_TO_END)):
        with contextlib.suppress(OSError), open(f"/proc/self/{name}", "w") as file:
            file.write(str(value))


def _listen(connection: Connection, tasks: SimpleQueue[bytes]) -> None:
    """Takes what comes; also while clingo works, so that this process ends with the other one."""
    with contextlib.suppress(OSError, EOFError):
        while True:
            tasks.put(connection.recv_bytes())
    os._exit(0)


if __name__ == "__main__":
    main()
