"""Plans that begin with a first plan of Fast Downward's: legal ones, and what becomes of others."""

from __future__ import annotations

import os
import stat
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner import layers, seeding
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE, Planner
from rosoclingo.loop.values.atoms import Plan, event
from rosoclingo.loop.values.recorded import Recorded
from rosoclingo.seed.downward import NONE, SeedProcess

HERE = Path(__file__).parent
ACTIONS = HERE.parents[1] / "lib" / "actions.lp"
HORIZON = 10_000
SECONDS = 60.0

lama = pytest.mark.skipif(
    find_spec("up_fast_downward") is None,
    reason="up-fast-downward is not installed, see requirements-test.txt",
)


@pytest.fixture
def only_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Has clingo find nothing but what the other planner has found."""

    def turn(_way: object, _stopped: Callable[[], bool]) -> None:
        time.sleep(0.01)

    monkeypatch.setattr(layers._Way, "turn", turn)
    for name in ("_SEED_SECONDS", "_MOST_SECONDS"):  # on a busy machine
        monkeypatch.setattr(layers, name, SECONDS)


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> List[int]:
    """Has clingo wait for what the other planner finds; then these are the layers to be tried."""
    tried: List[int] = []
    is_taken = False
    take, turn = seeding.Seed.take, layers._Way.turn

    def note(seed: seeding.Seed) -> Iterator[Tuple[int, List[wire.Assumption]]]:
        nonlocal is_taken
        is_taken = True
        for one in take(seed):
            tried.append(one[0])
            yield one

    def wait(way: layers._Way, stopped: Callable[[], bool]) -> Optional[SearchEnded]:
        if is_taken:
            return turn(way, stopped)
        time.sleep(0.01)
        return None

    monkeypatch.setattr(seeding.Seed, "take", note)
    monkeypatch.setattr(layers._Way, "turn", wait)
    return tried


def make_planner(encoding: Path, *requests: str, seed_planner: str = "lama") -> Planner:
    engine = Engine(Options((str(encoding),)))
    planner = Planner(engine, DEFAULT_PATIENCE, seed_planner=seed_planner)
    planner.begin()
    told = [event(str(slot), text, 0) for slot, text in enumerate(requests, 1)]
    assert planner.tell(told) == []
    return planner


def find_plan(planner: Planner) -> List[str]:
    """Returns the actions of its plan, in the order of their steps."""
    outcome = planner.search(0, HORIZON, lambda: False)
    assert outcome.result is wire.Result.SAT
    return actions_of(outcome)


def actions_of(outcome: wire.Outcome) -> List[str]:
    return [f"{one.actuator}: {one.name}" for one in Plan(outcome.symbols).actions_from(0)]


@lama
@pytest.mark.usefixtures("only_seeds")
def test_blocks() -> None:
    below: Dict[str, str] = {str(n): "table" if n % 2 else str(n - 1) for n in range(1, 9)}
    for action in find_plan(make_planner(HERE / "blocks.lp", "tower")):
        name, _, arguments = action[5:-1].partition("(")
        block, spot = arguments.split(",")
        holds = [one for one, place in below.items() if place == "hand"]
        assert holds == ([] if name == "pick" else [block])
        assert block not in below.values()
        assert spot == "table" or spot not in [p for b, p in below.items() if b != block]
        below[block] = "hand" if name == "pick" else spot
    assert [below[str(n)] for n in range(1, 8)] == [str(n) for n in range(2, 9)]


LAMPS = """
#include "{actions}".
#program base.
way(1..4,2..5).
moves(robot).
initially(at(robot),1).
initially(lamp(1..3),off).
initially(door,shut).
action(robot,press(N)) :- N = 1..3.
needs(robot,press(N),at(robot),N+1) :- N = 1..3.
needs_other(robot,press(N),door,shut) :- N = 1..3.
sets_if(robot,press(N),on(L),lamp(L),on) :- N = 1..3, L = 1..3, |N-L| <= 1.
sets_if(robot,press(N),off(L),lamp(L),off) :- N = 1..3, L = 1..3, |N-L| <= 1.
condition(robot,press(N),on(L),lamp(L),off) :- N = 1..3, L = 1..3, |N-L| <= 1.
condition(robot,press(N),off(L),lamp(L),on) :- N = 1..3, L = 1..3, |N-L| <= 1.
action(porter,open(ajar;wide)).
needs(porter,open(X),door,shut) :- X = (ajar;wide).
sets(porter,open(X),door,X) :- X = (ajar;wide).
costs(porter,open(wide),3).
request((light;dark)).
wants(light,lamp(1..3),on).
wants(dark,at(robot),5).
wants(dark,lamp(1),off).
"""


@lama
@pytest.mark.usefixtures("only_seeds")
@pytest.mark.parametrize("requests", [["light"], ["dark"], ["light", "dark"]])
def test_conditions_and_ways(requests: List[str], tmp_path: Path) -> None:
    """Each lamp changes with those beside it; two requests want a lamp to be on, and to be off."""
    encoding = tmp_path / "lamps.lp"
    ways = "".join(f"way({n},{n + 1}). way({n + 1},{n}). " for n in range(1, 5))
    encoding.write_text(LAMPS.format(actions=ACTIONS).replace("way(1..4,2..5).", ways))
    planner = make_planner(encoding, *requests)
    check_lamps(find_plan(planner), requests)
    assert planner.quality is not None
    first = planner.quality.cost
    better = planner.improve(0, lambda: False)
    assert planner.quality.is_best
    if better is not None:
        assert planner.quality.cost < first
        check_lamps(actions_of(better), requests)


def check_lamps(actions: List[str], requests: List[str]) -> None:
    assert ("light" in requests) == any(action.startswith("porter") for action in actions)
    place, lamps = 1, [False] * 3
    met = {"light": False, "dark": False}
    for action in actions:
        name, _, argument = action[:-1].partition(": ")[2].partition("(")
        if name == "go":
            assert abs(int(argument) - place) == 1
            place = int(argument)
        elif name == "press":
            number = int(argument)
            assert place == number + 1
            lamps = [on ^ (abs(number - lamp) <= 1) for lamp, on in enumerate(lamps, 1)]
        met["light"] |= all(lamps)
        met["dark"] |= place == 5 and not lamps[0]
    assert all(met[request] for request in requests)


@lama
@pytest.mark.usefixtures("only_seeds")
def test_boxes() -> None:
    """The other planner knows nothing of fuel and room, and what it has found fits here."""
    actions = find_plan(make_planner(HERE / "transport.lp", "bring(2,5)", "bring(3,1)"))
    assert sum("load(" in action for action in actions) == 4


NUMBERS = """
#include "{actions}".
#program base.
number(power,10).
initially(power,5).
action(arm,charge).
needs(arm,charge,lamp,on).
fills(arm,charge,power).
action(arm,light).
sets(arm,light,lamp,on).
initially(lamp,off).
action(eye,look).
uses(eye,look,power,8).
sets(eye,look,seen,yes).
initially(seen,no).
request(see).
wants(see,seen,yes).
"""


def write_numbers(folder: Path) -> Path:
    encoding = folder / "numbers.lp"
    encoding.write_text(NUMBERS.format(actions=ACTIONS))
    return encoding


@lama
def test_a_seed_that_is_impossible_because_of_numbers(tmp_path: Path, taken: List[int]) -> None:
    """There is too little power to look at once, which clingo knows; so it is dropped."""
    actions = find_plan(make_planner(write_numbers(tmp_path), "see"))
    assert taken == [1]
    assert actions == ["arm: light", "arm: charge", "eye: look"]


@pytest.mark.parametrize("text", ["exit 1", "echo plan", "echo '(999999999)'"])
def test_a_seed_planner_that_fails(
    text: str, tmp_path: Path, taken: List[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or that plans nonsense: the search goes on without it."""
    use_program(monkeypatch, tmp_path, f"cat > /dev/null; {text}")
    assert find_plan(make_planner(write_numbers(tmp_path), "see"))
    assert taken == []


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> List[SeedProcess]:
    """The processes that were started."""
    processes: List[SeedProcess] = []

    class Noted(SeedProcess):
        def __init__(self, program: Path, task: str) -> None:
            super().__init__(program, task)
            processes.append(self)

    monkeypatch.setattr(seeding, "SeedProcess", Noted)
    return processes


