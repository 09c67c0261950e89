"""Steps without a barrier: docs/protocol.md, section "Steps without a barrier"."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List, Sequence, Tuple

import pytest
from conftest import PACKAGE

from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop import journal
from rosoclingo.loop.words import ABORT

DYNAMIC = sorted(file.stem for file in (PACKAGE / "modes").glob("dynamic.*.lp"))
RECORDING = "dynamic.incremental.recording"
WORKSHOP = PACKAGE.parent / "rosoclingo_aspprograms" / "workshop"
FILES = (str(WORKSHOP / "instances" / "furniture.lp"), str(WORKSHOP / "workshop.lp"))
STEPS = ("-c", "steps=25")

# fast does a(3), a(2) and a(1), by which the goal is reached; slow does z meanwhile.
RULES = """
#external event((fast;slow),(success;busy),t).
holds(left(3),t) :- event(1,go,t).
holds(begun,t) :- event(1,go,t).
status(1,accepted,t) :- event(1,go,t).
{part}
#defined holds/2.
do(fast,a(N),t) :- holds(left(N),t-1), N > 0.
do(slow,z,t) :- holds(begun,t-1).
do(slow,z,t) :- holds(busy(slow,z),t-1).
holds(busy(slow,z),t) :- do(slow,z,t), event(slow,busy,t).
holds(left(N),t) :- do(fast,a(N),t), event(fast,busy,t).
holds(left(N-1),t) :- do(fast,a(N),t), not event(fast,busy,t).
status(1,succeeded,t) :- do(fast,a(1),t), not event(fast,busy,t).
"""
COMMIT = """
#external event(commit,do(fast,a(1..3)),t). #external event(commit,do(slow,z),t).
:- event(commit,do(R,A),t), not do(R,A,t).
#external event(info,passed,t).
:- do(R,A,t), not event(commit,do(R,A),t), event(info,passed,t).
"""
QUERY = "#program query(t). #external query(t). :- query(t), holds(left(N),t), N > 0."
DIALECT_2 = (
    "#program base. rslot(1). holds(F,0) :- event(save,F,0)."
    "#external event(save,(left(0..3);busy(slow,z)),0)."
    "#program state(t). #external event(1,(go;cancel),t)."
    + RULES.format(part="#program transition(t).")
    + f"{COMMIT} {QUERY}"
)
DIALECT_1 = (
    "#program base. rslot(1). #program state(t). #external event(1,(go;cancel),t)."
    + RULES.format(part="#program transition(t).")
    + "#program set_event(id,e,t). event(id,e,t)."
    "#program commit(r,a,t). committed(r,a,t). :- not do(r,a,t)."
    "#program finalize(t). #defined committed/3. :- do(R,A,t), not committed(R,A,t)." + QUERY
)
PAPER = (
    "#program base. id(1). #program transition(t). #external event(request,(1,(go;cancel)),t)."
    "event(1,go,t) :- event(request,(1,go),t)."
    + RULES.format(part="")
    + "occurs(R,A,t) :- do(R,A,t). #program query(t). #external horizon(t)."
    ":- horizon(t), holds(left(N),t), N > 0. #show occurs/3. #show status/3."
)
ON_DEMAND = """
#program base. #defined told/3. rslot(1).
#program event(s,c).
#external event(s,c) : s = 1, c = (go;cancel).
#external event(s,c) : s = (fast;slow), c = (success;busy).
#program event(s,c,t).
told(s,c,t).
#show do(R,A,t) : do(R,A) = c, s = commit.
#show status(s,accepted,t) : c = go.
#program query(t). #external query(t).
#program search(k,t).
through(A,k) :- told(commit,do(R,A),T), not told(R,busy,T).
left(N,k) :- told(1,go,_), N = 1..3, not through(a(N),k).
next(fast,a(N),t+M-N+1,k) :- left(N,k), M = #max { J : left(J,k) }.
next(slow,z,t+1,k) :- told(1,go,_), not through(z,k).
#external newer(k).
newer(k-1) :- k > 1.
#show do(R,A,T) : next(R,A,T,k), not newer(k).
#show status(1,succeeded,T) : next(fast,a(1),T,k), not newer(k).
#show status(1,succeeded,t) : told(commit,do(fast,a(1)),t), not told(fast,busy,t).
#show horizon(N) : N = #max { t; T : next(_,_,T,k) }, not newer(k).
"""


class Robots(SimulatedSystem):
    """Actions that take one second, and some that take more.

    Attributes:
        times: When each action was published, by whom it is done, and which.
        slow: How long actions take that have a word in them.
    """

    def __init__(self, mode: str, files: Sequence[str], *inputs: Tuple[str, ...], **more: Any):
        self.times: List[Tuple[float, str, str]] = []
        self.slow = more.pop("slow", {"z": 10.0, "bake": 10.0})
        self.parts = make_parts(mode, Options(tuple(files)), () if mode == SINGLE else STEPS)
        read = [read_input(*one) for one in inputs]
        super().__init__(self.parts.loop, read, seconds=self._lasts, **more)

    def _lasts(self, _: str, action: str) -> float:
        return next((s for name, s in self.slow.items() if name in action), 1.0)

    def publish(self, actuator: str, action: str) -> None:
        self.times.append((self.clock, actuator, action))
        super().publish(actuator, action)

    def told(self, content: str) -> List[str]:
        """Returns the events that are true, of such a content."""
        return [atom for atom in self.loop.state.externals.true if f",{content}," in atom]

    @property
    def dropped(self) -> List[str]:
        events = [entry.event for entry in self.journal]
        return [event.reason for event in events if isinstance(event, journal.MessageDropped)]


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Sequence[str]]:
    """Writes an encoding, and returns the planner's files."""

    def made(text: str) -> Sequence[str]:
        file = tmp_path / "encoding.lp"
        file.write_text(text)
        return (str(file),)

    return made


