from __future__ import annotations

import base64
import hashlib
import json
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, Dict, List, Tuple

import pytest
from bag_maker import Maker, run_without, source
from conftest import exit_status
from journals import Journal, long_journal
from matplotlib.figure import Figure

from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.bags.model import Recording
from rosoclingo.bags.report import picture
from rosoclingo.bags.report.command import main
from rosoclingo.bags.report.page import data, render
from rosoclingo.bags.report.picture import draw, label
from rosoclingo.bags.report.rows import COLOURS, LEGEND, Bar, Lane
from rosoclingo.bags.report.run import Statistics
from rosoclingo.bags.report.statistics import compute
from rosoclingo.encodings.about import LOOP_NODE, SOLVER_NODE, Launched

HOSTILE = "</script><img src=x onerror=alert(1)><!--<script>&lt;\u2028'\"@SCRIPT@"
PNG = b"\x89PNG\r\n\x1a\n"


class Page(HTMLParser):
    """What a browser sees of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._inside = ""
        self.tags: List[str] = []
        self.attributes: List[Tuple[str, str]] = []
        self.texts: Dict[str, str] = {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        self._inside = dict(attrs).get("type") or tag

    def handle_endtag(self, _: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        self.texts[self._inside] = self.texts.get(self._inside, "") + data

    @property
    def data(self) -> Any:
        return json.loads(self.texts["application/json"])


def page_of(recording: Recording) -> str:
    return render(recording, compute(recording), Path("some/run.bag"))


def rows(table: Dict[str, Any]) -> List[Dict[str, Any]]:
    return [dict(zip(table["names"], row)) for row in table["rows"]]


def test_the_page_holds_what_happened() -> None:
    journal = Journal().goal("g", "bring(1,3)", "a box").plan("do(r,a,1)")
    journal.status("g", "accepted", "1").move(1, 5).action("r", "a").message("r", "failure")
    journal.plan("do(r,a,1)", "do(r,b,2)").message("x", "y").dropped("id x, value y: why")
    found = Page(page_of(journal.recording())).data
    assert found["title"] == "run.bag"
    (goal,) = rows(found["goals"])
    assert (goal["request"], goal["information"], goal["came"]) == ("bring(1,3)", ["a box"], 1)
    assert goal["ended"] is None
    (action,) = rows(found["actions"])
    assert (action["actuator"], action["answer"]) == ("r", "failure")
    assert [row["causes"] for row in rows(found["changes"])] == [
        [["goal", "bring(1,3)"]],
        [["failure", "r: a"]],
    ]
    assert found["charts"][0]["series"] == [
        ["horizon", "open", [0, 5]], ["current step", "canceled", [0, 1]],
    ]  # fmt: skip
    assert found["steps"] == [1, 5]
    lanes = [(lane["name"], lane["kind"], len(lane["bars"])) for lane in found["lanes"]]
    assert lanes == [
        ("goals", "goals", 1), ("r", "actions", 1), ("messages", "messages", 1),
        ("plan changes", "changes", 2), ("searches", "searches", 2),
    ]  # fmt: skip
    number, began, _, colour = found["lanes"][1]["bars"][0]
    assert (number, began, list(found["colours"])[colour]) == (0, action["began"], "failure")
    assert [row["dropped"] for row in rows(found["messages"])] == ["id x, value y: why"]
    figures = {name: (value, more) for name, value, more in found["figures"]}
    assert figures["goals"] == ("1", "1 open")
    assert figures["actions"] == ("1", "1 failed, 0 without an answer")
    assert figures["messages"] == ("2", "1 dropped")
    assert figures["bag"] == ("4.0 KiB", f"{len(journal.entries)} events, with a journal")


def test_the_page_has_the_answers() -> None:
    journal = Journal().goal("g", "bring(1,3)").move(2, 5)
    journal.add("why", "goal 1", "It waits.", ('{"slot": "1"}',), 0.25)
    found = Page(page_of(journal.recording())).data
    (answer,) = rows(found["answers"])
    assert answer == {
        "seconds": 2, "step": 2, "question": "goal 1", "text": "It waits.", "duration": 0.25,
    }  # fmt: skip


def test_goals_of_one_slot_and_request_have_names_of_their_own() -> None:
    journal = Journal()
    for goal in "ab":
        journal.goal(goal, "visit(3)").status(goal, "accepted", "1").plan("do(r,a,1)")
        structure = '{"slot": "1", "request": "visit(3)"}'
        journal.add("why", "goal 1", "It waits.", (structure,), 0.25)
        journal.add("why", "goal visit(3)", "It waits.", (structure,), 0.25)
        journal.add("why", "goal 1", "It waits.", ("[" * 5000,), 0.25)
        journal.add("why", "goal 1", "It waits.", ("[1]",), 0.25)
        journal.plan().status(goal, "succeeded", "1")
    found = Page(page_of(journal.recording())).data
    assert [row["name"] for row in rows(found["goals"])] == ["visit(3)", "visit(3) (2)"]
    first, second = ["goal visit(3)"] * 2, ["goal visit(3) (2)"] * 2
    unknown = ["goal 1"] * 2
    assert [row["question"] for row in rows(found["answers"])] == [
        *first, *unknown, *second, *unknown,
    ]  # fmt: skip
    assert ["goal", "visit(3) (2)"] in [
        cause for row in rows(found["changes"]) for cause in row["causes"]
    ]


def test_what_has_no_rows_is_no_empty_card() -> None:
    page = page_of(Journal().goal("g", "x").recording())
    assert '<section id="restarts"></section>' in page  # its script fills it, if there are some
    assert re.search(r"section:empty \{\s+display: none;", page)


def test_the_page_says_with_what_the_nodes_were_started() -> None:
    planner = Launched(
        "/planner", "rosclingo run.py", ("-f", "a b.lp"), {"a b.lp": "a."}, {"clingo": "5.8"}
    )
    loop = Launched("/rosoclingo", "rosoclingo run.py", solvers={"planner": "/planner"})
    programs = {program.node: program for program in (planner, loop)}
    recording = Recording("/rosoclingo", (), programs, ("it was repaired",), has_journal=False)
    found = data(recording, compute(recording), Path("run.bag"))
    assert found["remarks"] == ["it was repaired"]
    assert found["programs"][0] == {
        "node": "/planner",
        "role": "planner",
        "command": "rosrun rosclingo run.py -f 'a b.lp'",
        "files": [["a b.lp", hashlib.sha256(b"a.").hexdigest()[:8]]],
        "versions": "clingo 5.8",
    }
    assert "without a journal" in found["figures"][-1][2]


def test_texts_of_the_bag_are_no_html() -> None:
    journal = Journal().goal(HOSTILE, HOSTILE, HOSTILE).status(HOSTILE, "accepted", HOSTILE)
    journal.action(HOSTILE, HOSTILE).message(HOSTILE, HOSTILE).dropped(HOSTILE)
    journal.plan(f"do({HOSTILE},{HOSTILE},1)").status(HOSTILE, HOSTILE, HOSTILE, HOSTILE)
    program = Launched(HOSTILE, HOSTILE, (HOSTILE,), {HOSTILE: HOSTILE}, {HOSTILE: HOSTILE})
    recording = Recording(
        HOSTILE,
        journal.add("end", text=HOSTILE).recording().entries,
        {HOSTILE: program},
        (HOSTILE,),
    )
    harmless = Page(page_of(Journal().goal("g", "x").recording()))
    page = Page(render(recording, compute(recording), Path(HOSTILE)))
    # Nothing but the data differs: not a tag, and no text outside of them.
    assert page.tags == harmless.tags
    assert page.attributes == harmless.attributes
    assert {**page.texts, "application/json": ""} == {**harmless.texts, "application/json": ""}
    assert rows(page.data["goals"])[0]["request"] == HOSTILE
    assert page.data["remarks"] == [HOSTILE]


def test_the_page_needs_nothing_else_and_runs_its_own_script_alone() -> None:
    page = Page(page_of(Journal().goal("g", "x").recording()))
    names = {name for name, _ in page.attributes}
    assert names.isdisjoint({"src", "href", "onclick", "onload", "style"})
    policy = next(value for _, value in page.attributes if "default-src" in value)
    assert "default-src 'none'" in policy
    assert ("http-equiv", "Content-Security-Policy") in page.attributes
    for text in (page.texts["module"], page.texts["style"]):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert "unsafe" not in policy
    for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
        assert word not in page.texts["module"]


def test_its_modules_are_one_script() -> None:
    """None of them imports anything, and no name stands in two of them."""
    script = Page(page_of(Journal().goal("g", "x").recording())).texts["module"]
    assert not re.search(r"^(import|export)\b", script, re.MULTILINE)
    names = re.findall(r"^(?:const|let|function) (\w+)", script, re.MULTILINE)
    assert len(names) == len(set(names))
    assert {"drawLanes", "tabulate"} <= set(names)


@pytest.mark.costly
@pytest.mark.long
def test_a_page_of_10000_steps_is_below_5_mib() -> None:
    recording = long_journal(10_000).recording()
    statistics = compute(recording)
    assert len(statistics.steps) == len(statistics.changes) == 10_000
    assert len(render(recording, statistics, Path("run.bag")).encode()) < 5 * 2**20


@pytest.mark.costly
def test_restarts_are_marked(tmp_path: Path) -> None:
    journal = Journal().action("r", "a").add("resumed", "rosoclingo", seconds=0.5)
    journal.add("resumed", "planner", HOSTILE, seconds=2.0).message("r", "success")
    found = Page(page_of(journal.recording())).data
    loop, planner = rows(found["restarts"])
    assert (loop["node"], loop["seconds"], loop["duration"], loop["last"]) == (
        "rosoclingo", 2, 0.5, 1,
    )  # fmt: skip
    assert (planner["node"], planner["reason"]) == ("planner", HOSTILE)
    figures = {name: (value, more) for name, value, more in found["figures"]}
    assert figures["restarts"] == ("2", "1 rosoclingo, 1 planner")
    assert_drawn(tmp_path, "restart", journal.compute(), Journal().action("r", "a").compute())


@pytest.mark.costly
def test_what_an_operator_held_is_a_lane(tmp_path: Path) -> None:
    journal = Journal().action("r", "a").message("r", "success").action("r", "b")
    held = (
        (-1.0, OperatorDecisions()),
        (0.5, OperatorDecisions(True, ("r",))),
        (1.0, OperatorDecisions(True, ("r",), (("r", "b", "pause"),))),
        (1.5, OperatorDecisions.read(False, (), ("do(r,b)", "nonsense"), ("approval",) * 2)),
        (2.0, OperatorDecisions()),
        (2.5, OperatorDecisions(on_hold=(HOSTILE,))),
    )
    recording = replace(journal.recording(), held=held)
    found = Page(page_of(recording)).data
    spans = [(one["began"], one["ended"], one["kind"], one["name"]) for one in rows(found["holds"])]
    assert spans == [
        (0.5, 1.5, "hold", "paused, r on hold"), (1.5, 2.0, "approval", "r: b for approval"),
        (2.5, None, "hold", f"{HOSTILE} on hold"),
    ]  # fmt: skip
    (lane,) = (one for one in found["lanes"] if one["name"] == "operator")
    assert [bar[:3] for bar in lane["bars"]] == [[0, 0.5, 1.5], [1, 1.5, 2.0], [2, 2.5, 3.0]]
    assert_drawn(tmp_path, "hold", compute(recording), journal.compute())


PHRASES = """
#program phrases. phrase("shut(W)", "the door of W is shut").
phrase("flat", "the battery is flat"). phrase("go(W)", "go to W").
phrase("observed(e,success)", "the bell rang").
"""


@pytest.mark.costly
def test_beliefs_are_a_lane_and_a_table(tmp_path: Path) -> None:
    seen = ("observes(d,failure,1)", "is_about(d,1,r,go(b))", "observes(e,success,2)")
    shut = ("belief(1,2,shut(b))", "certain(shut(b))", "speaks_for(shut(b),d,1)")
    flat = ("speaks_for(flat,d,1)", "belief(2,3,flat)")
    against = ("speaks_for(flat,d,1)", "speaks_against(flat,e,2,failure)")
    journal = Journal().move(3).add("belief", details=(*seen, *shut, *flat))
    journal.add("belief", details=(*seen, *shut, *against))
    journal.move(4).add("belief", details=(f'belief(1,2,"{HOSTILE}")',)).add("belief")
    journal.add("belief", details=("belief(1,2,flat)",)).goal("g", "x")
    found = Page(page_of(journal.recording())).data
    first, second, third = rows(found["beliefs"])
    assert first == {
        "began": 1, "ended": 3, "step": 3, "name": "shut(b)", "is_certain": True, "others": "",
        "speaks_for": "r: go(b) failure", "speaks_against": "flat: e: success",
    }  # fmt: skip
    assert (second["name"], second["is_certain"]) == (f'"{HOSTILE}"', False)
    assert (third["began"], third["ended"], third["step"]) == (5, None, 4)
    (lane,) = (one for one in found["lanes"] if one["name"] == "believed")
    assert [bar[:3] for bar in lane["bars"]] == [[0, 1, 3], [1, 3, 4], [2, 5, 6]]
    other = Journal().add("belief", details=(*seen, *shut, *flat)).compute()
    assert [one.others for one in other.beliefs] == ["flat (nearly as likely)"]
    planner = Launched("/planner", SOLVER_NODE, files={"/a.lp": PHRASES})
    loop = Launched("/rosoclingo", LOOP_NODE, solvers={"planner": "/planner"})
    programs = {"/planner": planner, "/rosoclingo": loop}
    recorded = replace(journal.recording(), name="/rosoclingo", programs=programs)
    (first, *_) = compute(recorded).beliefs
    assert (first.name, first.speaks_for) == ("the door of b is shut", "r could not go to b")
    assert first.speaks_against == "the battery is flat: the bell rang"
    assert_drawn(tmp_path, "belief", journal.compute(), Journal().goal("g", "x").compute())


def assert_drawn(folder: Path, what: str, marked: Statistics, plain: Statistics) -> None:
    """Draws a run with something that has a colour, and one without."""
    for statistics, has_it in ((marked, True), (plain, False)):
        draw(statistics, "run", folder / "run.svg")
        assert (COLOURS[what] in (folder / "run.svg").read_text()) == has_it


def test_a_label_does_not_reach_into_the_next_bar() -> None:
    axes = Figure().subplots()
    axes.set_xlim(0, 10)
    label(axes, 50 * "x", 2, 0, 3)
    label(axes, "y", 3, 0)
    first, second = axes.texts
    assert first.get_clip_box().x1 == pytest.approx(axes.transData.transform((3, 0))[0])
    assert second.get_clip_box().x1 == axes.bbox.x1
    assert re.fullmatch("x+…", first.get_text())


def test_a_bar_without_room_has_no_label() -> None:
    axes = Figure().subplots()
    axes.set_xlim(0, 100)
    label(axes, "go(c12)", 2, 0, 3)
    assert not axes.texts


@pytest.mark.costly
def test_the_legend_is_not_cut(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Not if all kinds of bars are there, either."""
    figures: List[Figure] = []
    monkeypatch.setattr(picture, "save", lambda figure, _: figures.append(figure))
    used = {name: word for words in LEGEND.values() for name, word in words.items()}
    bars = [Bar(0, 0, 1, name) for name in used]
    monkeypatch.setattr(picture, "rows", lambda _: [Lane("all", "", bars)])
    draw(long_journal(12).compute(), "run", tmp_path / "run.png")
    (figure,) = figures
    figure.draw_without_rendering()
    legend = figure.axes[0].get_legend()
    assert len(legend.get_texts()) == sum(map(len, LEGEND.values()))
    around = legend.get_window_extent()
    assert figure.bbox.x0 <= around.x0
    assert around.x1 <= figure.bbox.x1
    assert not any(around.overlaps(one.get_tightbbox()) for one in figure.axes[1:])


