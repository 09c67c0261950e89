"""The folder for an encoding's files: it goes with its process, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rosoclingo.encodings.folder import Folder

# Ends when nobody writes to it any more.
MAKE = """
import sys
from rosoclingo.encodings.folder import Folder
print(Folder().path, flush=True)
sys.stdin.read()
"""


def make(*, stays: bool = True) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", MAKE]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    source = subprocess.PIPE if stays else subprocess.DEVNULL
    return subprocess.Popen(
        command, stdin=source, stdout=subprocess.PIPE, text=True, env=environment
    )


def path_of(process: subprocess.Popen[str]) -> Path:
    assert process.stdout is not None
    return Path(process.stdout.readline().strip())


def test_folders_of_other_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    killed, young, alive, ended = make(), make(), make(), make(stays=False)
    try:
        paths = {one: path_of(one) for one in (killed, young, alive, ended)}
        assert ended.wait() == 0
        assert not paths[ended].exists()
        for one in (killed, young):
            os.kill(one.pid, signal.SIGKILL)
            one.wait()
        (paths[killed] / "task.lp").write_text("a.")
        long_ago = time.time() - 3600
        for one in (killed, alive):
            os.utime(paths[one], (long_ago, long_ago))
        folder = Folder()
        left = {paths[young], paths[alive], folder.path}
        assert set(tmp_path.iterdir()) == left
        folder.remove()
        folder.remove()
        assert set(tmp_path.iterdir()) == left - {folder.path}
    finally:
        for one in (killed, young, alive, ended):
            one.kill()
            one.communicate()
