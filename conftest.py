"""Skips the costly tests that are in another part than this run: see test/parts.py."""

from __future__ import annotations

import os
from typing import List, Set

import pytest
from parts import NUMBER, is_part, parts

PART = os.environ.get("PART", "")

left_out: Set[str] = set()


def pytest_configure() -> None:
    """Refuses a part that there is not."""
    if PART and not is_part(PART):
        raise pytest.UsageError(
            f"PART={PART} in the environment: expected a number from 1 to {NUMBER}; "
            "without it all tests run"
        )


@pytest.hookimpl(tryfirst=True)  # before -k and -m leave variants out
def pytest_collection_modifyitems(items: List[pytest.Item]) -> None:
    """Notes the costly tests of the other parts."""
    if PART:
        costly = [item.nodeid for item in items if item.get_closest_marker("costly")]
        left_out.update(name for name, part in parts(costly).items() if part != int(PART))


@pytest.hookimpl(tryfirst=True)  # before fixtures are made
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skips those tests, from here, so that one line of the summary tells all of them."""
    if item.nodeid in left_out:
        pytest.skip(f"costly, and not in part {PART} of {NUMBER}: scripts/test --full runs all")
