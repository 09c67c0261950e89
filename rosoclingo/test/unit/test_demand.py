"""Encodings that are told what happens by grounding, and that ask for what they need."""

from __future__ import annotations

import queue
import re
from pathlib import Path
from typing import Any, List, Optional, Sequence

import pytest
from conftest import PACKAGE, TIMEOUT, Make, System

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    AssignExternal,
    Command,
    Failure,
    GetExternals,
    Ground,
    Outcome,
    Reply,
    Result,
)
from rosoclingo.loop.journal import CommandDone, Event, PlanFound
from rosoclingo.loop.planner import demand
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.planner.vocabulary import ToldVocabulary
from rosoclingo.loop.values.atoms import event
from rosoclingo.loop.values.solver import Forwarding

TOLD = str(PACKAGE / "example/line_demand.lp")
MODES = ("recording", "reset", "dyn_reset")


class Counting(Forwarding):
    """A solver that remembers what it was asked."""

    def __init__(self, engine: Engine) -> None:
        super().__init__(engine)
        self.commands: List[Command] = []
        self.searches = 0

    def run(self, commands: Sequence[Command]) -> Reply:
        self.commands += commands
        return super().run(commands)

    def solve(self, *args: Any, **kwds: Any) -> Outcome:
        self.searches += 1
        return super().solve(*args, **kwds)


def told(system: Make, mode: str, *options: str, **kwds: Any) -> System:
    """Makes a system that plans with an encoding that is told what happens."""
    return system(f"dynamic.incremental.{mode}", *options, encoding=(TOLD,), **kwds)


@pytest.mark.parametrize("mode", [*MODES, "single"])
def test_goals_one_after_the_other(mode: str, system: Make, single: Make) -> None:
    run = single(TOLD) if mode == "single" else told(system, mode, "-c", "steps=40")
    run.start()
    for place in (4, 2, 6, 6, 1):
        assert run.goal(f"visit({place})").wait() == "succeeded"
    moves = [2, 3, 4, 3, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1]
    assert run.world.actions == [f"go({place})" for place in moves]
    assert not run.world.warnings


@pytest.mark.parametrize("mode", [*MODES, "single"])
def test_what_happens_on_the_way(mode: str, system: Make, single: Make) -> None:
    """A failure, a second goal, a closed cell that is opened again, and a cancelled goal."""
    run = single(TOLD) if mode == "single" else told(system, mode, "-c", "steps=40")
    answers = iter(["success", "failure"])
    run.world.answer = lambda actuator, action: next(answers, None)
    run.start()
    first = run.goal("visit(3)")
    run.world.wait_for(lambda world: len(world.actions) == 3)
    run.send("info", "close(3)")
    run.send("robot", "failure")
    second = run.goal("visit(1)")
    run.world.wait_for(lambda world: len(world.actions) == 4)
    assert run.world.actions == ["go(2)", "go(3)", "go(3)", "go(1)"]
    run.world.answer = lambda actuator, action: "success"
    run.send("robot", "success")
    assert second.wait() == "succeeded"
    third = run.goal("visit(5)")
    third.wait_until_accepted()
    run.cancel(third)
    assert third.wait() == "canceled"
    run.send("info", "open(3)")
    assert first.wait() == "succeeded"
    assert run.world.actions[4:] == ["go(2)", "go(3)"]


def test_unknown_requests_and_messages_leave_no_trace(system: Make) -> None:
    solver = Counting(Engine(Options((TOLD,))))
    run = told(system, "recording", planner=solver).start()
    assert run.goal("visit(2)").wait() == "succeeded"
    solver.commands.clear()
    for request, why, meant in (
        ("visit(7)", "7 is unknown as the first argument of visit; a request that it knows", 6),
        ("fly(2)", "there is no request like fly(2); one that it knows", 0),
        ("visit(1,2)", "there is no request like visit(1,2); one that it knows", 2),
    ):
        hint = f"; did you mean visit({meant})?" if meant else ""
        goal = run.goal(request)
        goal.ends("rejected", f"{why} is visit(1){hint} (there is no external event(1,{request},")
    assert not solver.commands  # what the examples exclude is not even asked for
    run.send("info", "close(7)")
    run.send("robot", "dance")
    run.world.wait_for(lambda world: len(world.warnings) == 2)
    assert all("declares no such event" in warning for warning in run.world.warnings)
    assert run.world.actions == ["go(2)"]
    assert run.loop.state.step == 1


