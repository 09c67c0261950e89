"""Splits the costly tests into six parts, of which each run of scripts/test takes one.

A test is costly if it has the mark of this name. PART in the environment, from 1 to 6, names the
part that runs; without it all tests run. The parts of a file's costly tests take turns, those of a
variant too, so that each part has as many of a file as another, and of two files that have one
each, mostly not both.
"""

from __future__ import annotations

import collections
import zlib
from typing import Counter, Dict, Iterable

NUMBER = 6  # scripts/test reads it here


def parts(names: Iterable[str]) -> Dict[str, int]:
    """Returns each test's part, from 1 to 6.

    Args:
        names: Node ids of pytest, such as ``test/test_x.py::test_y[a]``, of all costly tests of
            each file, in an order that is always the same.
    """
    turns: Counter[str] = collections.Counter()
    found = {}
    for name in names:
        file = name.partition("::")[0]
        # Not hash(), which differs from process to process.
        found[name] = (zlib.crc32(file.encode()) + turns[file]) % NUMBER + 1
        turns[file] += 1
    return found


def is_part(text: str) -> bool:
    """Returns whether a text is the number of a part."""
    return text in {str(number) for number in range(1, NUMBER + 1)}
