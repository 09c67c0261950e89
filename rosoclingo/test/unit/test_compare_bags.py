"""The command that compares two bags, and what it shares with the one that replays one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import List, Sequence
from xml.etree import ElementTree

import pytest
from bag_maker import Maker, run_without
from conftest import exit_status
from replay_maker import ASK, END, RUN, Made, drive, status

from rosoclingo.bags.compare import cli
from rosoclingo.bags.compare.command import main
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.read.run import Run

compare = partial(exit_status, main)
FAILS = ASK + status("accepted", 1) + drive(2) + status("aborted", 2) + END


def maker(
    made: Sequence[Made],
    goal: str = "g",
    *,
    name: str = "/rosoclingo",
    without: Sequence[int] = (),
    begin: float = 0.0,
) -> Maker:
    """Makes a bag of a journal, whose goal has an id, without some of its events."""
    bag = Maker(name).about(begin)
    for number, (kind, identifier, text, step) in enumerate(made, 1):
        if number not in without:
            owner = goal if identifier == "g" else identifier
            details = ["1"] if kind == "status" else []
            seconds = begin + number * 0.1
            bag.event(number, kind, seconds, id=owner, text=text, step=step, details=details)
    return bag


@pytest.fixture
def bags(tmp_path: Path) -> List[Path]:
    """A run, the same one at another time, and one that ends in another way."""
    return [
        maker(RUN).write(tmp_path / "expected.bag"),
        maker(RUN, "/client-1-17.5").write(tmp_path / "alike.bag"),
        maker(FAILS, "/client-1-18.5").write(tmp_path / "fails.bag"),
    ]


def test_the_exit_status(bags: List[Path], capsys: pytest.CaptureFixture[str]) -> None:
    expected, alike, fails = bags
    assert compare(expected, alike, "__name:=run", "__log:=run.log") == 0
    assert capsys.readouterr() == ("no difference at level exact: 1 goal, 2 steps\n", "")
    assert compare(expected, fails, "--level", "outcome") == 1
    said = capsys.readouterr().out
    assert "goal 1 visit(3) (g):" in said
    assert "<- first divergence" in said
    assert said.endswith("1 difference at level outcome: 1 goal, 2 steps\n")
    assert compare(expected, "nowhere.bag") == 2
    assert "compare: nowhere.bag: No such file" in capsys.readouterr().err
    assert compare(expected) == 2
    assert compare(expected, alike, "--level", "all") == 2


def test_results_for_ci(bags: List[Path], tmp_path: Path) -> None:
    file = tmp_path / "results.xml"
    for other, failures, errors in (
        (bags[1], "0", "0"),
        (bags[2], "2", "0"),
        (Path("no"), "0", "1"),
    ):
        compare(bags[0], other, "--junit", file)
        suite = ElementTree.parse(file).getroot()
        assert (suite.get("failures"), suite.get("errors")) == (failures, errors)
        assert suite.get("name") == f"comparison of expected.bag and {other.name}"
        assert suite[0].get("classname") == "compare.expected"


def test_names_of_nodes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = maker(RUN, name="/a"), maker(FAILS, name="/b")
    first.messages += second.messages
    both = first.write(tmp_path / "both.bag")
    single = maker(RUN, name="/c").write(tmp_path / "c.bag")
    assert compare(both, single) == 2
    assert "both.bag: the bag has several systems" in capsys.readouterr().err
    assert compare(both, single, "--name", "/a") == 2
    assert "no topics of /a; there are /c" in capsys.readouterr().err
    assert compare(both, single, "--name", "/a", "--seen-name", "/c") == 0
    assert compare(both, single, "--name", "/b", "--seen-name", "/c") == 1
    assert compare(both, both, "--name", "b") == 0
    assert compare(single, both, "--seen-name", "a") == 0
    assert compare(single, maker(RUN, name="/d").write(tmp_path / "d.bag")) == 0


@pytest.mark.costly
def test_the_program_runs_without_ros_and_clingo(bags: List[Path]) -> None:
    done = run_without([], "compare", str(bags[0]), str(bags[1]))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "no difference at level exact: 1 goal, 2 steps\n"
    assert run_without([], "compare", str(bags[0]), str(bags[2])).returncode == 1


# What cannot be compared.


@pytest.mark.parametrize(
    ("without", "missing"),
    [
        ([4], "missing: 4;"),
        ([4, 5, 7], "missing: 4 to 5, 7;"),
        ([2, 4, 6, 8, 10, 12], "missing: 2, 4, 6, 8, 10 and 1 more gaps;"),
        ([1, 2], "the first 2 events of the run are missing"),
    ],
)
def test_missing_events(
    bags: List[Path], capsys: pytest.CaptureFixture[str], without: List[int], missing: str
) -> None:
    gap = maker(RUN, without=without).write(bags[0].with_name("gap.bag"))
    for pair in ((gap, bags[0]), (bags[0], gap)):
        assert compare(*pair) == 2
        error = capsys.readouterr().err
        assert missing in error
        assert f"{gap}: " in error
        assert "record" in error


def test_a_bag_whose_end_is_missing(bags: List[Path], capsys: pytest.CaptureFixture[str]) -> None:
    whole = bags[0]
    content = whole.read_bytes()
    cut = whole.with_name("cut.bag")
    chunks = [at for at in range(len(content)) if content.startswith(b"compression=", at)]
    cut.write_bytes(content[: chunks[-2]])
    assert 4 < len(read_recording(cut).entries) < len(RUN)
    assert compare(cut, whole) == 0
    errors = capsys.readouterr().err
    assert "the bag has no intact index" in errors
    assert "ends while the loop was at work; what comes after that is not compared" in errors
    assert compare(whole, cut) == 1
    assert "what is missing at the end may have happened after it" in capsys.readouterr().err


def test_a_node_that_was_started_again(bags: List[Path]) -> None:
    """Its last run counts: that the first one has a gap does not matter."""
    first = maker([*FAILS, *drive(3, 4, first=3)], without=[5, 6])
    first.messages += maker(RUN, begin=60.0).messages
    restarted = first.write(bags[0].with_name("restarted.bag"))
    assert compare(bags[0], restarted) == 0
    assert compare(restarted, bags[2]) == 1


NOTHING: List[Made] = [("waiting", "", "", 0), ("message", "door", "open", 0),
                       ("command", "", "idle", 0), *END]  # fmt: skip


def test_nothing_to_compare(bags: List[Path], capsys: pytest.CaptureFixture[str]) -> None:
    nothing = maker(NOTHING).write(bags[0].with_name("nothing.bag"))
    stopped = maker([*NOTHING, ("end", "", "the node is shutting down", 0)])
    asked = maker(ASK[:2]).write(bags[0].with_name("asked.bag"))  # and ends before anything else
    for expected, seen in (
        (nothing, nothing),
        (nothing, stopped.write(bags[0].with_name("stopped.bag"))),
        (asked, asked),
        (asked, bags[0]),
    ):
        assert compare(expected, seen) == 2, (expected, seen)
        assert f"{expected}: nothing can be compared with {seen}" in capsys.readouterr().err
    assert compare(nothing, bags[0]) == 1
    assert compare(bags[0], nothing) == 1


@pytest.mark.parametrize(
    ("made", "empty"),
    [
        (RUN, False),
        (NOTHING, True),
        (ASK[:2], True),
        (ASK + END, False),  # a goal that nothing has become of
        ([("waiting", "", "", 0), ("end", "", "no plan", 0)], False),
        ([("waiting", "", "", 0), ("end", "", "the node is shutting down", 0)], True),
    ],
)
def test_what_a_replay_can_be_compared_with(tmp_path: Path, made: List[Made], empty: bool) -> None:
    recording = read_recording(maker(made).write(tmp_path / "a.bag"))
    assert Run.of(recording).is_empty == empty


@pytest.mark.costly
def test_a_bag_without_a_journal_has_no_gaps(bags: List[Path]) -> None:
    old = maker(RUN)
    old.messages.clear()
    goal = {"id": "x"}
    old.add("goal", 0.0, goal_id=goal, goal={"request": "visit(3)"})
    old.add("status", 0.2, status_list=[{"goal_id": goal, "status": 1}])
    old.add("out", 0.3, id="robot", action="go(2)").add("in", 0.4, id="robot", value="success")
    old.add("out", 0.5, id="robot", action="go(3)").add("in", 0.6, id="robot", value="success")
    old.add("result", 0.8, status={"goal_id": goal, "status": 3})
    file = old.write(bags[0].with_name("old.bag"))
    assert not cli.read("compare", file, None).has_journal
    for pair in ((file, file), (file, bags[0]), (bags[0], file)):
        assert compare(*pair) == 0, pair
    assert compare(bags[2], file) == compare(file, bags[2]) == 1


# What is printed.


def test_nothing_of_a_bag_commands_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hostile = maker([*RUN[:1], ("goal", "g", "\x1b[2J\x07visit", 0), *RUN[2:]], name="/\x1b[0m")
    files = [hostile.write(tmp_path / "a.bag"), maker(FAILS).write(tmp_path / "b.bag")]
    for pair in (files, files[::-1], [*files, "--name", "x"]):
        assert compare(*pair) > 0
        captured = capsys.readouterr()
        said = captured.out + captured.err
        assert "\\x1b[" in said
        assert all(letter.isprintable() or letter == "\n" for letter in said)


def test_a_terminal_that_has_no_such_letters(
    bags: List[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    exotic = maker([*RUN[:1], ("goal", "g", "visit(\u00e9\u732b)", 0), *RUN[2:]])
    file = exotic.write(bags[0].with_name("exotic.bag"))
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    done = run_without([], "compare", str(file), str(bags[2]))
    assert done.returncode == 1, done.stderr
    assert "visit(\\xe9\\u732b)" in done.stdout
