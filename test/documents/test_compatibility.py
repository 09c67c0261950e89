"""Types what the document on compatibility prints of old bags."""

from __future__ import annotations

import pytest
from page import BAGS, LINE, Page, of


@pytest.mark.costly
@of("docs/compatibility.md", "Bags")
def test_old_requests_to_another_name(page: Page) -> None:
    page.has(run_bag=BAGS / "line_single_2.0.bag")
    single = ("run-1.0.py", "--file", str(LINE), "__name:=ROSoClingo")
    started = page.terminals.start("rosrun", "rosoclingo", *single)
    page.hears("/ROSoClingo/about")
    page.run("rosbag play")
    started.wait_for("robot: go(2)")
