"""Each command, and what the controller is told, without ROS and with real solvers."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Any, List

import pytest
from clingo import Number
from conftest import HARD, PACKAGE, Make, System

from rosclingo.wire.commands import Result, Truth
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import ControllerError, ShutdownError
from rosoclingo.loop.beginning import reset
from rosoclingo.loop.journal import CommandDone, Event, MessageArrived

LINE = str(PACKAGE / "example/line.lp")

# Gives one command after the other: script(N,C) is the Nth. It shows what it was told as a fluent.
SCRIPT = """
#const last = 20.
#external event(save,n(0..last),0).
#external event(info,result(sat;unsat;unknown),0).
#external event(info,(pending_actions;new_messages;request_reset),0).
n(N) :- event(save,n(N),0).
n(0) :- not event(save,n(_),0).
do(controller,C,1) :- n(N), script(N,C).
holds(n(N+1),1) :- n(N), script(N,_).
told(I) :- event(info,I,0).
#show do/3. #show holds/2. #show told/1.
"""


def script(folder: Path, *commands: str) -> str:
    """Writes a mode that gives these commands, and then waits for ever."""
    facts = "".join(f"script({number},{command}). " for number, command in enumerate(commands))
    file = folder / "script.lp"
    file.write_text(f"{SCRIPT}{facts}script({len(commands)}..last,idle).")
    return str(file)


@pytest.fixture
def run(system: Make, tmp_path: Path) -> Make:
    """Runs commands one by one, without a thread, and returns the system."""

    def steps(*commands: str, **settings: Any) -> System:
        made = system(script(tmp_path, *commands), **settings)
        made.take(commands)
        return made

    return steps


def externals(system: System) -> List[str]:
    """Returns the planner's externals that are true."""
    return [
        atom for atom, value in system.loop.state.planner.externals().items() if value is Truth.TRUE
    ]


def test_initialize(run: Make) -> None:
    system = run("initialize")
    declared = system.loop.state.planner.externals()
    assert "query(0)" in declared
    assert "event(1,visit(3),0)" in declared
    assert not any(atom.startswith("rosoclingo") for atom in declared)
    assert system.loop.state.goals.slots == ["1", "2"]


def test_an_encoding_may_lack_parts_and_slots(run: Make, tmp_path: Path) -> None:
    file = tmp_path / "small.lp"
    file.write_text("do(a,b,7). #program transition(t). do(a,c,t).")
    system = run("initialize", "ground(1)", "solve", "publish", encoding=[str(file)])
    assert system.world.published == [("solver", "[do(a,c,1), do(a,b,7)]")]


