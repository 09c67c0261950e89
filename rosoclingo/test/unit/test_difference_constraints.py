"""An encoding with difference constraints, as the planner of a loop (``--theory dl``)."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosclingo.errors import ProgramError
from rosclingo.solver.about import about
from rosclingo.solver.options import parse_options
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.alphabet import read_alphabet
from rosoclingo.encodings.graph import GraphError, read_graph
from rosoclingo.encodings.started_with import started_with
from rosoclingo.encodings.unpack import unpack
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.tools.check.command import run as run_check
from rosoclingo.tools.plan.command import run

LINE = f"{EXAMPLES}/line.lp"
# To go to cell X takes X seconds, and the robot has to be through in time. end(T), a variable: when
# step T ends.
SECONDS = """
#const limit=5.
#program state(t).
#program transition(t).
&diff { end(t)-end(t-1) } >= X :- do(robot,go(X),t).
&diff { end(t)-end(t-1) } >= 0.
&diff { end(t)-end(0) } <= limit.
"""


@pytest.fixture
def seconds(tmp_path: Path) -> str:
    """The path of an encoding for the line."""
    file = tmp_path / "seconds.lp"
    file.write_text(SECONDS)
    return str(file)


@pytest.mark.costly
@pytest.mark.parametrize(
    "mode", ["dynamic.incremental.recording", "dynamic.incremental.reset", SINGLE]
)
def test_a_limit(seconds: str, mode: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = [LINE, seconds, "--goal", "visit(3)", "--mode", mode, "--theory", "dl"]
    assert run([*words, "--simulate"]) == 0
    assert "goal 1, visit(3): succeeded" in capsys.readouterr().out
    assert run([*words, "-c", "limit=4", "-c", "steps=6"]) == 1
    said = capsys.readouterr().err
    assert "no plan within the horizon of 6 steps" in said
    assert "the encoding excludes it by '&diff { end(t)-end(0) } <= limit.' (seconds.lp:7)" in said


def test_the_loop_gets_the_values(seconds: str) -> None:
    options = parse_options(["-f", LINE, "-f", seconds, "--theory=dl"])
    planner = Planner(make_parts(SINGLE, options).planner)
    planner.begin()
    planner.query(0, None, ())
    planner.tell(["event(1,visit(2),0)"])
    planner.query(1, 0, [1])
    assert "dl(end(1),2)" in planner.search(0, 1, lambda: False).symbols


@pytest.mark.costly
def test_check(seconds: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = [LINE, seconds, "--theory", "dl", "-c", "limit=60", "--episodes", "1"]
    assert run_check(words) == 0, capsys.readouterr()


def test_the_events_of_an_encoding_that_is_told(tmp_path: Path) -> None:
    file = tmp_path / "ready.lp"
    file.write_text("&diff { ready-0 } >= 1.")
    options = parse_options(["-f", f"{EXAMPLES}/line_demand.lp", "-f", str(file), "--theory=dl"])
    assert "visit(1)" in read_alphabet(options).requests


def test_the_map_of_an_encoding(tmp_path: Path) -> None:
    file = tmp_path / "map.lp"
    file.write_text("connection(a,b). position((a;b),10,0). &diff { ready-0 } >= 1.")
    assert read_graph([str(file)], (), "dl").edges == (("a", "b"),)
    with pytest.raises(GraphError, match="no definition found"):
        read_graph([str(file)])


def test_without_the_option(seconds: str) -> None:
    with pytest.raises(ProgramError, match="the option --theory dl defines it"):
        run([LINE, seconds, "--goal", "visit(3)"])


def test_what_a_run_rests_on() -> None:
    said = about("rosclingo run.py", ["-f", "a.lp", "--theory=dl"])
    assert started_with({"planner": Launched.decode("/planner", said)}) == {
        "the options of planner": "--theory dl"
    }


def test_a_bag_keeps_the_option(tmp_path: Path) -> None:
    node = Launched("/planner", "rosclingo run.py", ("-fa.lp", "--theory=dl"), {"/x/a.lp": ""})
    words, _ = unpack(node, tmp_path)
    assert parse_options(words).theory == "dl"