def test_examples_of_messages(system: Make) -> None:
    """Nobody is asked about them, and none that is known is excluded by them."""
    run = told(system, "recording").start()
    assert run.goal("visit(2)").wait() == "succeeded"
    for source, value, meant in (
        ("info", "clsoe(3)", "close(3)"),
        ("inof", "open(3)", "id info, value open(3)"),
        ("robot", "sucess", "success"),
    ):
        run.send(source, value)
        hint = f"; did you mean {meant}?"
        run.world.wait_for(lambda world, hint=hint: any(hint in said for said in world.warnings))


def without_examples(folder: Path) -> str:
    """Writes the encoding without its examples of requests."""
    file = folder / "line.lp"
    lines = Path(TOLD).read_text().splitlines(keepends=True)
    file.write_text("".join(line for line in lines if "#external event(1," not in line))
    return str(file)


def test_an_encoding_without_examples(system: Make, tmp_path: Path) -> None:
    encoding = without_examples(tmp_path)
    run = system("dynamic.incremental.recording", encoding=(encoding,)).start()
    goal = run.goal("visit(7)")
    goal.ends("rejected", "the encoding declares no request visit(7) (there is no")
    assert run.goal("visit(2)").wait() == "succeeded"
    goal = run.goal("visit(8)")
    goal.ends("rejected", "there is no request like visit(8); one that it knows is visit(2)")


def test_examples_exclude_no_messages(system: Make) -> None:
    run = told(system, "recording").start()
    run.send("info", "close(3)")
    goal = run.goal("visit(3)")
    goal.wait_until_accepted()
    assert not run.world.warnings
    assert not run.world.actions
    run.send("info", "open(3)")
    assert goal.wait() == "succeeded"


def test_examples_exclude_nothing_of_an_actuator_that_is_called_by_a_number() -> None:
    known = demand.Demand()
    known.requests = [("1", "visit(1)")]
    vocabulary = ToldVocabulary(known, ["1", "2"])
    assert vocabulary.is_sure([("2", "fly(2)")], 1)
    assert not vocabulary.is_sure([("7", "success")], 1)


