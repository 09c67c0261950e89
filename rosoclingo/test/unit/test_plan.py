"""The command plan.py: what it plans, simulates, prints and refuses."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Dict, List, NamedTuple

import pytest

from rosclingo import terminal
from rosclingo.errors import RosclingoError
from rosclingo.solver.options import Options
from rosclingo.terminal import PROGRESS, ProgressPrinter, say
from rosoclingo.drawing.errors import PictureError
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.journal import CommandDone, encode
from rosoclingo.tools.plan.command import main, run

LINE = f"{EXAMPLES}/line.lp"
MODES = ["fixed.recording", "incremental.recording", "incremental.reset", "incremental.dyn_reset"]


class Said(NamedTuple):
    status: int
    out: str
    err: str

    @property
    def lines(self) -> List[str]:
        return [line.strip() for line in self.out.splitlines()]


@pytest.fixture
def plan(capsys: pytest.CaptureFixture[str]) -> Any:
    """Types plan.py with arguments, and with as much time for a reason as it takes."""

    def plan(*arguments: str) -> Said:
        patient = () if "--why-seconds" in arguments else ("--why-seconds", "600")
        status = run([*arguments, *patient])
        said = capsys.readouterr()
        return Said(status, said.out, said.err)

    return plan


def test_a_plan(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)")
    assert said.status == 0
    assert said.lines[0].startswith("plan: 2 steps, found in ")
    assert said.lines[0].endswith(" s after 3 searches")
    assert said.lines[1:] == [
        "1  robot: go(2)",
        "2  robot: go(3)",
        "goal 1, visit(3), succeeds in step 2",
    ]
    assert said.err == ""


def test_the_option_of_seed_planners_is_accepted(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--seed-planner", "lama")
    assert said.status == 0
    assert said.err == (
        "warning: --seed-planner has no effect any more: first plans come from rosoclingo\n"
    )


def test_a_plan_without_goals(plan: Any) -> None:
    said = plan(f"{EXAMPLES}/instance.lp", "-f", f"{EXAMPLES}/itoh", "--mode",
                "static.incremental.recording", "-c", "steps=14")  # fmt: skip
    assert said.status == 0
    assert said.lines[0].startswith("plan: 14 steps")
    assert "arm: pickup(4)" in said.lines[1]


def test_a_simulation(plan: Any) -> None:
    """The goal comes while the robot moves, the first is cancelled, an action fails."""
    said = plan(
        LINE, "--simulate", "--goal", "visit(3)", "--at", "1", "goal:visit(2)",
        "--at", "2", "cancel:1", "--at", "2", "goal:visit(1)", "--fail", r"go\(1\)",
        "--at", "4", "robot:success", "--seconds", "2",
    )  # fmt: skip
    assert said.status == 0
    assert said.lines[4:] == [
        "goal 1 comes: visit(3)",
        "plan: 2 actions ahead, after 3 searches",
        "goal 1, visit(3), is accepted, in slot 1",
        "step 1 of 2, at 0 s",
        "robot: go(2)",
        "goal 2 comes: visit(2)",
        "robot answers success, at 2 s",
        "goal 2, visit(2), is accepted, in slot 2",
        "goal 2, visit(2), has succeeded",
        "step 2 of 2, at 2 s",
        "robot: go(3)",
        "goal 1, visit(3), is to be cancelled",
        "goal 3 comes: visit(1)",
        "another plan: 3 actions ahead, after 3 searches; in step 3 robot: go(2) instead of "
        "nothing",
        "robot answers success, at 4 s",
        "goal 3, visit(1), is accepted, in slot 2",
        "goal 1, visit(3), is canceled",
        "step 3 of 4, at 4 s",
        "robot: go(2)",
        "robot answers success, at 6 s",
        "step 4 of 4, at 6 s",
        "robot: go(1)",
        "robot answers success, at 8 s",
        "goal 3, visit(1), has succeeded",
        "waits",
        "after 4 steps, at 8 s",
        "goal 1, visit(3): canceled",
        "goal 2, visit(2): succeeded",
        "goal 3, visit(1): succeeded",
    ]


@pytest.mark.parametrize("mode", [f"dynamic.{mode}" for mode in MODES])
def test_a_mode(plan: Any, mode: str) -> None:
    step = "2" if "fixed" in mode else "9"  # where time does not wait, it would be over
    said = plan(LINE, "--mode", mode, "-c", "steps=20", "-c", "r=2", "--simulate",
                "--goal", "visit(3)", "--at", step, "goal:visit(2)")  # fmt: skip
    assert (said.status, said.lines[-2:]) == (
        0, ["goal 1, visit(3): succeeded", "goal 2, visit(2): succeeded"],
    )  # fmt: skip
    assert ("reset: step 2 is step 0 for the planner now" in said.lines) == ("reset" in mode)


@pytest.mark.parametrize("encoding", ["line", "line_1.0", "line_paper", "line_demand"])
def test_one_node(plan: Any, encoding: str) -> None:
    said = plan(f"{EXAMPLES}/{encoding}.lp", "--mode", SINGLE, "--simulate", "--goal", "visit(2)")
    assert (said.status, said.lines[-1]) == (0, "goal 1, visit(2): succeeded")


def test_a_goal_that_waits_for_a_slot(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--goal", "visit(4)", "-c", "slots=1")
    assert said.status == 0
    assert said.lines[-1] == "goal 2, visit(4), waits for a slot; the encoding has 1"


@pytest.mark.costly
def test_no_plan(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--event", "info:close(2)", "-c", "steps=7")
    assert (said.status, said.out) == (1, "")
    assert "no plan within the horizon of 7 steps for visit(3)" in said.err
    why = (
        "There is no plan for visit(3) because info says close(2). Without that, there would be a "
        "plan of 2 steps."
    )
    assert said.err.endswith(f"plan.py: {why}\n")
    arguments = [LINE, "--goal", "visit(3)", "--event", "info:close(2)", "-c", "steps=7"]
    assert "-c steps=N" not in said.err  # which would be of no use
    unasked = plan(*arguments, "--why-seconds", "0").err
    assert "because" not in unasked
    assert "for visit(3); -c steps=N sets another" in unasked
    assert [answer["text"] for answer in json.loads(plan(*arguments, "--json").out)["why"]] == [why]


@pytest.mark.parametrize("mode", ["dynamic.incremental.recording", SINGLE])
def test_no_plan_that_is_long_enough(plan: Any, mode: str) -> None:
    said = plan(LINE, "--goal", "visit(6)", "-c", "steps=4", "--mode", mode)
    assert said.status == 1
    assert said.err.endswith(
        "There is no plan up to step 4, the last one that may be planned for. That is the only "
        "reason: there is one up to step 5, with -c steps=5.\n"
    )


@pytest.mark.costly
def test_there_was_no_time_to_say_why(plan: Any) -> None:
    arguments = ["--goal", "visit(3)", "--event", "info:close(2)", "--why-seconds", "0.000001"]
    said = plan(LINE, *arguments)
    assert said.status == 1
    assert said.err.endswith("why: there was no time for an answer; --why-seconds 1e-06\n")
    assert "-c steps=N sets another" in said.err


def test_no_plan_for_one_of_two(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(1)", "--goal", "visit(3)", "--event", "info:close(2)",
                "--simulate", "--abort-unreachable", "-c", "steps=5")  # fmt: skip
    assert (said.status, said.lines[-2:]) == (
        1, ["goal 1, visit(1): succeeded", "goal 2, visit(3): aborted"],
    )  # fmt: skip
    assert "visit(3) was aborted: the planner has no plan within the horizon of 5" in said.err
    assert "warning: the planner has no plan within the horizon of 5" in said.err
    assert "-c steps=N" not in said.out + said.err
    assert said.err.endswith(
        "There is no plan for visit(3) because info says close(2). Without that, there would be a "
        "plan of 2 steps.\n"
    )


def test_no_plan_in_a_simulation(plan: Any) -> None:
    """It is told how it came to that, and no plan from before the goal is shown."""
    said = plan(LINE, "--goal", "visit(3)", "--event", "info:close(2)", "-c", "steps=3",
                "--simulate", "--mode", SINGLE, "--at", "1", "goal:visit(2)")  # fmt: skip
    assert said.status == 1
    assert said.lines == [
        "message info: close(2)",
        "goal 1 comes: visit(3)",
        "the loop ends: the planner has no plan within the horizon of 3 steps for visit(3)",
        "goal 1, visit(3), is aborted: the planner has no plan within the horizon of 3 steps for "
        "visit(3)",
        "after 0 steps, at 0 s",
        "goal 1, visit(3): aborted",
    ]


def test_an_action_without_an_answer(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--simulate", "--no-answer", r"go\(3\)")
    assert (said.status, said.lines[-1]) == (1, "goal 1, visit(3): accepted")
    assert said.err == "plan.py: visit(3): not reached; robot never answers\n"


def test_an_action_that_takes_too_long(plan: Any) -> None:
    """The loop's clock is that of the simulation."""
    said = plan(LINE, "--goal", "visit(3)", "--simulate", "--no-answer", r"go\(3\)", "--seconds",
                "4", "--action-timeout", "40", "--at", "2", "goal:visit(1)", "--at", "3",
                "cancel:1")  # fmt: skip
    assert said.status == 0
    assert "robot answers timeout, at 44 s" in said.lines
    assert said.lines[-3] == "after 4 steps, at 48 s"
    assert "robot has not answered for 30 s" in said.err
    assert "robot has not answered for 40 s (~action_timeout)" in said.err


