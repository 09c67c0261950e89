from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Iterator, List

import pytest

from rosoclingo.engine import process as process_module
from rosoclingo.engine.flat import FlatAction, FlatTask
from rosoclingo.engine.kinds import ADDS, TAKES
from rosoclingo.engine.process import SearchProcess, Spare, prepare_search
from rosoclingo.engine.worker import SearchEnd

SECONDS = 120  # until a test gives up waiting
BYTES = 2**31


def steps(length: int) -> FlatTask:
    """A line of rooms, through which one robot goes."""
    actions: List[FlatAction] = []
    for room in range(length - 1):
        actions.append(([(0, room)], [], [([], 0, room + 1)], [], 1, 0))
        actions.append(([(0, room + 1)], [], [([], 0, room)], [], 1, 0))
    return FlatTask([length], [0], [], [], [([(0, length - 1)], [])], actions)


def counters(number: int, parity: int) -> FlatTask:
    """A vast space of states without a plan: all levels move together by two, and one is to be odd.

    The relaxation, in which each level is reached in one action, does not see that.
    """
    limit = 9
    actions: List[FlatAction] = []
    for one in range(number):
        actions.append(([], [], [], [(ADDS, one, 2)], 1, 0))
        actions.append(([], [], [], [(TAKES, one, 2)], 1, 0))
    wishes = [(0, parity, parity)]
    return FlatTask([], [], [limit] * number, [0] * number, [([], wishes)], actions)


def ended(task: FlatTask, seconds: float = 60, memory: int = BYTES) -> SearchProcess:
    process = SearchProcess(task, seconds=seconds, improve_seconds=60, bytes=memory)
    assert process.wait(SECONDS)
    process.close()
    return process


def test_a_plan_is_found_and_improved_until_it_is_the_best() -> None:
    process = ended(steps(5))
    assert process.latest() == [0, 2, 4, 6]
    assert process.plans_found == 1
    assert process.why_ended == SearchEnd.THROUGH
    assert process.seconds > 0


def test_no_requests_are_met_by_an_empty_plan() -> None:
    assert ended(FlatTask([], [], [], [], [], [])).latest() == []


def test_a_task_without_a_plan_is_told_as_such() -> None:
    process = ended(counters(2, 3))
    assert (process.latest(), process.why_ended) == (None, SearchEnd.NO_PLAN)


@pytest.mark.costly
def test_a_plan_for_some_requests_is_told_while_one_for_all_is_searched_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(process_module, "_MOMENT_SECONDS", 0.02)
    task = counters(12, 3)
    task.requests.append(([], [(1, 4, 4)]))
    process = SearchProcess(task, seconds=60, improve_seconds=0, bytes=BYTES)
    deadline = time.monotonic() + SECONDS
    while not process.partial:
        assert time.monotonic() < deadline
        assert not process.wait(0.01)
    process.close()
    assert process.partial == (2, 2)
    assert process.latest() is None


def test_processor_time_ends() -> None:
    process = ended(counters(12, 3), seconds=0.3)
    assert (process.latest(), process.why_ended) == (None, SearchEnd.OUT_OF_TIME)


@pytest.mark.costly
def test_memory_ends() -> None:
    process = ended(counters(200, 3), memory=40 * 2**20)
    assert (process.latest(), process.why_ended) == (None, SearchEnd.OUT_OF_MEMORY)


def test_a_process_can_be_closed_while_it_searches() -> None:
    process = SearchProcess(counters(12, 3), seconds=60, improve_seconds=0, bytes=BYTES)
    assert not process.has_ended
    process.close()
    assert process.has_ended
    assert process.why_ended == SearchEnd.CLOSED
    process.close()


def test_a_process_that_is_killed_is_lost() -> None:
    process = SearchProcess(counters(12, 3), seconds=60, improve_seconds=0, bytes=BYTES)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait(SECONDS)
    assert (process.latest(), process.why_ended) == (None, SearchEnd.LOST)
    process.close()


@pytest.fixture
def spare(monkeypatch: pytest.MonkeyPatch) -> Iterator[Spare]:
    """Holds no process yet."""
    empty = Spare()
    monkeypatch.setattr(process_module, "_SPARE", empty)
    yield empty
    empty.end()


def test_a_search_takes_the_process_that_was_started_in_advance(spare: Spare) -> None:
    prepare_search()
    pid = spare.pid
    prepare_search()
    assert spare.pid == pid
    first, second = ended(steps(5)), ended(steps(6))
    assert (first.pid, first.latest()) == (pid, [0, 2, 4, 6])
    assert (spare.pid, second.latest()) == (None, [0, 2, 4, 6, 8])


def test_a_process_that_was_started_in_advance_may_be_killed(spare: Spare) -> None:
    """A search starts another one then."""
    prepare_search()
    assert spare.pid
    os.kill(spare.pid, signal.SIGKILL)
    os.waitid(os.P_PID, spare.pid, os.WEXITED | os.WNOWAIT)
    assert ended(steps(5)).latest() == [0, 2, 4, 6]


def test_limits_count_for_a_process_that_was_started_in_advance(spare: Spare) -> None:
    prepare_search()
    assert ended(counters(12, 3), seconds=0.3).why_ended == SearchEnd.OUT_OF_TIME


@pytest.mark.costly
@pytest.mark.parametrize(
    "start",
    [
        "pid = SearchProcess(counters(12, 3), seconds=60, improve_seconds=0, bytes=BYTES).pid",
        "prepare_search(); pid = process_module._SPARE.pid",
    ],
    ids=["searching", "waiting"],
)
@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
def test_a_process_ends_with_its_parent(start: str, end: signal.Signals) -> None:
    program = (
        "import os, signal\nfrom test_engine_process import *\n"
        # A shell has its background jobs ignore SIGINT.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "read, write = os.pipe()\nos.set_blocking(write, False)\nsignal.set_wakeup_fd(write)\n"
        f"{start}\nprint(pid, flush=True)\n"
        "os.read(read, 1)\n"  # ends with a signal, even if that came before
    )
    paths = os.pathsep.join([*sys.path, str(Path(__file__).parent)])
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as parent:
        assert parent.stdout
        pid = int(parent.stdout.readline())
        parent.send_signal(end)
    deadline = time.monotonic() + SECONDS
    while is_running(pid):
        assert time.monotonic() < deadline


def is_running(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"  # init may take its time to reap it
