"""Random tasks with numbers: a breadth-first search says which have a plan, and so do we.

unified-planning's validator judges our plans and those of the search. TASKS=500 in the environment
draws so many, FULL=1 draws 100.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import Dict, Iterator, Tuple

import pytest
from downward_versions import NEEDS_DOWNWARD
from draws import draws
from numeric_tasks import LIMITS, NumericTask
from pddl_judge import judged
from test_imported import ImportedWorld

from rosoclingo.loop.planner import layers, planner
from rosoclingo.loop.words import SOLVER
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.files import ImportOptions, import_task, write_files

pytestmark = [pytest.mark.costly, NEEDS_DOWNWARD]
SEEDS = draws(list(range(12)), 100, "TASKS")
OPTIONS = ImportOptions(slots=1, limits=LIMITS)
_NEVER = re.compile(
    r".*(domain|problem)\.pddl:\d+: .*(can never be met|never holds), whatever is done"
)
_LEAST_JUDGED = 12  # tasks, to say what their shares are


@pytest.fixture(scope="module")
def shares() -> Iterator[Counter[str]]:
    """Counts the tasks by what has become of them, and says so at the end."""
    counts: Counter[str] = Counter()
    yield counts
    tasks = counts["tasks"]
    print(f"\n{dict(counts)}")
    if tasks >= _LEAST_JUDGED:
        assert counts["accepted"] >= 0.8 * tasks, counts
        assert 0.35 * tasks <= counts["with a plan"] <= 0.65 * tasks, counts
        assert counts["not known"] <= 0.05 * tasks, counts


def _imported(domain: Path, problem: Path) -> Tuple[Dict[str, str], str]:
    """Returns the encoding's files, or why there are none."""
    try:
        return import_task(domain, problem, OPTIONS), ""
    except PddlError as err:
        return {}, str(err)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_task(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, shares: Counter[str]
) -> None:
    """What is planned is valid; what the search reaches is planned, and nothing else."""
    task = NumericTask(seed)
    files = domain, problem = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
    for file, text in zip(files, (task.domain, task.problem)):
        file.write_text(text)
    shares["tasks"] += 1
    shares["with a plan" if task.plan else "without" if task.is_known else "not known"] += 1
    shares["with durations"] += task.lasts is not None
    if task.plan is not None:
        assert judged(domain, problem, task.plan, task.lasts), f"the search is wrong: {task.plan}"
    texts, refusal = _imported(domain, problem)
    if refusal:
        assert _NEVER.match(refusal), refusal
        assert task.plan is None, f"{refusal}, though there is {task.plan}"
        return
    shares["accepted"] += 1
    if task.plan is None:  # then all time is spent on what has no end
        for name, most in (("_MOST_SECONDS", 0.5), ("_MORE_SECONDS", 0.5), ("_MOST_LAYERS", 16)):
            monkeypatch.setattr(layers, name, most)
        monkeypatch.setattr(planner, "_MORE_SECONDS", 0.5)
    written = write_files(texts, tmp_path)
    world = ImportedWorld([str(f) for f in written if f.suffix == ".lp"], domain, problem)
    goal = world.request("goal")
    failure = world.run()
    assert failure is None, failure
    assert world.violations == []
    steps = [world.world.words(action) for who, action in world.published if who != SOLVER]
    shares["planned"] += goal.words[-1] == "succeeded"
    if goal.words[-1] != "succeeded":
        assert task.plan is None, f"{goal.words}, though there is {task.plan}"
        assert goal.words == ["accepted"]
        assert steps == []
        return
    assert task.plan or not task.is_known, f"{steps}, though no state is as the goal says"
    world.world.require_goal()
    assert judged(domain, problem, steps, task.lasts), steps