def test_a_mode_of_ones_own(plan: Any, tmp_path: Path) -> None:
    """One that gives no command ends the loop, and the goals are no fault."""
    (tmp_path / "mode.lp").write_text("#external event(info,new_messages,0).")
    said = plan(LINE, "--goal", "visit(2)", "--mode", str(tmp_path / "mode.lp"))
    assert (said.status, said.out) == (1, "")
    assert "plan.py: the controller has 0 commands in its answer set" in said.err


def test_a_request_that_is_cut_off(plan: Any, tmp_path: Path) -> None:
    """The encoding finds plans in which nothing is done for it."""
    (tmp_path / "off.lp").write_text(
        "rslot(1). #program state(t). #external event(1,(here;there),t)."
        "status(1,accepted,t) :- event(1,_,t). status(1,succeeded,t) :- event(1,here,t)."
        "#program query(t). #external query(t)."
    )
    assert plan(str(tmp_path / "off.lp"), "--goal", "here").status == 0
    said = plan(str(tmp_path / "off.lp"), "--goal", "there")
    assert said.status == 1
    assert said.err.endswith(
        "plan.py: there: not reached; the plan has no action for it, with a horizon of 0 steps\n"
        "plan.py: There is no plan for there, whatever was told: the encoding excludes it.\n"
    )


