"""Versions of up-fast-downward that tests run with: the newest, and one with the older folders."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rosoclingo.tools.pddl.downward import find_fast_downward, installed_version

VERSIONS = ("0.5.2", "1.0.0")
_OLDER = Path(sys.prefix, "older")  # scripts/setup --test installs the older version there
_IS_MISSING = find_fast_downward() is None and sys.version_info < (3, 9)
_REASON = "up-fast-downward needs Python 3.9"

NEEDS_DOWNWARD = pytest.mark.skipif(_IS_MISSING, reason=_REASON)
"""Skips tests where up-fast-downward cannot be installed. Where it can be, they fail without it."""


def use_version(monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    """Has the product find a version of the package up-fast-downward until the test ends."""
    if version != VERSIONS[-1]:
        monkeypatch.syspath_prepend(str(_OLDER))
    if _IS_MISSING:
        pytest.skip(_REASON)
    assert installed_version() == version
