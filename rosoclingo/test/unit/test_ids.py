"""Any term may be the id of a slot, an actuator or a source, or is refused by its name."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any, Dict, Sequence

import pytest

from rosoclingo.encodings.alphabet import Alphabet
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import EXAMPLES
from rosoclingo.loop.values.ids import RESERVED, split_event, type_event, why_no_message
from rosoclingo.tools.check.command import Checking
from rosoclingo.tools.check.command_line import parse
from rosoclingo.tools.check.findings import typed
from rosoclingo.tools.check.search import FailureSearch
from rosoclingo.tools.plan import command as plan
from rosoclingo.tools.plan.command_line import parse as parse_plan

LINE = Path(f"{EXAMPLES}/line.lp").read_text()
SMALL = ("-c", "cells=2", "-c", "steps=9")


def encoding(
    folder: Path,
    *,
    actuator: str = "robot",
    source: str = "info",
    visit: str = "visit(X)",
    slots: str = "1..2",
) -> str:
    """Writes line.lp with other names, and returns its path."""
    text = re.sub(r"^%.*\n", "", LINE, flags=re.MULTILINE)
    text = re.sub(r"\brobot\b", lambda _: actuator, text).replace("visit(X)", visit)
    text = re.sub(r"\binfo,(?!passed)", lambda _: f"{source},", text)
    text = text.replace("rslot(1..slots).", f"rslot({slots}).")
    file = folder / "names.lp"
    file.write_text(text)
    return str(file)


def run(capsys: pytest.CaptureFixture[str], *words: str) -> Dict[str, Any]:
    """Runs plan.py, and returns what it prints as JSON."""
    plan.run([*words, *SMALL, "--simulate", "--json"])
    read: Dict[str, Any] = json.loads(capsys.readouterr().out)
    return read


@pytest.mark.parametrize("slot", ["1", "(1,2)"])
def test_an_actuator_with_the_id_of_a_slot(
    slot: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = encoding(tmp_path, actuator=slot, slots=slot)
    told = run(capsys, file, "--goal", "visit(2)")
    assert [goal["status"] for goal in told["goals"]] == ["aborted"]
    said = f"{slot} is the id of an actuator, and that of a goal's slot, rslot({slot}); give it"
    assert said in told["goals"][0]["reason"]
    assert not [event for event in told["journal"] if event["kind"] == "action"]
    checking = Checking(parse([file, *SMALL]))
    assert [said in one.text for one in checking.findings() if one.check == "names"] == [True]
    assert not checking.commands  # none could show more


@pytest.mark.parametrize("term", RESERVED)
def test_an_actuator_or_a_slot_with_a_reserved_id(
    term: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for what, names in (("an actuator", {"actuator": term}), ("a slot", {"slots": term})):
        file = encoding(tmp_path, **names)
        told = run(capsys, file, "--goal", "visit(2)")
        assert [goal["status"] for goal in told["goals"]] == ["aborted"]
        assert f"{term} is the id of {what}, and stands for" in told["goals"][0]["reason"]
        assert not [event for event in told["journal"] if event["kind"] == "action"]
        checking = Checking(parse([file, *SMALL]))
        assert "names" in [one.check for one in checking.findings()]
        assert not checking.commands


@pytest.mark.costly
@pytest.mark.parametrize(
    "names",
    [
        ("goal", "cancel", "success(X)", "goal(1)"),
        ("cancel", "goal", "cancel(X)", "queue(1)"),
        ("-1", "-x", "-visit(X)", "-2"),
        ('"it\'s a:b"', '"$x"', '(X,"a b")', '"1,2"'),
    ],
    ids=lambda names: names[0],
)
def test_any_other_id(
    names: Sequence[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each can be typed, to plan.py and to check.py, and does what any other does."""
    actuator, source, visit, slot = names
    file = encoding(tmp_path, actuator=actuator, source=source, visit=visit, slots=slot)
    message, failure = type_event(source, "open(2)"), type_event(actuator, "failure")
    words = ("--goal", visit.replace("X", "2"), "--event", message, "--at", "1", failure)
    told = run(capsys, file, *words)
    assert (told["wrong"], told["reasons"], told["warnings"]) == ([], [], [])
    assert [goal["status"] for goal in told["goals"]] == ["succeeded"]
    actions = [event["id"] for event in told["journal"] if event["kind"] == "action"]
    assert actions == [actuator, actuator]
    chosen = parse([file, *SMALL, *words[:4], "--episodes", "2"])
    assert (chosen.requests, chosen.messages) == ((words[1],), ((source, "open(2)"),))
    assert not [*Checking(chosen).findings()]


def test_what_check_prints_can_be_typed(tmp_path: Path) -> None:
    file = encoding(tmp_path)
    typed_inputs = [
        ("goal:-visit(2)", "0"), ("-1:-x", "0"), ('goal:("it\'s $x\\"",2)', "in:3"),
        ("cancel:1", "after:4"), ("-1:failure", "1"), ("(cancel):-1", "1"), ("(goal):1", "0"),
    ]  # fmt: skip
    inputs = [read_input(text, when) for text, when in typed_inputs]
    command = typed(FailureSearch((file, *SMALL), Alphabet()).words(tuple(inputs)))
    program, *words = shlex.split(command)
    assert program == "plan.py"
    assert sorted(map(str, parse_plan(words).inputs)) == sorted(map(str, inputs))


def test_what_nobody_may_announce() -> None:
    for source, content in [
        ("commit", "do(robot,go(2))"),
        ("save", "at(2)"),
        ("info", "passed"),
        ("queue", "first(visit(2))"),
        ("1", "visit(2)"),
        ("1", "cancel"),
    ]:
        assert why_no_message(source, content, ["1", "2"]), (source, content)
    for source, content in [("info", "passed(1)"), ("queue", "long"), ("3", "x"), ("do", "x")]:
        assert why_no_message(source, content, ["1", "2"]) is None, (source, content)


def test_an_event_as_it_is_typed() -> None:
    assert split_event(' "a:\\"b" : c ') == ('"a:\\"b"', "c")
    assert split_event("a") is split_event('"a:b"') is split_event('"a:b') is None
    assert str(read_input("(goal):done")) == "(goal):done"
    assert read_input("(cancel):1").kind == "message"
    assert read_input("cancel:1").kind == "cancel"
    assert read_input(" goal : visit( 2 )").value == "visit(2)"
