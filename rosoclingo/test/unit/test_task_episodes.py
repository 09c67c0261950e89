"""Random episodes in domains of ``actions.lp``, with kills; their journals are replayed exactly.

TASK_EPISODES=300 in the environment runs so many, FULL=1 runs 60.
"""

from __future__ import annotations

from collections import Counter
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any, Dict, List, Tuple

import pytest
from crashes import Runs, World
from draws import draws
from task_judge import Rules
from task_world import DOMAINS, MOST_SLOTS, TaskLife, TaskWorld
from test_replay_kills import Replayed

from rosoclingo.bags.compare import text_report
from rosoclingo.bags.compare.comparison import compare
from rosoclingo.bags.read.run import Run
from rosoclingo.engine.process import SearchProcess
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.loop.journal import Ended, Entry, SearchEnded
from rosoclingo.loop.planner import task_search
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.store.store import Store

MODES = [*(f"dynamic.incremental.{name}" for name in ("recording", "reset", "dyn_reset")), SINGLE]
STEPS = 400
SEEDS = draws((0, 2, 3, 9, 20, 46, 47, 59, 61, 62), 60, "TASK_EPISODES")
TIMED_SEEDS = draws((1, 3, 6, 8, 9, 11, 14, 17), 60, "TASK_EPISODES")


@pytest.fixture(scope="module")
def rules() -> Dict[str, Rules]:
    return {name: Rules(domain.files, MOST_SLOTS) for name, domain in DOMAINS.items()}


def play(
    seed: int,
    rules: Dict[str, Rules],
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    *,
    is_timed: bool = False,
) -> Tuple[TaskWorld, Runs, List[Entry]]:
    """Plays an episode; returns its world, which has judged it, and its journal."""
    monkeypatch.setattr("crashes.Life", TaskLife)
    monkeypatch.setattr(task_search, "_IMPROVE_SECONDS", 0.05)
    chance = Random(f"episode {seed}")
    names = [name for name, domain in DOMAINS.items() if domain.is_timed == is_timed]
    name = names[seed % len(names)]
    domain, mode = DOMAINS[name], MODES[seed // len(names) % len(MODES)]
    options = ["-c", f"slots={chance.choice(domain.slots)}"]
    runs = Runs(folder, mode, domain.files, STEPS, options)
    if chance.random() < 0.5:  # better plans are looked for while robots act
        runs.parameters = {"patience": DEFAULT_PATIENCE}
    if chance.random() < 0.1:  # clingo looks for layers, too
        monkeypatch.setattr(task_search, "_ALONE_SECONDS", -1.0)
    world = TaskWorld(rules[name], domain, chance)
    file = runs.file()
    runs.run(world, [chance.randrange(5, 200) for _ in range(chance.choice([0, 0, 1, 3]))], file)
    with closing(Store(file)) as store:
        journal = list(store.records)
    ways = Counter(one.event.how.name for one in journal if isinstance(one.event, SearchEnded))
    print(name, mode, {**world.counts, "kills": runs.kills}, dict(ways))
    return world, runs, journal


@pytest.mark.costly
@pytest.mark.parametrize(
    ("seed", "is_timed"),
    [*((seed, False) for seed in SEEDS), *((seed, True) for seed in TIMED_SEEDS)],
)
def test_a_random_episode(
    seed: int,
    is_timed: bool,
    rules: Dict[str, Rules],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    world, runs, recorded = play(seed, rules, tmp_path, monkeypatch, is_timed=is_timed)
    assert world.judge() == []
    again = Replayed(runs, recorded).play()
    comparison = compare(Run(recorded), Run(again))
    assert not comparison.differences, text_report.describe(comparison)


@pytest.mark.costly
def test_a_run_that_goes_on_knows_its_task_and_its_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a kill, what is left of the plan stands, and clingo looks for none."""
    begun: List[object] = []
    begin = SearchProcess.__init__

    def note(*arguments: Any, **options: Any) -> None:
        begun.append(arguments)
        begin(*arguments, **options)

    monkeypatch.setattr(SearchProcess, "__init__", note)
    runs = Runs(tmp_path, MODES[2], DOMAINS["kitchen"].files, STEPS)
    points = len(runs.run(World(["meal(stew)"], failures=[1])))
    assert len(begun) == 1
    for point in range(points // 4, points, points // 4):
        begun.clear()
        file, world = runs.file(), World(["meal(stew)"], failures=[1])
        runs.run(world, [point], file)
        assert world.clients["1"].end() == ["succeeded"]
        assert len(begun) == 1, point
        with closing(Store(file)) as store:
            ways = {one.event.how for one in store.records if isinstance(one.event, SearchEnded)}
        assert Ended.LAYERED not in ways