def test_how_many_unknown_pairs_are_remembered(
    system: Make, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(demand, "_MOST_UNKNOWN", 10)
    encoding = without_examples(tmp_path)
    run = system("dynamic.incremental.recording", encoding=(encoding,)).start()
    for number in range(30):
        assert run.goal(f"fly({number})").wait() == "rejected"
    known = run.loop.state.planner.demand.declared
    assert sum(not is_known for is_known in known.values()) == 10
    assert run.goal("fly(0)").wait() == "rejected"
    assert run.goal("visit(2)").wait() == "succeeded"


def test_the_horizon_is_reached_at_once(system: Make) -> None:
    """What the plan needs is grounded in one request, and searched for once."""
    solver = Counting(Engine(Options((TOLD,), ("-c", "cells=30"))))
    run = told(system, "recording", "-c", "steps=40", planner=solver)
    run.world.answer = lambda actuator, action: None
    run.goal("visit(30)")
    run.start()
    run.world.wait_for(lambda world: world.actions == ["go(2)"])
    assert run.loop.state.horizon == 29
    assert len(run.loop.state.ahead()) == 29
    assert solver.searches == 2  # the first asks
    run.send(run.world.published[0][0], "success")
    run.world.wait_for(lambda world: world.actions == ["go(2)", "go(3)"])  # it has idled
    queries = [c.name for c in solver.commands if isinstance(c, AssignExternal)]
    queries = [name for name in queries if name.startswith("query")]
    assert queries == ["query(0)"] * 2 + ["query(29)"]
    steps = [command for command in solver.commands if isinstance(command, Ground)]
    assert [part.name for step in steps for part in step.parts].count("transition") == 29


def test_a_search_is_stopped_while_it_is_grounded() -> None:
    """Nothing is searched for that would be out of date, and nothing is asked for in vain."""
    solver = Counting(Engine(Options((TOLD,), ("-c", "cells=30"))))
    planner = Planner(solver)
    planner.begin()
    assert not planner.tell(["event(1,visit(30),0)"])
    for searches, answers in ((0, [False, True]), (1, [False, False, True])):
        outcome = planner.search(0, 0, lambda rest=answers: not rest or rest.pop(0))
        assert (outcome.result, outcome.interrupted) == (Result.UNKNOWN, True)
        assert solver.searches == searches
    planner.search(0, 0, lambda: False)
    assert planner.needed == 29


def test_a_plan_that_is_too_long(system: Make) -> None:
    run = told(system, "recording", "-c", "steps=3").start()
    goal = run.goal("visit(6)")
    assert "within the horizon of 3 steps" in str(run.wait())
    assert goal.wait() == "aborted"


def test_an_answer_as_planned_asks_for_nothing(system: Make) -> None:
    solver = Counting(Engine(Options((TOLD,))))
    run = told(system, "recording", planner=solver)
    run.world.answer = lambda actuator, action: None
    run.start()
    goal = run.goal("visit(3)")
    run.world.wait_for(lambda world: world.actions == ["go(2)"])
    solver.commands.clear()
    run.send("robot", "success")
    run.world.wait_for(lambda world: len(world.actions) == 2)
    parts = [part.name for c in solver.commands if isinstance(c, Ground) for part in c.parts]
    assert parts.count("search") == 1
    assert not any(isinstance(command, GetExternals) for command in solver.commands)
    run.send("robot", "success")
    assert goal.wait() == "succeeded"


def test_a_failure_after_a_search_that_expected_success(system: Make) -> None:
    run = told(system, "recording")
    commands: queue.Queue[Event] = queue.Queue()
    run.world.note = lambda record: commands.put(record.event)  # type: ignore[method-assign]
    run.world.answer = lambda actuator, action: None
    run.start()
    goal = run.goal("visit(2)")
    run.world.wait_for(lambda world: world.actions == ["go(2)"])
    while not commands.empty():
        commands.get()
    run.send("info", "open(5)")
    searched: Optional[Event] = None
    while not (isinstance(searched, CommandDone) and searched.result is Result.SAT):
        searched = commands.get(timeout=TIMEOUT)
    assert searched.command == "solve"
    run.send("robot", "failure")
    run.world.wait_for(lambda world: world.actions == ["go(2)", "go(2)"])
    assert goal.words == ["accepted"]
    run.send("robot", "success")
    assert goal.wait() == "succeeded"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("#program event(s,c).", r"has the part event\(s,c\) and lacks event\(s,c,t\)"),
        ("#program event(s,c,t).", r"has the part event\(s,c,t\) and lacks event\(s,c\)"),
        (
            "#program search(k,t). #external ground(query(7)).",
            r"the program query cannot be asked for; .* ground\(query\(7\)\)",
        ),
        ("#program search(k,t). #show ground(base).", r"asks for base by ground\(base\)"),
        ("#program search(k,t). #show ground(state(3)).", r"asks for state\(3\) by"),
        ("#program search(k,t). #show ground(none(3)).", "no program none/1"),
    ],
)
def test_an_encoding_that_does_not_fit(
    text: str, reason: str, system: Make, tmp_path: Path
) -> None:
    file = tmp_path / "own.lp"
    file.write_text(f"rslot(1). #program query(t). #external query(t). {text}")
    run = system("dynamic.incremental.recording", encoding=(str(file),)).start()
    assert re.search(reason, str(run.wait()))


