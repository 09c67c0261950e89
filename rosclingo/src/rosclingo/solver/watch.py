"""Watches searches, and interrupts those that are to stop.

clingo can search in a thread of its own, so that its caller may look around in between. For short
searches that thread costs more than all of ROS: it often begins on another core, whose caches know
nothing of the problem. So a search runs in the thread of its caller, and one thread for all of the
process's searches looks around.
"""

from __future__ import annotations

import threading
import time
from typing import Callable, List, Optional

POLL_SECONDS = 0.01
"""How often a search looks whether it is to stop."""


class SearchWatch:
    """A context in which a search is watched.

    Attributes:
        stopped: Whether the search was told to stop.
    """

    def __init__(self, has_to_stop: Callable[[], bool], interrupt: Callable[[], None]) -> None:
        """Prepares a watch of a search.

        Args:
            has_to_stop: Asked now and then, by one thread at a time, and not again when it has
                said True.
            interrupt: Called when that says True, while the context is open: ends the search.
        """
        self.stopped = False
        self._has_to_stop = has_to_stop
        self._interrupt = interrupt
        self._lock = threading.Lock()  # held while it is asked
        self._over = False
        self._error: Optional[Exception] = None

    def __enter__(self) -> SearchWatch:
        _WATCHER.add(self)
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the watch; reraises errors of has_to_stop."""
        _WATCHER.remove(self)
        with self._lock:
            self._over = True
        if self._error is not None:
            raise self._error

    def look(self) -> bool:
        """Returns whether the search is to stop. Thread-safe."""
        with self._lock:
            if not (self._over or self.stopped):
                try:
                    self.stopped = self._has_to_stop()
                except Exception as err:  # the caller's, in whose thread it is raised
                    self._error = err
                    self.stopped = True
                if self.stopped:
                    self._interrupt()  # clingo's, which raises nothing
            return self.stopped


class _Watcher:
    """The thread that watches all searches; it starts with the first."""

    def __init__(self) -> None:
        self._watches: List[SearchWatch] = []
        self._changed = threading.Condition()  # guards the list
        self._begun = False

    def add(self, watch: SearchWatch) -> None:
        with self._changed:
            if not self._begun:
                threading.Thread(target=self._run, name="watch", daemon=True).start()
                self._begun = True
            self._watches.append(watch)
            self._changed.notify()

    def remove(self, watch: SearchWatch) -> None:
        with self._changed:
            self._watches.remove(watch)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._watches)
            time.sleep(POLL_SECONDS)
            self._look()

    def _look(self) -> None:
        """Looks at all searches once; no variable of the thread keeps their solvers."""
        with self._changed:
            watches = list(self._watches)
        for watch in watches:
            watch.look()


_WATCHER = _Watcher()
