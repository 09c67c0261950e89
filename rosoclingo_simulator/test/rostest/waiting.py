"""Waits until something holds that nothing announces."""

from __future__ import annotations

import threading
import time
from typing import Any, Callable

TIMEOUT = 180.0  # seconds of wall time; no more than a bound for what never comes
POLL = 0.01


def wait_for(condition: Callable[[], Any]) -> None:
    end = time.monotonic() + TIMEOUT
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < end, "timeout"
        pause.wait(POLL)
