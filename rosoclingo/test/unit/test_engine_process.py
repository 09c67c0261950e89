from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Callable, List

import pytest

from rosoclingo.engine import process as engine_process
from rosoclingo.engine.flat import FlatAction, FlatTask
from rosoclingo.engine.kinds import ADDS, TAKES
from rosoclingo.engine.process import SearchProcess
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


class News:
    """Waits until something holds that changes with the news of a process."""

    def __init__(self) -> None:
        self._condition = threading.Condition()

    def __call__(self) -> None:
        with self._condition:
            self._condition.notify_all()

    def wait_for(self, holds: Callable[[], bool]) -> None:
        with self._condition:
            assert self._condition.wait_for(holds, SECONDS)


def ended(task: FlatTask, seconds: float = 60, memory: int = BYTES) -> SearchProcess:
    news = News()
    process = SearchProcess(task, seconds=seconds, improve_seconds=60, bytes=memory, on_news=news)
    news.wait_for(lambda: process.has_ended)
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
    monkeypatch.setattr(engine_process, "_MOMENT_SECONDS", 0.02)
    task = counters(12, 3)
    task.requests.append(([], [(1, 4, 4)]))
    process = ended(task, seconds=1.5)
    assert (process.latest(), process.why_ended) == (None, SearchEnd.OUT_OF_TIME)
    assert process.partial == (2, 2)


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
    news = News()
    process = SearchProcess(
        counters(12, 3), seconds=60, improve_seconds=0, bytes=BYTES, on_news=news
    )
    os.kill(process.pid, signal.SIGKILL)
    news.wait_for(lambda: process.has_ended)
    assert (process.latest(), process.why_ended) == (None, SearchEnd.LOST)
    process.close()


def test_a_search_ends_when_its_parent_is_killed() -> None:
    program = (
        "from test_engine_process import BYTES, SearchProcess, counters, signal\n"
        "process = SearchProcess(counters(12, 3), seconds=60, improve_seconds=0, bytes=BYTES)\n"
        "print(process.pid, flush=True)\n"
        "signal.pause()\n"
    )
    paths = os.pathsep.join([*sys.path, str(Path(__file__).parent)])
    with subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.PIPE,
    ) as parent:
        assert parent.stdout
        pid = int(parent.stdout.readline())
        parent.kill()
    deadline = time.monotonic() + SECONDS
    while is_running(pid):
        assert time.monotonic() < deadline


def is_running(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"  # init may take its time to reap it
