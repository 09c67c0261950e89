"""Stacks that are deep enough for what a client makes clingo write."""

from __future__ import annotations

import threading
from typing import Callable, List

import pytest

from rosclingo.solver import stack


def test_a_term_that_nests_deeply_does_not_end_the_process(
    run_python: Callable[[str], str],
) -> None:
    code = (
        "from rosclingo.wire.commands import Add, Ground, Part\n"
        "from rosclingo.solver.engine import Engine\n"
        "from rosclingo.solver.options import Options\n"
        "from rosclingo.solver.worker import Worker\n"
        "worker = Worker(Engine(Options()))\n"
        "text = 'n(0,z). n(I+1,f(T)) :- n(I,T), I < 700000. #show. #show T : n(700000,T).'\n"
        "print(worker.control([Add('p', (), text), Ground((Part('p'),))]).success)"
    )
    assert run_python(code) == "True"


class LimitedThread(threading.Thread):
    """A thread of a process that has only so much memory left."""

    def __init__(self, limit: int) -> None:
        super().__init__(target=lambda: None)
        self.sizes: List[int] = []
        self._limit = limit

    def start(self) -> None:
        self.sizes.append(threading.stack_size())
        if self.sizes[-1] > self._limit:
            raise RuntimeError("can't start new thread")
        super().start()


def test_with_less_memory_the_stack_is_smaller() -> None:
    thread = LimitedThread(2**28)
    before = threading.stack_size()
    stack.start(thread)
    thread.join()
    assert thread.sizes == [2**30, 2**29, 2**28]
    assert threading.stack_size() == before


def test_without_memory_there_is_no_thread() -> None:
    before = threading.stack_size()
    with pytest.raises(RuntimeError, match="can't start"):
        stack.start(LimitedThread(0))
    assert threading.stack_size() == before
