"""What a console knows of an encoding, and what it draws on its map."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Dict

import pytest

from rosclingo.errors import RosclingoError
from rosclingo.solver.about import about
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.graph import Graph
from rosoclingo.encodings.known import EncodingError, read_encoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Status
from rosoclingo_console.model.map import MapTable

ENCODINGS = Path(__file__).resolve().parents[3] / "rosoclingo_aspprograms" / "mailbot"
LINE = Path(__file__).resolve().parents[3] / "rosoclingo" / "example" / "line.lp"
GRAPH = Graph(
    {"a": (0.0, 0.0), "b": (4.0, 0.0), "c": (4.0, 3.0)}, (("a", "b"), ("b", "c")), {"robot": "a"}
)


def launched(*files: Path) -> Launched:
    """How a planner says that it was started."""
    arguments = [word for file in files for word in ("-f", str(file))]
    engine = Engine(parse_options(arguments))
    said = about("rosclingo run.py", arguments, engine.program)
    return Launched.decode("/planner", said)


@pytest.mark.costly
def test_an_encoding_with_a_map() -> None:
    files = (ENCODINGS / "instances" / "graph_wg.lp", ENCODINGS / "mailbot.lp")
    known = read_encoding(launched(*files))
    assert "bring(o9,o14)" in known.requests
    assert known.graph is not None
    assert len(known.graph.places) == len({end for edge in known.graph.edges for end in edge})
    assert set(known.graph.starts.values()) <= set(known.graph.places)


def test_an_encoding_without_a_map() -> None:
    known = read_encoding(launched(LINE))
    assert known.requests == tuple(f"visit({cell})" for cell in range(1, 7))
    assert known.graph is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#script (python)\nimport os; os._exit(7)\n#end.", "has scripts, which do not run here"),
        ("a :- b(X.", "is not understood"),
        ("a(X) :- not b(X).", "is not understood"),
    ],
)
def test_an_encoding_that_is_not_read(text: str, said: str) -> None:
    with pytest.raises(EncodingError, match=said):
        read_encoding(replace(launched(LINE), files={str(LINE): text}))


def test_nothing_is_written_outside_of_a_folder(tmp_path: Path) -> None:
    outside = tmp_path / "outside.lp"
    strange = Launched(
        "/planner", "rosclingo run.py", ("-f", "x"), {f"../../../../../..{outside}": "a."}
    )
    with pytest.raises(RosclingoError):
        read_encoding(strange)
    assert not outside.exists()


def shapes(table: MapTable, group: str) -> Any:
    rows: Dict[str, Any] = dict(table.rows())
    return rows.get(group, {"shapes": []})["shapes"]


def test_what_happens_on_a_map() -> None:
    """Also what has happened before the map is known."""
    table = MapTable()
    table.hear(journal.GoalArrived("g", "bring(b,c)"))
    table.hear(journal.ActionPublished("robot", "go(b)"))
    table.set_plan(["do(robot,go(c),2)", "expected(1,5)"])
    assert table.rows() == {}
    table.set_graph(GRAPH)
    table.hear(journal.MessageArrived("robot", "success"))
    (robot,) = shapes(table, "robots")
    assert (robot["robot"], robot["points"]) == ("robot", [[4.0, 0.0]])
    assert [one["kind"] for one in shapes(table, "plan")] == ["arrow"]
    table.hear(journal.ActionPublished("robot", "pickup(1)"))
    table.hear(journal.MessageArrived("robot", "success"))
    assert {one["kind"] for one in shapes(table, "carried packages")} == {"box", "text"}
    table.hear(journal.MessageArrived("info", "blocked(b,c)"))
    (blocked,) = shapes(table, "blocked ways")
    assert blocked["points"] == [[4.0, 0.0], [4.0, 3.0]]
    table.hear(journal.MessageArrived("info", "unblocked(b,c)"))
    assert shapes(table, "blocked ways") == []
    table.hear(journal.MessageArrived("info", "at(robot,a)"))
    assert shapes(table, "robots")[0]["points"] == [[0.0, 0.0]]
    table.hear(journal.MessageArrived("info", "at(robot,b)"))
    table.hear(journal.StatusSet("g", Status.SUCCEEDED))
    assert shapes(table, "packages")[0]["points"][0][1] == 3.0
    for strange in ("blocked(", "blocked(x)", "(", "", "blocked(b,c)x"):
        table.hear(journal.MessageArrived("info", strange))
        table.hear(journal.MessageArrived("robot", strange))
        table.hear(journal.GoalArrived(strange, f"bring({strange}"))
        table.hear(journal.ActionPublished("robot", strange))
    before = dict(table.rows())
    table.hear(journal.MessageArrived("stranger", "success"))
    assert dict(table.rows()) == before
    table.forget_run()
    assert table.rows() == {}


def test_a_system_without_a_map_keeps_little() -> None:
    table = MapTable()
    for number in range(5000):
        table.hear(journal.MessageArrived("robot", f"a({number})"))
    assert len(table._kept) == 2000
