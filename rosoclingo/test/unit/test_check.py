"""check.py finds what is wrong with an encoding, and shows it by a command that does the same."""

from __future__ import annotations

import json
import runpy
import shlex
import signal
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

import pytest

from reproduced import is_reproduced
from rosclingo.errors import OptionsError, RosclingoError
from rosclingo.solver.options import Options
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.loop.values.atoms import Action
from rosoclingo.tools.check import twins
from rosoclingo.tools.check.command import Checking, main, run
from rosoclingo.tools.check.command_line import parse
from rosoclingo.tools.check.examples import read_example, read_examples
from rosoclingo.tools.check.findings import Finding
from rosoclingo.tools.check.run import DOES, CheckedRun, FoundPlan
from rosoclingo.tools.plan.command_line import parse as parse_plan

LINE = f"{EXAMPLES}/line.lp"
SMALL = ("-c", "cells=4")
MOVED = "moved(X,t) :- do(robot,go(X),t), not event(robot,failure,t)."


def changed(folder: Path, *changes: str) -> str:
    """Writes line.lp with changes, pairs of old and new text, and returns its path."""
    text = Path(LINE).read_text()
    for old, new in zip(changes[::2], changes[1::2]):
        assert old in text, old
        text = text.replace(old, new)
    file = folder / "changed.lp"
    file.write_text(text)
    return str(file)


def check(*arguments: str) -> List[Finding]:
    """Returns all findings."""
    return list(Checking(parse(arguments)).findings())


# What is written there.

STATIC = {
    "a part that nobody grounds": (
        "parts", "#program state(t).", "#program state(t,u).\n#program state(t).",
        "state/2 is of no use: it has 2 parameters, and rosoclingo grounds it with 1", "29",
    ),
    "a part of another name": (
        "parts", "#program query(t).", "#program goal(t).\n#program query(t).",
        "neither rosoclingo nor the encoding grounds it", "87",
    ),
    "no query": (
        "parts", "#external query(t).\n:- query(t), holds(want(ID,X),t).",
        "#external horizon(t,t).", "there is no encoding of a known dialect", "",
    ),
    "a predicate that nobody defines": (
        "predicates", "cell(1..cells).", "cell(1..cells). c(X) :- ceil(X).", "ceil/1 is used", "15",
    ),
    "a fluent that nothing makes true": (
        "predicates", "holds(closed(X),t-1).", "holds(close(X),t-1).",
        "no rule, fact or external makes holds/2 true with close/1 in it; is closed/1 meant?", "64",
    ),
    "an event that is not declared": (
        "predicates", "holds(closed(X),t) :- event(info,close(X),t), not event(info,open(X),t).",
        "holds(closed(X),t) :- event(info,close(X),t), not event(info,opened(X),t).",
        "makes event/3 true with opened/1 in it; is open/1 meant?", "46",
    ),
    "an action that there is not": (
        "predicates", "do(robot,go(X),t), not event(robot,failure,t)",
        "do(robot,goes(X),t), not event(robot,failure,t)",
        "makes do/3 true with goes/1 in it", "83",
    ),
    "an answer that is misspelt": (
        "predicates", "not event(robot,failure,t)", "not event(robot,failur,t)",
        "makes event/3 true with failur in it; is failure meant?", "83",
    ),
    "a fluent that is made true and not used": (
        "unused", "holds(closed(X),t) :- event(", "holds(close(X),t) :- event(",
        "made true with close/1 in it, and nothing uses that; is closed/1 meant?", "46",
    ),
    "statuses that are not shown": (
        "shown", "#show status/3.", "", "status/3 is not shown", "50",
    ),
    "what is saved is not shown": (
        "shown", "#show holds/2.", "", "holds/2 is not shown, so that rosoclingo does not", "45",
    ),
    "a name that is rosoclingo's": (
        "names", "cell(1..cells).", "cell(1..cells). rosoclingo_has(do).",
        "rosoclingo_has/1: names with rosoclingo_ are rosoclingo's own", "15",
    ),
    "an actuator with a name that is rosoclingo's": (
        "names", "#external event(info,passed,t).",
        "#external event(info,passed,t). #external event(solver,success,t).",
        "solver is the id of an actuator", "",
    ),
    "a goal that cannot be cancelled": (
        "slots", "event(ID,cancel,t) : rslot(ID).", "event(ID,cancel,t) : rslot(ID), ID < 2.",
        "the goal in slot 2 cannot be cancelled", "",
    ),
    "a request that one slot does not take": (
        "slots", "event(ID,visit(X),t) : rslot(ID), cell(X).",
        "event(ID,visit(X),t) : rslot(ID), cell(X), ID + X < 6.",
        "the request visit(4) is declared for other slots, and not for slot 2", "",
    ),
    "no slot": (
        "slots", "rslot(1..slots).", "rslot(1..0).", "there is no slot", "",
    ),
    "a message that some steps do not take": (
        "steps", "(close(X);open(X)),t) : cell(X).", "(close(X);open(X)),t) : cell(X), t < 2.",
        "event(info,close(1),t) is declared in some steps only, and not in step 2, 3", "37",
    ),
    "a request that the first step does not take": (
        "steps", "event(ID,visit(X),t) : rslot(ID), cell(X).",
        "event(ID,visit(X),t) : rslot(ID), cell(X), t > 0.",
        "event(1,visit(1),t) is declared in some steps only, and not in step 0", "32",
    ),
}  # fmt: skip


