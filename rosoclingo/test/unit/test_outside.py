"""What comes from outside at a bad moment: nobody hangs, and nobody ends another's goal."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Any, List

import pytest
from clingo import Number
from conftest import PACKAGE, Make
from test_loop import LINE, SCRIPT, script

from rosclingo.errors import ServiceError, TermError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.worker import Worker
from rosclingo.wire.commands import Reply, Truth
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import PlannerError
from rosoclingo.loop.journal import MessageArrived, PlanFound, Record, Status
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import canonical

INCREMENTAL = [f"dynamic.incremental.{kind}" for kind in ("recording", "reset", "dyn_reset")]


def test_characters_that_cannot_be_sent() -> None:
    for text in ('"a\x01b"', 'f("\ud800")', '"\ufffe"'):
        with pytest.raises(TermError, match="XML"):
            canonical(text)
    assert canonical('f( "é\\n\t" )') == 'f("é\\n\t")'


def test_a_message_with_a_control_character(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20").start()
    made.send("robot", '"a\x01b"')
    made.world.wait_for(lambda world: bool(world.warnings))
    assert made.goal("visit(3)").wait() == "succeeded"


@pytest.mark.costly
def test_a_request_is_sent_in_parts() -> None:
    engine = Engine(Options((LINE,)))
    sizes: List[int] = []

    class Listener:
        def run(self, commands: Any) -> Reply:
            sizes.append(sum(len(command.name) for command in commands))
            return engine.run(commands)

    planner = Planner(Listener())  # type: ignore[arg-type]
    atoms = [f'event(robot,"{"x" * 300_000}{number}",0)' for number in range(19)]
    missing = planner.assign(atoms, Truth.TRUE)
    assert [atom for atom, _ in missing] == atoms
    assert all("no external" in reason for _, reason in missing)
    assert max(sizes) <= 2**20


def test_a_solver_that_refuses_the_whole_request() -> None:
    """As one does that is shutting down: an error, not an endless loop."""

    class Closing:
        def __init__(self) -> None:
            self._worker = Worker(Engine(Options()))
            self._worker.close()
            self.run = self._worker.control

    with pytest.raises(PlannerError, match="shutting down"):
        Planner(Closing()).assign(["a", "b"], Truth.TRUE)  # type: ignore[arg-type]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_early_messages_with_the_id_of_a_slot(system: Make, mode: str) -> None:
    """The slots' ids are not known yet when they come."""
    made = system(mode, "-c", "steps=20")
    made.send("1", "visit(5)")
    goal = made.goal("visit(3)")
    made.send("1", "cancel")
    made.start()
    assert goal.wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)"]
    assert len([w for w in made.world.warnings if "slot" in w]) == 2


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_rubbish_takes_no_step(system: Make, mode: str) -> None:
    """One by one, so that each could begin a step, of which there are only 20."""
    made = system(mode, "-c", "steps=20").start()
    assert made.goal("visit(2)").wait() == "succeeded"
    for number in range(30):
        made.send("robot", f"rubbish({number})")
        made.world.wait_for(lambda world, n=number: len(world.warnings) > n)  # type: ignore[misc]
        made.goal(f"fly({number})").ends("rejected", f"event(1,fly({number}),")
    assert made.goal("visit(3)").wait() == "succeeded"


