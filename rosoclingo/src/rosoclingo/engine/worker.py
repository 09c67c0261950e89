"""The process that searches: reads a task, writes each plan as soon as it is found.

    python -I -S worker.py PARENT CYTHON FOLDER...

PARENT is the process that reads the plans; the search ends when that has gone. The FOLDERs have the
modules of this package, of which the first one counts, and CYTHON, unless it is empty, is where
uncompiled ones find Cython. Nothing is imported that is not needed, so that the process starts
fast.

Standard input has ``(task, options)``, marshalled, where the task is the tuple of a
:class:`~rosoclingo.engine.flat.FlatTask`. The options are ``seconds``, the processor time of the
search for a first plan, and ``improve_seconds``, that of the search for better ones; ``plan``, one
that is known, so that only better ones are searched for, else None; ``standing``, what these keep
of it, the ``names`` and ``begun`` of :class:`~rosoclingo.engine.standing.Standing`, or None; and
``improve_evaluations``, how many states that search may look at; None for as many as the search for
the first plan, if these are at most ``moment``, and else for none. After ``moment`` states, a
search for all requests is interrupted by one for one after the other.

Standard output has records, each with its length before it, in four bytes with the lowest first. A
record is a marshalled list of the indices of a plan's actions, or a tuple of them if it meets only
some requests; the last one is the reason for the end.
"""

import gc
import sys
from marshal import dumps, loads
from posix import _exit, getppid
from time import process_time

LENGTH_BYTES = 4


class SearchEnd:
    """Reasons for the end of a search."""

    THROUGH = "through"
    """The last plan cannot be improved by more search, or no improvement was asked for."""
    NO_PLAN = "no plan"
    """No plan exists: all states that can be reached have been searched."""
    OUT_OF_TIME = "out of time"
    OUT_OF_MEMORY = "out of memory"
    LOST = "lost"
    """The process was killed, or failed."""
    CLOSED = "closed"
    """The process was ended by its :class:`~rosoclingo.engine.process.SearchProcess`."""


def write(record) -> None:
    """Writes a record."""
    data = dumps(record)
    sys.stdout.buffer.write(len(data).to_bytes(LENGTH_BYTES, "little") + data)
    sys.stdout.buffer.flush()


class Limit:
    """The end of the processor time. Also stops a search whose parent has gone."""

    def __init__(self, parent: int, seconds: float) -> None:
        """Takes the parent's process number, and the processor time from now on, in seconds."""
        self._parent = parent
        self._end = process_time() + seconds

    def __call__(self) -> bool:
        """Tells whether to stop."""
        if getppid() != self._parent:
            sys.exit()
        return process_time() > self._end


def search(task: tuple, options: dict, parent: int) -> str:
    """Searches, and writes the plans.

    Returns:
        The reason for the end.
    """
    from rosoclingo.engine.improving import Improver  # noqa: PLC0415 (as main says)
    from rosoclingo.engine.insertion import inserter_of  # noqa: PLC0415
    from rosoclingo.engine.search import OutOfTimeError, Search  # noqa: PLC0415

    try:
        plan, most = options["plan"], options["improve_evaluations"]
        first = None
        inserter = inserter_of(task)
        if plan is None:
            plan = inserter and inserter.first(Limit(parent, options["seconds"]))
            if plan is not None:
                write(plan)
                if most is None:
                    moment = options["moment"]
                    most = moment if task[9] else min(moment, inserter.evaluations)
        if plan is None:
            first = Search(task, Limit(parent, options["seconds"]))
            plan, is_whole = first.find_soon(options["moment"])
            if not is_whole:
                if plan:
                    write(tuple(plan))
                plan = first.find()
            if plan is None:
                return SearchEnd.NO_PLAN
            write(plan)
            if most is None:
                most = first.evaluations if first.evaluations <= options["moment"] else 0
        if options["improve_seconds"] > 0:
            limit = Limit(parent, options["improve_seconds"])
            standing = options["standing"]
            if standing is not None:
                from rosoclingo.engine.standing import Standing  # noqa: PLC0415

                standing = Standing(plan, [action[5] for action in task[5]], *standing)
            improver = Improver(task, limit, most, first, standing=standing, inserter=inserter)
            improver.improve(plan, write)
    except OutOfTimeError:
        return SearchEnd.OUT_OF_TIME
    except MemoryError:
        return SearchEnd.OUT_OF_MEMORY
    return SearchEnd.THROUGH


def main() -> None:
    """Runs the process."""
    _, parent, cython, *folders = sys.argv
    for name, path in (("rosoclingo", []), ("rosoclingo.engine", folders)):
        package = type(sys)(name)  # instead of packages that import more
        package.__path__ = path
        sys.modules[name] = package
    if cython:
        sys.path.append(cython)
    # What it needs is loaded before the task comes, for which it may wait.
    import rosoclingo.engine.improving  # noqa: PLC0415
    import rosoclingo.engine.insertion  # noqa: PLC0415
    import rosoclingo.engine.search  # noqa: F401, PLC0415

    data = sys.stdin.buffer.read()
    if data:  # else the parent has ended without a task
        gc.disable()  # it would look at the task again and again; a search makes no cycles
        task, options = loads(data)  # noqa: S302 (of the parent)
        write(search(task, options, int(parent)))
        _exit(0)  # to free the memory object by object would take some time


if __name__ == "__main__":
    main()
