"""The first plan goes out at once, and a better one takes its place while robots act."""

from __future__ import annotations

import random
import threading
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence

import pytest
from conftest import PACKAGE, Make, System
from replay_maker import run_of
from test_replay_inbox import Session, replay, replay_alike

from rosclingo.errors import ParameterError
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Assumed, Outcome, Result
from rosoclingo.bags.compare.comparison import compare
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule, rest
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.improving import improve
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import (
    Phase,
    ReplayInbox,
    ScheduledInput,
    ScheduledKind,
    decode,
    encode,
)
from rosoclingo.loop.journal import (
    IMPROVING,
    ActionTook,
    CommandDone,
    Ended,
    Entry,
    Event,
    LoopWaits,
    MessageArrived,
    PlanFound,
    Record,
    SearchEnded,
    to_text,
)
from rosoclingo.loop.planner import layers
from rosoclingo.loop.planner.task_search import TaskSearch
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.solver import Forwarding
from rosoclingo.tools.plan.command_line import parse, simulated

AT_ONCE = 1e-6  # seconds
MAILBOT = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot"
HALL = [str(MAILBOT / "instances" / "graph_hall.lp"), str(MAILBOT / "mailbot.lp")]
REQUESTS = ["bring(a,b)", "bring(b,c)", "bring(d,a)", "bring(c,d)", "bring(b,a)"]
MODES = ["recording", "dyn_reset"]


def simulation(mode: str, patience: float) -> SimulatedSystem:
    options = Options(tuple(HALL), ("-c", "slots=5"))
    parts = make_parts(f"dynamic.incremental.{mode}", options, ("-c", "steps=60"))
    lasts = {"a": 5.0, "b": 8.0, "c": 3.0, "d": 12.0}
    return SimulatedSystem(parts.loop, seconds=lambda _, action: lasts.get(action[3:4], 2.0),
                      patience=patience)  # fmt: skip


def events(entries: Sequence[Entry], kind: Any) -> List[Any]:
    return [entry.event for entry in entries if isinstance(entry.event, kind)]


def improving(run: SimulatedSystem) -> List[SearchEnded]:
    return [one for one in events(run.journal, SearchEnded) if one.how in IMPROVING]


@pytest.mark.costly
@pytest.mark.parametrize("mode", MODES)
def test_a_better_plan_takes_the_place_of_the_first(mode: str) -> None:
    run = simulation(mode, AT_ONCE)
    shown: List[Optional[Quality]] = []
    run.show_quality = shown.append  # type: ignore[method-assign]
    for request in REQUESTS:
        run.request(request)
    assert run.run() is None
    assert {goal.words[-1] for goal in run.goals} == {"succeeded"}
    assert run.warnings == []
    plans = events(run.journal, PlanFound)
    first, better = [one for one in plans if one.actions][:2]
    assert not first.is_best
    assert better.is_best
    assert better.quality.cost == better.quality.bound
    searches = improving(run)
    assert searches[0].how is Ended.BETTER
    assert searches[0].quality == better.quality
    assert all(one.quality.is_best for one in searches)  # nothing has come in the meantime
    assert [quality.is_best for quality in shown[:2] if quality is not None] == [False, True]
    told = [line for goal in run.goals for line in goal.lines if line.startswith("expected")]
    assert len(told) > len(run.goals)  # when each package comes, again for the better plan

    proven = simulation(mode, 0.0)
    for request in REQUESTS:
        proven.request(request)
    assert proven.run() is None
    assert events(proven.journal, SearchEnded) == []
    assert all(plan.is_best for plan in events(proven.journal, PlanFound))
    assert run.clock <= 2 * proven.clock


@pytest.mark.costly
def test_at_the_desk_patience_is_the_end() -> None:
    """No time goes by while a better plan is looked for, so that this might never end."""
    goals = [word for request in REQUESTS for word in ("--goal", request)]
    chosen = parse([*HALL, "-c", "slots=5", "-c", "steps=60", "--patience", str(AT_ONCE), *goals])
    parts = make_parts(chosen.mode, chosen.options, chosen.mode_options)
    run = SimulatedSystem(parts.loop, **simulated(chosen))
    assert run.run() is None
    assert {goal.words[-1] for goal in run.goals} == {"succeeded"}
    assert run.loop.state.planner.demand.improves
    assert improving(run) == []
    assert not all(plan.is_best for plan in events(run.journal, PlanFound))


