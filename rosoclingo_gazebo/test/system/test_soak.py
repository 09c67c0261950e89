"""Ten simulated minutes of scripts/soak's program, by its command line, and a Ctrl-C.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
import signal
import subprocess
from pathlib import Path

import pytest
from readmes import check_output
from waiting import wait_for

pytestmark = pytest.mark.costly

SOAK = Path(__file__).resolve().parents[3] / "benchmarks" / "soak.py"
SEED = "289"  # by which nodes of each kind are ended, and requests cancelled, early
_SECONDS = 600.0  # no more than a bound for what never comes


def test_ten_minutes(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    ended = subprocess.run(
        ["python", str(SOAK), "0.167", SEED, "--replay", "--output", str(page)],
        stdout=subprocess.PIPE, text=True, check=False, timeout=_SECONDS,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stdout
    check_output("docs/soak.md", "Soak", ended.stdout)
    assert f"0 violations; the page: {page}" in ended.stdout
    text = page.read_text(encoding="utf-8")
    counts = dict(re.findall(r"<tr class=\"\"><td>([a-z ]+)</td><td>(\d+)</td></tr>", text))
    assert int(counts["asked"]) >= 4
    assert int(counts["succeeded"]) >= 1
    assert int(counts["node killed"]) >= 2


def test_an_end_by_ctrl_c(tmp_path: Path) -> None:
    page, log = tmp_path / "page.html", tmp_path / "log"
    with log.open("wb") as output:
        soak = subprocess.Popen(
            ["python", str(SOAK), "100", "--robots", "1", "--output", str(page)],
            stdout=output, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
    try:
        wait_for(lambda: "watched" in log.read_text() or soak.poll() is not None, log.read_text)
        soak.send_signal(signal.SIGINT)
        assert soak.wait(_SECONDS) == 0, log.read_text()
    finally:
        if soak.poll() is None:
            soak.terminate()
            soak.wait()
    assert "no more disturbances" in log.read_text()
    assert "<h1>Soak with seed 1</h1>" in page.read_text(encoding="utf-8")
