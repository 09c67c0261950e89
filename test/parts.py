"""Splits the costly tests into three parts, of which each run of scripts/test takes one.

A test is costly if it has the mark of this name. PART in the environment, from 1 to 3, names the
part that runs; without it all tests run. A test's part depends on its name alone, and that of a
variant also on its place among the test's variants, so that a run has some of three or more.
"""

from __future__ import annotations

import collections
import zlib
from typing import Counter, Dict, Iterable

NUMBER = 3


def parts(names: Iterable[str]) -> Dict[str, int]:
    """Returns each test's part, from 1 to 3.

    Args:
        names: Node ids of pytest, such as ``test/test_x.py::test_y[a]``; all variants of a test,
            in an order that is always the same.
    """
    variants: Counter[str] = collections.Counter()
    found = {}
    for name in names:
        test = name.partition("[")[0]
        # Not hash(), which differs from process to process.
        found[name] = (zlib.crc32(test.encode()) + variants[test]) % NUMBER + 1
        variants[test] += 1
    return found


def is_part(text: str) -> bool:
    """Returns whether a text is the number of a part."""
    return text in {str(number) for number in range(1, NUMBER + 1)}