@pytest.mark.costly
@pytest.mark.parametrize("what", STATIC)
def test_what_is_written(what: str, tmp_path: Path) -> None:
    name, old, new, text, line = STATIC[what]
    found = check(changed(tmp_path, old, new), *SMALL, "--episodes", "0")
    (own,) = [finding for finding in found if text in finding.text]
    assert own.check == name
    assert own.place.rpartition(":")[2] == line


UNUSED = {
    "a predicate that is meant to be another": (
        MOVED, f"{MOVED} moves(X,t) :- moved(X,t).",
        "moves/2 is defined by rules, and nothing uses it; is moved/2 meant?",
    ),
    "one that is chosen": (
        MOVED, f"{MOVED} {{ naps(X,t) : cell(X) }} :- moved(_,t).", "naps/2 is defined by rules",
    ),
    "one that is said to be for others": (
        MOVED, f"{MOVED} leave(t) :- moved(_,t). #defined leave/1.", "",
    ),
    "one that is shown": (MOVED, f"{MOVED} leave(t) :- moved(_,t). #show leave/1.", ""),
    "one in a term that is shown": (
        MOVED, f"{MOVED} leave(t) :- moved(_,t). #show gone(t) : leave(t).", "",
    ),
    "one that is negated": (MOVED, f"{MOVED} leave(t) :- moved(_,t). :- not leave(t), t < 0.", ""),
    "one that costs": (MOVED, f"{MOVED} leave(t) :- moved(_,t). :~ leave(t). [1,t]", ""),
    "one in an aggregate": (
        MOVED, f"{MOVED} leave(t) :- moved(_,t). :- #count {{ 1 : leave(t) }} > 1.", "",
    ),
    "one on which an external depends": (
        MOVED, f"{MOVED} leave(1..2) :- cell(1). #external event(info,leave,t) : leave(X).", "",
    ),
    "a name above a rule": (
        MOVED, f"%! the robot moves\n{MOVED}", "the comment %! names no constraint: it has to be",
    ),
    "a name with a blank line below it": (
        MOVED, f"{MOVED}\n%! it stays in cell 1\n\n:- moved(1,t), t < 0.", "%! names no constraint",
    ),
    "a name above a constraint": (
        MOVED, f"{MOVED}\n%! it stays\n% in\n%! cell 1\n:- moved(1,t), t < 0.", "",
    ),
    "facts, as a map for pictures": ("cell(1..cells).", "cell(1..cells). position(1,0,0).", ""),
}  # fmt: skip


