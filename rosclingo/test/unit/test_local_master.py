"""Processes of one's own; the tests of replays start a master and nodes."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Callable, List, Tuple
from xmlrpc.client import ServerProxy

import pytest

from rosclingo.ros import local_master
from rosclingo.ros.local_master import LocalMaster, Process, ProcessError, end

# Says which signals come, and ends at the one that it is told to end at.
STUBBORN = """
import signal, sys
def on_signal(number, frame):
    print(signal.Signals(number).name, flush=True)
    if signal.Signals(number).name == sys.argv[1]:
        sys.exit(3)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, on_signal)
print("ready", flush=True)
while True:
    signal.pause()
"""


@pytest.fixture(autouse=True)
def little_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    patience = [(number, 1.0) for number, _ in local_master._PATIENCE]
    monkeypatch.setattr(local_master, "_PATIENCE", patience)


def wait_for(condition: Callable[[], bool]) -> None:
    until = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def test_each_process_is_ended_as_gently_as_possible(tmp_path: Path) -> None:
    ends = ("SIGINT", "SIGTERM", "never")
    processes = [
        Process([sys.executable, "-c", STUBBORN, name], tmp_path / name, os.environ)
        for name in ends
    ]
    wait_for(lambda: all("ready" in process.output for process in processes))
    end(processes)
    said: List[Tuple[int, List[str]]] = [
        (process.process.poll(), process.output.split()) for process in processes
    ]
    assert said == [
        (3, ["ready", "SIGINT"]),
        (3, ["ready", "SIGINT", "SIGTERM"]),
        (-9, ["ready", "SIGINT", "SIGTERM"]),
    ]
    end(processes)


def test_what_a_process_has_started_ends_with_it(tmp_path: Path) -> None:
    code = (
        "import subprocess as s; p = s.Popen(['sleep', '99']); print(p.pid, flush=True); p.wait()"
    )
    process = Process([sys.executable, "-c", code], tmp_path / "log", os.environ)
    wait_for(lambda: process.output.strip() != "")
    other = int(process.output)
    end([process])

    def is_gone() -> bool:
        try:
            return Path(f"/proc/{other}/stat").read_text().split()[2] == "Z"
        except OSError:
            return True

    wait_for(is_gone)


def test_there_is_no_such_program(tmp_path: Path) -> None:
    with pytest.raises(ProcessError, match=r"no_such cannot be started: .*; source the workspace"):
        Process(["no_such"], tmp_path / "log", os.environ)


def test_the_master_is_there_at_once_and_no_longer_than_it_is_needed(tmp_path: Path) -> None:
    with LocalMaster(tmp_path) as master:
        assert ServerProxy(master.uri).getUri("/test") == [1, "", f"{master.uri}/"]
    with pytest.raises(ConnectionRefusedError):
        ServerProxy(master.uri).getUri("/test")


@pytest.mark.parametrize("package", ["rosgraph", "no_such"])
def test_there_is_no_such_executable(package: str) -> None:
    with pytest.raises(ProcessError, match=f"{package} has no program none, or is not there"):
        local_master.executable(package, "none")


def test_the_environment_leads_to_this_master(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://elsewhere:11311")
    monkeypatch.setenv("ROS_IP", "192.0.2.1")
    first, second = LocalMaster(tmp_path), LocalMaster(tmp_path)
    assert first.uri != second.uri
    environment = second.environment("/robot")
    assert environment["ROS_MASTER_URI"] == second.uri
    assert environment["ROS_NAMESPACE"] == "/robot"
    assert "ROS_IP" not in environment
    for master in (first, second):
        master.close()
