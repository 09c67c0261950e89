"""What the unit tests share."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Callable, List

import pytest
from hypothesis import settings
from waiting import Within

import rosclingo

# How long an example takes says nothing here, because clingo and the garbage collector share it.
settings.register_profile("rosclingo", deadline=None, database=None)
settings.load_profile("rosclingo")


@pytest.fixture
def within() -> Within:
    """A function that calls another and returns its value, but fails if that takes too long."""

    def call(seconds: float, function: Callable[[], Any]) -> Any:
        results: List[Any] = []
        # A daemon, so that a search that does not end cannot hold up the end of the tests.
        thread = threading.Thread(target=lambda: results.append(function()), daemon=True)
        thread.start()
        thread.join(seconds)
        assert not thread.is_alive(), f"not through within {seconds} seconds"
        assert results, "ended with an exception"
        return results[0]

    return call


@pytest.fixture
def run_python() -> Callable[..., str]:
    """A function that runs code in a process of its own, which must live to print something."""

    def run(code: str, stdin: str = "") -> str:
        path = str(Path(rosclingo.__file__).parents[1])
        done = subprocess.run(
            [sys.executable, "-c", code],
            input=stdin,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, f"status {done.returncode}: {done.stderr[-500:]}"
        return done.stdout.strip()

    return run