# Nobody waits.


@pytest.mark.costly
@pytest.mark.parametrize("mode", [*DYNAMIC, SINGLE])
def test_ten_short_actions_beside_a_long_one(mode: str) -> None:
    robots = Robots(mode, FILES, ("goal:make(box)",))
    assert robots.run() is None
    assert robots.goals[0].words == ["accepted", "succeeded"]
    cuts = [(float(number), "saw", f"work(1,cut({number + 1}))") for number in range(10)]
    assert sorted(robots.times) == sorted([*cuts, (0.0, "oven", "work(1,bake)")])
    assert robots.clock == 10.0


def test_with_a_barrier_all_wait_for_the_slowest(write: Callable[[str], Sequence[str]]) -> None:
    text = Path(FILES[1]).read_text()
    declared = "#external event(R,(success;failure;busy),t)"
    assert declared in text
    files = write(text.replace(declared, "#external event(R,(success;failure),t)"))
    robots = Robots(RECORDING, [FILES[0], *files], ("goal:make(box)",))
    assert robots.run() is None
    assert robots.goals[0].words == ["accepted", "succeeded"]
    assert robots.clock == 19.0


@pytest.mark.parametrize(
    ("mode", "text"),
    [*((mode, DIALECT_2) for mode in (*DYNAMIC, SINGLE)), (SINGLE, DIALECT_1), (SINGLE, PAPER),
     (RECORDING, ON_DEMAND), (SINGLE, ON_DEMAND)],
)  # fmt: skip
def test_all_dialects(mode: str, text: str, write: Callable[[str], Sequence[str]]) -> None:
    """The plan is through before who is busy answers; that begins a step of its own."""
    robots = Robots(mode, write(text), ("goal:go",))
    assert robots.run() is None
    assert robots.warnings == []
    assert sorted(robots.times) == [
        (0.0, "fast", "a(3)"), (0.0, "slow", "z"), (1.0, "fast", "a(2)"), (2.0, "fast", "a(1)"),
    ]  # fmt: skip
    assert robots.goals[0].words == ["accepted", "succeeded"]
    assert robots.clock == 10.0
    (answer,) = [atom for atom in robots.told("success") if atom.startswith("event(slow,")]
    step = int(answer[len("event(slow,success,") : -1])
    assert f"event(slow,busy,{step})" not in robots.told("busy")
    assert f"event(commit,do(slow,z),{step})" in robots.told("do(slow,z)")


# Which answers belong to which step.


def test_answers_that_come_together_belong_to_the_same_step() -> None:
    robots = Robots(RECORDING, FILES, ("goal:make(box)",), slow={})
    robots.run()
    assert robots.told("busy") == []
    assert {"event(saw,success,1)", "event(oven,success,1)"} <= set(robots.told("success"))


def _first_told(robots: Robots) -> int:
    """Returns the number of the command that tells the first answer."""
    commands = [e.event for e in robots.journal if isinstance(e.event, journal.CommandDone)]
    return next(n for n, one in enumerate(commands, 1) if one.command == "assign_messages(1)")


