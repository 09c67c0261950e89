"""Queues calls of other threads for the simulation's thread."""

from __future__ import annotations

import queue
from concurrent.futures import Future
from typing import Any, Callable, TypeVar

_Returned = TypeVar("_Returned")


class Calls:
    """A queue of calls between two steps. ``run`` is for one thread, the rest is thread-safe."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def submit(self, function: Callable[..., _Returned], *arguments: Any) -> Future[_Returned]:
        """Queues a call; returns at once, and may be called under any lock.

        Returns:
            The future with the function's value, or the error that it raises.
        """
        future: Future[_Returned] = Future()

        def call() -> None:
            try:
                future.set_result(function(*arguments))
            except Exception as err:
                future.set_exception(err)

        self._waiting.put(call)
        return future

    def run(self) -> None:
        """Makes the queued calls, in order of arrival."""
        while not self._waiting.empty():  # this is its only reader
            self._waiting.get()()
