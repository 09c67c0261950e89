"""What the scripts refuse, and what they install."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import List, Tuple

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(
    ("command", "pieces"),
    [
        (("setup", "--tests"), ["usage: scripts/setup [--test | --bench]"]),
        (("test", "unit"), ["'unit'", "system planning whole driving"]),
        (("test", "--again", "units"), ["--again needs a number"]),
        (("in-chroot", "trixie"), ["usage: scripts/in-chroot SUITE COMMAND..."]),
        (("in-chroot", "sarge", "true"), ["'sarge'", "bookworm, trixie, focal"]),
    ],
)
def test_what_is_refused(command: Tuple[str, ...], pieces: List[str]) -> None:
    ended = subprocess.run(
        [ROOT / "scripts" / command[0], *command[1:]], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    for piece in pieces:
        assert piece in ended.stderr


@pytest.mark.skipif(
    "ID=ubuntu" in Path("/etc/os-release").read_text(), reason="it can be made here"
)
def test_a_suite_of_another_distribution() -> None:
    ended = subprocess.run(
        [ROOT / "scripts/in-chroot", "focal", "true"], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "focal is a suite of ubuntu, but the apt sources of this machine" in ended.stderr


@pytest.mark.parametrize("library", ["clingo", "rosbags"])
def test_who_lives_in_private_parts_has_limits(library: str) -> None:
    text = (ROOT / "requirements.txt").read_text()
    assert re.search(rf"^{library}>=[0-9.]+,<[0-9.]+$", text, re.MULTILINE)