def test_answer_sets_that_ask_without_end(
    system: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rosoclingo.loop.planner.searching._MOST_ROUNDS", 20)
    file = tmp_path / "own.lp"
    file.write_text(
        "#program query(t). #external query(t). #program search(k,t). #show ground(more(0))."
        "#program more(n). #show ground(more(n+1))."
    )
    run = system("dynamic.incremental.recording", encoding=(str(file),)).start()
    assert "20 answer sets in a row" in str(run.wait())


def test_others_are_driven_as_before(system: Make, tmp_path: Path) -> None:
    """An encoding that has not opted in may use the names for something else."""
    file = tmp_path / "own.lp"
    file.write_text("#external ground(3). #show ground(4). #show horizon(9).")
    solver = Counting(Engine(Options((str(PACKAGE / "example/line.lp"), str(file)))))
    run = system("dynamic.incremental.recording", planner=solver).start()
    assert run.goal("visit(3)").wait() == "succeeded"
    assert not any(isinstance(c, Ground) and c.asking for c in solver.commands)
    assert any(isinstance(c, AssignExternal) and "visit" in c.name for c in solver.commands)


EXAMPLES = """
rslot(1..2).
#external event(1,work).
#external event(2,rest).
#external event(info,noise).
#program event(s,c).
#program event(s,c,t).
told(s,c,t).
#program query(t).
#external query(t).
:- query(t), not told(1,work,0).
#show status(1,succeeded,t) : told(1,work,0).
#show do(robot,work,t) : told(1,work,0).
"""
HARD = """
rslot(1).
#program event(s,c).
#external event(s,c) : work = c.
#program event(s,c,t).
told(s,c,t).
#program query(t).
#external query(t).
#program search(k,t).
% Cliques in a random graph, as large as possible: the best one is not proven within a minute.
edge(I,J) :- I = 1..300, J = 1..300, I < J, (I*I*31 + J*J*17 + I*J*7) \\ 10 < 7.
{ in(1..300) } :- told(_,work,t).
:- in(I), in(J), I < J, not edge(I,J).
#maximize { 1,I : in(I) }.
#show do(robot,count(N),t+1) : N = #count { I : in(I) }, told(_,work,t).
#show status(S,succeeded,t+1) : told(S,work,t).
#show horizon(t+1) : told(_,work,t).
#show.
"""


def test_a_search_that_has_found_a_plan_ends_after_a_while(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "hard.lp"
    file.write_text(HARD)
    run = system("dynamic.incremental.recording", encoding=(str(file),))
    run.loop.state.planner.patience = 0.2
    events: List[Event] = []
    run.world.note = lambda record: events.append(record.event)  # type: ignore[method-assign]
    run.start()
    assert run.goal("work").wait() == "succeeded"
    plans = [event for event in events if isinstance(event, PlanFound) and event.actions]
    assert [plan.is_best for plan in plans] == [False]


def test_examples_are_known_and_released(tmp_path: Path) -> None:
    """Each search takes some time for each external that there is."""
    file = tmp_path / "examples.lp"
    file.write_text(EXAMPLES)
    solver = Counting(Engine(Options((str(file),))))
    planner = Planner(solver)
    for slots in (None, ["1", "2"]):
        assert planner.begin(slots=slots) == ["1", "2"]
        assert not any(atom.startswith("event(") for atom in planner.externals())
        solver.commands.clear()
        assert planner.tell([event("1", "work", 0), event("info", "noise", 0)]) == []
        assert not any(isinstance(command, AssignExternal) for command in solver.commands)
        for unknown in (("info", "work"), ("2", "work"), ("1", "rest")):
            assert planner.tell([event(*unknown, 0)]) != []
    assert planner.search(0, 1, lambda: False).result is Result.SAT


def test_many_events_are_asked_about_at_once() -> None:
    solver = Counting(Engine(Options((TOLD,))))
    planner = Planner(solver)
    planner.begin()
    solver.commands.clear()
    pairs = [("1", f"visit({cell})") for cell in range(100)]
    planner.declare(pairs)
    asked = [type(one) for one in solver.commands if not isinstance(one, AssignExternal)]
    assert asked == [Ground, Ground, GetExternals]
    known = [pair for pair in pairs if planner.demand.declared[pair]]
    assert known == [("1", f"visit({cell})") for cell in range(1, 7)]


SLOTS = """
rslot(1..40).
#program event(s,c).
#external event(s,c) : rslot(s), work(N) = c, N = 1..40.
#program event(s,c,t).
told(s,c,t).
"""


def test_a_request_is_looked_up_in_one_slot_first(tmp_path: Path) -> None:
    """Then it is told in others, of which all externals need not be read."""
    file = tmp_path / "slots.lp"
    file.write_text(SLOTS)
    solver = Counting(Engine(Options((str(file),))))
    planner = Planner(solver)
    planner.begin()
    solver.commands.clear()
    pairs = [(str(number), f"work({number})") for number in range(1, 41)]
    for _, content in pairs:
        planner.declare([("1", content)])
    assert planner.tell([event(*pair, 0) for pair in pairs]) == []
    assert not any(isinstance(command, GetExternals) for command in solver.commands)
    assert planner.tell([event("1", "work(41)", 0)]) != []


def test_goals_ask_about_one_slot(system: Make) -> None:
    run = told(system, "recording")
    run.start()
    assert run.goal("visit(3)").wait() == "succeeded"
    declared = run.loop.state.planner.demand.declared
    asked = [source for source, content in declared if content == "visit(3)"]
    assert asked == run.loop.state.goals.slots[:1]


def test_goals_that_come_together_are_asked_about_together(system: Make, tmp_path: Path) -> None:
    """Each in the slot that it is about to get, so that nothing is grounded for another one."""
    encoding = without_examples(tmp_path)
    solver = Counting(Engine(Options((encoding,), ("-c", "slots=3"))))
    run = system("dynamic.incremental.recording", planner=solver)
    later: List[Any] = []

    def answer(actuator: str, action: str) -> str:
        if not later:
            later.extend(map(run.goal, ("cancel", "visit(3)", "visit(5)", "visit(6)", "fly(2)")))
        return "success"

    run.world.answer = answer
    run.start()
    assert run.goal("visit(2)").wait() == "succeeded"
    expected = ["rejected", "succeeded", "succeeded", "succeeded", "rejected"]
    assert [goal.wait() for goal in later] == expected
    asked = [
        [part.parameters for part in command.parts if len(part.parameters) == 2]
        for command in solver.commands
        if isinstance(command, Ground) and command.parts[0].name == "event"
    ]
    pairs = [("2", "visit(3)"), ("3", "visit(5)"), ("1", "visit(6)"), ("1", "fly(2)")]
    assert pairs in asked
    assert sum(pairs[0] in one for one in asked) == 1


def test_a_question_that_is_refused_is_asked_for_each_goal(system: Make, tmp_path: Path) -> None:
    """None is lost, and those are taken that are no reason for it."""

    class Refusing(Counting):
        def run(self, commands: Sequence[Command]) -> Reply:
            first = commands[0]
            parts = first.parts if isinstance(first, Ground) else ()
            if [len(part.parameters) for part in parts] == [2, 2, 2]:
                refused.append(first)
                return Reply(failure=Failure("ground", 0, "too large"))
            return super().run(commands)

    refused: List[Command] = []
    solver = Refusing(Engine(Options((without_examples(tmp_path),), ("-c", "slots=4"))))
    run = system("dynamic.incremental.recording", planner=solver)
    later: List[Any] = []

    def answer(actuator: str, action: str) -> str:
        if not later:
            later.extend(map(run.goal, ("visit(3)", "visit(5)", "visit(6)")))
        return "success"

    run.world.answer = answer
    run.start()
    assert run.goal("visit(2)").wait() == "succeeded"
    assert [goal.wait() for goal in later] == ["succeeded"] * 3
    assert refused