def test_without_patience_nothing_is_looked_for(system: Make) -> None:
    """Nor while nobody acts, or by an encoding that has not opted in."""
    run = simulation("recording", AT_ONCE)
    assert not improve(run.loop.state)
    line = system("dynamic.incremental.recording")
    line.loop.state.planner.patience = AT_ONCE
    line.start()
    assert line.goal("visit(3)").wait() == "succeeded"
    assert not line.loop.state.planner.demand.improves


class Called(Forwarding):
    """A planner to which something comes in its search for a better plan."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.comes: Callable[[], None] = lambda: None
        self._improves = False

    def solve(self, assumptions: Sequence[Assumed] = (), *others: Any) -> Outcome:
        if self._improves:
            self.comes()
        self._improves = any(one.name.startswith("as_before") for one in assumptions)
        return super().solve(assumptions, *others)


def called(comes: Callable[[SimulatedSystem], None]) -> SimulatedSystem:
    run = simulation("recording", AT_ONCE)
    planner = run.loop.state.planner
    planner._solver = wrapped = Called(planner._solver)
    wrapped.comes = lambda: comes(run)
    for request in REQUESTS:
        run.request(request)
    return run


@pytest.mark.costly
def test_an_input_ends_the_search() -> None:
    """What it has found by then is taken."""
    run = called(lambda run: run.request("bring(a,c)") if len(run.goals) < 6 else None)
    assert run.run() is None
    hows = [one.how for one in improving(run)]
    assert hows[0] in (Ended.AS_BEFORE, Ended.BETTER)
    first = improving(run)[0]
    assert not first.quality.is_best
    assert first.quality.bound
    assert [goal.words[-1] for goal in run.goals] == ["succeeded"] * 6


@pytest.mark.costly
def test_who_does_not_answer_is_seen_in_the_search() -> None:
    def wait(run: SimulatedSystem) -> None:
        run.clock += 100.0

    run = called(wait)
    run.loop.state.watchdog.action_timeout = 50.0
    assert run.run() is None
    assert any("~action_timeout" in text for text in run.warnings)


@pytest.mark.costly
def test_the_search_is_kept_in_a_replay(system: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """With answers that come while it is looked for a better plan, and goals.

    The solver of the replay finds other plans of the same cost.
    """
    monkeypatch.setattr("rosoclingo.loop.improving._QUIET_SECONDS", 0.0)
    for seed in range(2):
        mode = f"dynamic.incremental.{MODES[seed]}"

        def make(inbox: Inbox, *options: str, mode: str = mode) -> System:
            options = ("-c", "slots=4", *options)
            made = system(mode, "-c", "steps=80", encoding=[*HALL, *options], inbox=inbox)
            made.loop.state.planner.patience = AT_ONCE
            return made

        recorded = record(make(Inbox()), seed)
        assert {one.how for one in events(recorded, SearchEnded)} > {Ended.CUT, Ended.FINISHED}
        assert events(recorded, ActionTook)
        replay_otherwise(make, recorded, seed, SearchEnded, ActionTook, PlanFound)


HOSPITAL = [
    str(MAILBOT.parent / "hospital" / name) for name in ("hospital.lp", "instances/small.lp")
]
LINEN = [f"linen(ward_{ward},bags({bags}))" for ward in "abcd" for bags in (1, 2)]


def hospital(system: Make, mode: str) -> Make:
    """Makes systems that take first plans at once, with an inbox and options for the planner."""

    def make(inbox: Inbox, *options: str) -> System:
        name, steps = f"dynamic.incremental.{mode}", ("-c", "steps=400")
        made = system(name, *steps, encoding=[*HOSPITAL, *options], inbox=inbox)
        made.loop.state.planner.patience = AT_ONCE
        return made

    return make


@pytest.mark.costly
@pytest.mark.parametrize("how", [Ended.FOUND, Ended.LAYERED])
@pytest.mark.parametrize("mode", MODES)
def test_searches_for_tasks_and_in_layers_are_kept_in_a_replay(
    system: Make, mode: str, how: Ended, monkeypatch: pytest.MonkeyPatch
) -> None:
    if how is Ended.LAYERED:
        monkeypatch.setattr(TaskSearch, "find", lambda *_: None)  # as if it took long

    make = hospital(system, mode)
    recorded = record(make(Inbox()), 3, LINEN, "unlocked(isolation)", 3)
    assert how in {one.how for one in events(recorded, SearchEnded)}
    monkeypatch.setattr(TaskSearch, "find", lambda *_: pytest.fail("a replay searches"))
    replay_otherwise(make, recorded, 3, SearchEnded, PlanFound)


class Prompt(Forwarding):
    """A solver that finds nothing if a search has to end when it begins."""

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        *others: Any,
    ) -> Outcome:
        if stopped is not None and stopped():
            return Outcome(Result.UNKNOWN, interrupted=True)
        return super().solve(assumptions, stopped, *others)


@pytest.mark.costly
@pytest.mark.parametrize("how", [Ended.FOUND, Ended.LAYERED])
def test_an_input_between_two_answer_sets_is_kept_in_a_replay(
    system: Make, how: Ended, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the replay, it is there when the search for the first answer set begins."""
    if how is Ended.LAYERED:
        monkeypatch.setattr(TaskSearch, "find", lambda *_: None)
    make = hospital(system, "recording")

    def make_prompt(inbox: Inbox, *options: str) -> System:
        made = make(inbox, *options)
        made.loop.state.planner._solver = Prompt(made.loop.state.planner._solver)
        return made

    def note(ended: SearchEnded) -> None:
        run.note(ended)
        if len(run.goals) == 1:
            run.goal("g1", LINEN[1])

    first = make(Inbox())
    first.loop.state.planner.note = note
    run = Session(first, lambda *_: "success")
    run.start()
    run.goal("g0", LINEN[0])
    run.goals["g0"].wait()
    run.goals["g1"].wait()
    run.inbox.put(MessageArrived("info", "unlocked(isolation)"))
    run.wait_for(_rests)
    recorded = list(run.entries)
    ended = [(one.how, one.round) for one in events(recorded, SearchEnded)]
    assert ended[:3] == [(how, 0), (Ended.CALLED, 1), (how, 0)]
    replay_otherwise(make_prompt, recorded, 0, SearchEnded, PlanFound)