@pytest.mark.costly
@pytest.mark.parametrize("what", UNUSED)
def test_what_nothing_uses(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is a hint, and the encoding is not wrong by that."""
    old, new, text = UNUSED[what]
    file = changed(tmp_path, old, new)
    found = check(file, *SMALL, "--episodes", "0", "--goal", "visit(1)")
    assert [finding.check for finding in found if finding.is_hint] == (["unused"] if text else [])
    assert all(finding.is_hint and text in finding.text for finding in found)
    if "meant?" in text:
        assert run([file, *SMALL, "--episodes", "0", "--goal", "visit(1)"]) == 0
        first, last = capsys.readouterr().out.splitlines()
        assert first.endswith(f"changed.lp:83: unused (a hint): {text}")
        assert last.endswith(": nothing found, 1 hint")


def test_a_slot_is_an_id(tmp_path: Path) -> None:
    """Without slots, requests are messages of nobody."""
    found = check(changed(tmp_path, "rslot(1..slots).", "#defined rslot/1."), "--episodes", "0")
    assert not [finding for finding in found if finding.check == "predicates"]


def test_an_encoding_that_does_not_parse(tmp_path: Path) -> None:
    (found,) = check(changed(tmp_path, "cell(1..cells).", "cell(1..cells)"))
    assert found.check == "program"
    assert "changed.lp:" in found.text


# What it does.

SUCCEEDED = "asked(ID,X,t), holds(at(X),t), not event(ID,cancel,t)."

# After a failure, a lamp has to be on before, be it in the past.
LAMP = """
{ do(lamp,on,t) }.
#minimize { 1@2,t : do(lamp,on,t) }.
#external event(lamp,success,t).
#external event(commit,do(lamp,on),t).
was_on(t) :- do(lamp,on,t).
was_on(t) :- was_on(t-1).
:- event(robot,failure,t), not was_on(t-1).
"""

DYNAMIC = {
    "contradiction": ["#program query(t).", ":- event(info,close(3),t).\n#program query(t)."],
    "error": ["#show do/3.", ""],
    "warning": ["#external event(commit,do(robot,go(X)),t) : cell(X).", "#defined event/3."],
    "past": [":- event(commit,A,t), not act(A,t).", ""],
    "gone_by": [":- act(A,t), not event(commit,A,t), event(info,passed,t).", LAMP],
    "one_at_a_time": ["{ do(robot,go(X),t) : cell(X) } 1.", "{ do(robot,go(X),t) : cell(X) }.",
                      "before(at(1),0)", "before(at(2),0)"],
    "known_status": ["status(ID,accepted,t) :-", "status(ID+1,accepted,t) :-"],
    "accepted": ["status(ID,accepted,t) :- event(ID,visit(X),t).", ""],
    "one_end": ["status(ID,canceled,t) :- event(ID,cancel,t),", "status(ID,canceled,t) :- X = 3,"],
    "ends": [f"status(ID,succeeded,t) :- {SUCCEEDED}", ""],
    "foretold": [MOVED, MOVED.replace("failure", "success")],
    "failed": [MOVED, "moved(X,t) :- do(robot,go(X),t)."],
    "recall": ["#program query(t).",
               ":- do(robot,_,t), event(ID,cancel,t-1), rslot(ID).\n#program query(t)."],
    "reset": ["fluent(want(ID,X)) :- rslot(ID), cell(X).", ""],
}  # fmt: skip


@pytest.mark.costly
@pytest.mark.parametrize("name", DYNAMIC)
def test_what_it_does(name: str, tmp_path: Path) -> None:
    """The check finds it in some episode, and plan.py does what the shrunk one does."""
    file = changed(tmp_path, *DYNAMIC[name])
    only = ("--goal", "visit(1)", "--goal", "visit(3)", "--event", "info:close(3)")
    seed = "9" if name == "recall" else "5"  # with which it is found soon
    words = (file, *SMALL, "-c", "steps=16", "--episodes", "100", *only, "--seed", seed)
    checking = Checking(parse(words))
    own = next(finding for finding in checking.findings() if finding.check == name)
    assert 1 <= len(own.commands) <= 2
    assert is_reproduced(own)
    inputs = [len(parse_plan(words).inputs) for words in own.commands]
    assert max(inputs) <= 4, own  # it is shrunk


def test_each_check_has_a_test() -> None:
    from rosoclingo.tools.check import invariants  # noqa: PLC0415 (the names of the checks)

    names = {one.__name__ for one in invariants.CHECKS} | {"failed", "recall", "reset"}
    assert names == set(DYNAMIC)
    assert all(hasattr(twins, name) for name in ("failed", "recall", "reset"))


def found(
    actions: Sequence[Action],
    *,
    successes: int = 0,
    has_barrier: bool = True,
    is_layered: bool = False,
) -> CheckedRun:
    """Returns a run in which one plan was found, in its first step."""
    plan = FoundPlan(
        elapsed=0, step=0, actions=tuple(actions), published=frozenset(), has_barrier=has_barrier,
        statuses=(), fluents=frozenset(), slots={"1": "1"}, told={}, active=frozenset({"1"}),
        over=frozenset(), cancelled=frozenset(), heard=(), successes=successes,
        is_layered=is_layered,
    )  # fmt: skip
    words = (LINE, "--simulate")
    chosen = parse_plan(words)
    run = CheckedRun(make_parts(chosen.mode, chosen.options).loop, words, chosen)
    run.plans.append(plan)
    return run


def test_plans_that_are_compared() -> None:
    """Those of which the same was known, where a step is as long as all that act in it."""
    short, long = [Action("robot", "a", 1)], [Action("robot", "a", 1), Action("robot", "b", 2)]
    (said,) = twins.reset(found(short), found(long))
    assert "the plan takes 1 step in the first run, and 2 steps in the second" in said
    assert not [*twins.reset(found(short), found(long, successes=1))]
    assert not [*twins.reset(found(short), found(long, has_barrier=False))]
    assert not [*twins.reset(found(short, has_barrier=False), found(long))]
    assert not [*twins.reset(found(short, is_layered=True), found(long, is_layered=True))]


@pytest.mark.parametrize(("is_layered", "findings"), [(False, 1), (True, 0)])
def test_steps_without_a_recalled_goal(is_layered: bool, findings: int) -> None:
    """They are as many, if plans are shortest."""
    one, other = (found([], is_layered=is_layered) for _ in range(2))
    one.heard.append((DOES, "robot", "a", "6"))
    other.heard.append((DOES, "robot", "a", "4"))
    assert len([*twins.recall(one, other)]) == findings


# Examples of an author.

CLOSED = "--goal 'visit(3)' --event 'info:close(2)' -c steps=7"


@pytest.mark.costly
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("--goal 'visit(3)' => 2 steps", ""),
        ("--goal 'visit(3)' --at 1 cancel:1 => 1 step, canceled, go(2)", ""),
        ("--goal 'visit(3)' => go(2), go(3)", ""),
        ("--goal 'visit(9)' => rejected, \"9 is unknown\"", ""),
        ("--goal 'visit(3)' => 3 steps", "expected 3 steps, and it takes 2: go(2), go(3)"),
        ("--goal 'visit(3)' => canceled", "expected canceled, and the goals are succeeded"),
        ("--goal 'visit(3)' => go(3), go(2)", "expected go(3), go(2) in this order, and it does"),
        (
            "--goal 'visit(9)' => rejected, \"no 9\"",
            'expected "no 9", and it says the planner does',
        ),
        ("--event 'info:shut(3)' => \"no external event(info,shut(3)\"", ""),
        (f"{CLOSED} => no plan because close(2)", ""),
        (f'{CLOSED} => aborted, no plan because "info says close(2)", 0 steps', ""),
        (f"{CLOSED} --event 'info:close(4)' => no plan because close(2)", ""),
        (
            f"{CLOSED} --event 'info:close(1)' --abort-unreachable --goal 'visit(6)' => "
            "no plan because close(2), because visit(6)",
            "expected no plan because visit(6), and why is: There is no plan for visit(3)",
        ),
        (f"{CLOSED} => succeeded, no plan because close(2)", "expected succeeded, and the goals"),
        (
            f"{CLOSED} => no plan because close(3)",
            "expected no plan because close(3), and why is: There is no plan for visit(3) because "
            "info says close(2). Without that, there would be a plan of 2 steps.",
        ),
        (
            "--goal 'visit(3)' => no plan because close(2)",
            "expected no plan because close(2), and why is: there is a plan for all goals",
        ),
    ],
)
def test_examples(line: str, said: str, tmp_path: Path) -> None:
    """They lie beside the encoding, and are judged like all other runs."""
    file = changed(tmp_path)
    (tmp_path / "changed.examples").write_text(f"# What is expected.\n\n{line}\n")
    found = check(file, "--episodes", "0", "--goal", "visit(2)")
    assert [finding.check for finding in found] == (["example"] if said else [])
    for finding in found:
        assert finding.place == f"{tmp_path}/changed.examples:3"
        assert finding.text.startswith(said)
        assert is_reproduced(finding)


def test_files_of_an_example(tmp_path: Path) -> None:
    """They may have any name, and are seen from the encoding's folder."""
    (tmp_path / "map.asp").touch()
    line = "map.asp -t 2 --goal -visit(1) -f ../b --at 1 -1:x => 4 steps"
    example = read_example(line, tmp_path / "robot.lp", "")
    assert example.words[:2] == (f"{tmp_path}/map.asp", str(tmp_path.parent / "b"))
    rest = "--simulate -t 2 --goal -visit(1) --at 1 -1:x"
    assert example.words[2:] == (f"{tmp_path}/robot.lp", *rest.split())


def test_an_example_without_files(tmp_path: Path) -> None:
    """It is planned with all files of the command line, as there may be a library among them."""
    files = ("lib/actions.lp", str(tmp_path / "robot.lp"))
    (tmp_path / "robot.examples").write_text("--goal x => 1 step\nmap.lp --goal x => 1 step\n")
    alone, own = read_examples(files[1], files)
    assert alone.words == (*files, "--simulate", "--goal", "x")
    assert own.words[:3] == (f"{tmp_path}/map.lp", files[1], "--simulate")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("--goal 'visit(3)'", "expected arguments of plan.py, =>, and what comes of them"),
        ("--goal 'visit(3)' =>", "'': expected N steps, the goals' statuses"),
        ("--goal 'visit(3)' => no plan because", "no plan because: name the reason, such as"),
        ("--goal 'visit(3)' => no plan", "no plan: name the reason, such as"),
        ("--goal 'visit(3)' => no plan because X", "'X' is not a ground term: X begins"),
        ("--goal 'visit(3' => 2 steps", "'visit(3' is not a ground term"),
        ("--goal visit(3)' => 2 steps", "No closing quotation"),
        ("none.lp => 2 steps", "there is no file '{folder}/none.lp'"),
    ],
)
def test_a_line_that_is_no_example(line: str, reason: str, tmp_path: Path) -> None:
    file = changed(tmp_path)
    (tmp_path / "changed.examples").write_text(f"{line}\n")
    with pytest.raises(RosclingoError) as caught:
        check(file, "--episodes", "0")
    assert str(caught.value).startswith(f"{tmp_path}/changed.examples:1: ")
    assert reason.format(folder=tmp_path) in str(caught.value)


