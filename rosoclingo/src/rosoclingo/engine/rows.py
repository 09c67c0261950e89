"""TaskRows by which an answer set shows a planning task, see ``lib/task.lp``."""

from __future__ import annotations

from collections import defaultdict
from typing import DefaultDict, Dict, Iterable, List, Sequence, Tuple

from rosclingo.wire.term_text import number

BASE, SEARCH = "base_", "task_"
"""The prefixes of rows of what is said in base, and of what a search alone knows."""
SEPARATOR = ',"|",'
MOST_AMOUNT = 999_999_999
"""The largest amount of a number."""

TaskRows = Dict[str, List[List[str]]]
"""TaskRows as their arguments, by their names."""


def read_rows(symbols: Iterable[str], prefix: str) -> TaskRows:
    """Returns the rows of an answer set that have a prefix, each as its arguments, by their names.

    The answer set of a run that goes on after a crash shows both kinds.
    """
    rows: DefaultDict[str, List[List[str]]] = defaultdict(list)
    start = len(prefix)
    for text in symbols:
        if text.startswith(prefix):
            name, _, arguments = text[start:-1].partition("(")
            rows[name].append(arguments.split(SEPARATOR))
    return rows


def joined(first: TaskRows, second: TaskRows) -> TaskRows:
    """Returns the rows of both."""
    rows: DefaultDict[str, List[List[str]]] = defaultdict(list)
    for name in (*first, *second):
        rows[name] = [*first.get(name, ()), *second.get(name, ())]
    return rows


def unique(rows: Iterable[Sequence[str]]) -> Iterable[Tuple[str, ...]]:
    """Returns different rows: the same fact twice is one fact."""
    return dict.fromkeys(map(tuple, rows))


def level_of(text: str) -> int:
    """Returns a level or limit; -1 for what is none."""
    level = number(text)
    return level if level is not None and 0 <= level <= MOST_AMOUNT else -1