def test_an_unknown_answer_is_none(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    (goal,) = made.act("visit(2)")
    made.send("robot", "maybe")
    made.send("robot", "success")
    assert goal.wait() == "succeeded"


# A bell rings some time, which ends the goal bell; the goal now ends at once.
BELL = """
rslot(1..2).
#program state(t).
#external event(ID,(bell;now),t) : rslot(ID).
#external event(world,ring,t).
#external event(info,passed,t).
hears(ID,t) :- event(ID,bell,t).
status(ID,accepted,t) :- event(ID,_,t).
status(ID,succeeded,t) :- event(ID,now,t).
#program transition(t).
hears(ID,t) :- hears(ID,t-1), not rings(t-1).
rings(t) :- event(world,ring,t).
status(ID,succeeded,t) :- hears(ID,t), rings(t).
#program query(t).
#external query(t).
"""


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_a_slot_is_free_although_another_goal_stays(
    system: Make, tmp_path: Path, mode: str
) -> None:
    file = tmp_path / "bell.lp"
    file.write_text(BELL)
    made = system(mode, "-c", "steps=30", "-c", "r=100", encoding=[str(file)])
    goals = [made.goal(request) for request in ("bell", "now", "now")]
    made.start()
    assert [goal.wait() for goal in goals[1:]] == ["succeeded", "succeeded"]


def test_a_late_cancel_leaves_the_next_goal_alone(system: Make, tmp_path: Path) -> None:
    made = system(script(tmp_path), encoding=(LINE,))
    made.loop.prepare()
    state, commands = made.loop.state, ROSCommands(made.loop.state)
    commands.initialize()
    first = made.goal("visit(1)")
    state.mail.take(may_ask=True)
    commands.assign_messages(Number(0))
    made.cancel(first)
    second, third = made.goal("visit(2)"), made.goal("visit(3)")
    state.mail.take(may_ask=True)
    first.set_status(Status.SUCCEEDED)  # before the cancel request has been assigned
    state.move_to(1)
    commands.ground(Number(1))
    commands.assign_messages(Number(1))
    assert {second.slot, third.slot} == {"1", "2"}
    true = [atom for atom, value in state.externals.read().items() if value is Truth.TRUE]
    assert not any("cancel" in atom for atom in true)


def test_a_goal_after_the_end(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=2").start()
    assert made.goal("visit(6)").wait() == "aborted"
    made.wait()
    made.goal("visit(2)").ends("rejected", "horizon of 2 steps")


@pytest.mark.parametrize("gone", ["controller", "planner"])
def test_a_solver_goes_away_while_nothing_happens(
    system: Make, monkeypatch: pytest.MonkeyPatch, gone: str
) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    (goal,) = made.act("visit(2)")

    def check() -> None:
        raise ServiceError(f"the solver {gone} went away")

    monkeypatch.setattr(getattr(made, gone), "check", check)
    goal.ends("aborted", f"{gone} went away; start that node again")
    made.wait()


def test_a_goal_is_recalled_while_the_loop_is_busy(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    goal, other = made.goal("visit(2)"), made.goal("visit(3)")
    goal.recall()
    assert goal.wait() == "canceled"
    made.cancel(goal)
    made.start()
    assert other.wait() == "succeeded"
    assert goal.words == ["canceled"]


def test_publish_in_a_mode_that_takes_goals(system: Make, tmp_path: Path) -> None:
    made = system(script(tmp_path, "initialize", "publish")).start()
    made.world.wait_for(lambda world: bool(world.published))
    made.send("robot", "success")
    for _ in range(2):
        goal = made.goal("visit(2)")
        assert goal.wait() in ("rejected", "aborted")
        assert "published" in goal.reason


def test_idle_waits_for_what_is_new(system: Make, tmp_path: Path) -> None:
    """Also in a mode that leaves messages unassigned; it shows each decision as an action."""
    file = tmp_path / "idle.lp"
    file.write_text(
        SCRIPT.replace("script(N,C).", "script(N,C), not wait.")
        + "script(0,initialize). script(1..last,idle). wait :- #false."
    )
    made = system(str(file))
    decisions: List[int] = []
    decide = made.loop._controller.decide

    def listen(info: Any) -> Any:
        decisions.append(1)
        return decide(info)

    made.loop._controller.decide = listen  # type: ignore[method-assign]
    made.start()
    for number in range(3):
        made.send("robot", "success")
        made.world.inbox.wait(0.0)
        assert _settles(decisions) <= 3 + number
    assert len(decisions) <= 5


def _settles(decisions: List[int]) -> int:
    """Returns how many there are, once there are no more for a while."""
    import threading  # noqa: PLC0415

    pause = threading.Event()
    while True:
        before = len(decisions)
        pause.wait(0.1)
        if len(decisions) == before:
            return before


def test_a_second_initialize_ends_open_goals(system: Make, tmp_path: Path) -> None:
    made = system(script(tmp_path, "initialize", "assign_messages(0)", "initialize"))
    made.begin("visit(2)").ends("aborted", "anew")


def test_reset_after_a_mode_has_set_and_released_events(system: Make, tmp_path: Path) -> None:
    commands = [
        "initialize", "assign_messages(0)", "release_external(event(1,visit(2),0))",
        "assign_external(event(robot,success,0),true)", "solve", "reset(0)",
    ]  # fmt: skip
    made = system(script(tmp_path, *commands))
    made.goal("visit(2)")
    made.take(commands)
    assert made.loop.state.externals.read()["event(robot,success,0)"] is Truth.FALSE


def test_steps_in_any_order(system: Make, tmp_path: Path) -> None:
    commands = ["initialize", "ground(2)", "ground(1)", "ground(2)"]
    file = tmp_path / "steps.lp"
    file.write_text("#program state(t). #external e(t).")
    made = system(script(tmp_path, *commands), encoding=[str(file)])
    made.take(commands)
    assert sorted(made.loop.state.externals.read()) == ["e(0)", "e(1)", "e(2)"]


@pytest.mark.parametrize("command", ["ground(a)", "commit_actions(f(1))", 'assign_messages("x")'])
def test_a_step_that_is_no_number(system: Make, tmp_path: Path, command: str) -> None:
    made = system(script(tmp_path, "initialize", command)).start()
    assert "a step is a number" in str(made.wait())


def test_the_reset_mode_with_no_steps_between(system: Make) -> None:
    made = system("dynamic.incremental.reset", "-c", "steps=20", "-c", "r=0").start()
    for target in (3, 1):
        assert made.goal(f"visit({target})").wait() == "succeeded"


def test_passed_may_be_declared_from_step_1_on(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "line.lp"
    text = (PACKAGE / "example/line.lp").read_text()
    file.write_text(
        text.replace("#external event(info,passed,t).", "").replace(
            "#program transition(t).", "#program transition(t). #external event(info,passed,t)."
        )
    )
    made = system("dynamic.incremental.recording", "-c", "steps=20", encoding=[str(file)]).start()
    assert made.goal("visit(3)").wait() == "succeeded"
    assert made.world.warnings == []


@pytest.mark.parametrize("late", [False, True])
def test_a_rejection_says_what_is_wrong(system: Make, tmp_path: Path, late: bool) -> None:
    file = tmp_path / "bring.lp"
    file.write_text(
        "rslot(1..2). #program state(t). #external event(info,passed,t). office(1..3)."
        "#external event(I,bring(O,P),t) : rslot(I), office(O), office(P), O != P."
        "#external event(I,cancel,t) : rslot(I). status(I,succeeded,t) :- event(I,bring(O,P),t)."
        "#program query(t). #external query(t)."
    )
    made = system("dynamic.incremental.recording", encoding=[str(file)]).start()
    if late:
        assert made.goal("bring(1,2)").wait() == "succeeded"
        made.send("a", "b")
        made.world.wait_for(lambda world: bool(world.warnings))
    known = "is bring(1,2)"
    for request, reason in (
        ("fly(1)", f"no request like fly(1); one that it knows {known} ("),
        ("brig(2,3)", f"like brig(2,3); one that it knows {known}; did you mean bring(2,3)? ("),
        ("bring(1)", f"like bring(1); one that it knows {known}; did you mean bring("),
        ("bring", f"no request like bring; one that it knows {known}"),
        ("7", f"no request like 7; one that it knows {known}"),
        ("(1,2)", f"no request like (1,2); one that it knows {known}"),
        (
            "bring(1,9)",
            f"9 is unknown as the second argument of bring; a request that it knows {known}; "
            "did you mean bring(1,3)? (",
        ),
        ("bring(2,2)", "2 and 2 do not go together in bring; did you mean bring("),
    ):
        goal = made.goal(request)
        assert goal.wait() == "rejected"
        assert reason in goal.reason
        assert f"event(1,{request}," in goal.reason or f"event(2,{request}," in goal.reason


def test_release_step_keeps_what_the_mode_has_made_true(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "gates.lp"
    file.write_text(
        "#program state(t). #external gate(t). #external other(t). #external open(t). [true]"
        "#external event(a,b,t). #external event(save,f,t). #program query(t). #external query(t)."
    )
    commands = [
        "initialize", "assign_external(gate(0),true)", "release_step(0)", "solve", "ground(1)",
        "assign_external(gate(1),true)", "assign_external(gate(1),false)",
        "release_external(event(a,b,1))", "release_step(1)", "solve", "release_step(1)", "solve",
    ]  # fmt: skip
    made = system(script(tmp_path, *commands), encoding=[str(file)])
    made.take(commands)
    assert sorted(made.loop.state.externals.read()) == [
        "event(save,f,0)", "event(save,f,1)", "gate(0)", "open(0)", "open(1)", "query(0)",
        "query(1)",
    ]  # fmt: skip


def test_an_action_without_an_answer_counts_as_failed(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20", action_timeout=0.01)
    answers = iter([None, None, "success"])
    made.world.answer = lambda actuator, action: next(answers, "success")
    assert made.begin("visit(2)").wait() == "succeeded"
    assert made.world.actions == ["go(2)"] * 3
    assert len(made.world.warnings) == 2
    assert "robot has not answered for 0.01 s (~action_timeout)" in made.world.warnings[0]


def test_an_encoding_may_know_of_no_answer_in_time(system: Make, tmp_path: Path) -> None:
    """Then nobody says that the action has failed."""
    text = (PACKAGE / "example" / "line.lp").read_text()
    declared, begins = "#external event(robot,(success;failure),t).", "#program transition(t).\n"
    assert declared in text
    assert begins in text
    text = text.replace(declared, "#external event(robot,(success;failure;timeout),t).")
    aborts = "status(ID,aborted,t) :- asked(ID,X,t), event(robot,timeout,t).\n"
    encoding = tmp_path / "late.lp"
    encoding.write_text(text.replace(begins, aborts + begins))
    mode = "dynamic.incremental.recording"
    made = system(mode, "-c", "steps=20", encoding=(str(encoding),), action_timeout=0.01)
    made.world.answer = lambda actuator, action: None
    assert made.begin("visit(2)").wait() == "aborted"
    assert "event(robot,timeout,1)" in made.loop.state.externals.true
    assert len(made.world.actions) == 1


def test_the_plan_is_shown_from_the_current_step_on(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    made.world.answer = lambda actuator, action: None
    goal = made.begin("visit(4)")
    made.world.wait_for(lambda world: bool(world.plan and world.published))
    moves = [f"do(robot,go({cell}),{cell - 1})" for cell in (2, 3, 4)]
    assert made.world.plan == moves
    made.world.answer = lambda actuator, action: "success" if action == "go(3)" else None
    made.send("robot", "success")
    made.world.wait_for(lambda world: world.plan == moves[2:])
    made.send("robot", "success")
    assert goal.wait() == "succeeded"


def test_an_action_fails_in_time_although_messages_keep_coming(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20", action_timeout=0.1)
    answers = iter([None, "success"])
    made.world.answer = lambda actuator, action: next(answers, "success")
    goal = made.begin("visit(2)")
    made.world.wait_for(lambda world: bool(world.published))
    stop = threading.Event()

    def chatter() -> None:
        while not stop.wait(0.01):
            made.send("nobody", "cares")

    talker = threading.Thread(target=chatter)
    talker.start()
    try:
        assert goal.wait() == "succeeded"
    finally:
        stop.set()
        talker.join()
    assert made.world.actions == ["go(2)"] * 2


def silence(folder: Path, *declarations: str) -> str:
    """Writes the encoding of the line without some of its declarations."""
    text = Path(LINE).read_text()
    for declaration in declarations:
        assert text.count(declaration) == 1
        text = text.replace(declaration, "")
    file = folder / "line.lp"
    file.write_text(text)
    return str(file)


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_an_answer_counts_although_it_is_not_declared(
    system: Make, tmp_path: Path, mode: str
) -> None:
    file = silence(tmp_path, "#external event(robot,(success;failure),t).")
    made = system(mode, "-c", "steps=20", encoding=[file])
    answers = iter(["success", "done(1)", "failure"])
    made.world.answer = lambda actuator, action: next(answers)
    assert made.begin("visit(4)").wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)", "go(4)"]
    (warning,) = made.world.warnings
    assert "robot has answered success: that ends its action" in warning
    assert "#external event(robot,success,t)" in warning


def test_a_second_answer_is_none_although_the_first_is_not_declared(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=20")
    made.world.answer = lambda actuator, action: None
    made.goal("visit(3)")
    made.start()
    made.world.wait_for(lambda world: len(world.published) == 1)
    made.inbox._changed.acquire()  # both come before the loop looks
    made.inbox._items += [MessageArrived("robot", "maybe"), MessageArrived("robot", "failure")]
    made.inbox._changed.notify_all()
    made.inbox._changed.release()
    made.world.wait_for(lambda world: len(world.published) == 2)
    assert "robot has answered maybe" in made.world.warnings[0]
    assert "it has answered maybe already" in made.world.warnings[1]


def test_an_encoding_without_commits_is_warned_of_once(system: Make, tmp_path: Path) -> None:
    file = silence(
        tmp_path,
        "#external event(commit,do(robot,go(X)),t) : cell(X).",
        ":- event(commit,A,t), not act(A,t).",
        ":- act(A,t), not event(commit,A,t), event(info,passed,t).",
    )
    made = system("dynamic.incremental.recording", "-c", "steps=20", encoding=[file])
    assert made.begin("visit(4)").wait() == "succeeded"
    (warning,) = made.world.warnings
    assert "does not declare #external event(commit,do(robot,go(2)),1)" in warning
    assert "another past" in warning


@pytest.mark.parametrize(
    ("declaration", "reason"),
    [
        ("#external event(save,F,0) : fluent(F).", r"declares no #external event\(save,F,0\)"),
        ("#show holds/2.", r"shows no holds\(F,\d\)"),
    ],
)
def test_a_reset_that_forgets_all_is_warned_of_once(
    system: Make, tmp_path: Path, declaration: str, reason: str
) -> None:
    file = silence(tmp_path, declaration)
    made = system("dynamic.incremental.dyn_reset", "-c", "steps=20", encoding=[file]).start()
    for target in (3, 2, 4):
        assert made.goal(f"visit({target})").wait() == "succeeded"
    (warning,) = made.world.warnings
    assert re.search(reason, warning)
    assert "keeps nothing" in warning


def test_nothing_is_shown_beyond_the_horizon(system: Make, tmp_path: Path) -> None:
    """After a reset the steps beyond the horizon are still there; here the robot never rests."""
    file = silence(tmp_path, ":- do(robot,_,t), not holds(want(_,_),t-1).")
    Path(file).write_text(f"{Path(file).read_text()} #program transition(t). :- not do(robot,_,t).")
    made = system("dynamic.incremental.dyn_reset", "-c", "steps=20", encoding=[file])
    beyond: List[str] = []
    show = made.world.show_plan

    def listen(step: int, horizon: int, actions: Any, arrivals: Any = ()) -> None:
        beyond.extend(str(action) for action in actions if action.step > max(step, horizon))
        show(step, horizon, actions, arrivals)

    made.world.show_plan = listen  # type: ignore[method-assign]
    noted: List[Record] = []
    made.world.note = noted.append  # type: ignore[method-assign, assignment]
    made.start()
    for target in (6, 4, 5):
        assert made.goal(f"visit({target})").wait() == "succeeded"
    made.world.wait_for(lambda world: (world.step, world.horizon, world.plan) == (0, 0, []))
    assert beyond == []
    plans = [(one, one.event.actions) for one in noted if isinstance(one.event, PlanFound)]
    assert plans
    for record, actions in plans:
        steps = [int(text.rpartition(",")[2].rstrip(")")) for text in actions]
        assert all(step <= max(record.step, record.horizon) for step in steps)