@pytest.mark.costly
def test_a_search_in_layers_that_is_interrupted_is_kept_in_a_replay(
    system: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is no power for the first goal, until a message comes; the second one interrupts."""
    monkeypatch.setattr(layers, "_MOST_SECONDS", 120.0)
    monkeypatch.setattr(layers, "_MORE_SECONDS", 0.1)
    monkeypatch.setattr(layers, "_MOST_LAYERS", 10_000)
    encoding = MAILBOT.parent / "test" / "planning" / "power.lp"

    def make(inbox: Inbox, *options: str) -> System:
        name, steps = "dynamic.incremental.dyn_reset", ("-c", "steps=400")
        return system(name, *steps, encoding=[str(encoding), *options], inbox=inbox)

    run = Session(make(Inbox()), lambda _, __: "success")
    run.start()
    run.goal("g0", "shine")
    run.wait_for(lambda events: any(isinstance(one, SearchEnded) for one in events))
    run.goal("g1", "call")
    run.goals["g1"].wait()
    run.inbox.put(MessageArrived("info", "power(2)"))
    run.goals["g0"].wait()
    run.wait_for(lambda events: isinstance(events[-1], LoopWaits))
    recorded = list(run.entries)
    assert Ended.CALLED in {one.how for one in events(recorded, SearchEnded)}
    replay_otherwise(make, recorded, 0)


@pytest.mark.costly
@pytest.mark.parametrize("mode", MODES)
def test_searches_for_what_was_not_planned_in_time_are_kept_in_a_replay(
    system: Make, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No search finds a plan in time, and each for more does."""
    monkeypatch.setattr(TaskSearch, "find", lambda *_: None)
    monkeypatch.setattr(layers._OneByOne, "is_over", lambda search, begin: True)
    monkeypatch.setattr(layers, "_AT_ONCE_SECONDS", 0.0)

    make = hospital(system, mode)
    recorded = record(make(Inbox()), 3, LINEN, "unlocked(isolation)", 3)
    ended = events(recorded, SearchEnded)
    assert any(one.missing for one in ended if one.how is Ended.LAYERED)
    replay_otherwise(make, recorded, 3, SearchEnded, PlanFound)


ANY_OF_MANY = """
#program base.
rslot(1..4).
#program state(t).
#external event(ID,R,t) : rslot(ID), R = (bring(a,b);bring(b,c);bring(d,a);bring(c,d);bring(b,a)).
#external event(info,unblocked(a,hall),t).
#external event(r,(success;failure),t).
#external event(info,passed,t).
wants(ID,t) :- event(ID,R,t), R != passed, rslot(ID).
wants(ID,t) :- wants(ID,t-1), not met(ID,t-1).
status(ID,accepted,t) :- wants(ID,t), not wants(ID,t-1).
status(ID,succeeded,t) :- met(ID,t).
#program transition(t).
% Any of these does.
#external event(commit,do(r,go(1..40)),t).
{ do(r,go(N),t) : N = 1..40 } 1.
:- event(commit,do(R,A),t), not do(R,A,t).
:- do(R,A,t), not event(commit,do(R,A),t), event(info,passed,t).
met(ID,t) :- wants(ID,t), ID = #min { I : wants(I,t) }, do(r,_,t), not event(r,failure,t).
#program query(t).
#external query(t).
:- query(t), wants(ID,t), not met(ID,t).
#show do/3. #show status/3.
"""


@pytest.mark.costly
@pytest.mark.parametrize("is_plain", [True, False], ids=["plain", "on demand"])
def test_what_several_threads_find_is_kept_in_a_replay(
    system: Make, tmp_path: Path, is_plain: bool
) -> None:
    """Without patience; the solver of the replay has one thread, and finds other plans."""
    (tmp_path / "any.lp").write_text(ANY_OF_MANY)
    encoding = [str(tmp_path / "any.lp")] if is_plain else [*HALL, "-c", "slots=4"]

    def make(inbox: Inbox, *options: str) -> System:
        mode = "dynamic.incremental.recording"
        return system(mode, "-c", "steps=80", encoding=[*encoding, *options], inbox=inbox)

    recorded = record(make(Inbox(), "--parallel-mode=2,compete"), 1)
    searches = events(recorded, SearchEnded)
    assert Ended.FINISHED in {one.how for one in searches}
    assert len(searches) >= len({one.actions for one in events(recorded, PlanFound)})
    replay_otherwise(make, recorded, 1, SearchEnded, PlanFound)


def test_a_search_with_one_thread_is_not_noted(system: Make, tmp_path: Path) -> None:
    (tmp_path / "any.lp").write_text(ANY_OF_MANY)
    mode = "dynamic.incremental.recording"
    run = system(mode, "-c", "steps=80", encoding=[str(tmp_path / "any.lp")])
    assert events(record(run, 0), SearchEnded) == []


def record(
    system: System,
    seed: int,
    requests: Sequence[str] = tuple(REQUESTS),
    news: str = "unblocked(a,hall)",
    number_of_goals: int = 6,
) -> List[Entry]:
    """Runs a system to which goals and answers come at random, and news in the end."""
    chance = random.Random(seed)

    def answer(actuator: str, action: str) -> Optional[str]:
        # Without the way to it, an office would be cut off.
        is_way = action.startswith("go")
        value = "failure" if not is_way and chance.random() < 0.1 else "success"
        seconds = chance.random() * 0.08
        timer = threading.Timer(seconds, lambda: run.inbox.put(MessageArrived(actuator, value)))
        timer.start()
        timers.append(timer)
        return None

    run = Session(system, answer)
    timers: List[threading.Timer] = []
    run.start()
    for number in range(number_of_goals):
        run.goal(f"g{number}", chance.choice(requests))
        if chance.random() < 0.4:
            run.wait_for(lambda events, number=number: len(plans(events)) > number)  # type: ignore[misc]
    for goal in run.goals.values():
        goal.wait()
    for timer in timers:
        timer.join()
    run.inbox.put(MessageArrived("info", news))
    run.wait_for(_rests)
    return list(run.entries)


def replay_otherwise(make: Make, recorded: Sequence[Entry], seed: int, *same: Any) -> None:
    """Replays a run with a solver that finds other plans; it and kinds of events are the same."""
    inbox = ReplayInbox(decode(encode(input_schedule(Run(recorded)))))
    again = replay_alike(make(inbox, "--rand-freq=1", "--seed=7"), recorded, seed)
    for kind in same:
        assert events(again, kind) == events(recorded, kind)


def plans(events: Sequence[Event]) -> List[Event]:
    return [event for event in events if isinstance(event, PlanFound)]


def _rests(events: Sequence[Event]) -> bool:
    sources = [event.source if isinstance(event, MessageArrived) else "" for event in events]
    after = events[sources.index("info") :] if "info" in sources else ()
    done = [event for event in after if isinstance(event, (CommandDone, LoopWaits))]
    return bool(done) and isinstance(done[-1], LoopWaits)


def due(decision: int, ended: Optional[SearchEnded]) -> ScheduledInput:
    return ScheduledInput(
        decision, Phase.DURING, ScheduledKind.SEARCH, "", "" if ended is None else to_text(ended)
    )


def test_which_search_is_due() -> None:
    cut = SearchEnded(Ended.CUT, ("a",), Quality((3,), (1,)), 1)
    better = SearchEnded(Ended.BETTER, ("b",), Quality((2,), (2,)))
    gate = ReplayInbox([due(1, cut), due(1, better), due(3, cut), due(9, None)])
    assert gate.recorded.knows_searches
    for decision in range(5):
        gate.begin_decision(lambda: None)
        gate.begin_command(lambda: None)
        assert not gate.recorded.is_search_due(improves=True)  # before the other one
        assert gate.recorded.search_due(Ended.BETTER) is None
        assert gate.recorded.search_due(Ended.CUT) is None
        if decision == 1:
            assert gate.recorded.search_due(Ended.CUT, number=1) == cut
            assert gate.recorded.is_search_due(improves=True)
            assert gate.recorded.search_due(Ended.AS_BEFORE, Ended.BETTER) == better
            assert not gate.recorded.is_search_due(improves=True)
    gate.open()
    assert not gate.recorded.knows_searches
    assert not Inbox().recorded.knows_searches
    assert Inbox().recorded.search_due(Ended.CUT) is None


def test_older_journals_tell_no_searches() -> None:
    """Those are made in a replay as they were: within a time, if there is one."""
    cut = SearchEnded(Ended.CUT, ("do(r,a,1)", "h"), Quality((1,)))
    solve = Record(CommandDone("solve"))
    assert input_schedule(run_of([Record(PlanFound(("do(r,a,1)",))), solve])) == []
    (known,) = input_schedule(run_of([Record(PlanFound((), True, Quality((1,), (1,)))), solve]))
    assert (known.kind, known.text) == (ScheduledKind.SEARCH, "")
    dues = input_schedule(run_of([solve, Record(cut), solve, Record(cut), solve]))
    assert dues[:2] == [due(1, cut), due(2, cut)]
    assert [one.text for one in rest(dues, 2)] == [due(2, cut).text, ""]


def test_finished_searches_of_another_program() -> None:
    """They are made again: it may have other plans."""
    finished = SearchEnded(Ended.FINISHED, ("do(r,a,1)",), Quality((1,), (1,)))
    cut = SearchEnded(Ended.CUT, ("do(r,a,1)",), Quality((2,), (1,)))
    solve = Record(CommandDone("solve"))
    run = run_of([Record(finished), solve, Record(cut), solve])
    assert input_schedule(run)[:2] == [due(0, finished), due(1, cut)]
    assert input_schedule(run, same_encodings=False)[:-1] == [due(1, cut)]
    only = run_of([Record(finished), solve])
    (known,) = input_schedule(only, same_encodings=False)
    assert known.text == ""


def test_a_changed_encoding_is_put_to_the_test(system: Make, tmp_path: Path) -> None:
    """In a replay with patience, too: the robot goes another way there."""
    text = (PACKAGE / "example/line.lp").read_text() + "#minimize { 1,R,A,t : do(R,A,t) }.\n"
    texts = {"old.lp": text, "new.lp": text + ":- do(robot,go(2),1).\n"}
    for name, content in texts.items():
        (tmp_path / name).write_text(content)

    def made(name: str, inbox: Inbox) -> System:
        other = system(
            "dynamic.incremental.recording", "-c", "steps=40",
            encoding=[str(tmp_path / name)], inbox=inbox,
        )  # fmt: skip
        other.loop.state.planner.patience = 1000.0
        return other

    recorded = Session(made("old.lp", Inbox()), lambda *_: "success")
    recorded.start()
    recorded.goal("g", "visit(3)")
    assert recorded.goals["g"].wait() == "succeeded"

    def replayed(name: str, *, same_encodings: bool) -> Run:
        dues = input_schedule(Run(recorded.entries), same_encodings=same_encodings)
        inbox = ReplayInbox(decode(encode(dues)))
        return Run(replay(made(name, inbox), recorded.entries, 0))

    again = replayed("old.lp", same_encodings=True)
    assert not compare(Run(recorded.entries), again).differences
    with pytest.raises(AssertionError, match="is_exact"):
        replayed("new.lp", same_encodings=False)


@pytest.mark.parametrize("text", ["x", "[]", '["1/2", "never", ["0"]]', '["x", "better", ["0"]]'])
def test_a_wrong_search(text: str) -> None:
    with pytest.raises(ParameterError):
        decode(encode([ScheduledInput(0, Phase.DURING, ScheduledKind.SEARCH, "", text)]))