def test_news_end_the_other_search(
    tmp_path: Path, begun: List[SeedProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The process has ended when the search has; the next search begins another one."""
    use_program(monkeypatch, tmp_path, "exec sleep 1000")
    planner = make_planner(HERE / "blocks.lp", "tower")
    for number in (1, 2):
        outcome = planner.search(0, HORIZON, lambda number=number: len(begun) == number)  # type: ignore[misc] # mypy#12557
        assert outcome.result is wire.Result.UNKNOWN
        assert outcome.interrupted
        assert len(begun) == number
        with pytest.raises(ProcessLookupError):
            os.kill(begun[-1].pid, 0)
        planner.tell([event("1", "cancel", 0)] if number == 2 else [event("2", "tower", 0)])


@pytest.mark.costly
@lama
@pytest.mark.usefixtures("only_seeds")
def test_what_is_left_of_a_plan_comes_first(
    begun: List[SeedProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other planner is asked again only if that does not fit any more."""
    planner = make_planner(HERE / "blocks.lp", "tower")
    first = find_plan(planner)
    monkeypatch.undo()
    monkeypatch.setattr(layers, "_SAME_SECONDS", SECONDS)  # on a busy machine
    monkeypatch.setattr(seeding, "SeedProcess", None)
    planner.tell(["event(info,passed,0)"])
    assert find_plan(planner) == first
    assert len(begun) == 1


class Noted(Recorded):
    """Knows what another planner has noted."""

    def __init__(self, noted: List[SearchEnded]) -> None:
        super().__init__(knows_searches=True)
        self._noted = noted

    def search_due(self, *ways: Ended, number: int = 0) -> Optional[SearchEnded]:
        is_due = self._noted and self._noted[0].how in ways and self._noted[0].round == number
        return self._noted.pop(0) if is_due else None


@pytest.mark.costly
@lama
@pytest.mark.usefixtures("only_seeds")
def test_a_replay_asks_nobody() -> None:
    """The journal has what was found."""
    planner = make_planner(HERE / "blocks.lp", "tower")
    noted: List[SearchEnded] = []
    planner.note = noted.append
    actions = find_plan(planner)
    assert Ended.LAYERED in [ended.how for ended in noted]
    again = make_planner(HERE / "blocks.lp", "tower", seed_planner=NONE)
    again.recorded = Noted(noted)
    assert find_plan(again) == actions
    assert noted == []


def use_program(monkeypatch: pytest.MonkeyPatch, folder: Path, text: str) -> None:
    """Puts a script in the place of the other planner."""
    made = folder / "planner.sh"
    made.write_text(f"#!/bin/sh\n{text}\n")
    made.chmod(made.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("rosoclingo.loop.planner.planner.find_seed_planner", lambda _: made)
