"""The command new.py: the package that it writes, its bag, and what it refuses."""

from __future__ import annotations

import ast
import os
import re
import runpy
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Dict, List, Optional

import pytest
from bag_maker import ROOT
from conftest import PACKAGE, exit_status

from rosclingo.solver.options import Options
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.startup import check, starts
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop import journal
from rosoclingo.tools.new import command
from rosoclingo.tools.new import package as scaffold
from rosoclingo.tools.new.package import PackageError, find_library, render, write
from rosoclingo.tools.plan import command as plan
from rosoclingo.tools.plan.bag import write_bag
from rosoclingo.tools.plan.command_line import parse
from rosoclingo.why.phrases import Phrases

NAMES = ["my_robot", "r2", "a_robot_with_a_name_that_is_longer_than_most_are"]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package as it is written."""
    folder = tmp_path_factory.mktemp("src")
    write("my_robot", folder)
    return folder / "my_robot"


@pytest.mark.parametrize("name", NAMES)
def test_each_file_has_the_name(name: str) -> None:
    files = render(name)
    others = render("x" * len(name))
    assert all(text.replace("x" * len(name), name) == files[path] for path, text in others.items())
    assert not [path for path, text in files.items() if "@name@" in text or "@line@" in text]
    assert ET.fromstring(files["package.xml"]).findtext("name") == name
    assert f"project({name})" in files["CMakeLists.txt"]
    for path in ("launch/robot.launch", "test/robot.rostest"):
        assert f"$(find {name})/" in files[path]
        ET.fromstring(files[path])
    first, title, last, *_ = files["CHANGELOG.rst"].splitlines()
    assert title.endswith(name)
    assert {len(first), len(last)} == {len(title)}


@pytest.mark.costly
def test_what_is_written(package: Path) -> None:
    files = {str(file.relative_to(package)) for file in package.rglob("*") if file.is_file()}
    assert files == {*render("my_robot"), "test/visits.bag"}
    script = package / "nodes/robot.py"
    assert os.access(script, os.X_OK)
    assert not os.access(package / "package.xml", os.X_OK)
    ast.parse(script.read_text(), feature_version=(3, 8))
    described = (package / "README.md").read_text()
    for name in files - {"CHANGELOG.rst", "CMakeLists.txt", "README.md"}:
        assert f"`{name}`" in described


def test_the_checkers_are_content(package: Path) -> None:
    ruff = [sys.executable, "-m", "ruff"]
    settings = ["--config", str(ROOT / "pyproject.toml"), str(package)]
    for arguments in (["check", "--no-cache"], ["format", "--check", "--no-cache"]):
        subprocess.run([*ruff, *arguments, *settings], check=True)
    for path, text in render("my_robot").items():
        longest = 100 if path.endswith((".lp", ".py")) else 120
        assert all(len(line) <= longest for line in text.splitlines()), path


@pytest.mark.costly
@pytest.mark.parametrize(
    "mode",
    ["recording", "reset", "dyn_reset"],
)
def test_the_encoding_plans(package: Path, mode: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Failures, a cancel and requests that wait for a slot, without a word of warning."""
    status = plan.run(
        [
            find_library(),
            str(package / "encoding/robot.lp"),
            *("--mode", f"dynamic.incremental.{mode}", "--simulate", "-c", "slots=1"),
            *("--goal", "visit(kitchen)", "--goal", "visit(dock)", "--goal", "visit(office)"),
            *(
                "--at",
                "2",
                "robot:failure",
                "--at",
                "3",
                "goal:visit(hall)",
                "--at",
                "3",
                "cancel:4",
            ),
        ]
    )
    said = capsys.readouterr()
    progress = re.compile(r"^\d+ s: .*\n", re.MULTILINE)  # of a machine that is busy
    assert (status, progress.sub("", said.err)) == (0, "")
    for goal, word in enumerate(["succeeded", "succeeded", "succeeded", "canceled"], 1):
        assert f"    goal {goal}, " in said.out.partition("after ")[2]
        assert f": {word}" in said.out
    actions = [line.strip() for line in said.out.splitlines() if line.startswith("    robot: ")]
    assert actions[1:3] == ["robot: go(kitchen)"] * 2  # it is tried again


def test_clingo_has_nothing_to_say_of_the_encoding(package: Path) -> None:
    """What it says is in the log of the planner's node."""
    messages: List[str] = []
    encoding = Options((find_library(), str(package / "encoding/robot.lp")))
    system = System(make_parts("dynamic.incremental.recording", encoding, log=messages.append).loop)
    goal = system.request("visit(kitchen)")
    assert system.run() is None
    assert (goal.words, messages) == (["accepted", "succeeded"], [])


def test_the_encoding_says_what_its_terms_mean(package: Path) -> None:
    phrases = Phrases.read([(package / "encoding/robot.lp").read_text()])
    assert phrases.of("visit(hall)") == "the robot is to be at hall"


