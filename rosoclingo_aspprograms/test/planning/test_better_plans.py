"""A first plan at once, and then a better one, which is never worse and in the end the best."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Dict, List

import pytest
from draws import draws
from episode import MAILBOT, RESET, SINGLE
from test_fleet import Fleet
from test_seconds import draw_map, replay

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Outcome, Result
from rosoclingo.loop import improving
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import Plan

AT_ONCE = 1e-6  # seconds


class Instance:
    """A random map with requests.

    Attributes:
        news: What a plan does not expect, and what changes nothing.
    """

    def __init__(self, seed: int, robots: int, folder: Path) -> None:
        pick = random.Random(f"anytime {seed} {robots}")
        self._graph = draw_map(pick, robots)
        self._file = folder / "instance.lp"
        self._file.write_text(self._graph.facts())
        jobs = [pick.sample(sorted(self._graph.offices), 2) for _ in range(5)]
        when = ["", "", "", ",urgent", ",by(40)"]
        way = sorted(min(self._graph.edges, key=sorted))
        self.news = "event(info,unblocked({},{}),0)".format(*way)
        self._events = [
            f"event({slot},bring({origin},{destination}{pick.choice(when)}),0)"
            for slot, (origin, destination) in enumerate(jobs, 1)
        ]

    def planner(self, patience: float, *options: str) -> Planner:
        """Returns a planner that knows the requests."""
        options = ("-c", "slots=5", *options)
        planner = Planner(Engine(Options((str(self._file), MAILBOT), options)), patience)
        planner.begin()
        assert planner.tell(self._events) == []
        return planner

    def ends(self, outcome: Outcome) -> Dict[str, int]:
        """Checks a plan, and returns when each delivery is through."""
        assert outcome.result is Result.SAT
        return replay(self._graph, Plan(outcome.symbols), [])


def search(planner: Planner) -> Outcome:
    return planner.search(0, 10_000, lambda: False)


@pytest.mark.costly
@pytest.mark.parametrize("minimise", ["last", "waits"])
@pytest.mark.parametrize("seed", range(4))
def test_it_ends_with_the_best_plan(
    seed: int, minimise: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "rosoclingo.loop.planner.searching._SAME_SECONDS", 60.0
    )  # on a busy machine
    instance = Instance(seed, 1 + seed % 2, tmp_path)
    options = ("-c", f"minimise={minimise}")
    proven = instance.planner(0.0, *options)
    instance.ends(search(proven))
    assert proven.quality is not None
    assert proven.quality.is_best

    planner = instance.planner(AT_ONCE, *options)
    first = search(planner)
    instance.ends(first)
    found = planner.quality
    assert found is not None
    costs = [found.cost]
    for looks in (1, 2):  # something comes each time
        polls = iter([False] * looks)
        better = planner.improve(0, lambda polls=polls: next(polls, True))  # type: ignore[misc]
        assert planner.quality is not None
        costs.append(planner.quality.cost)
        if better is not None:
            assert costs[-1] < costs[-2]
            instance.ends(better)
    last = planner.improve(0, lambda: False)
    assert planner.quality == proven.quality
    costs.append(proven.quality.cost)
    assert costs == sorted(costs, reverse=True)
    stands = search(planner)
    assert planner.quality == proven.quality
    if last is not None:
        assert instance.ends(stands) == instance.ends(last)

    assert planner.tell([instance.news]) == []
    instance.ends(search(planner))  # a search that begins with what is left of the plan
    assert planner.quality is not None
    assert planner.quality.cost == proven.quality.cost


FLEETS = [(RESET, 5), (SINGLE, 11), (RESET, 1), (SINGLE, 3)]


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "seed"), [FLEETS[number] for number in draws(range(2), 4)])
def test_a_random_fleet(
    mode: str, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In two modes; an input comes after a while, be it a search for a better plan or not."""
    fleet = Fleet(mode, seed, tmp_path)
    state, left = fleet.loop.state, random.Random(seed)
    state.planner.patience = AT_ONCE
    called = improving.is_called
    monkeypatch.setattr(improving, "is_called", lambda one: left.random() < 0.3 or called(one))
    fleet._ask()
    failure = fleet.run()
    assert failure is None, failure
    assert fleet.validator.finish() == []
    ways: List[Ended] = [e.event.how for e in fleet.journal if isinstance(e.event, SearchEnded)]
    assert Ended.NOTHING not in ways
    assert {Ended.BETTER, Ended.AS_BEFORE} & set(ways)
