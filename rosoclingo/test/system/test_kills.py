"""Real processes are killed, and a world that survives judges: a short run of benchmarks/kills.py.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Dict, Tuple

KILLS = Path(__file__).resolve().parents[3] / "benchmarks" / "kills.py"


def run(*arguments: str) -> Tuple[int, str, Dict[str, int]]:
    """Returns the exit status, the output, and the figures of its last line by their names."""
    ended = subprocess.run(
        ["python", str(KILLS), *arguments], stdout=subprocess.PIPE, text=True, check=False
    )
    last = ended.stdout.splitlines()[-1]
    return (
        ended.returncode,
        ended.stdout,
        {name: int(n) for n, name in re.findall(r"(\d+) (\w+)", last)},
    )


def test_some_kills() -> None:
    status, output, figures = run("random", "--rounds", "4")
    assert status == 0, output
    assert figures["kills"] >= 4
    assert figures["violations"] == 0
