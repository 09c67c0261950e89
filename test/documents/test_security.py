"""The document on security names tests and doors that there are, and all of the doors."""

from __future__ import annotations

import re
import sys

import pytest
from readmes import ROOT, rows

sys.path.append(str(ROOT / "fuzz"))

from all_doors import DOORS

DOCUMENT = "docs/security.md"
BOUNDARIES = ("Names in the ROS graph", "Files", "The console's port")


@pytest.mark.parametrize("heading", BOUNDARIES)
def test_each_boundary_has_tests_that_there_are(heading: str) -> None:
    files = {file.name for file in ROOT.glob("*/test/*/test_*.py")}
    held = [row[-1] for row in rows(DOCUMENT, heading) if ".py`" in row[-1]]
    assert held
    for cell in held:
        assert set(re.findall(r"`(\w+\.py)`", cell)) <= files, cell


def test_all_doors_are_named_and_no_others() -> None:
    cells = [row[-1] for heading in BOUNDARIES for row in rows(DOCUMENT, heading)]
    named = [re.findall(r"`(\w+)`", cell.split(" door")[1]) for cell in cells if " door" in cell]
    assert {name for names in named for name in names} == set(DOORS)


def test_what_was_counted_and_found_is_of_doors() -> None:
    cells = [row[0] for row in rows(DOCUMENT, "Fuzzers")]
    assert set(re.findall(r"`(\w+)`", " ".join(cells))) == set(DOORS)
