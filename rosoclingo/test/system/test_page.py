"""Shows a recorded run, as a user does.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from terminals import Terminals, terminals

__all__ = ["terminals"]

BAG = Path(__file__).resolve().parents[3] / "test/bags/mailbot_dynamic_reset.bag"
REPORT = ("rosrun", "rosoclingo", "report.py")


@pytest.mark.install_space
def test_a_page_and_a_picture(terminals: Terminals, tmp_path: Path) -> None:
    page, picture = tmp_path / "run.html", tmp_path / "run.png"
    shown = terminals.run(*REPORT, str(BAG), "-o", str(page), "--png", str(picture))
    assert shown.wait() == 0, shown.output
    assert shown.output == f"wrote {page}\nwrote {picture}\n"
    assert "bring(" in page.read_text(encoding="utf-8")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_bag_that_is_not_there(terminals: Terminals, tmp_path: Path) -> None:
    shown = terminals.run(*REPORT, str(tmp_path / "none.bag"))
    assert shown.wait() == 2
    assert shown.output.startswith(f"report.py: {tmp_path / 'none.bag'}: ")
    assert "Traceback" not in shown.output