def test_the_bag_is_a_run(package: Path, tmp_path: Path) -> None:
    """It names the nodes' command lines and files, and a replay starts them with its own."""
    bag = package / "test/visits.bag"
    recording = read_recording(bag)
    assert not recording.remarks
    run = Run.of(recording)
    assert list(run.requests.values()) == ["visit(kitchen)", "visit(dock)"]
    assert not run.is_empty
    assert not run.is_open
    check(bag, recording, allow_scripts=False)
    started = starts(recording, tmp_path)
    assert [start.name for start in started] == ["rosoclingo", "controller", "planner"]
    assert "_abort_unreachable:=true" not in started[0].command  # as in the launch file
    encoding = next(word for word in started[2].command if word.endswith("robot.lp"))
    assert Path(encoding).read_text() == (package / "encoding/robot.lp").read_text()
    assert started[1].command[-4:] == ("-c", "steps=20", "-c", "r=5")


def test_the_launch_file_has_the_arguments_of_rosoclingo(package: Path) -> None:
    """With the same defaults, which are those of plan.py, too, but for mode and steps."""

    def defaults(file: Path) -> Dict[str, Optional[str]]:
        return {arg.attrib["name"]: arg.get("default") for arg in ET.parse(file).iter("arg")}

    own = defaults(package / "launch/robot.launch")
    others = defaults(PACKAGE / "launch/rosoclingo.launch")
    unlike = {"mode", "encoding", "steps", "ns", "seed_planner"}  # the last one has no effect
    for name in others.keys() - unlike:
        assert own[name] == others[name], name
    chosen = parse([f"{EXAMPLES}/line.lp"])
    assert own["abort_unreachable"] == str(chosen.abort_unreachable).lower()
    assert float(own["patience"] or -1) == chosen.patience
    assert float(own["action_timeout"] or -1) == chosen.action_timeout
    assert int(own["threads"] or -1) == chosen.threads
    assert float(own["why_seconds"] or -1) == chosen.why_seconds


def test_a_bag_has_the_journal(tmp_path: Path) -> None:
    line = Options((f"{EXAMPLES}/line.lp",), ("-c", "cells=4"))
    system = System(make_parts("dynamic.incremental.recording", line).loop)
    system.request("visit(2)", ["with", "a ü"])
    system.request("nonsense")
    assert system.run() is None
    write_bag(tmp_path / "run.bag", system, {"planner": line, "controller": Options()})
    read = read_recording(tmp_path / "run.bag")
    for there, here in zip(read.entries, system.journal):
        assert journal.encode(there.event) == journal.encode(here.event)
        assert (there.number, there.step, there.horizon) == (here.number, here.step, here.horizon)
    assert len(read.entries) == len(system.journal)
    assert any(isinstance(entry.event, journal.GoalArrived) for entry in read.entries)
    assert read.programs["/planner"].arguments == ("-f", *line.files, *line.clingo)


def test_a_library_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scaffold, "LIBRARY", ("no_package", "lib/actions.lp"))
    with pytest.raises(PackageError, match=r"lib/actions\.lp of the package no_package.*install"):
        write("my_robot", tmp_path)
    assert not list(tmp_path.iterdir())


def said(arguments: List[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Returns what the command says when it refuses."""
    assert exit_status(command.main, *arguments) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("My-Robot", "did you mean 'my_robot'?"),
        ("my robot", "did you mean 'my_robot'?"),
        ("3d", "such as my_robot"),
        ("x", "such as my_robot"),
        ("", "such as my_robot"),
        ("../x", "such as my_robot"),
        ("rübe", "did you mean 'r_be'?"),
        ("a/b", "did you mean 'a_b'?"),
    ],
)
def test_names_that_are_none(
    name: str, hint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = said([name, "--folder", str(tmp_path)], capsys)
    assert repr(name) in text
    assert hint in text
    assert not list(tmp_path.iterdir())


@pytest.mark.costly
def test_a_name_that_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rospkg", reason="rospkg is ROS's")
    write("my_robot", tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with pytest.raises(PackageError, match=f"already, in {tmp_path}/my_robot.*another one"):
        write("my_robot", elsewhere)


def test_places_that_are_none(
    package: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = ["--folder"]
    missing = tmp_path / "a" / "b"
    assert f"make it with mkdir -p {missing}" in said(["robot", *folder, str(missing)], capsys)
    file = tmp_path / "file"
    file.write_text("mine")
    assert f"no folder {file}" in said(["robot", *folder, str(file)], capsys)
    assert "nothing in it was changed" in said(["file", *folder, str(tmp_path)], capsys)
    assert file.read_text() == "mine"
    inner = said(["robot", *folder, str(package / "nodes")], capsys)
    assert f"in the package {package}" in inner
    assert not (package / "nodes/robot").exists()
    # Nobody, root neither, makes a folder there.
    assert "name a folder with --folder that can be written to" in said(
        ["robot", *folder, "/proc"], capsys
    )


@pytest.mark.costly
def test_nothing_is_left_of_what_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", str(tmp_path / "my_robot/test/visits.bag"))

    monkeypatch.setattr(scaffold, "write_bag", full)
    with pytest.raises(PackageError, match=r"visits\.bag: No space left on device; name a folder"):
        write("my_robot", tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.costly
def test_without_ros(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("rospy", "genpy", "roslib", "actionlib", "rospkg", "catkin_pkg"):
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["new.py", "my_robot"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("rosoclingo.tools.new", run_name="__main__")
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith("wrote my_robot:\n    CHANGELOG.rst\n")
    assert read_recording(tmp_path / "my_robot/test/visits.bag").entries
