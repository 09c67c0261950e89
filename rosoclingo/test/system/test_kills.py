"""Real processes are killed, and a world that survives judges: a short run of benchmarks/kills.py.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Dict, Tuple

import pytest

pytestmark = pytest.mark.costly

KILLS = Path(__file__).resolve().parents[3] / "benchmarks" / "kills.py"


def run(*arguments: str) -> Tuple[int, str, Dict[str, int]]:
    """Returns the exit status, the output, and the figures of its last line by their names."""
    ended = subprocess.run(
        ["python", str(KILLS), *arguments], stdout=subprocess.PIPE, text=True, check=False
    )
    figures = re.findall(r"(\d+) (\w+)", ended.stdout.splitlines()[-1])
    return ended.returncode, ended.stdout, {name: int(number) for number, name in figures}


def test_some_kills() -> None:
    status, output, figures = run("random", "--rounds", "4")
    assert (status, figures["violations"]) == (0, 0), output
    assert figures["kills"] >= 3


def test_a_robot_that_does_not_know() -> None:
    """It is killed when a package is picked up, and nobody has written that down."""
    status, output, figures = run(
        "points", "--process", "robot", "--blind", "--first", "8", "--most", "1"
    )
    assert (status, figures["violations"]) == (0, 0), output
    assert figures["goals"] == 1


def test_a_robot_that_forgets() -> None:
    """The judge sees that a package is picked up twice."""
    status, output, figures = run(
        "points", "--process", "robot", "--blind", "--forgets", "--first", "2", "--most", "1"
    )
    assert status == 1
    assert "pickup at a, where it has 'round 3 a'" in output
    assert figures["violations"] > 0
