"""Tasks in PDDL with derived predicates and conditions of any form: all that has a plan gets one.

The validator judges the plans step by step, by PDDL's own semantics. Of random tasks, it says which
have a plan, too, by a search of all states. TASKS=500 in the environment draws so many, FULL=1
draws 100.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

import pytest
from derived_tasks import DerivedTask, shortest_plan
from downward_versions import NEEDS_DOWNWARD, VERSIONS, use_version
from draws import draws
from pddl_judge import judged
from pddl_tasks import TASKS
from test_imported import ImportedWorld

from rosoclingo.loop.words import SOLVER
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.files import ImportOptions, import_task, write_files

pytestmark = [pytest.mark.costly, NEEDS_DOWNWARD]
SEEDS = draws(list(range(12)), 100, "TASKS")
_NEVER = re.compile(
    r".*problem\.pddl:\d+: the goal (can never be met, whatever is done|is met whatever is done)"
)


def _written(name: str, folder: Path) -> Tuple[Path, Path]:
    files = folder / "domain.pddl", folder / "problem.pddl"
    for file, text in zip(files, TASKS[name]):
        file.write_text(text)
    return files


def _imported(files: Tuple[Path, Path], options: ImportOptions) -> ImportedWorld:
    written = write_files(import_task(*files, options), files[0].parent)
    return ImportedWorld([str(each) for each in written if each.suffix == ".lp"], *files)


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", TASKS)
def test_a_task_is_planned(
    name: str, version: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_version(monkeypatch, version)
    kinds = ["robot"] if "robots" in name else []
    files = _written(name, tmp_path)
    world = _imported(files, ImportOptions(actuators=kinds, limits=_limits(name)))
    goal = world.request("goal")
    failure = world.run()
    assert failure is None, failure
    assert goal.words[-1] == "succeeded"
    assert world.violations == []
    world.world.require_goal()
    steps = [world.world.words(action) for who, action in world.published if who != SOLVER]
    if not {":derived", "(either"} & {*re.findall(r":derived|\(either", TASKS[name][0])}:
        assert judged(*files, steps, None)


def _imported_or_refused(files: Tuple[Path, Path]) -> Tuple[Optional[ImportedWorld], str]:
    """Returns the world of a task, or why it is refused."""
    try:
        return _imported(files, ImportOptions(slots=1)), ""
    except PddlError as err:
        return None, str(err)


@pytest.fixture(scope="module")
def shares() -> Iterator[Counter[str]]:
    """Counts the random tasks by what has become of them, and says so at the end."""
    counts: Counter[str] = Counter()
    yield counts
    print(f"\n{dict(counts)}")


def _limits(name: str) -> dict:
    return {"coins": 5} if "(coins)" in TASKS[name][0] else {}


class AnyOrder(ImportedWorld):
    """Some of the actions that go on end, in any order.

    Attributes:
        most: How many actions have gone on at the same time, at most.
    """

    random = random.Random(0)
    most = 0

    def turn(self) -> bool:
        self.most = max(self.most, len(self.acting))
        for actuator in self.random.sample(sorted(self.acting), len(self.acting)):
            if self.random.random() < 0.6 or not self._items:
                self.finish(actuator, "success")
        return bool(self._items)


def test_robots_work_at_once_only_where_nothing_depends_on_it(tmp_path: Path) -> None:
    """Whether there is a way depends on each door, so who walks waits for who shuts one."""
    files = _, problem = _written("derived, with two robots", tmp_path)
    problem.write_text(problem.read_text().replace("(in right a)", "(in right c)"))
    written = write_files(import_task(*files, ImportOptions(actuators=["robot"])), tmp_path)
    at_once = set()
    for seed in range(4):
        world = AnyOrder([str(each) for each in written if each.suffix == ".lp"], *files)
        world.random = random.Random(seed)
        others = ["in(left,c)", "in(right,a)", "-shut(d1)", "-way(a,c)", "seen(right,b)", "goal"]
        wanted = ["way(a,c)", *world.random.sample(others, len(others))]
        goals = [world.request(fact) for fact in wanted]
        assert world.run() is None
        assert [goal.words[-1] for goal in goals] == len(goals) * ["succeeded"]
        assert world.violations == []
        at_once.add(world.most)
    assert 2 in at_once


def test_a_derived_fact_is_requested_and_follows_from_messages(tmp_path: Path) -> None:
    files = _written("derived from derived", tmp_path)
    world = _imported(files, ImportOptions())
    unknown = world.request("fed(n9)")
    goal = world.request("fed(n4)")
    lone = world.request("-joined(n1,n2)")  # which neither the goal nor an action reads by itself
    assert world.run() is None
    assert lone.words[-1] == "succeeded"
    assert "n9" in unknown.reason
    assert goal.words[-1] == "succeeded"
    assert world.violations == []
    world.world.facts -= {("closed", "s5"), ("closed", "s4")}
    world.world.facts = {*world.world.facts}
    world.tell("info", "-closed(s5)")
    world.tell("info", "-closed(s4)")
    before = len(world.published)
    again = world.request("fed(n4)")
    assert world.run() is None
    assert again.words[-1] == "succeeded"
    assert len(world.published) > before
    assert world.violations == []


def test_a_derived_fact_cannot_be_told(tmp_path: Path) -> None:
    files = _written("derived from derived", tmp_path)
    world = _imported(files, ImportOptions())
    world.tell("info", "danger")
    goal = world.request("fed(n1)")
    assert world.run() is None
    assert goal.words[-1] == "succeeded"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_task(seed: int, tmp_path: Path, shares: Counter[str]) -> None:
    """What is planned is valid; what the search reaches is planned, and nothing else."""
    files = DerivedTask(seed, tmp_path).files
    length, is_known = shortest_plan(*files)
    shares["tasks"] += 1
    shares["with a plan" if length else "met" if length == 0 else "without"] += 1
    world, refusal = _imported_or_refused(files)
    if world is None:
        assert _NEVER.fullmatch(refusal), refusal
        assert not length, f"{refusal}, though there is a plan of {length} steps"
        shares["refused"] += 1
        return
    goal = world.request("goal")
    failure = world.run()
    assert failure is None, failure
    assert world.violations == []
    steps: List[str] = [action for who, action in world.published if who != SOLVER]
    if goal.words[-1] == "succeeded":
        shares["planned"] += 1
        assert length is not None or not is_known, steps
        world.world.require_goal()
        assert length is None or len(steps) >= length
    else:
        assert length is None, f"{goal.words}, though there is a plan of {length} steps"
