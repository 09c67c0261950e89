"""A screen that is nowhere, for programs with windows."""

from __future__ import annotations

import os
import subprocess
from typing import Iterator

import pytest


@pytest.fixture
def screen() -> Iterator[str]:
    """The name of a display of its own, on which OpenGL is drawn by software."""
    reading, writing = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1500x900x24", "-nolisten", "tcp"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    with os.fdopen(reading) as chosen:
        number = chosen.readline().strip()  # empty if the server has ended
    try:
        assert number, "Xvfb does not start"
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()