# The command.


def test_what_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = changed(tmp_path, "status(ID,accepted,t) :- event(ID,visit(X),t).", "")
    assert run([file, "--episodes", "0", "--goal", "visit(2)"]) == 1
    assert capsys.readouterr().out.splitlines() == [
        "accepted: goal 1, visit(2), gets no status in the step in which it comes",
        f"    plan.py {shlex.quote(file)} --simulate --goal 'visit(2)'",
        "0 examples, 0 episodes, 2 runs: 1 found",
    ]


@pytest.mark.costly
def test_nothing_is_found(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([LINE, *SMALL, "--episodes", "4", "--seed", "3", "--event", "info:open(3)"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("0 examples, 4 episodes, ")  # as many as were asked for
    assert out.endswith(": nothing found\n")


# Nobody knows soon whether there is a plan: so many pigeons do not fit into their holes.
PIGEONS = """
1 { in(P,H) : H = 1..13 } 1 :- P = 1..14, t > 1.
:- in(P,H), in(Q,H), P < Q, t > 1.
"""


@pytest.mark.costly
def test_the_time_is_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = changed(tmp_path, "#program query(t).", f"{PIGEONS}\n#program query(t).")
    assert run([file, *SMALL, "--seconds", "2"]) == 0
    *_, slow, command, last = capsys.readouterr().out.splitlines()
    assert slow.startswith("slow (a hint): this run was ended after ")
    assert ", at horizon " in slow
    assert command.startswith(f"    plan.py {shlex.quote(file)} -c cells=4 --simulate")
    assert last.endswith(
        ": nothing found, 1 hint, and then the 2 s were over; --seconds S gives more"
    )
    assert run([LINE, "--seconds", "1e-9"]) == 0
    assert "0 examples, 0 episodes, 0 runs: nothing found" in capsys.readouterr().out


def test_a_mode_that_takes_no_goals(capsys: pytest.CaptureFixture[str]) -> None:
    blocks = (f"{EXAMPLES}/instance.lp", f"{EXAMPLES}/itoh.lp")
    assert run([*blocks, "--episodes", "4"]) == 0
    assert capsys.readouterr().out == "0 examples, 0 episodes, 1 runs: nothing found\n"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "name the planner's encoding and instance: check.py FILE.lp..."),
        (["none.lp"], "there is no file 'none.lp'"),
        ([LINE, "--goal", "visit("], "'visit(' is not a ground term"),
        ([LINE, "--event", "close"], "expected goal:REQUEST, cancel:NUMBER or SOURCE:VALUE"),
        ([LINE, "--event", "goal:a"], "'goal:a': expected SOURCE:VALUE"),
        ([LINE, "--live"], "--live needs ROS: type rosrun rosoclingo check.py"),
        ([LINE, "--mode", "none", "--episodes", "0"], "there is no mode 'none'"),
        ([LINE, "--wrong"], "wrong"),
        ([LINE, "--episodes", "-1"], "--episodes: a number from 0 on is needed: -1"),
        ([LINE, "--episodes", "9" * 5000], "--episodes: a number from 0 on is needed: 999"),
    ],
)
def test_a_wrong_command_line(arguments: Sequence[str], reason: str, capsys: Any) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(arguments=arguments)
    assert reason in capsys.readouterr().err


