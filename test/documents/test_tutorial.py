"""The tutorial, as one page."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Iterator

import pytest
from page import Page, as_one_page, of
from readmes import ROOT, check_output, sections

TUTORIAL = [
    "1. A package that runs",
    "2. A second action",
    "3. Failures and announcements",
    "4. A run as a test",
]


@pytest.fixture
def tutorial(tmp_path: Path) -> Iterator[Page]:
    """The tutorial's steps, with all that they have to be typed, as one page."""
    with as_one_page(tmp_path, "docs/tutorial.md", TUTORIAL) as page:
        yield page


@pytest.mark.costly
@of("docs/tutorial.md", TUTORIAL[0])
@of("docs/tutorial.md", TUTORIAL[1])
@of("docs/tutorial.md", TUTORIAL[2])
@of("docs/tutorial.md", TUTORIAL[3])
def test_the_tutorial(tutorial: Page) -> None:
    """A package of one's own, from an empty folder; its README prints nothing else."""
    typed = {piece.text for piece in tutorial.left}
    workspace = tutorial.folder / "my_workspace"
    package = workspace / "src" / "my_robot"
    encoding, script = package / "encoding/robot.lp", package / "nodes/robot.py"

    tutorial.run("mkdir")
    said = tutorial.run("new.py") + tutorial.run("plan.py")
    printed = [piece.text for _, found in sections(str(package / "README.md")) for piece in found]
    assert len(printed) > 5
    assert typed.issuperset(printed)
    assert tutorial.block("command") == f"cd {workspace.name}"
    tutorial.folder = workspace
    tutorial.run("catkin_make")
    sources(tutorial, tutorial.block("command"))
    robot = tutorial.type("roslaunch")
    robot.wait_for("/planner is ready")
    tutorial.sees("/rosoclingo/goal")
    tutorial.run("rostopic pub")
    robot.wait_for("go(kitchen): success")
    check_output("docs/tutorial.md", "1. A package that runs", said + robot.output)
    tutorial.interrupt()
    tutorial.run("rostest")

    change(encoding, tutorial.block("diff"))
    place = "    def _simulate("
    script.write_text(script.read_text().replace(place, f"{tutorial.block('python')}\n{place}"))
    check_output("docs/tutorial.md", "2. A second action", tutorial.run("plan.py"))

    meet_failures(tutorial, encoding)

    robot = tutorial.type("record:=")
    tutorial.sees("/rosoclingo/goal")
    tutorial.run("rostopic pub")
    robot.wait_for("sweep(kitchen): success")
    check_output("docs/tutorial.md", "4. A run as a test", robot.output)
    tutorial.interrupt()
    tests = package / "test/robot.rostest"
    tests.write_text(tests.read_text().replace("</launch>", f"{tutorial.block('xml')}</launch>"))
    assert "testdetour" in tutorial.run("rostest")
    tutorial.run("report.py")
    assert "sweep(kitchen)" in (workspace / "detour.html").read_text()


def meet_failures(tutorial: Page, encoding: Path) -> None:
    """Types the tutorial's third step."""
    text = (ROOT / "docs/tutorial.md").read_text()
    said = tutorial.run("robot:failure")
    blocked = tutorial.type("blocked(dock,hall)")
    assert blocked.wait() == 1
    (reason,) = re.findall(r"says why:\n`([^`]+)`", text)
    assert reason in blocked.output
    said += tutorial.run("unblocked(dock,hall)")
    check_output("docs/tutorial.md", "3. Failures and announcements", said)
    change(encoding, tutorial.block("diff"))
    wet = tutorial.type("wet(kitchen)")
    assert wet.wait() == 1
    (reason,) = re.findall(r"says `(There is no plan[^`]+)`", text)
    assert reason in wet.output
    examples = encoding.with_suffix(".examples")
    change(examples, tutorial.block("diff"))
    checked = tutorial.type("check.py")
    assert checked.wait() == 1
    (difference,) = re.findall(r"the request waits: `([^`]+)`", text)
    assert f"robot.examples:15: example: {difference}" in checked.output
    assert "1 found" in checked.output
    change(examples, tutorial.block("diff"))
    assert re.search("5 examples, .*: nothing found", tutorial.run("check.py"))


def change(file: Path, difference: str) -> None:
    """Changes a file as a block of the language diff shows: a paragraph for each place."""
    text = file.read_text()
    for paragraph in re.split(r"\n\n+", difference.strip("\n")):
        lines = paragraph.splitlines()
        old, new = (
            "".join(f"{line[1:]}\n" for line in lines if line[0] in kept) for kept in (" -", " +")
        )
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    file.write_text(text)


def sources(page: Page, command: str) -> None:
    """Gives each terminal from now on what a command sets."""
    variables = subprocess.check_output(
        ("bash", "-c", f"{command} && env -0"),
        cwd=page.folder, env=page.terminals.environment, text=True,
    )  # fmt: skip
    pairs = (variable.partition("=") for variable in variables.split("\0"))
    page.terminals.environment.update({name: value for name, _, value in pairs if name})
