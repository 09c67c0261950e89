"""The guide to modelling: files as they are printed, and what their commands say."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Callable, Dict, List

import pytest
from page import ACTIONS, Page, of
from readmes import ROOT, check_output, sections

from rosoclingo.tools.check import command as check
from rosoclingo.tools.plan import command as plan

GUIDE, ROBOTS = "docs/modelling.md", "With robots"


def write_guide(folder: Path) -> str:
    """Writes each file as the guide prints it, and returns the guide's text."""
    text = (ROOT / GUIDE).read_text()
    for name, content in re.findall(
        r"`(my_\w+\.lp)`[^`]*?:\n\n```prolog\n(.*?)```", text, re.DOTALL
    ):
        (folder / name).write_text(content)
    return text


@pytest.mark.costly
@of(GUIDE, ROBOTS)
def test_modelling_with_robots(page: Page) -> None:
    write_guide(page.folder)
    page.terminals.environment["A"] = ACTIONS
    page.terminals.master.setParam(
        "/test", "/rosoclingo/why_nice", 0
    )  # other tests take all the time
    page.type("single.launch").wait_for("plans with")
    page.type("fulfill.py")
    page.hears("/rosoclingo/dispatch")
    page.run("ROSoClingoActionGoal")
    page.run("locked(d1)")
    said = page.run("why.py")
    assert "no plan for bring(store,ward1) because the door d1 is locked." in said
    page.run("/rosoclingo/cancel")


@pytest.mark.costly
def test_modelling(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All other commands are typed, in this process."""
    monkeypatch.chdir(tmp_path)
    text = write_guide(tmp_path)
    programs: Dict[str, Callable[[List[str]], int]] = {"plan.py": plan.run, "check.py": check.run}
    others = [(heading, pieces) for heading, pieces in sections(GUIDE) if heading != ROBOTS]
    said = {heading: "" for heading, _ in others}
    for heading, pieces in others:
        for command in (piece.text for piece in pieces if piece.kind == "command"):
            words = shlex.split(command.replace("\\\n", "").replace("$A", ACTIONS))
            programs[words[2]](words[3:])
            said[heading] += "".join(capsys.readouterr())
    check_output("docs/modelling.md", "A first encoding", said["A first encoding"])
    check_output("docs/modelling.md", "Batteries", said["Batteries"])
    check_output("docs/modelling.md", "Capacities", said["Capacities"])
    assert "goal 2, bring(ward2," in said["Several robots"]
    assert "goal 2, bring(ward2," in said["Shared resources"]
    check_output("docs/modelling.md", "Doors", said["Doors"])
    check_output("docs/modelling.md", "Bringing things back", said["Bringing things back"])
    check_output("docs/modelling.md", "Time", said["Time"])
    check_output("docs/modelling.md", "Urgent things", said["Urgent things"])
    check_output("docs/modelling.md", "Waiting", said["Waiting"])
    (reason,) = re.findall(r"^says `([^`]+)`", text, re.MULTILINE)
    assert reason in said["Waiting"]
    assert "nothing found" in said["All of it"]
    check_output("docs/modelling.md", "A plain encoding", said["A plain encoding"])
    robot = Path("my_robot.lp").read_text()
    Path("my_robot.lp").write_text(re.sub("^request.*", "", robot, flags=re.MULTILINE))
    files = ["my_map.lp", "my_robot.lp", "my_many.lp"]
    assert plan.run([ACTIONS, *files, "--goal", "bring(store,ward1)"]) == 0


for _heading in (heading for heading, _ in sections(GUIDE) if heading != ROBOTS):
    test_modelling = of(GUIDE, _heading)(test_modelling)
