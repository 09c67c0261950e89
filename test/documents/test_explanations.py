"""The guide to explanations."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from page import LINE, Page, of
from readmes import ROOT, check_output, section

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.why.happened import happened
from rosoclingo.why.past import Past
from rosoclingo.why.phrases import Phrases


@pytest.mark.costly
@of("docs/why.md", "At run time")
def test_why_at_run_time(page: Page) -> None:
    # Other tests may take all the time that what answers gives way to.
    page.terminals.master.setParam("/test", "/rosoclingo/why_nice", 0)
    node = page.type("rosoclingo.launch")
    page.hears("/rosoclingo/about")
    page.run("/rosoclingo/goal")
    node.wait_for("robot: go(2)")
    said = ""
    for word, status in (("info:close(3)", 0), ("goal:visit(6)", 0), ("--goal", 2)):
        (question,) = page.left[:1]
        terminal = page.type(word)
        while terminal.wait() == 1 and "there was no answer within" in terminal.output:
            page.left.insert(0, question)  # other processes have taken all the time
            terminal = page.type(word)
        assert terminal.wait() == status, terminal.output
        said += terminal.output
    check_output("docs/why.md", "At run time", said)


class Office(System):
    """The mailbot, which cannot get to c6."""

    def turn(self) -> bool:
        for actuator, action in sorted(self.acting.items()):
            self.answer(actuator, "failure" if action == "go(c6)" else "success")
        return bool(self._items)


@of("docs/why.md", "What has happened")
def test_what_has_happened() -> None:
    mailbot = ROOT / "rosoclingo_aspprograms" / "mailbot"
    files = (mailbot / "instances" / "graph_wg.lp", mailbot / "mailbot_causes.lp")
    options = Options(tuple(map(str, files)), ("-c", "looks=0"))
    run = Office(make_parts("dynamic.incremental.recording", options, ("-c", "steps=20")).loop)
    run.request("bring(o1,o9)")
    assert run.run() is None
    phrases = Phrases.read(Path(file).read_text() for file in options.files)
    text = happened("go(c6)", Past.of(run.loop.state), phrases).text
    said = " ".join((ROOT / "docs/why.md").read_text().split())
    assert f"`{text}`" in said


@of("docs/causes.md", "The mailbot")
def test_the_mailbot_finds_a_cause(page: Page) -> None:
    check_output("docs/causes.md", "The mailbot", page.run("plan.py"))


@of("docs/causes.md", "What an encoding says")
def test_rules_are_those_of_the_mailbot() -> None:
    encoding = (ROOT / "rosoclingo_aspprograms" / "mailbot" / "mailbot_causes.lp").read_text()
    blocks = [piece.text for piece in section("docs/causes.md", "What an encoding says")]
    rules = [rule for block in blocks for rule in block.strip().split("\n")]
    assert len(rules) == 7
    assert all(rule in encoding for rule in rules)


@of("docs/why.md", "In Python")
def test_why(tmp_path: Path) -> None:
    shutil.copy(LINE, tmp_path)
    (program,) = [p.text for p in section("docs/why.md", "In Python") if p.kind == "python"]
    said = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    check_output("docs/why.md", "In Python", said.stdout)


@of("docs/why.md", "What an encoding may say")
def test_phrases() -> None:
    (program,) = [piece.text for piece in section("docs/why.md", "What an encoding may say")]
    phrases = Phrases.read([program])
    assert phrases.of("blocked(c3,c4)") == "the way between c3 and c4 is blocked"
    assert phrases.of("go(c3)") == "go to c3"


BATTERY = """
#program base. fluent(battery(0..3)). before(battery(3),0).
#program state(t). holds(battery(N),0) :- before(battery(N),0), t = 0.
#program transition(t).
holds(battery(N-1),t) :- holds(battery(N),t-1), do(robot,_,t).
holds(battery(N),t) :- holds(battery(N),t-1), not do(robot,_,t).
"""


@of("docs/why.md", "Rules")
def test_a_rule_with_a_name(page: Page) -> None:
    battery = page.folder / "battery.lp"
    battery.write_text(BATTERY + page.block("prolog"))
    command = [
        "rosrun",
        "rosoclingo",
        "plan.py",
        str(LINE),
        str(battery),
        "--goal=visit(6)",
        "-c",
        "steps=9",
    ]
    said = " ".join(
        subprocess.run(command, check=False, stderr=subprocess.PIPE, text=True).stderr.split()
    )
    answer = re.search(
        "The answer is `(.*?)`", " ".join((ROOT / "docs/why.md").read_text().split())
    )
    assert answer is not None
    assert answer[1] in said
