"""Beliefs are kept, published, noted in the journal and replayed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any, Dict, List, Mapping, Sequence, Tuple

import pytest
from conftest import PACKAGE, Make
from crashes import Life, Runs, World, outcome
from test_replay_inbox import replay_alike

from rosclingo.solver.options import Options
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.believing import BeliefKeeper
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.journal import BeliefsChanged
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.loop.values.beliefs import Beliefs, Evidence, Observation
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.loop.values.snapshot import decode, encode
from rosoclingo.store.store import Store
from rosoclingo.tools.plan.story import RunStory

MAILBOT = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot"
ENCODING = MAILBOT / "mailbot_causes.lp"
RECORDING, DYN_RESET = (f"dynamic.incremental.{name}" for name in ("recording", "dyn_reset"))
SQUARE = """
#include "{encoding}".
#program base.
corridor(a). corridor(b). corridor(c). corridor(d). office(o1). office(o2).
connection(a,b). connection(b,c). connection(a,d). connection(d,c).
connection(o1,a). connection(c,o2). start(robot,o1).
"""
REQUEST = "bring(o1,o2)"
FAILED, AGAIN = "observes(drive(robot,a,b),failure,1)", "observes(drive(robot,a,b),failure,2)"
TERMS = (FAILED, "belief(1,2,passing)", "belief(2,3,blocked)", "certain(passing)")


@pytest.fixture
def square(tmp_path: Path) -> str:
    """A robot that is to go around four corners, and looks for causes."""
    file = tmp_path / "square.lp"
    file.write_text(SQUARE.format(encoding=MAILBOT / "mailbot_causes.lp"), encoding="utf-8")
    return str(file)


class Square(System):
    """The robot, which does not get from one corner to the next.

    Attributes:
        shown: What was published of beliefs.
    """

    def __init__(self, file: str, mode: str = RECORDING) -> None:
        self.shown: List[Tuple[Beliefs, Mapping[str, float]]] = []
        super().__init__(make_parts(mode, Options((file,)), ("-c", "steps=30")).loop)

    def turn(self) -> bool:
        self.clock += 1.0
        for actuator, action in sorted(self.acting.items()):
            self.answer(actuator, "failure" if action == "go(b)" else "success")
        return bool(self._items)

    def show_beliefs(self, beliefs: Beliefs, since: Mapping[str, float]) -> None:
        self.shown.append((beliefs, since))


def changes(journal: Sequence[Any]) -> List[BeliefsChanged]:
    return [one.event for one in journal if isinstance(one.event, BeliefsChanged)]


def test_terms_of_other_forms_are_skipped() -> None:
    strange = ("belief(x,y,z)", "belief(1)", "speaks_up(a)", "observes(a,b,c,d)", "certain", "is_(")
    read = Beliefs.read((*strange, "belief(2,-3,c)", "belief(1,2,b)", "speaks_against(b,o,1,x)"))
    assert read.explanations == ((0, ("z",)), (2, ("b",)), (0, ("c",)))
    assert read.evidence == {"b": Evidence((), ((Observation("o", 1), "x"),))}
    assert Beliefs.read(()).believed == ()


def test_a_plan_tells_beliefs_from_the_rest() -> None:
    plan = Plan(
        ("do(r,a,1)", "holds(belief(x),1)", *TERMS, "beliefs(1)", "feedback(1,observes(x))")
    )
    assert plan.beliefs == tuple(sorted(TERMS))
    assert [str(one) for one in plan.actions(1)] == ["do(r,a,1)"]


def test_since_when() -> None:
    """A cause that comes back is believed since then; one that stays, since it first was."""
    keeper, now = BeliefKeeper(), [10.0]

    def take(*terms: str, step: int) -> bool:
        now[0] += 1.0
        return keeper.take(terms, step, lambda: now[0])

    assert not take(step=0)
    assert not keeper.is_shown
    assert take(*TERMS, step=3)
    assert not take(*TERMS, step=4)
    assert take(*TERMS, AGAIN, step=5)
    assert keeper.since == {"passing": 12.0}
    assert keeper.steps == {FAILED: 3, AGAIN: 5}
    keeper.begin_steps(4)
    assert keeper.steps == {FAILED: -2, AGAIN: 0}
    assert take("belief(1,2,blocked)", AGAIN, step=1)
    assert (keeper.since, keeper.steps) == ({"blocked": 15.0}, {AGAIN: 0})
    assert decode(BeliefKeeper, encode(keeper)) == BeliefKeeper(
        ("belief(1,2,blocked)", AGAIN), keeper.since, keeper.steps, True
    )
    assert take(step=2)
    assert take(*TERMS, step=3)
    assert keeper.since == {"passing": 17.0}


@pytest.mark.costly
@pytest.mark.parametrize("mode", [RECORDING, DYN_RESET])
def test_beliefs_of_a_run(mode: str, square: str) -> None:
    run = Square(square, mode)
    goal = run.request(REQUEST)
    assert run.run() is None
    assert goal.words == ["accepted", "succeeded"]
    noted = changes(run.journal)
    assert [Beliefs.read(one.terms) for one in noted] == [shown for shown, _ in run.shown]
    assert all(one != two for one, two in zip(noted, noted[1:]))
    believed = [shown.believed for shown, _ in run.shown if shown.believed]
    assert list(dict.fromkeys(believed)) == [("passing(a,b,1)",), ("blocked(a,b,1)",)]
    times = [since["blocked(a,b,1)"] for _, since in run.shown if "blocked(a,b,1)" in since]
    assert len(times) > 1
    assert len(set(times)) == 1
    first, last = run.shown[0], run.shown[believed.index(("blocked(a,b,1)",))]
    assert first[0].observed == {Observation("drive(robot,a,b)", 1): "failure"}
    assert first[0].about == {Observation("drive(robot,a,b)", 1): ("robot", "go(b)")}
    assert last[0].certain == {"blocked(a,b,1)"}
    steps = [entry.step for entry in run.journal if isinstance(entry.event, BeliefsChanged)]
    known = run.loop.state.beliefs
    assert mode == DYN_RESET or known.steps.get(FAILED, steps[0]) == steps[0] == 3


@pytest.mark.costly
def test_the_story_tells_what_is_believed_when_that_is_another_cause(square: str) -> None:
    run = Square(square)
    run.request(REQUEST)
    assert run.run() is None
    lines: List[str] = []
    story = RunStory(lines.append, phrases=lambda: TermPhrases.read([ENCODING.read_text()]))
    for entry in run.journal:
        story.hear(entry)
    told = [line.strip() for line in lines if "believed" in line]
    assert told[:2] == [
        "believed: something was in the way between a and b for a moment",
        "believed: something stands between a and b",
    ]  # fmt: skip
    assert len(told) == len(set(told)) <= 3


def test_an_encoding_that_looks_for_no_causes_has_none(square: str) -> None:
    file = Path(square)
    file.write_text(SQUARE.format(encoding=MAILBOT / "mailbot.lp"), encoding="utf-8")
    run = Square(square)
    run.request(REQUEST)
    assert run.run() is None
    assert ("robot", "go(d)") in run.published
    assert (run.shown, changes(run.journal)) == ([], [])
    assert encode(run.loop.state.beliefs) == encode(BeliefKeeper())


@pytest.mark.costly
def test_a_replay_believes_the_same(square: str, system: Make) -> None:
    run = Square(square)
    run.request(REQUEST)
    assert run.run() is None
    inbox = ReplayInbox(input_schedule(Run(run.journal)))
    again = system(RECORDING, "-c", "steps=30", encoding=(square,), inbox=inbox)
    replayed = replay_alike(again, run.journal, 1)
    assert changes(replayed) == changes(run.journal) != []


class TimedWorld(World):
    """The robot in a world with a clock, which counts what was done.

    Attributes:
        shown: What was heard of beliefs last.
    """

    def __init__(self) -> None:
        super().__init__([REQUEST], failures=(3, 4))
        self.shown: Tuple[object, Mapping[str, float]] = (None, {})


@pytest.mark.costly
def test_beliefs_outlive_crashes(
    square: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever the process dies, the same is believed, since the same time, and heard."""

    def show(life: Life, *shown: Any) -> None:
        life._world.shown = shown  # type: ignore[attr-defined]

    monkeypatch.setattr(Life, "world_now", lambda life: float(len(life._world.effects)))
    monkeypatch.setattr(Life, "show_beliefs", show)
    runs = Runs(tmp_path, RECORDING, square)
    found: List[Dict[str, object]] = []

    def live(*kills: int) -> List[str]:
        world, file = TimedWorld(), runs.file()
        points = runs.run(world, kills, file)
        with closing(Store(file)) as store:
            assert store.snapshot is not None
            noted = changes(store.records)
            saved = store.snapshot.state.beliefs
        found.append(
            {"outcome": outcome(world), "noted": noted, "saved": saved, "shown": world.shown}
        )
        return points

    calm = list(live())
    first = calm.index("before beliefs") + 1
    last = len(calm) - calm[::-1].index("before beliefs")
    live(first)
    live(first + 1, 9)
    live(last)
    assert runs.kills == 4
    assert found[0]["noted"]
    assert found[1:] == found[:1] * 3