def test_without_ros(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("rospy", "genpy", "roslib", "actionlib", "rospkg", "catkin_pkg"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setattr(sys, "argv", ["check.py", LINE, *SMALL, "--episodes", "1"])
    interrupt = signal.getsignal(signal.SIGINT)
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("rosoclingo.tools.check", run_name="__main__")
    signal.signal(signal.SIGINT, interrupt)
    assert ended.value.code == 0
    assert "nothing found" in capsys.readouterr().out


@pytest.mark.costly
def test_the_same_again() -> None:
    """A seed gives the same episodes."""
    runs: List[List[str]] = []
    for seed in ("1", "1", "2"):
        words = [LINE, *SMALL, "--episodes", "4", "--seed", seed, "--event", "info:open(3)"]
        checking = Checking(parse(words))
        assert list(checking.findings()) == []
        runs.append([repr(words) for words in checking.commands])
    assert runs[0] == runs[1] != runs[2]


@pytest.mark.parametrize("name", ["line", "line_1.0", "line_paper", "line_demand"])
def test_an_alphabet(name: str) -> None:
    """Each dialect, and encodings that are told their events, declare the same."""
    alphabet = read_alphabet(Options((f"{EXAMPLES}/{name}.lp",)))
    assert alphabet.slots == ("1", "2")
    assert alphabet.requests == tuple(f"visit({cell})" for cell in range(1, 7))
    assert alphabet.cancels == {"1", "2"}
    assert alphabet.answers == {"robot": ("failure", "success")}
    assert alphabet.messages[5:7] == (("info", "close(6)"), ("info", "open(1)"))
    assert alphabet.can_be_saved == (name in ("line", "line_demand"))


def test_a_word_for_a_command() -> None:
    finding = Finding("past", "it is wrong", "robot.lp:3", (("robot.lp", "--goal", "visit(3)"),))
    assert str(finding) == "robot.lp:3: past: it is wrong\n    plan.py robot.lp --goal 'visit(3)'"


def test_an_option_is_wrong() -> None:
    with pytest.raises(OptionsError, match="clingo refuses the options"):
        check(LINE, "-c", "cells=4", "--nonsense")


# A running system.

ABOUT = {"sha256": "", "text": Path(LINE).read_text()}
RUNNING: Dict[str, Dict[str, Any]] = {
    "/rosoclingo": {"program": "rosoclingo run.py", "solvers": {"planner": "/planner"}},
    "/planner": {"files": {"/elsewhere/line.lp": ABOUT}, "versions": {"clingo": "5.7.1"}},
    "/robot": {"actuators": ["robot"], "messages": [], "versions": {"clingo": "5.7.1"}},
    "/un_block": {"messages": ["info"]},
}


@pytest.mark.costly
@pytest.mark.parametrize(
    ("node", "about", "said"),
    [
        ("/robot", {"actuators": []}, ""),
        ("/robot", {"actuators": ["arm"]}, "no interface says that it does the actions of robot"),
        ("/un_block", {}, "no node says that it sends the messages of info"),
        ("/rosoclingo", {}, "no planning node runs"),
        ("/planner", None, "/rosoclingo plans with /planner, and there is no such node"),
        ("/planner", {"files": {}}, "/planner runs without line.lp, which was checked"),
        ("/planner", {"files": {"line.lp": {"text": "a."}}}, "/planner runs with another line.lp"),
        (
            "/planner",
            {"files": {"line.lp": ABOUT, "more.lp": ABOUT}},
            "/planner runs with more.lp, which was not checked",
        ),
        (
            "/robot",
            {"actuators": ["robot"], "versions": {"clingo": "5.6.2"}},
            "different versions of clingo (5.7.1: /planner; 5.6.2: /robot)",
        ),
    ],
)
def test_a_running_system(node: str, about: Optional[Dict[str, Any]], said: str) -> None:
    """What does not fit is said, and nothing else."""
    running = {name: value for name, value in RUNNING.items() if name != node}
    if about is not None:
        running[node] = about
    nodes = {
        name: Launched.decode(name, json.dumps({"program": "", **value}))
        for name, value in running.items()
    }
    words = [LINE, *SMALL, "--episodes", "0", "--goal", "visit(1)", "--live"]
    found = list(Checking(parse(words), lambda: nodes).findings())
    assert [finding.check for finding in found] == (["live"] if said else [])
    assert all(said in finding.text for finding in found)
