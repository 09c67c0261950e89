"""Processes of one's own; the tests of replays start a master and nodes."""

from __future__ import annotations

import os
import signal
import socket
import sys
from pathlib import Path
from typing import List
from xmlrpc.client import ServerProxy

import pytest
from waiting import wait_for

from rosclingo.ros import local_master
from rosclingo.ros.local_master import LocalMaster, Process, ProcessError, end

# Says which signals come, and ends at the one that it is told to end at.
STUBBORN = """
import os, signal, sys
def on_signal(number, frame):
    name = signal.Signals(number).name
    os.write(1, (name + "\\n").encode())
    if name == sys.argv[1]:
        os._exit(3)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, on_signal)
os.write(1, b"ready\\n")
while True:
    signal.pause()
"""


@pytest.mark.parametrize(
    ("ends_at", "status", "says"),
    [
        (signal.SIGINT, 3, ["ready", "SIGINT"]),
        (signal.SIGTERM, 3, ["ready", "SIGINT", "SIGTERM"]),
        (signal.SIGKILL, -9, ["ready"]),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_each_process_is_ended_as_gently_as_possible(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ends_at: signal.Signals,
    status: int,
    says: List[str],
) -> None:
    signals = [number for number, _ in local_master._PATIENCE]
    assert signals == [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
    patience = [(number, 60.0 if number == ends_at else 0.1) for number in signals]
    monkeypatch.setattr(local_master, "_PATIENCE", patience)
    command = [sys.executable, "-c", STUBBORN, ends_at.name]
    process = Process(command, tmp_path / "log", os.environ)
    wait_for(lambda: "ready" in process.output)
    end([process])
    assert process.process.poll() == status
    said = process.output.split()
    assert said[: len(says)] == says  # the last ones may be too quick for it
    end([process])


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


def test_a_master_that_cannot_listen_frees_its_port(tmp_path: Path) -> None:
    master = LocalMaster(tmp_path)
    port = int(master.uri.rpartition(":")[2])
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(("", port))
        other.listen()
        with pytest.raises(OSError, match="in use"), master:
            pass
    with socket.socket() as new:
        new.bind(("", port))


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
