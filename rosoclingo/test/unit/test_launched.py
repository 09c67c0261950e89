"""How nodes were started, decoded from their ``~about``."""

from __future__ import annotations

import json
from typing import Any, Dict

import pytest

from rosclingo.solver.about import about
from rosclingo.solver.programs import Program
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.unpack import options
from rosoclingo.errors import LaunchedError


def test_what_is_encoded_is_decoded() -> None:
    words = ["-f", "a", "-c", "n=2"]
    files = {"/x/a.lp": '#include "b.lp".', "/x/b.lp": "\u00e9."}
    includes = {"/x/a.lp": {"b.lp": "/x/b.lp"}}
    said = about(
        "rosclingo run.py", words, Program(texts=files, named=["/x/a.lp"], includes=includes)
    )
    node = Launched.decode("/planner", said)
    assert (node.node, node.program, node.arguments) == ("/planner", "rosclingo run.py", (*words,))
    assert node.files == files
    assert node.includes == {**includes, "/x/b.lp": {}}
    assert node.paths == {"a": "/x/a.lp"}
    assert node.directory
    assert set(node.versions) == {"clingo", "python"}
    assert (node.solvers, node.parameters, node.actuators, node.messages) == ({}, {}, None, ())
    recorded = json.loads(said)["files"]
    assert node.digests() == {path: file["sha256"] for path, file in recorded.items()}


def test_what_only_some_nodes_say() -> None:
    solvers, parameters = {"planner": "/planner"}, {"patience": 0.5}
    said = about("rosoclingo run.py", [], solvers=solvers, parameters=parameters)
    loop = Launched.decode("/rosoclingo", said)
    assert (loop.solvers, loop.parameters, loop.directory) == (solvers, parameters, "")
    said = about("rosoclingo_interfaces", [], actuators=[], messages=["door"])
    interface = Launched.decode("/robot", said)
    assert (interface.actuators, interface.messages) == ((), ("door",))


@pytest.mark.parametrize(
    ("entries", "why"),
    [
        ({"program": None}, "program is no text"),
        ({"arguments": "-f a.lp"}, "arguments is no list"),
        ({"arguments": ["-n", 1]}, "arguments: 1 is no text"),
        ({"files": []}, "files is no object"),
        ({"files": {"a.lp": "a."}}, "files: a.lp is no object"),
        ({"files": {"a.lp": {"text": True}}}, "a.lp is no text"),
        ({"solvers": {"planner": 1.5}}, "solvers: planner is no text"),
    ],
)
def test_a_wrong_entry_is_named(entries: Dict[str, Any], why: str) -> None:
    text = json.dumps({"program": "rosclingo run.py", **entries})
    with pytest.raises(LaunchedError) as caught:
        Launched.decode("/planner", text)
    assert str(caught.value) == f"/planner/about does not say how the node was started: {why}"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[1",
        "[" * 10**5,
    ],
)
def test_no_json(text: str) -> None:
    with pytest.raises(
        LaunchedError, match="/planner/about does not say how the node was started: "
    ):
        Launched.decode("/planner", text)


def test_an_option_without_its_value() -> None:
    node = Launched("/planner", "rosclingo run.py", ("-f",))
    with pytest.raises(LaunchedError, match="the command line of /planner is wrong: option -f"):
        options(node)
