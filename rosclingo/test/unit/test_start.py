"""The start of a program: Ctrl-C ends it without a traceback, and garbage is looked for rarely."""

from __future__ import annotations

import signal
import subprocess
import sys


def test_ctrl_c() -> None:
    code = "import rosclingo.start, os, signal; os.kill(os.getpid(), signal.SIGINT)"
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert ended.returncode == -signal.SIGINT
    assert not ended.stderr


def test_garbage_is_looked_for_rarely() -> None:
    """By default, Python would do so more than ten times in this import."""
    code = (
        "import gc, rosclingo.start; before = gc.get_stats()[0]['collections']\n"
        "import rosclingo.solver.engine; print(gc.get_stats()[0]['collections'] - before)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(said.stdout) <= 3
