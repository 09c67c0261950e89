"""Draws and variants of tests: a few, or with FULL=1 in the environment all."""

from __future__ import annotations

import os
from typing import Iterable, Sequence, TypeVar

Variant = TypeVar("Variant")
IS_FULL = os.environ.get("FULL") == "1"


def draws(few: Iterable[int], full: int, variable: str = "", times: int = 1) -> Sequence[int]:
    """Returns the numbers of the draws.

    Args:
        few: Those by which each branch is taken of the test and of what it tests.
        full: How many it takes to meet rare cases.
        variable: What names another number in the environment; none if empty.
        times: How many draws one of that number stands for.
    """
    named = os.environ.get(variable)
    if named is not None:
        return range(int(named) * times)
    return range(full) if IS_FULL else tuple(few)


def variants(few: Sequence[Variant], full: Iterable[Variant]) -> Sequence[Variant]:
    """Returns the few variants that differ in what is tested, or all of them."""
    return tuple(full) if IS_FULL else few
