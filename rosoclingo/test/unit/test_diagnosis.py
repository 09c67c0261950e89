"""No plan: which goal cannot be reached, and what contradicts the program."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Callable

import pytest
from conftest import HARD, PACKAGE, Make, RecordedGoal, System

from rosclingo.solver.options import Options
from rosoclingo.errors import LoopError
from rosoclingo.in_process.inputs import Input, Moment
from rosoclingo.in_process.parts import SINGLE, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop import diagnosis, waiting

LINES = {name: str(PACKAGE / f"example/line{name}.lp") for name in ("", "_1.0", "_paper")}
LINE = LINES[""]
RECORDING = "dynamic.incremental.recording"
RESETS = [f"dynamic.incremental.{kind}" for kind in ("reset", "dyn_reset")]
INCREMENTAL = [RECORDING, *RESETS]


@pytest.fixture
def line(tmp_path: Path) -> Callable[..., str]:
    """Writes the encoding of the line with further rules, and returns the file."""

    def write(rules: str, original: str = LINE) -> str:
        file = tmp_path / "line.lp"
        file.write_text(f"{Path(original).read_text()}\n{rules}\n")
        return str(file)

    return write


# No robot can visit cell 5.
ISLAND = "#program transition(t). :- do(robot,go(5),t)."


@pytest.fixture
def ruled(system: Make, line: Callable[..., str]) -> Make:
    """Makes systems with three nodes: by further rules, a mode, and options for it."""

    def make(rules: str, mode: str, *options: str, slots: int = 2, **others: Any) -> System:
        encoding = [line(rules), "-c", f"slots={slots}"]
        return system(mode, *options, encoding=encoding, **others)

    return make


@pytest.fixture
def ruled_alone(single: Make, line: Callable[..., str]) -> Make:
    """Makes systems with one node: by further rules, and options for clingo."""
    return lambda rules, *options, **others: single(line(rules), *options, **others)


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_the_goal_that_cannot_be_reached_is_named(ruled: Make, mode: str) -> None:
    made = ruled(ISLAND, mode, "-c", "steps=6", "-c", "r=3")
    goals = [made.goal("visit(2)"), made.goal("visit(5)")]
    made.start()
    reason = str(made.wait())
    assert "no plan within the horizon of 6 steps for visit(5); -c steps=N" in reason
    assert [goal.wait() for goal in goals] == ["aborted", "aborted"]
    assert goals[0].reason == reason


def test_goals_that_cannot_be_reached_together_are_named(ruled: Make) -> None:
    rules = "#program state(t). :- event(1,_,t), event(2,visit(X),t), holds(at(X),t)."
    made = ruled(ISLAND.replace("5", "3") + rules, RECORDING, "-c", "steps=4")
    goals = [made.goal("visit(5)"), made.goal("visit(6)")]
    made.start()
    assert "4 steps for visit(5), visit(6);" in str(made.wait())
    assert [goal.wait() for goal in goals] == ["aborted", "aborted"]


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_only_the_goal_that_cannot_be_reached_ends(ruled: Make, mode: str) -> None:
    made = ruled(ISLAND, mode, "-c", "steps=9", "-c", "r=4", abort_unreachable=True)
    reachable, unreachable = made.goal("visit(3)"), made.goal("visit(5)")
    made.start()
    unreachable.ends("aborted", "no plan within the horizon of 9 steps for visit(5)")
    no_plan = "no plan within the horizon of 9 steps: looking for the reason"
    assert no_plan in unreachable.lines
    assert reachable.wait() == "succeeded"
    assert no_plan in reachable.lines
    assert made.world.actions == ["go(2)", "go(3)"]
    assert any("~abort_unreachable" in warning for warning in made.world.warnings)
    rest(made)
    assert made.goal("visit(2)").wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)", "go(2)"]


def rest(made: System) -> None:
    """Waits until the steps up to the horizon are through."""
    made.world.wait_for(lambda world: world.step == world.horizon)


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_all_goals_that_cannot_be_reached_end_and_no_other(ruled: Make, mode: str) -> None:
    made = ruled(ISLAND, mode, *("-c", "steps=9", "-c", "r=4"), slots=3, abort_unreachable=True)
    goals = [made.goal(request) for request in ("visit(5)", "visit(2)", "visit(6)")]
    made.start()
    assert [goal.wait() for goal in goals] == ["aborted", "succeeded", "aborted"]
    assert "for visit(5), visit(6);" in goals[0].reason


@pytest.mark.parametrize("dialect", ["_1.0", "_paper"])
def test_no_goal_is_canceled_where_that_cannot_be_taken_back(
    single: Make, line: Callable[..., str], dialect: str
) -> None:
    rules = ISLAND if dialect == "_1.0" else ISLAND.replace("do(", "occurs(")
    made = single(line(rules, LINES[dialect]), "-c", "steps=9", abort_unreachable=True).start()
    assert made.goal("visit(2)").wait() == "succeeded"
    goals = [RecordedGoal("visit(6)"), RecordedGoal("visit(3)")]
    with made.inbox._changed:  # both come before the loop looks
        made.inbox._items += goals
        made.inbox._changed.notify_all()
    assert [goal.wait() for goal in goals] == ["aborted", "aborted"]
    assert "9 steps for visit(6), visit(3);" in str(made.wait())


def test_what_comes_again_and_again_does_not_put_the_end_off(ruled: Make) -> None:
    made = ruled(ISLAND, RECORDING, "-c", "steps=6")
    look = made.loop.state.planner.has_answer_set

    def talk(stopped: Callable[[], bool]) -> Any:
        made.send("info", "open(2)")  # stands for a chatty sensor and a long search
        return None if stopped() else look(stopped)

    made.loop.state.planner.has_answer_set = talk  # type: ignore[method-assign]
    made.start()
    assert made.goal("visit(6)").wait() == "aborted"
    assert "no plan within the horizon of 6 steps for visit(6)" in str(made.wait())


def test_only_the_goal_that_cannot_be_reached_ends_in_one_node(ruled_alone: Make) -> None:
    made = ruled_alone(ISLAND, "-c", "steps=9", abort_unreachable=True).start()
    assert made.goal("visit(6)").wait() == "aborted"
    assert made.goal("visit(2)").wait() == "succeeded"


@pytest.mark.parametrize("one_by_one_seconds", [0.0, 0.1])
def test_a_search_without_a_last_step_says_so(
    ruled_alone: Make, monkeypatch: pytest.MonkeyPatch, one_by_one_seconds: float
) -> None:
    """It warns once in a search, and again for the next goal, in both ways to search horizons."""
    monkeypatch.setattr(waiting, "_ENDLESS_SECONDS", 1.0)
    made = ruled_alone(ISLAND, one_by_one_seconds=one_by_one_seconds).start()
    for number, request in enumerate(("visit(6)", "visit(5)"), 1):
        goal = made.goal(request)
        made.world.wait_for(lambda world, number=number: len(world.warnings) == number)
        warning = made.world.warnings[-1]
        assert re.match(rf"no plan for {re.escape(request)} after \d+ s\. There is no", warning)
        assert "-c steps=N" in warning
        made.cancel(goal)
        assert goal.wait() == "canceled"
    assert len(made.world.warnings) == 2


def test_a_search_that_stays_at_a_horizon_says_so(
    single: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "_ENDLESS_SECONDS", 1.0)
    (tmp_path / "hard.lp").write_text(HARD)
    made = single(str(tmp_path / "hard.lp"), one_by_one_seconds=0.0).start()
    made.goal("hard")
    made.world.wait_for(lambda world: bool(world.warnings))
    assert "no plan for hard after" in made.world.warnings[0]


def test_a_search_with_a_last_step_does_not(
    ruled_alone: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "_ENDLESS_SECONDS", -1.0)
    made = ruled_alone(ISLAND, "-c", "steps=6").start()
    assert made.goal("visit(6)").wait() == "aborted"
    assert not any("last step" in warning for warning in made.world.warnings)


def test_a_goal_that_the_planner_does_not_cancel_ends_all(system: Make, tmp_path: Path) -> None:
    file = tmp_path / "stubborn.lp"
    file.write_text(
        "rslot(1). #program state(t). #external event(1,(now;never),t)."
        "#external event(1,cancel,t). status(1,succeeded,t) :- event(1,now,t)."
        "refused(t) :- event(1,never,t). refused(t) :- refused(t-1)."
        "#program query(t). #external query(t). :- query(t), refused(t)."
    )
    made = system(RECORDING, "-c", "steps=2", encoding=[str(file)], abort_unreachable=True).start()
    assert made.goal("now").wait() == "succeeded"
    assert made.goal("never").wait() == "aborted"
    assert "for never" in str(made.wait())


def test_a_goal_that_was_never_accepted_is_not_called_so(system: Make) -> None:
    made = system(RECORDING, "-c", "steps=2").start()
    goal = made.goal("visit(6)")
    assert goal.wait() == "aborted"
    assert "accepted" not in goal.lines
    made.wait()


@pytest.mark.parametrize(
    ("rules", "part"),
    [
        ("#program base. wrong. :- wrong.", "base"),
        ("#program base. {wrong}. :- wrong. :- not wrong.", "base"),
        ("#program state(t). :- t = 0.", r"state\(0\)"),
        ("#program transition(t). :- t = 2, cell(1).", r"transition\(2\)"),
        ("#program transition(t). {wrong(t)}. :- t=2, wrong(t). :- t=2, not wrong(t).",
         r"transition\(2\)"),
        ("#program query(t). :- t = 0.", r"query\(0\)"),
    ],
)  # fmt: skip
def test_a_part_that_contradicts_itself_is_named(
    system: Make, single: Make, line: Callable[..., str], rules: str, part: str
) -> None:
    file = line(rules)
    for made in (
        system(RECORDING, "-c", "steps=4", encoding=[file]),
        single(file, "-c", "steps=4"),
    ):
        goal = made.begin("visit(4)")
        with pytest.raises(LoopError, match=f"no answer set even without a goal: the part {part} "):
            raise made.wait()
        assert goal.wait() in ("aborted", "rejected")


def test_two_parts_that_contradict_each_other_are_named(ruled: Make) -> None:
    rules = "#program state(t). :- not x(t), t > 0. #program transition(t). x(t). :- t = 3."
    made = ruled(rules, RECORDING, "-c", "steps=6").start()
    made.goal("visit(6)")
    assert "grounded in step 3, state(3), transition(3), query(3), contra" in str(made.wait())


def test_a_part_that_contradicts_itself_later_is_named(
    system: Make, line: Callable[..., str]
) -> None:
    file = line("#program transition(t). :- t = 4, cell(1). #external event(save,F,0).")
    Path(file).write_text(Path(file).read_text().replace("#external event(save,F,0)", "%"))
    made = system(RECORDING, "-c", "steps=9", encoding=[file]).start()
    assert made.goal("visit(3)").wait() == "succeeded"
    assert made.goal("visit(6)").wait() == "aborted"
    assert "the part transition(4) contradicts" in str(made.wait())


def test_a_contradiction_is_found_long_before_the_last_horizon(ruled_alone: Make) -> None:
    made = ruled_alone("#program base. {wrong}. :- wrong. :- not wrong.")  # there is no last one
    assert "the part base" in str(made.start().wait())


# A closed cell 4 is impossible; one says so by mistake.
IMPOSSIBLE = "#program state(t). :- holds(closed(4),t)."


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_an_event_that_contradicts_the_program_is_taken_back(ruled: Make, mode: str) -> None:
    made = ruled(IMPOSSIBLE, mode, "-c", "steps=30", "-c", "r=5")
    check_that_it_goes_on(made)


def test_an_event_that_contradicts_the_program_in_one_node(ruled_alone: Make) -> None:
    check_that_it_goes_on(ruled_alone(IMPOSSIBLE))


def check_that_it_goes_on(made: System) -> None:
    goals = made.act("visit(3)", "visit(5)", "visit(2)")
    made.send("info", "close(4)")
    made.world.wait_for(lambda world: bool(world.warnings))
    (warning,) = made.world.warnings
    assert "dropped a message: id info, value close(4): the program has no answer set with" in (
        warning
    )
    made.world.answer = lambda actuator, action: "success"
    made.send("robot", "success")
    assert [goal.wait() for goal in goals] == ["succeeded"] * 3


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_an_event_that_is_taken_back_takes_no_steps(ruled: Make, mode: str) -> None:
    made = ruled(IMPOSSIBLE, mode, "-c", "steps=10", "-c", "r=5").start()
    assert made.goal("visit(2)").wait() == "succeeded"
    for number in range(3):
        made.send("info", "close(4)")
        made.world.wait_for(lambda world, n=number: len(world.warnings) > n)  # type: ignore[misc]
    assert made.goal("visit(5)").wait() == "succeeded"


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_several_events_that_contradict_the_program(ruled: Make, mode: str) -> None:
    rules = f"{IMPOSSIBLE} :- holds(closed(5),t). :- event(_,visit(6),t)."
    made = ruled(rules, mode, "-c", "steps=30", "-c", "r=5", slots=3)
    for value in ("close(4)", "close(1)", "close(5)"):
        made.send("info", value)
    goals = [made.goal(f"visit({cell})") for cell in (6, 6, 2)]
    made.start()
    assert [goal.wait() for goal in goals] == ["aborted", "aborted", "succeeded"]
    assert "no answer set with event(1,visit(6),0), even without a goal" in goals[0].reason
    assert len(made.world.warnings) == 4
    assert not any("close(1)" in warning for warning in made.world.warnings)


def test_only_the_last_of_two_equal_requests_is_taken_back(ruled: Make) -> None:
    rules = "#program state(t). :- event(_,visit(3),t), t > 0."
    made = ruled(rules, RECORDING, "-c", "steps=40").start()
    assert made.goal("visit(3)").wait() == "succeeded"
    assert made.goal("visit(3)").wait() == "aborted"
    assert made.goal("visit(2)").wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)", "go(2)"]


def test_a_cancel_request_that_contradicts_the_program(ruled: Make) -> None:
    made = ruled("#program state(t). :- event(_,cancel,t).", RECORDING, "-c", "steps=20")
    (goal,) = made.act("visit(2)")
    made.cancel(goal)
    made.world.wait_for(lambda world: bool(world.warnings))
    assert "visit(2) cannot be cancelled now" in made.world.warnings[0]
    made.send("robot", "success")
    assert goal.wait() == "succeeded"


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_an_answer_that_contradicts_the_program(ruled: Make, mode: str) -> None:
    """It cannot be taken back: the planner begins again with what it knew before."""
    rules = "#program state(t). late(t) :- event(robot,failure,t). :- late(t)."
    made = ruled(rules, mode, "-c", "steps=20", "-c", "r=9")
    answers = iter(["success", "failure"])
    made.world.answer = lambda actuator, action: next(answers, "success")
    goals = [made.goal("visit(2)"), made.goal("visit(4)")]
    made.start()
    assert [goal.wait() for goal in goals] == ["succeeded", "succeeded"]
    assert made.world.actions == ["go(2)", "go(3)", "go(3)", "go(4)"]
    assert "after event(" in made.world.warnings[0]
    assert "event(robot,failure," in made.world.warnings[0]
    assert "begins again with what it knew before step" in made.world.warnings[0]
    assert made.goal("visit(3)").wait() == "succeeded"


def test_an_answer_that_contradicts_the_program_in_one_node(ruled_alone: Make) -> None:
    rules = "#program state(t). late(t) :- event(robot,failure,t). :- late(t)."
    made = ruled_alone(rules)
    answers = iter(["success", "failure"])
    made.world.answer = lambda actuator, action: next(answers, "success")
    assert made.begin("visit(4)").wait() == "succeeded"
    assert made.world.actions == ["go(2)", "go(3)", "go(3)", "go(4)"]


def test_an_answer_that_contradicts_the_program_and_nothing_is_saved(
    system: Make, line: Callable[..., str]
) -> None:
    file = line("#program state(t). late(t) :- event(robot,failure,t). :- late(t).")
    text = Path(file).read_text()
    Path(file).write_text(text.replace("#external event(save,F,0) : fluent(F).", ""))
    made = system(RECORDING, "-c", "steps=20", encoding=[file])
    made.world.answer = lambda actuator, action: "failure"
    goal = made.begin("visit(4)")
    assert goal.wait() == "aborted"
    assert "no answer set any more, even without a goal, after " in str(made.wait())
    assert "event(robot,failure,1)" in goal.reason


@pytest.mark.parametrize("mode", INCREMENTAL)
def test_a_goal_that_contradicts_the_program_ends_alone(ruled: Make, mode: str) -> None:
    rules = "#program state(t). :- event(_,visit(5),t)."
    made = ruled(rules, mode, "-c", "steps=30", "-c", "r=5")
    other, wrong = made.goal("visit(4)"), made.goal("visit(5)")
    made.start()
    wrong.ends("aborted", "no answer set with event(2,visit(5),0), even without a goal")
    assert other.wait() == "succeeded"
    assert made.goal("visit(2)").wait() == "succeeded"


@pytest.mark.parametrize("dialect", ["_1.0", "_paper"])
def test_an_event_that_cannot_be_taken_back_is_named(
    single: Make, line: Callable[..., str], dialect: str
) -> None:
    rules = {
        "_1.0": "#program set_event(id,e,t). :- id = info, e = open(4).",
        "_paper": "#program transition(t). :- event(info,open(4),t).",
    }
    made = single(line(rules[dialect], LINES[dialect])).start()
    assert made.goal("visit(2)").wait() == "succeeded"
    goal = made.goal("visit(6)")
    made.send("info", "open(4)")
    goal.ends("aborted", "no answer set any more, even without a goal, after ")
    assert "event(info,open(4)," in str(made.wait())


def test_the_first_event_that_cannot_be_taken_back_is_named(
    single: Make, line: Callable[..., str]
) -> None:
    made = single(line("#program set_event(id,e,t). :- e = visit(6).", LINES["_1.0"])).start()
    assert made.goal("visit(6)").wait() == "aborted"
    # Whether step 0 passes before the goal comes is up to chance.
    said = re.sub(r"event\(info,passed,0\), ", "", str(made.wait()))
    assert "after event(1,visit(6),1)" in said


def test_what_is_released_may_contradict_the_program(ruled: Make) -> None:
    """The bell has to ring in step 1; when it can no longer, clingo grounds nothing any more."""
    rules = "#program transition(t). #external event(bell,rings,t) : t = 1. :- not heard, t = 1."
    rules += "heard :- event(bell,rings,t)."
    made = ruled(rules, RECORDING, "-c", "steps=9").start()
    made.send("bell", "rings")
    goal = made.goal("visit(3)")
    text = str(made.wait())
    assert goal.wait() == "aborted"
    assert "no answer set" in text
    assert "there is no external" not in text


def test_what_comes_while_the_reason_is_looked_for(system: Make, line: Callable[..., str]) -> None:
    """The search for the reason ends, and the next plan is made with what has come."""
    made = system(RECORDING, "-c", "steps=3")
    goal = made.goal("visit(3)")
    made.send("info", "close(2)")
    look = made.loop.state.planner.has_answer_set
    looked = []

    def listen(stopped: Callable[[], bool]) -> Any:
        if not looked:
            looked.append(1)
            made.send("info", "open(2)")
            assert made.inbox.wait(0)
        return look(stopped)

    made.loop.state.planner.has_answer_set = listen  # type: ignore[method-assign]
    made.start()
    assert goal.wait() == "succeeded"
    assert looked


@pytest.mark.costly
@pytest.mark.parametrize(("cancelled", "mode"), [(2, RECORDING), (1, SINGLE)])
def test_a_cancel_request_at_any_moment_ends_no_other_goal(
    line: Callable[..., str], cancelled: int, mode: str
) -> None:
    options = Options((line(ISLAND),), ("-c", "slots=3"))
    parts = make_parts(mode, options, ("-c", "steps=5"))
    moment = 0
    left = False
    while not left:
        moment += 2
        inputs = [
            *(Input("goal", f"visit({cell})") for cell in (5, 3, 6)),
            Input("cancel", str(cancelled), Moment("in", moment)),
        ]
        run = SimulatedSystem(parts.loop, inputs, abort_unreachable=True)
        assert run.run() is None
        left = bool(run.left)
        first, second, third = [goal.words[-1] for goal in run.goals]
        assert first in ("aborted", "canceled")[: 2 if cancelled == 1 else 1]
        assert second in ("succeeded", "canceled")[: 2 if cancelled == 2 else 1]
        assert third == "aborted"
    assert moment > 10


def test_the_search_for_the_goal_takes_its_time(
    ruled: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnosis, "_SECONDS", -1.0)  # for those who end all goals anyway
    made = ruled(ISLAND, RECORDING, "-c", "steps=6", abort_unreachable=True).start()
    goals = [made.goal("visit(5)"), made.goal("visit(3)")]
    assert [goal.wait() for goal in goals] == ["aborted", "succeeded"]