def test_progress(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """It is said on stderr, how far the loop is, as long as that takes."""
    asked = threading.Event()

    def place() -> str:
        asked.set()
        return "step 3, horizon 7"

    monkeypatch.setattr(terminal, "_SECONDS", 0.001)
    with ProgressPrinter(place):
        assert asked.wait(30)
    assert "0 s: step 3, horizon 7\n" in capsys.readouterr().err


class Tty(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line is rewritten in place, and gone when something else is printed, and in the end."""
    screen = Tty()
    monkeypatch.setattr(sys, "stderr", screen)
    PROGRESS.show("2 s: step 10")
    PROGRESS.show("4 s: step 9")
    say("plan.py", "a warning")
    PROGRESS.show("6 s: step 9" + 200 * "x")
    PROGRESS.clear()
    PROGRESS.clear()
    rows = [row.split("\r") for row in screen.getvalue().split("\n")]
    shown = "2 s: step 10", "4 s: step 9 "
    assert rows[0] == ["", shown[0], "", shown[1], "", " " * 11, "plan.py: a warning"]
    assert [len(text) for text in rows[1]] == [0, 79, 0, 79, 0]
    assert rows[1][3].isspace()


def test_a_simulation_that_would_not_end(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(3)", "--simulate", "--fail", "go", "--mode",
                "dynamic.incremental.reset", "--most-steps", "12")  # fmt: skip
    assert (said.status, said.lines[-1]) == (1, "goal 1, visit(3): accepted")
    assert "plan.py: ended without visit(3) after 12 steps, as --most-steps says" in said.err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--goal", "visit(99)"], "99 is unknown as the first argument of visit"),
        (["--goal", "visit(3)", "--event", "info:shut(3)"], "no external event(info,shut(3)"),
        (["--goal", "visit(3)", "--simulate", "--at", "1", "cancel:2"], "no such goal yet"),
        (["--goal", "visit(3)", "--simulate", "--at", "in:99", "cancel:1"], "did not come"),
        (["--goal", "visit(3)", "--mode", "static.fixed.recording"], "it takes no goals"),
        (["--event", "a:b", "--mode", "static.fixed.recording"], "it takes no messages"),
    ],
)  # fmt: skip
def test_what_the_loop_refuses(plan: Any, arguments: List[str], reason: str) -> None:
    said = plan(LINE, "-c", "steps=5", *arguments)
    assert said.status == 2
    assert reason in said.err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "name the planner's encoding"),
        (["none.lp"], "there is no file 'none.lp'"),
        ([LINE, "--goal", "visit(3"], "'visit(3' is not a ground term"),
        ([LINE, "--event", "close(2)"], "expected goal:REQUEST, cancel:NUMBER or SOURCE:VALUE"),
        ([LINE, "--simulate", "--at", "x:2", "goal:visit(3)"], "expected when it comes"),
        ([LINE, "--simulate", "--at", "9" * 5000, "goal:visit(3)"], "expected when it comes"),
        ([LINE, "--simulate", "--at", "2", "cancel:0"], "expected the number of a goal"),
        ([LINE, "--simulate", "--at", "2", f"cancel:{'9' * 5000}"], "the number of a goal"),
        ([LINE, "--at", "2", "cancel:1"], "--at is for a run: add --simulate"),
        ([LINE, "--fail", "go"], "--fail is for a run: add --simulate"),
        ([LINE, "--mode", "dynamic"], "there are dynamic.fixed.recording, "),
        ([LINE, "--mode", "none.lp"], "there is no mode 'none.lp'"),
        ([LINE, "--wrong-option"], "wrong-option"),
    ],
)  # fmt: skip
def test_a_wrong_command_line(arguments: List[str], reason: str) -> None:
    with pytest.raises(RosclingoError, match=r"\w") as caught:
        run(arguments)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--fail", "("], "no regular expression"),
        (["--fail-probability", "2"], "--fail-probability: invalid number value: '2'"),
    ],
)
def test_a_wrong_value(
    arguments: List[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main([LINE, "--simulate", *arguments])
    assert reason in capsys.readouterr().err


def test_failures_by_chance(plan: Any) -> None:
    def simulate(seed: int) -> str:
        said: Said = plan(LINE, "--simulate", "--goal", "visit(6)", "--seed", str(seed),
                          "--fail-probability", "0.5")  # fmt: skip
        return said.out.partition("goal 1 comes")[2]

    assert simulate(1) == simulate(1) != simulate(2)
    assert "failure" in simulate(1)


def test_json(plan: Any) -> None:
    said = plan(LINE, "--goal", "visit(2)", "--simulate", "--json")
    values = json.loads(said.out)
    assert values["plan"].pop("seconds") > 0
    assert values["plan"] == {
        "horizon": 1, "searches": 2, "actions": [[1, "robot", "go(2)"]], "succeeds": {"1": 1},
    }  # fmt: skip
    assert values["goals"] == [
        {"number": 1, "request": "visit(2)", "status": "succeeded",
         "reason": "the planner's status in step 1"},
    ]  # fmt: skip
    assert values["reasons"] == values["wrong"] == []
    actions = [entry for entry in values["journal"] if entry["kind"] == "action"]
    assert [(entry["clock"], entry["id"], entry["text"]) for entry in actions] == [
        (0.0, "robot", "go(2)")
    ]


MAP = """
connection(1,2). connection(2,3). start(robot,1).
position(1,0,0). position(2,40,0). position(3,80,30).
"""


def test_a_picture_on_the_map(plan: Any, tmp_path: Path) -> None:
    """Waypoints, the blocked way, and the steps in which the robot moves; no bars."""
    (tmp_path / "map.lp").write_text(MAP)
    file = tmp_path / "plan.svg"
    said = plan(LINE, str(tmp_path / "map.lp"), "--goal", "visit(3)", "--picture", str(file))
    assert (said.status, said.lines[-1]) == (0, f"wrote {file}")
    assert texts(file) == ["1", "2", "3", "1", "2", "visit(3)"]


def test_a_picture_with_bars(plan: Any, tmp_path: Path) -> None:
    file = tmp_path / "plan.svg"
    plan(LINE, "--goal", "visit(3)", "--goal", "visit(2)", "--picture", str(file))
    shown = texts(file)
    assert shown[-5:] == ["visit(3)", "visit(2)", "go(2)", "go(3)", "visit(3) visit(2)"]
    assert [text for text in shown if text.isalpha()] == ["steps", "goals", "robot"]


@pytest.mark.costly
def test_a_picture_with_many_bars_is_wide_enough_for_their_labels(
    plan: Any, tmp_path: Path
) -> None:
    file = tmp_path / "plan.svg"
    plan(LINE, "-c", "cells=30", "-c", "steps=29", "--mode", "dynamic.fixed.recording",
         "--goal", "visit(30)", "--picture", str(file))  # fmt: skip
    width = float(re.findall(r'width="([\d.]+)pt"', file.read_text())[0])
    letters = 29 * len("go(30)")
    assert width > 5.0 * letters  # points, of letters that are 8 points high
    assert len([text for text in texts(file) if text.startswith("go(")]) == 29


@pytest.mark.costly
def test_a_picture_of_a_run(plan: Any, tmp_path: Path) -> None:
    file = tmp_path / "run.svg"
    said = plan(LINE, "--goal", "visit(3)", "--simulate", "--json", "--picture", str(file))
    assert json.loads(said.out)["goals"][0]["status"] == "succeeded"
    assert {"visit(3)", "go(2)", "go(3)"} <= set(texts(file))


TIMES = """
#program state(t).
#show due(ID,25) : rslot(ID).
#program transition(t).
#show lasts(do(robot,go(X),t),go,10) : do(robot,go(X),t).
#show expected(ID,do(robot,go(X),t)) : do(robot,go(X),t), asked(ID,X,t).
"""


@pytest.mark.parametrize("has_map", [False, True])
def test_a_picture_of_a_plan_with_durations(has_map: bool, plan: Any, tmp_path: Path) -> None:
    """By seconds, with deadlines and what will be late."""
    (tmp_path / "times.lp").write_text(TIMES + (MAP if has_map else ""))
    file = tmp_path / "plan.svg"
    plan(LINE, str(tmp_path / "times.lp"), "--goal", "visit(2)", "--goal", "visit(4)",
         "--picture", str(file))  # fmt: skip
    shown = texts(file)
    assert {"s", "goals", "robot"} <= set(shown)
    assert {"visit(2), due at 25 s", "visit(4), 5 s late"} <= set(shown)
    assert [text for text in shown if text.startswith("go(")] == ["go(2)", "go(3)", "go(4)"]
    said = ["open", "after the deadline", "deadline", "expected"]
    assert {"actions: planned", *(f"goals: {word}" for word in said)} <= set(shown)


def test_a_picture_of_a_run_with_durations(plan: Any, tmp_path: Path) -> None:
    (tmp_path / "times.lp").write_text(TIMES)
    file = tmp_path / "run.svg"
    plan(LINE, str(tmp_path / "times.lp"), "--goal", "visit(4)", "--simulate",
         "--lasts", r"go\(3\)", "17", "--picture", str(file))  # fmt: skip
    shown = texts(file)
    assert {"visit(4), 12 s late", "goals: succeeded", "goals: after the deadline"} <= set(shown)
    assert "actions: planned" not in shown


def test_a_picture_that_cannot_be_drawn(plan: Any, tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"plan\.bmp: .*; \.png is a good ending"):
        plan(LINE, "--goal", "visit(2)", "--picture", str(tmp_path / "plan.bmp"))


def test_without_matplotlib_all_but_pictures_works(tmp_path: Path) -> None:
    blocker = "import sys; sys.modules['matplotlib'] = None"
    program = f"{blocker}\nfrom rosoclingo.tools.plan.command import main; main()"
    command = [sys.executable, "-c", program, LINE, "--goal", "visit(3)", "--simulate"]

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)

    assert (run().returncode, run().stderr) == (0, "")
    file = tmp_path / "run.svg"
    said = run("--picture", str(file))
    assert said.returncode == 2
    assert "goal 1, visit(3): succeeded" in said.stdout
    assert f"{file}: pictures need matplotlib, which cannot be loaded" in said.stderr
    assert f"install it: {sys.executable} -m pip install 'matplotlib>=3.6'" in said.stderr
    assert "Traceback" not in said.stderr


def texts(file: Path) -> List[str]:
    """Returns the texts of a picture; matplotlib notes each before it draws it."""
    return re.findall(r"<!-- (\S.*?) -->", file.read_text())


def test_each_command(plan: Any) -> None:
    """An input may come in any command, or between two; in a search it ends that."""
    said = plan(LINE, "--goal", "visit(2)", "--simulate", "--commands", "--at", "in:4",
                "info:close(3)", "--at", "after:6", "info:open(3)")  # fmt: skip
    commands = [line for line in said.lines if line.startswith(("command", "message"))]
    assert commands[3:9] == [
        "message info: close(3)",
        "command 4, solve: unknown",
        "command 5, assign_messages(0)",
        "command 6, solve: unsat",
        "message info: open(3)",
        "command 7, assign_messages(0)",
    ]


def simulate(mode: str, *inputs: str) -> List[Any]:
    """Returns the journal of a simulation, but for how long commands took."""
    parts = make_parts(mode, Options((LINE,)), ("-c", "steps=20"))
    simulation = SimulatedSystem(parts.loop, [read_input(*one.split(" ")) for one in inputs])
    assert simulation.run() is None
    return [
        (entry.seconds, entry.step, entry.horizon, encode(entry.event)._replace(seconds=0))
        for entry in simulation.journal
    ]


@pytest.mark.parametrize("mode", [*(f"dynamic.{mode}" for mode in MODES[1:]), SINGLE])
def test_the_same_run_again(mode: str) -> None:
    inputs = ["goal:visit(4)", "robot:failure 2", "cancel:1 in:9", "goal:visit(2) after:9"]
    assert simulate(mode, *inputs) == simulate(mode, *inputs)


def test_an_answer_in_a_command() -> None:
    """It comes at once, and not when the action would be over."""
    parts = make_parts(SINGLE, Options((LINE,)))
    first = SimulatedSystem(parts.loop, [read_input("goal:visit(2)")])
    first.run()
    number = 1 + next(
        index
        for index, command in enumerate(
            entry.event.command for entry in first.journal if isinstance(entry.event, CommandDone)
        )
        if command == "idle"
    )
    parts = make_parts(SINGLE, Options((LINE,)))
    inputs = [read_input("goal:visit(2)"), read_input("robot:success", f"in:{number}")]
    second = SimulatedSystem(parts.loop, inputs)
    second.run()
    assert (first.clock, second.clock) == (1.0, 0.0)
    assert second.goals[0].words == ["accepted", "succeeded"]


def test_the_command_without_ros(tmp_path: Path) -> None:
    """It runs in any folder, and imports nothing of ROS, nor what only other commands need."""
    others = "'rospy', 'rosgraph', 'rosclingo.msg', 'logging', 'concurrent.futures'"
    code = (
        "import sys, rosoclingo.tools.plan.command as plan\n"
        "try:\n    plan.main(sys.argv[1:])\n"
        f"finally:\n    print(sorted(sys.modules.keys() & {{{others}, 'rosoclingo.loop.single'}}))"
    )
    folders = [str(Path(__file__).resolve().parents[3] / name / "src")
               for name in ("rosclingo", "rosoclingo")]  # fmt: skip
    environment: Dict[str, str] = {"PYTHONPATH": ":".join(folders)}
    said = subprocess.run(
        [sys.executable, "-c", code, LINE, "--goal", "visit(2)"],
        cwd=tmp_path, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout.splitlines()[1:] == [
        "     1  robot: go(2)",
        "goal 1, visit(2), succeeds in step 1",
        "[]",
    ]


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (["--event", "info:opne(3)"], "did you mean open(3)?"),
        (["--simulate", "--at", "1", "inof:open(3)"], "did you mean id info, value open(3)?"),
        (["--simulate", "--at", "1", "robot:sucess"], "did you mean success?"),
    ],
)
def test_a_message_that_was_misspelt(plan: Any, arguments: List[str], meant: str) -> None:
    assert meant in plan(LINE, "--goal", "visit(3)", *arguments).err


def test_two_goals_of_one_slot(plan: Any) -> None:
    said = plan(LINE, "-c", "slots=1", "--goal", "visit(1)", "--goal", "visit(3)")
    assert said.lines[-2:] == [
        "goal 1, visit(1), succeeds in step 0",
        "goal 2, visit(3), succeeds in step 3",
    ]
    shown = plan(LINE, "-c", "slots=1", "--goal", "visit(1)", "--goal", "visit(3)", "--json")
    assert json.loads(shown.out)["plan"]["succeeds"] == {"1": 0, "2": 3}


@pytest.mark.parametrize("simulates", [False, True])
def test_no_plan_is_shown_if_all_goals_are_rejected(plan: Any, simulates: bool) -> None:
    run_it = ["--simulate"] if simulates else []
    refused = plan(LINE, "--goal", "visit(98)", "--goal", "visit(99)", *run_it)
    assert "plan:" not in refused.out
    assert refused.err.count("rejected the goal visit(9") == 2
    some = plan(LINE, "--goal", "visit(99)", "--goal", "visit(1)", *run_it)
    assert some.lines[0].startswith("plan: nothing to do, ")  # for the second goal


def test_a_goal_that_is_recalled_before_it_is_taken(plan: Any) -> None:
    said = plan(LINE, "-c", "slots=1", "--simulate", "--goal", "visit(3)", "--goal", "visit(5)",
                "--at", "0", "cancel:2")  # fmt: skip
    come = said.lines.index("goal 2 comes: visit(5)")
    assert said.lines[come + 1] == "goal 2, visit(5), is canceled: recalled before it had a slot"
    assert "?" not in said.out
