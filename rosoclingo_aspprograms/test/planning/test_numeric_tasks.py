"""Random tasks with numbers: unified-planning's validator judges plans, and a search their absence.

TASKS=500 in the environment draws so many, FULL=1 draws 100.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Dict, List, Tuple

import pytest
from draws import draws
from numeric_tasks import LIMITS, NumericTask, shortest_plan
from test_imported import ImportedWorld

from plan_validator import read_validator
from rosoclingo.loop.planner import layers
from rosoclingo.loop.words import SOLVER
from rosoclingo.pddl.expressions import PddlError
from rosoclingo.pddl.files import ImportOptions, import_task, write_files

pytestmark = [
    pytest.mark.costly,
    pytest.mark.skipif(
        importlib.util.find_spec("up_fast_downward") is None,
        reason="Fast Downward is not installed: scripts/setup --test",
    ),
]
SEEDS = draws(list(range(12)), 500, "TASKS")
OPTIONS = ImportOptions(slots=1, limits=LIMITS)
_LIMIT = re.compile(r"^number\((.*),(\d+)\)\.$", re.MULTILINE)
_REFUSED = (
    "otherwise, too: an assignment has to be the only change",
    "goal has",
    "goal can never be met",
    "never holds, whatever is done",
    "the goal is met whatever is done",
    "which is more than --most",
)


def _written(folder: Path, seed: int) -> Tuple[Path, Path]:
    task = NumericTask(seed)
    files = folder / "domain.pddl", folder / "problem.pddl"
    for file, text in zip(files, (task.domain, task.problem)):
        file.write_text(text)
    return files


def _imported(domain: Path, problem: Path) -> Tuple[Dict[str, str], str]:
    """Returns the encoding's files, or why there are none."""
    try:
        return import_task(domain, problem, OPTIONS), ""
    except PddlError as err:
        return {}, str(err)


def judged(domain: Path, problem: Path, plan: List[str]) -> bool:
    """Returns whether unified-planning finds a plan valid; its steps are in PDDL's words."""
    up = pytest.importorskip("unified_planning", reason="scripts/setup --bench installs it")
    from unified_planning.io import PDDLReader  # noqa: PLC0415 (it takes a second)

    up.shortcuts = importlib.import_module("unified_planning.shortcuts")
    up.shortcuts.get_environment().credits_stream = None
    task = PDDLReader().parse_problem(str(domain), str(problem))
    steps = "\n".join(f"({step})" for step in plan)
    parsed = PDDLReader().parse_plan_string(task, steps)
    with up.shortcuts.PlanValidator(problem_kind=task.kind, plan_kind=parsed.kind) as validator:
        return bool(validator.validate(task, parsed))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_task(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Plans are valid, and there is one for each task that a breadth-first search solves."""
    domain, problem = _written(tmp_path, seed)
    texts, refusal = _imported(domain, problem)
    if refusal:
        assert any(reason in refusal for reason in _REFUSED), refusal
        assert re.match(r".*(domain|problem)\.pddl:\d+: ", refusal), refusal
        pytest.skip(f"refused: {refusal}")
    written = write_files(texts, tmp_path)
    names = read_validator(domain, problem).names
    largest = {}
    for term, most in _LIMIT.findall(texts["random_numbers.lp"]):
        name, objects = names.words(term)
        largest[(name, *objects)] = int(most)
    shortest, is_known = shortest_plan(read_validator(domain, problem), largest)
    if shortest is None:  # then all time is spent on what has no end
        monkeypatch.setattr(layers, "_MOST_SECONDS", 0.5)
    world = ImportedWorld([str(f) for f in written if f.suffix == ".lp"], domain, problem)
    goal = world.request("goal")
    failure = world.run()
    assert failure is None, failure
    assert world.violations == []
    steps = [world.world.words(action) for who, action in world.published if who != SOLVER]
    if shortest is None and goal.words == ["accepted"]:
        assert steps == []
        return
    assert shortest is not None or not is_known
    assert goal.words[-1] == "succeeded", f"{goal.words}, though there is {shortest}"
    world.world.require_goal()
    assert judged(domain, problem, steps)
