"""A page for each test, and a screen."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator

import pytest
from page import Page, is_left_out
from readmes import section
from screen import screen

__all__ = ["screen"]


@pytest.fixture
def page(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Page]:
    """The section that the test's mark names."""
    pieces = section(*request.node.get_closest_marker("readme").args)
    page = Page(tmp_path, [piece for piece in pieces if not is_left_out(piece)])
    terminals = page.terminals
    if not {"roscore"} & {piece.text for piece in page.left}:
        terminals.start_master()
    try:
        yield page
        assert not page.left, "the README prints more than the test types"
        page.interrupt()
    finally:
        terminals.close()
