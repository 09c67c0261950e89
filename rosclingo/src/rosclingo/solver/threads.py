"""Sets the number of threads with which a solver searches.

Several threads have a configuration each, of clingo's portfolio, and the first one that is through
ends the search. Which of several answer sets they find is up to chance.

>>> with_threads(Options(clingo=("-c", "n=3")), 4).clingo
('-c', 'n=3', '--parallel-mode=4,compete')
"""

from __future__ import annotations

import dataclasses
import os

from rosclingo.errors import OptionsError
from rosclingo.solver.options import Options
from rosclingo.wire.term_text import number

AUTO = "auto"
"""Stands for as many threads as there are cores that no other node needs."""

MOST = 64
"""How many threads clingo has at most."""

_OTHERS = 2  # nodes that are at work beside a planner: the loop and its controller
_PORTFOLIO = 8  # configurations; more threads repeat them


def read_threads(value: object) -> int:
    """Reads a number of threads, or :data:`AUTO`.

    Raises:
        ValueError: It is neither.
    """
    text = str(value)
    if text == AUTO:
        return spare_cores()
    threads = number(text)
    if threads is None or not 1 <= threads <= MOST:
        raise ValueError(f"expected a number of threads from 1 to {MOST}, or {AUTO}: {value}")
    return threads


def spare_cores() -> int:
    """Returns for how many threads of a planner this process may use a core; at least for one."""
    return max(1, min(len(os.sched_getaffinity(0)) - _OTHERS, _PORTFOLIO))


def with_threads(options: Options, threads: int) -> Options:
    """Returns options with which a solver has some threads.

    Raises:
        OptionsError: They say already how many it has.
    """
    if threads == 1:
        return options
    given = next((one for one in options.clingo if one.startswith(("-t", "--parallel-mode"))), None)
    if given is not None:
        raise OptionsError(
            f"{threads} threads are asked for, and by option {given} clingo has a number of its "
            "own; leave out one of them"
        )
    return dataclasses.replace(
        options, clingo=(*options.clingo, f"--parallel-mode={threads},compete")
    )
