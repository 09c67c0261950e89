"""``plan.py`` finds the best plan of a small task by default, and the same plan each time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest
from test_actions import write
from test_open_goals import restaurant

PLAN = (sys.executable, "-m", "rosoclingo.tools.plan")


def _plan(encoding: str, *tables: int, seed: int = 0) -> List[List[object]]:
    """Returns the actions of a plan, found by a process of its own."""
    goals = [word for table in tables for word in ("--goal", f"dish(t{table})")]
    run = subprocess.run(
        [*PLAN, encoding, *goals, "-c", "slots=6", "--why-seconds", "0", "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONHASHSEED": str(seed)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    actions: List[List[object]] = json.loads(run.stdout)["plan"]["actions"]
    return actions


@pytest.mark.costly
def test_a_small_plan_is_the_best(tmp_path: Path) -> None:
    """Each waiter brings one dish: one alone would need seven steps, and eight actions are more."""
    encoding = write(tmp_path, restaurant(2, 2) + " corridor(t0,t1).")
    plan = _plan(encoding, 0, 1)
    assert (max(step for step, *_ in plan), len(plan)) == (4, 8)


@pytest.mark.costly
def test_the_same_command_gives_the_same_plan(tmp_path: Path) -> None:
    """Also of a task whose plan is cut off before it is proven the best."""
    encoding = write(tmp_path, restaurant(6, 2))
    plans = [_plan(encoding, 0, 3, 5, seed=seed) for seed in range(3)]
    assert plans[0] == plans[1] == plans[2]