@pytest.mark.costly
@pytest.mark.parametrize("steps", [0, 12, 1_000])
def test_a_picture_is_written(tmp_path: Path, steps: int) -> None:
    file = tmp_path / "run.png"
    draw(long_journal(steps).compute(), f"$ {HOSTILE}", file)
    assert file.read_bytes().startswith(PNG)


# The program.


def bag(folder: Path) -> Path:
    maker = Maker().about().event(1, "goal", 0.1, id="g", text="bring(1,3)")
    maker.event(2, "status", 0.2, id="g", text="accepted", details=["1", ""], step=1)
    return maker.write(folder / "run.bag")


@pytest.mark.costly
def test_the_program_writes_page_and_picture(tmp_path: Path) -> None:
    assert exit_status(main, bag(tmp_path), "--png", tmp_path / "run.png") == 0
    assert (tmp_path / "run.png").read_bytes().startswith(PNG)
    found = Page((tmp_path / "run.html").read_text(encoding="utf-8")).data
    assert rows(found["goals"])[0]["request"] == "bring(1,3)"
    assert [program["node"] for program in found["programs"]] == [
        "/rosoclingo",
        "/controller",
        "/planner",
    ]


def test_the_program_runs_without_ros_clingo_and_matplotlib(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    done = run_without(["matplotlib"], "report", str(bag(tmp_path)), "-o", str(page))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"wrote {page}\n"
    assert page.exists()


def test_nothing_of_a_bag_commands_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    maker = Maker("/\x1b[2J")
    maker.event(1, "goal", 0.1, id="g", text="bring(1,3)")
    other = source("/\x1b[2J/journal", "std_msgs/String")
    maker.messages.append((other, 0.2, b""))
    assert exit_status(main, maker.write(tmp_path / "run.bag")) == 0
    captured = capsys.readouterr()
    assert "left out: /\\x1b[2J/journal" in captured.err
    assert "\x1b" not in captured.out + captured.err
    assert exit_status(main, tmp_path / "run.bag", "--name", "x") == 2
    captured = capsys.readouterr()
    assert "there are /\\x1b[2J" in captured.err
    assert "\x1b" not in captured.out + captured.err


@pytest.mark.parametrize("content", [None, b"", b"no bag at all"])
def test_what_is_no_bag_ends_the_program_with_a_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: Any
) -> None:
    file = tmp_path / "run.bag"
    if content is not None:
        file.write_bytes(content)
    assert exit_status(main, file) == 2
    assert str(file) in capsys.readouterr().err
    assert not (tmp_path / "run.html").exists()


@pytest.mark.parametrize(
    ("modules", "reason"),
    [((), "bmp"), (("matplotlib.collections",), "-m pip install 'matplotlib>=3.6'")],
)
def test_a_picture_that_cannot_be_drawn(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    modules: Tuple[str, ...],
    reason: str,
) -> None:
    monkeypatch.delitem(sys.modules, "rosoclingo.bags.report.picture", raising=False)
    for module in modules:
        monkeypatch.setitem(sys.modules, module, None)  # importing it fails
    assert exit_status(main, bag(tmp_path), "--png", tmp_path / "run.bmp") == 2
    error = capsys.readouterr().err
    assert str(tmp_path / "run.bmp") in error
    assert reason in error


def test_a_page_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_status(main, bag(tmp_path), "-o", tmp_path / "none" / "page.html") == 2
    assert "none/page.html" in capsys.readouterr().err
