"""How to add something, in CONTRIBUTING.md."""

from __future__ import annotations

import ast
import functools
import re
import textwrap
from pathlib import Path

import pytest
from page import BAGS, Page, of
from readmes import ROOT, section
from waiting import wait_for


def changed(file: Path, difference: str) -> str:
    """Returns a file's text after the changes that a block of the language diff shows."""
    text = file.read_text()
    for old, new in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n)+)", difference, re.MULTILINE):
        before, after = (re.sub(r"^[-+]", "", lines, flags=re.MULTILINE) for lines in (old, new))
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    return text


@of("CONTRIBUTING.md", "Add a command")
def test_the_method_of_a_command(page: Page) -> None:
    """It is the one that the next section has, which is typed."""
    pieces = section("CONTRIBUTING.md", "In a package of your own")
    (script,) = [piece.text for piece in pieces if piece.kind == "python"]
    assert page.block("python").strip() in script
    page.block("diff")
    page.set_variables()


@pytest.mark.costly
@of("CONTRIBUTING.md", "In a package of your own")
def test_a_command_in_a_package_of_ones_own(page: Page) -> None:
    pieces = section("CONTRIBUTING.md", "Add a command")
    difference = next(piece.text for piece in pieces if piece.kind == "diff")
    mode = ROOT / "rosoclingo/modes/static.incremental.recording.lp"
    (page.folder / "my_mode.lp").write_text(changed(mode, difference))
    for word in ("catkin_create_pkg", "mkdir", "touch", "chmod"):
        page.run(word)
    page.set_variables()
    (page.folder / "my_package/nodes/my_run.py").write_text(page.block("python"))
    page.type("roscore")
    for _ in range(2):
        page.type("run.py")
    page.type("my_run.py").wait_for("the plan has 14 actions")


@pytest.mark.costly
@of("CONTRIBUTING.md", "Add an action of a robot")
def test_an_action_of_a_robot(page: Page) -> None:
    (page.folder / "my_task.lp").write_text(page.block("prolog"))
    (page.folder / "my_robot.py").write_text(page.block("python"))
    page.type("single.launch")
    robot = page.type("my_robot.py")
    result = page.type("rostopic echo")
    page.hears("/rosoclingo/about")
    listeners = functools.partial(page.terminals.receivers, "/rosoclingo", "/rosoclingo/result")
    wait_for(lambda: any(name.startswith("/rostopic_") for name in listeners()))
    page.run("rostopic pub")
    result.wait_for('result: "succeeded"')
    assert "hello ann" in robot.output


@of("CONTRIBUTING.md", "Add a recorded topic")
def test_a_recorded_topic(page: Page) -> None:
    environment = (ROOT / "rosoclingo/src/rosoclingo/ros/environment.py").read_text()
    for used in ("publisher(", "String", "def show_plan(", "class RosEnvironment"):
        assert used in environment
    for _ in range(2):
        ast.parse(textwrap.dedent(page.block("python")))


@of("CONTRIBUTING.md", "Add a regression bag")
def test_a_regression_bag(page: Page) -> None:
    recording = (BAGS / "recording.py").read_text()
    added = ast.parse(textwrap.dedent(page.block("python")))
    for name in {node.id for node in ast.walk(added) if isinstance(node, ast.Name)}:
        assert re.search(rf"\b{name}\b", recording), name