def test_goals_without_any_slot_are_rejected(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "no_slots.lp"
    file.write_text("#program query(t). #external query(t).")
    made = system("dynamic.incremental.recording", encoding=[str(file)])
    early = made.begin("visit(2)")
    for goal in (early, made.goal("visit(3)")):
        goal.ends("rejected", "rslot(ID)")


def test_ground_and_assign(run: Make) -> None:
    system = run("initialize", "ground(1)", "ground(2)", "assign_external(query(2),true)")
    assert externals(system) == ["query(2)"]
    assert system.loop.state.horizon == 2
    assert system.loop.state.externals.grounded == {0, 1, 2}


@pytest.mark.parametrize("spelling", ["assign_external", "assign_externals"])
def test_both_spellings_of_assign(run: Make, spelling: str) -> None:
    system = run("initialize", f"{spelling}(query(0),true)", f"{spelling}(query(0),false)")
    assert externals(system) == []
    # What does not exist is false already, and stays so, as in clingo.
    assert not run("initialize", f"{spelling}(query(5),false)").world.warnings
    with pytest.raises(ControllerError, match="maybe is not a value"):
        run("initialize", f"{spelling}(query(0),maybe)")


@pytest.mark.parametrize(
    "command",
    ["solve", "ground(1)", "ground_all(1)", "query(0)", "plan(0)", "assign_external(query(0),true)",
     "assign_externals(query(0),false)", "release_external(query(0))", "assign_messages(0)",
     "status_update(0)", "commit_actions(now)", "release_step(0)", "reset(0)", "forget(0)",
     "publish", "exit"],
)  # fmt: skip
def test_a_command_before_initialize_is_named(run: Make, command: str) -> None:
    named = re.escape(command.replace("now", "0"))
    with pytest.raises(ControllerError, match=f"^the mode gave {named} before initialize, .*first"):
        run(command)


def test_what_needs_no_planner_may_come_before_initialize(system: Make, tmp_path: Path) -> None:
    class MyCommands(ROSCommands):
        def say(self, what: Any) -> None:
            self.state.environment.publish("speaker", str(what))

    commands = ["say(now)", "initialize", "query(0)", "solve"]
    made = system(script(tmp_path, *commands), commands=MyCommands)
    made.goal("visit(2)")
    made.take(commands)
    assert made.world.published == [("speaker", "now")]  # the names of steps are not for it


@pytest.mark.costly
def test_wrong_steps_are_named(run: Make) -> None:
    for command in ("ground", "ground_all", "query", "plan", "assign_messages", "status_update",
                    "commit_actions", "reset", "forget"):  # fmt: skip
        for step in ("-1", "x"):
            with pytest.raises(
                ControllerError, match=rf"the mode gave {command}\({step}\): a step"
            ):
                run("initialize", f"{command}({step})")
    run("initialize", "release_step(-1)")
    with pytest.raises(ControllerError, match=r"gave plan\(further\(0\)\), where 0 is no horizon"):
        run("initialize", "plan(further(0))")


def test_events_of_a_step_that_is_not_grounded(system: Make, tmp_path: Path) -> None:
    commands = ["initialize", "ground(1)", "assign_messages(7)"]
    made = system(script(tmp_path, *commands))
    goal = made.goal("visit(2)")
    made.take(commands)
    assert goal.words == ["rejected"]
    assert goal.reason == "the mode tells it in step 7, which is not grounded"
    (warning,) = made.world.warnings
    assert warning.endswith("ground(7) has to come before")


def test_named_steps(system: Make, tmp_path: Path) -> None:
    commands = ["initialize", "assign_messages(now)", "query(0)", "plan(further(9))",
                "plan(further(9))", "commit_actions(now)", "commit_actions(next)",
                "status_update(now)", "forget(now)", "solve", "status_update(now)"]  # fmt: skip
    made = system(script(tmp_path, *commands))
    goal = made.goal("visit(3)")
    made.loop.prepare()
    events: List[Event] = []
    made.world.note = lambda record: events.append(record.event)  # type: ignore[method-assign]
    for _ in commands:
        made.loop.step()
    assert [event.command for event in events if isinstance(event, CommandDone)] == [
        "initialize", "assign_messages(0)", "query(0)", "plan(1)", "plan(2)", "commit_actions(0)",
        "commit_actions(1)", "status_update(1)", "forget(1)", "solve", "status_update(0)",
    ]  # fmt: skip
    assert goal.words == []  # its status was that of step 0
    assert made.world.actions == ["go(2)"]
    state = made.loop.state
    assert (state.step, state.horizon) == (0, 1)
    assert "query(1)" in externals(made)
    assert "event(save,at(2),0)" in externals(made)


def test_ground_all(run: Make) -> None:
    system = run("initialize", "ground(2)", "ground_all(4)", "ground_all(4)", "ground_all(0)")
    assert system.loop.state.externals.grounded == {0, 1, 2, 3, 4}
    system.inbox.close()
    with pytest.raises(ShutdownError):
        ROSCommands(system.loop.state).ground_all(Number(5))


def test_release_external(run: Make) -> None:
    system = run("initialize", "release_external(query(0))", "release_external(query(0))")
    assert "query(0)" not in system.loop.state.planner.externals()


@pytest.mark.parametrize("value", ["true", "free"])
@pytest.mark.parametrize("encoding", ["line.lp", "line_demand.lp"])
def test_what_is_no_external_stays_as_it_is(run: Make, encoding: str, value: str) -> None:
    system = run(
        *("initialize", "release_external(nothing)", "release_external(query(0))"),
        *(f"assign_externals({atom},{value})" for atom in ("query(0)", "query(0)", "nothing")),
        *("query(1)", "solve"),
        encoding=[str(PACKAGE / "example" / encoding)],
    )
    assert system.loop.state.result is Result.SAT
    assert system.loop.state.horizon == 1
    assert not {"query(0)", "nothing"} & set(system.loop.state.planner.externals())
    first, second = sorted(system.world.warnings)
    assert "makes nothing true or free" in first
    assert "makes query(0) true or free" in second


def test_the_infos(system: Make, tmp_path: Path) -> None:
    commands = ["initialize", "ground(1)", "assign_messages(0)", "solve", "assign_messages(0)",
                "assign_external(query(1),true)", "solve", "commit_actions(1)",
                "status_update(1)", "assign_messages(1)", "solve", "status_update(1)",
                "reset(1)", "idle"]  # fmt: skip
    told: List[List[str]] = []

    def listen(info: Any) -> Any:
        told.append([name[len("event(info,") : -len(",0)")] for name in info.events()])
        return decide(info)

    made = system(script(tmp_path, *commands))
    decide = made.controller.decide
    made.controller.decide = listen  # type: ignore[method-assign]
    made.world.answer = lambda actuator, action: None
    made.loop.prepare()
    goal = made.goal("visit(2)")
    for number in range(len(commands) - 1):
        if number == 8:
            made.send("robot", "success")
        made.loop.step()
    assert told[:4] == [[], ["new_messages"], ["new_messages"], []]
    assert told[4] == ["result(sat)"]
    assert told[5] == []
    assert told[7] == ["result(sat)"]
    assert told[8] == ["new_messages"]  # the answer has come, so no action is pending
    assert told[9] == ["new_messages"]  # the planner does not know it, so no goal ends
    assert told[10] == []
    assert told[11] == ["request_reset", "result(sat)"]
    assert goal.words == ["accepted", "succeeded"]


def test_pending_actions_until_the_right_one_answers(run: Make) -> None:
    system = run("initialize", "ground(1)", "assign_external(query(1),true)")
    system.world.answer = lambda actuator, action: None
    state = system.loop.state
    system.goal("visit(2)")
    state.mail.take(may_ask=True)
    state.assign_messages(0)
    state.mail.tell()
    commands = ROSCommands(state)
    commands.solve()
    commands.commit_actions(Number(1))
    assert system.world.published == [("robot", "go(2)")]
    assert state.executions.pending_actions
    system.send("camera", "success")
    state.mail.take(may_ask=True)
    assert state.executions.pending_actions
    system.send("robot", "success")
    state.mail.take(may_ask=True)
    assert not state.executions.pending_actions
    assert state.mail.new_messages
    # Nothing is published twice.
    commands.commit_actions(Number(1))
    assert len(system.world.published) == 1
    assert "event(commit,do(robot,go(2)),1)" in externals(system)


def test_the_past_stays_the_past(run: Make) -> None:
    system = run(
        "initialize", "ground(1)", "ground(2)", "solve", "commit_actions(1)", "commit_actions(2)"
    )
    assert sorted(externals(system)) == ["event(info,passed,0)", "event(info,passed,1)"]
    reset(system.loop.state, 2)
    assert externals(system) == ["event(save,at(1),0)"]
    assert system.loop.state.step == 0


def test_release_step(run: Make) -> None:
    system = run("initialize", "ground(1)")
    system.send("info", "close(3)")
    system.loop.state.mail.take(may_ask=True)
    system.loop.state.assign_messages(0)
    ROSCommands(system.loop.state).release_step(Number(0))
    ROSCommands(system.loop.state).solve()  # at the latest now
    declared = system.loop.state.planner.externals()
    of_step = {atom for atom in declared if atom.endswith(",0)") or atom == "query(0)"}
    saves = {atom for atom in of_step if atom.startswith("event(save,")}
    assert of_step - saves == {"query(0)", "event(info,passed,0)", "event(info,close(3),0)"}
    assert saves
    assert "event(robot,success,1)" in declared


def test_no_command_two_commands_unknown_command(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "mode.lp"
    cases = {
        "#external event(save,x,0). holds(x,1).": "has 0 commands",
        "do(controller,(solve;idle),1).": "has 2 commands",
        "do(controller,solve,1). {a}. :- a. :- not a.": "no answer set",
        "do(controller,dance(3),1).": r"for the command dance\(3\): ROSCommands has .*, commit_",
        "do(controller,-idle,1).": "no method for the command -idle",
        "do(controller,state,1).": "no method for the command state",
        "do(controller,7,1).": "no method for the command 7",
        "do(controller,solve(3),1).": r"solve\(3\) does not fit the method solve\(\).*: too",
        "do(controller,__init__,1).": "no method for the command __init__",
    }
    for program, message in cases.items():
        file.write_text(program)
        made = system(str(file))
        goal = made.begin("visit(2)")
        with pytest.raises(ControllerError, match=message):
            raise made.wait()
        assert goal.wait() in ("aborted", "rejected")


def test_the_error_shows_infos_saved_fluents_and_answer_set(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "mode.lp"
    file.write_text(
        "#external event(save,once,0). #external event(info,new_messages,0)."
        "do(controller,initialize,1) :- not event(save,once,0). holds(once,1)."
        "#show do/3. #show holds/2."
    )
    made = system(str(file))
    made.goal("visit(2)")
    text = str(made.start().wait())
    for piece in ("event(info,new_messages,0)", "event(save,once,0)", "holds(once,1)"):
        assert piece in text


def test_both_spellings_of_saved_fluents(system: Make, tmp_path: Path) -> None:
    """The published modes show holds(val(F,true),1), and declare event(save,F,0)."""
    file = tmp_path / "mode.lp"
    for shown, declared in [
        ("holds(val(meta(g,3),true),1)", "event(save,meta(g,3),0)"),
        ("holds(val(meta(g,3),true),1)", "event(save,val(meta(g,3),true),0)"),
        ("holds(meta(g,3),1)", "event(save,meta(g,3),0)"),
    ]:
        file.write_text(
            f"#external {declared}. {shown}. holds(val(other,false),1). holds(unknown,1)."
            f"do(controller,initialize,1) :- not {declared}. do(controller,exit,1) :- {declared}."
        )
        made = system(str(file)).start()
        assert "horizon" in str(made.wait())  # the second command was exit


def test_a_mode_in_the_published_style(system: Make, tmp_path: Path) -> None:
    """A static incremental mode whose fluents look like val(situation(solved),true)."""
    file = tmp_path / "published.lp"
    file.write_text(
        """
        #const steps=20.
        #program base.
        time(0..steps).
        #external event(save,situation(S),0) : S=(ready;asked;solved;forget;grow).
        #external event(save,meta(g,T),0) : time(T).
        #external event(info,result(sat),0).
        #external event(info,result(unsat),0).
        val(F,0) :- event(save,F,0).
        none :- not val(situation(_),0).
        do(controller,initialize,1) :- none.
        next(situation(ready)) :- none.  next(meta(g,0)) :- none.
        do(controller,assign_externals(query(T),true),1) :-
          val(situation(ready),0), val(meta(g,T),0).
        next(situation(asked)) :- val(situation(ready),0).
        do(controller,solve,1) :- val(situation(asked),0).
        next(situation(solved)) :- val(situation(asked),0).
        do(controller,publish,1) :- val(situation(solved),0), event(info,result(sat),0).
        do(controller,assign_externals(query(T),false),1) :-
          val(situation(solved),0), event(info,result(unsat),0), val(meta(g,T),0).
        next(situation(grow)) :- val(situation(solved),0).
        do(controller,ground(T+1),1) :- val(situation(grow),0), val(meta(g,T),0).
        next(situation(ready)) :- val(situation(grow),0).
        next(meta(g,T+1)) :- val(situation(grow),0), val(meta(g,T),0).
        next(meta(g,T)) :- val(meta(g,T),0), not val(situation(grow),0).
        holds(val(F,true),1) :- next(F).
        #show do/3.  #show holds/2.
        """
    )
    blocks = [str(PACKAGE / "example" / name) for name in ("instance.lp", "itoh.lp")]
    made = system(str(file), encoding=blocks).start()
    made.world.wait_for(lambda world: bool(world.published))
    assert made.world.published[0][1].count("do(") == 14


def test_a_command_of_a_user(system: Make, tmp_path: Path) -> None:
    class MyCommands(ROSCommands):
        def say(self, what: Any, step: Any) -> None:
            self.state.environment.publish("speaker", f"{what} at {step.number}")

    made = system(script(tmp_path, "initialize", "say(hello,3)"), commands=MyCommands).start()
    made.world.wait_for(lambda world: bool(world.published))
    assert made.world.published == [("speaker", "hello at 3")]


def test_an_error_in_a_command_of_a_user(system: Make, tmp_path: Path) -> None:
    class MyCommands(ROSCommands):
        def broken(self) -> None:
            raise ZeroDivisionError("oh")

    made = system(script(tmp_path, "initialize", "broken"), commands=MyCommands)
    made.begin("visit(2)").ends("aborted", "ZeroDivisionError")
    made._thread.join(30)
    assert isinstance(made.failure, ZeroDivisionError)


def test_status_words(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "status.lp"
    file.write_text(
        "rslot(1..6). #program state(t). #external event(S,r,t) : rslot(S)."
        "status(1,accepted,1). status(2,rejected,1). status(3,succeeded,1). status(4,canceled,1)."
        "status(5,aborted,1). status(6,happy,1). status(1,rejected,2). status(9,accepted,1)."
    )
    commands = ["initialize", "assign_messages(0)", "solve", "status_update(1)", "status_update(2)"]
    made = system(script(tmp_path, *commands), encoding=[str(file)])
    goals = [made.goal("r") for _ in range(6)]
    made.take(commands)
    assert [goal.words for goal in goals] == [
        ["accepted", "aborted"],  # rejected is not legal any more
        ["rejected"],
        ["accepted", "succeeded"],
        ["canceled"],
        ["aborted"],
        [],
    ]
    assert any("happy" in warning for warning in made.world.warnings)


@pytest.mark.costly
def test_bad_messages_are_dropped_and_named(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20").start()
    assert made.goal("visit(2)").wait() == "succeeded"
    bad = [
        ("", "success"), ("robot", ""), ("robot", "f(X)"), ("a b", "x"), ("robot", "dance"),
        ("commit", "x"), ("save", "at(3)"), ("1", "cancel"), ("info", "passed"), ("é", "x"),
        ("robot", '"a\\"b\\\\ é"'), ("robot", "f(" * 100_000 + "1" + ")" * 100_000),
    ]  # fmt: skip
    for number, (identifier, value) in enumerate(bad, 1):
        made.send(identifier, value)
        made.world.wait_for(lambda world, number=number: len(world.warnings) == number)
    assert all(warning.startswith("dropped a message") for warning in made.world.warnings)
    assert "dance" in "".join(made.world.warnings)
    assert made.goal("visit(3)").wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)"]


def test_a_second_answer_in_a_step_is_dropped(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    (goal,) = made.act("visit(3)")
    # Both come before the loop looks; the inbox keeps their order.
    made.inbox._changed.acquire()
    made.inbox._items += [
        MessageArrived("robot", "success"),
        MessageArrived("robot", "failure"),
        MessageArrived("robot", "success"),
    ]
    made.inbox._changed.notify_all()
    made.inbox._changed.release()
    made.world.wait_for(lambda world: len(world.published) == 2)
    assert any("has answered success already" in warning for warning in made.world.warnings)
    made.send("robot", "success")
    assert goal.wait() == "succeeded"


def test_bad_requests_are_rejected(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20").start()
    made.goal("fly(3)").ends("rejected", "event(1,fly(3),0)")
    assert made.goal("visit(3)").wait() == "succeeded"


def test_a_goal_interrupts_a_search_of_minutes(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "hard.lp"
    file.write_text(HARD)
    made = system("dynamic.incremental.recording", encoding=[str(file)])
    searching = threading.Event()
    solve = made.planner.solve

    def listen(*arguments: Any) -> Any:
        searching.set()
        return solve(*arguments)

    made.planner.solve = listen  # type: ignore[method-assign]
    hard = made.begin("hard")
    assert searching.wait(30)
    assert made.goal("easy").wait() == "succeeded"
    assert hard.wait() == "succeeded"


@pytest.mark.costly
def test_many_goals_at_once(system: Make) -> None:
    made = system("dynamic.incremental.dyn_reset", "-c", "steps=30")
    goals = [made.goal(f"visit({1 + number % 6})") for number in range(200)]
    made.start()
    for goal in goals[1::2]:
        made.cancel(goal)
    ends = [goal.wait() for goal in goals]
    assert set(ends[0::2]) == {"succeeded"}
    assert set(ends[1::2]) <= {"canceled", "succeeded"}
    legal = (["accepted", "succeeded"], ["accepted", "canceled"], ["canceled"])
    assert all(goal.words in legal for goal in goals)


@pytest.mark.costly
def test_many_messages_at_once(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    for number in range(10_000):
        made.send("sensor" if number % 2 else "nobody knows", f"reading({number})")
    assert made.begin("visit(3)").wait() == "succeeded"
    assert any("more messages like these" in warning for warning in made.world.warnings)
    assert len(made.world.warnings) < 100