@pytest.mark.costly
@pytest.mark.parametrize(
    ("moment", "step"),
    [("in:{0}", 1), ("after:{0}", 1), ("in:{1}", 2), ("in:{2}", 2), ("after:{2}", 2)],
)
def test_an_answer_belongs_to_the_step_in_which_it_comes(moment: str, step: int) -> None:
    """One that comes when it is known who is busy is kept, and ends no search."""
    number = _first_told(_run_box())
    at = moment.format(number - 1, number, number + 1)  # the last one is the search
    robots = _run_box(("oven:success", at))
    assert f"event(oven,success,{step})" in robots.told("success")
    assert ("event(oven,busy,1)" in robots.told("busy")) == (step == 2)
    assert [action for _, action in robots.published].count("work(1,bake)") == 1
    results = [e.event.result for e in robots.journal if isinstance(e.event, journal.CommandDone)]
    assert all(result is None or result.value != "unknown" for result in results)
    assert robots.clock == 10.0


def _run_box(*inputs: Tuple[str, ...]) -> Robots:
    robots = Robots(RECORDING, FILES, ("goal:make(box)",), *inputs)
    assert robots.run() is None
    assert robots.left == []
    return robots


def test_the_token_stays() -> None:
    robots = Robots(RECORDING, FILES, ("goal:make(box)",))
    told = []
    robots.show_executions = lambda run, all_told: told.extend(all_told)  # type: ignore[method-assign]
    robots.run()
    numbers = {one.number for one in told if one.actuator == "oven"}
    assert len(numbers) == 1
    assert {one.step for one in told if one.actuator == "oven"} == {1}
    assert robots.loop.state.executions.number == len(robots.published) == 11


def test_time_is_counted_from_the_publication() -> None:
    """An action that lasts for many steps is late some time."""
    robots = Robots(
        RECORDING, FILES, ("goal:make(box)",), slow={"bake": 99.0}, action_timeout=5.0
    )  # fmt: skip
    failed: List[float] = []
    warn = robots.warn

    def listen(text: str) -> None:
        warn(text)
        if "oven has not answered for 5 s" in text and not failed:
            failed.append(robots.clock)
            robots.slow["bake"] = 1.0

    robots.warn = listen  # type: ignore[method-assign]
    robots.run()
    assert failed
    assert 5.0 <= failed[0] <= 6.0
    assert robots.goals[0].words == ["accepted", "succeeded"]


# What is aborted, and what is wrong.


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_what_nobody_needs_is_aborted_once(mode: str) -> None:
    robots = Robots(mode, FILES, ("goal:make(box)",), ("cancel:1", "4"))
    robots.run()
    oven = [(time, action) for time, robot, action in robots.times if robot == "oven"]
    assert oven == [(0.0, "work(1,bake)"), (3.0, ABORT)]
    assert robots.loop.state.executions.last["oven"].aborted
    assert robots.goals[0].words == ["accepted", "canceled"]
    assert robots.clock == 10.0  # the oven answers as it does without


def test_who_is_busy_nobody_else_says() -> None:
    robots = _run_box(("oven:busy", "after:8"), ("saw:busy", "in:9"))
    assert [reason.split(": ")[-1] for reason in robots.dropped] == [
        "who is busy, rosoclingo says itself"
    ] * 2
    assert len([text for text in robots.warnings if "dropped a message" in text]) == 2
    assert robots.goals[0].words == ["accepted", "succeeded"]
    assert robots.clock == 10.0


def test_busy_is_an_answer_where_the_encoding_does_not_declare_it() -> None:
    robots = Robots(RECORDING, [f"{EXAMPLES}/line.lp"], ("goal:visit(2)",), ("robot:busy", "1"))
    robots.run()
    assert robots.dropped == []
    assert any("robot has answered busy: that ends its action" in one for one in robots.warnings)


def test_an_encoding_that_does_not_repeat_is_told(write: Callable[[str], Sequence[str]]) -> None:
    text = DIALECT_2.replace(
        "do(slow,z,t) :- holds(busy(slow,z),t-1).", "do(slow,y,t) :- holds(busy(slow,z),t-1)."
    )
    assert text != DIALECT_2
    robots = Robots(RECORDING, write(text), ("goal:go",))
    failure = str(robots.run())
    assert "the plan has do(slow,y,2), and slow is still busy with z" in failure
    assert robots.goals[0].words == ["accepted", "aborted"]
    assert "y" not in [action for _, action in robots.published]
