"""Ctrl-C ends a program that has just begun, without a traceback."""

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
