"""Prints progress on stderr while something takes long."""

from __future__ import annotations

import threading
import time
from typing import Callable

from rosoclingo.bags.text import PROGRESS

_SECONDS = 2.0


class ProgressPrinter:
    """A context that prints progress every 2 s."""

    def __init__(self, place: Callable[[], str]) -> None:
        """Prepares the output.

        Args:
            place: Says how far it is; called in another thread.
        """
        self._place = place
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()
        PROGRESS.clear()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._is_over.wait(_SECONDS):
            seconds = time.monotonic() - began
            PROGRESS.show(f"{seconds:.0f} s: {self._place()}")
