"""First plans of another planner: its task, its process, and its plan in layers."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import List, Sequence

import pytest
from conftest import exit_status
from downward_versions import VERSIONS, use_version
from waiting import wait_for

from rosoclingo.desk.command_line import parse
from rosoclingo.errors import SeedPlannerError
from rosoclingo.seed import downward
from rosoclingo.seed.downward import NONE, SeedProcess, find_seed_planner
from rosoclingo.seed.elimination import leave_out
from rosoclingo.seed.layering import put_in_layers
from rosoclingo.seed.sas import write
from rosoclingo.seed.task import Operator, SeedFact, read_task

LAMP = [
    'seed_is(lamp,"|",off)', 'seed_is(power,"|",good)', 'seed_wish(1,"|",lamp,"|",on)',
    'seed_other(arm,press,"|",power,"|",none)', 'seed_costs(arm,press,"|",7)',
    'seed_sets(arm,press,"|",pressed,"|",yes)', 'seed_sets_if(arm,press,"|",1,"|",lamp,"|",on)',
    'seed_condition(arm,press,"|",1,"|",lamp,"|",off)',
    'seed_sets_if(arm,press,"|",2,"|",lamp,"|",off)',
    'seed_condition(arm,press,"|",2,"|",lamp,"|",on)',
]  # fmt: skip
SECONDS = 60.0


def go(robot: str, start: str, goal: str) -> Operator:
    at = f"at({robot})"
    return Operator(f"{robot},{goal}", needs={at: start}, sets=[(at, goal)], robot=robot)


def act(
    choice: str, needs: Sequence[str], sets: Sequence[str] = (), numbers: Sequence[str] = ()
) -> Operator:
    return Operator(choice, dict(facts(needs)), sets=facts(sets), numbers=numbers)


def facts(texts: Sequence[str]) -> List[SeedFact]:
    pairs = (text.partition("=") for text in texts)
    return [(variable, value) for variable, _, value in pairs]


def test_a_task_in_sas() -> None:
    """A value that is unknown, one that a variable must not have, and effects with conditions."""
    task = write(read_task(LAMP))
    assert task.text.splitlines()[6] == "4"  # variables: power is not none, pressed, lamp, power
    assert "begin_state\n0\n1\n0\n0\nend_state" in task.text  # it is; nobody knows; off; good
    operator = task.text.partition("begin_operator\n")[2].splitlines()
    assert operator == [
        "0",  # its name
        "1", "0 0",  # needs that power is not none
        "3", "0 1 -1 0", "1 2 0 2 -1 1", "1 2 1 2 -1 0",
        "7",
        "end_operator", "0",
    ]  # fmt: skip


def test_each_of_several_requests_is_met_once() -> None:
    """Two requests may want a variable to have two values, one after the other."""
    wishes = ['seed_wish(1,"|",lamp,"|",on)', 'seed_wish(2,"|",lamp,"|",off)']
    task = write(read_task([*LAMP[:2], *LAMP[3:], *wishes]))
    assert task.goal == {"met 1": "yes", "met 2": "yes"}
    assert [one.cost for one in task.operators] == [7, 0, 0]


@pytest.mark.parametrize(
    "symbols",
    [
        ['seed_wish(1,"|",lamp,"|",on)', 'seed_wish(1,"|",lamp,"|",off)'],
        ['seed_is(lamp,"|","a,"|",b")'],
    ],
)
def test_what_is_no_task(symbols: List[str]) -> None:
    with pytest.raises(ValueError, match="values"):
        read_task(symbols)


def test_a_robot_goes_once_before_it_acts() -> None:
    """Two ways are one, and a way back is none; who depends on nobody is in the first layer."""
    plan = [
        go("r", "a", "b"), go("r", "b", "c"), go("s", "a", "b"), go("s", "b", "a"),
        act("r,load", ["at(r)=c", "box=c"], ["box=r"]),
        act("s,look", ["at(s)=a"], ["seen=yes"]),
        go("r", "c", "d"),
        act("r,unload", ["at(r)=d", "box=r"], ["box=d"]),
    ]  # fmt: skip
    layered = put_in_layers(plan, {"at(r)": "a", "at(s)": "a", "box": "c"}, {"box": "d"})
    assert layered.actions == [("r,load", 1), ("s,look", 1), ("r,unload", 2)]
    assert layered.ways == [("r,c", 1), ("r,d", 2)]
    assert layered.layers == 2


def test_a_value_is_read_before_it_is_changed() -> None:
    """In a layer that is possible; what is changed is read, and changed again, in later ones."""
    plan = [
        act("a,read", ["x=0"], ["y=1"]),
        act("b,change", ["x=0"], ["x=1"]),
        act("a,use", ["x=1"], numbers=["power"]),
        act("b,fill", [], ["z=1"], numbers=["power"]),
        act("c,change", [], ["x=2"]),
    ]
    initial = {"x": "0"}
    layers = [layer for _, layer in put_in_layers(plan, initial, {}).actions]
    assert layers == [1, 1, 2, 3, 2]
    one_each = put_in_layers(plan, initial, {}, one_each=True)
    assert [layer for _, layer in one_each.actions] == [1, 2, 3, 4, 5]


def test_a_request_is_met_before_its_values_change() -> None:
    """The robot gets there in the layer in which the door is opened, and leaves in a later one."""
    plan = [
        act("d,open", [], ["door=open"]),
        go("r", "a", "b"),
        Operator(needs={"door": "open", "at(r)": "b"}),
        go("r", "b", "a"),
        act("d,shut", [], ["door=shut"]),
        Operator(needs={"at(r)": "a"}),
    ]
    layered = put_in_layers(plan, {"at(r)": "a"}, {})
    assert layered.actions == [("d,open", 1), ("d,shut", 2)]
    assert layered.ways == [("r,b", 1), ("r,a", 2)]


def test_what_serves_nothing_is_left_out() -> None:
    """With an action goes what is possible only because of it."""
    back = act("a,back", ["x=1"], ["x=0"])
    plan = [
        act("a,there", ["x=0"], ["x=1"]),
        back,
        act("a,do", ["x=0"], ["y=1"]),
        act("a,end", ["y=1"], ["z=1"]),
        act("a,other", [], ["w=1"]),
    ]
    kept = leave_out(plan, {"x": "0"}, {"z": "1"})
    assert [one.choice for one in kept] == ["a,do", "a,end"]
    assert leave_out(plan[:2], {"x": "0"}, {"x": "1"}) == [plan[0]]


def test_a_seed_planner_that_there_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    assert find_seed_planner(NONE) is None
    with pytest.raises(SeedPlannerError, match="expected lama or none: fast"):
        find_seed_planner("fast")
    monkeypatch.setattr(downward, "find_fast_downward", lambda: None)
    with pytest.raises(SeedPlannerError, match="up-fast-downward, which is not installed: run pip"):
        find_seed_planner("lama")


def test_the_desk_names_the_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(downward, "find_fast_downward", lambda: None)
    assert exit_status(parse, "line.lp", "--seed-planner", "lama") == 2
    assert "pip install up-fast-downward" in capsys.readouterr().err


@pytest.mark.parametrize("version", VERSIONS)
def test_the_seed_planner_starts(monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    use_version(monkeypatch, version)
    program = find_seed_planner("lama")
    assert program is not None
    process = SeedProcess(program, write(read_task(LAMP)).text)
    wait_for(lambda: process.has_ended)
    assert process.plan() == [0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("echo 'unknown option' >&2; exit 32", "unknown option, exit status 32"),
        ("exit 127", "exit status 127"),
        ("", "Exec format error"),
    ],
)
def test_a_seed_planner_that_does_not_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, reason: str
) -> None:
    """For instance that of another processor, or of a version with other options."""
    folder = tmp_path / "builds" / "release" / "bin"
    folder.mkdir(parents=True)
    program(folder, text).rename(folder / "downward")
    monkeypatch.setattr(downward, "find_fast_downward", lambda: tmp_path)
    message = (
        rf"up-fast-downward \d\S* fails \(.*{reason}.*\).*pip install .*up-fast-downward==1.0.0"
    )
    with pytest.raises(SeedPlannerError, match=message):
        find_seed_planner("lama")


@pytest.mark.parametrize(
    ("text", "plan"),
    [("cat > /dev/null; echo '(1)'; echo '(0)'; echo '; cost = 2'", [1, 0]), ("exit 12", None)],
)
def test_the_plan_of_a_process(tmp_path: Path, text: str, plan: object) -> None:
    process = SeedProcess(program(tmp_path, text), "a task\n" * 100_000)
    wait_for(lambda: process.has_ended)
    assert process.plan() == plan
    process.close()


def test_a_process_is_ended(tmp_path: Path) -> None:
    """Be it that it has not read its task."""
    process = SeedProcess(program(tmp_path, "exec sleep 1000"), "a task\n" * 100_000)
    assert not process.has_ended
    process.close()
    assert process.has_ended
    assert process.plan() is None


def program(folder: Path, text: str) -> Path:
    made = folder / "planner.sh"
    made.write_text(f"#!/bin/sh\n{text}\n" if text else "no program")
    made.chmod(made.stat().st_mode | stat.S_IXUSR)
    return made
