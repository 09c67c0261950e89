"""A screen that is nowhere, for programs with windows, and rviz on it."""

from __future__ import annotations

import os
import re
import subprocess
from typing import Callable, Iterator

import pytest
from terminals import Terminal, wait_for

RVIZ_BROKE = re.compile(r"rviz-\d+\] process has died.*exit code -(6|11)")
"""Once in some hundred starts, where OpenGL is drawn by software, rviz breaks its own heap."""


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


def broke(launch: Terminal) -> bool:
    return RVIZ_BROKE.search(launch.output) is not None


def start_with_rviz(
    start: Callable[[], Terminal], is_up: Callable[[], bool], times: int = 3
) -> Terminal:
    """Starts a launch file with rviz, again if rviz breaks, and waits until it is up."""
    launch = start()
    wait_for(lambda: is_up() or broke(launch))
    if not broke(launch):
        return launch
    assert times > 1, f"rviz breaks each time: {launch.output}"
    launch.interrupt()
    launch.wait()
    return start_with_rviz(start, is_up, times - 1)
