"""Doors for bags, for PDDL, and for what nodes say of themselves in JSON."""

from __future__ import annotations

import contextlib
import itertools
import json
from pathlib import Path
from typing import Any, List

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from fuzzing import Door
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.record.writer import COMPRESSIONS
from rosoclingo.encodings.about import Launched
from rosoclingo.errors import BagError, LaunchedError
from rosoclingo.tools.pddl.actuators import Actuators
from rosoclingo.tools.pddl.conditions import compile_conditions
from rosoclingo.tools.pddl.declarations import check_declarations
from rosoclingo.tools.pddl.expressions import PddlError, parse
from rosoclingo.tools.pddl.names import Identifiers
from rosoclingo.tools.pddl.numbers import Numbers
from store_doors import FolderDoor

_ROOT = Path(__file__).resolve().parents[1]
_BETWEEN = b"\n;;;;\n"


class BagDoor(FolderDoor):
    """Bags of a run, uncompressed and compressed, as the recorder writes them."""

    name = "bags"
    words = (
        b"\xff\xff\xff\xff", b"\x00\x00\x00\x80", b"\0\0\0\0", b"op=\x05", b"op=\x07", b"op=\x02",
        b"compression=bz2", b"compression=lz4", b"compression=none", b"md5sum=*", b"type=a/b",
        b"topic=/rosoclingo/journal", b"conn=\0\0\0\0", b"conn_count=\xff\xff\xff\xff",
        b"size=\0\0\0\0",
        b"index_pos=\0\0\0\0\0\0\0\0", b"encryptor=a", b"message_definition=", b"latching=1",
        b"\x04\0\0\0op=\x03", b"#ROSBAG V1.2\n", b"time=\xff\xff\xff\xff\xff\xff\xff\xff",
        b"string id\n",
    )  # fmt: skip
    errors = (BagError,)
    inputs = 200

    def __init__(self) -> None:
        self._samples: List[bytes] = []

    def __enter__(self) -> Door:
        super().__enter__()
        from bag_maker import run  # which makes all types, and takes a while

        file = self.folder / "sample.bag"
        for compression in COMPRESSIONS:
            run().write(file, compression)
            self._samples.append(file.read_bytes())
            file.unlink()
        return self

    def valid(self) -> SearchStrategy[bytes]:
        """Returns one of the bags."""
        return st.sampled_from(self._samples)

    def read(self, data: bytes) -> None:
        """Reads the bag, and the run in it."""
        file = self.folder / "input.bag"
        file.write_bytes(data)
        recording = read_recording(file, with_feedback=True)
        Run.of(recording)


_DECLARED = b"""
  (idle ?r - robot))"""
_RULES = b"""
  (:derived (tired ?r - robot)
    (or (< (battery ?r) 2)
      (exists (?o - robot) (and (tired ?o) (not (= ?o ?r))))))
  (:derived (idle ?r - robot)
    (forall (?b - (either box robot))
      (imply (carries ?r ?b) (not (tired ?r)))))
"""


class PddlDoor(Door):
    """A domain and a problem in PDDL, up to where Fast Downward translates them."""

    name = "pddl"
    words = (
        b"(define", b"(domain a)", b"(problem a)", b":predicates", b":init", b":goal", b":action",
        b":parameters", b":precondition", b":effect", b":durative-action", b":duration", b":types",
        b"either", b"- object", b"- number", b"(and", b"(or", b"(not", b"(forall (?x)",
        b"(exists (?x)", b"(:derived (p ?x)", b"(imply",
        b"(when", b"(= a b)", b"(increase (f) 1)", b"?x", b"?", b"-", b";", b"|", b"_",
        b"(at 5 (p))",
        b"(:metric minimize (total-cost))", b"(assign", b"(over all", b"(at start", b"1.5", b"1e9",
        b"1e999", b"nan", b"-inf", b"9" * 400, b"(* 1e300 1e300)", b"(= (fuel) 1e999)",
        b":constraints", b"(:derived", b"(preference", b"#t", b"object", b"'", b"A" * 300, b"()",
    )  # fmt: skip
    errors = (PddlError,)
    inputs = 800

    def __init__(self) -> None:
        folder = _ROOT / "rosoclingo" / "example" / "pddl"
        both = (folder / name for name in ("delivery.pddl", "delivery_problem.pddl"))
        domain, problem = (file.read_bytes() for file in both)
        domain = domain.replace(b"(door_free))", b"(door_free) (tired ?r - robot)" + _DECLARED, 1)
        first = domain.index(b"  (:durative-action")
        self._task = _BETWEEN.join((domain[:first] + _RULES + domain[first:], problem))

    def valid(self) -> SearchStrategy[bytes]:
        """Returns the task of the example, of which some sections are left out."""
        lines = self._task.splitlines(keepends=True)
        return st.lists(st.integers(0, len(lines) - 1), max_size=2).map(
            lambda gone: b"".join(line for at, line in enumerate(lines) if at not in gone)
        )

    def read(self, data: bytes) -> None:
        """Reads both, as far as no other program is needed."""
        texts = data.decode("utf-8", "replace").split(_BETWEEN.decode(), 1)
        forms = parse(texts[0], "domain.pddl"), parse((*texts, "")[1], "problem.pddl")
        domain, problem = compile_conditions(*forms)
        check_declarations(domain, problem)
        names = Identifiers.of(domain.form, problem.form)
        Actuators(domain, problem, names, ["robot"] if len(data) % 2 else [], "robot")
        numbers = Numbers(domain, problem, {})
        few = itertools.permutations([*problem.objects][:4], 3)
        for objects, action in itertools.product(few, domain.actions):
            with contextlib.suppress(PddlError):  # as that a number has no value for these objects
                numbers.read([(action.name, objects)])

    def check(self, err: Exception) -> None:
        """Checks that file and line are named."""
        text = str(err)
        assert "domain.pddl" in text or "problem.pddl" in text or "--" in text, text


class AboutDoor(Door):
    """The texts by which nodes say how they were started, on the topic ``~about`` or in a bag."""

    name = "about"
    words = (b"null", b"[]", b"{}", b'""', b"1e999", b"NaN", b'"\\ud800"', b'"files": ', b"true")
    errors = (LaunchedError,)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns descriptions of nodes."""
        texts = st.sampled_from(["", "a.", '#include "b.lp".', "é"])
        names = st.sampled_from(["/a.lp", "b.lp", "x"])
        files = st.dictionaries(
            names,
            st.fixed_dictionaries(
                {"text": texts, "sha256": texts},
                optional={"includes": st.dictionaries(names, names)},
            ),
            max_size=2,
        )
        said: SearchStrategy[Any] = st.fixed_dictionaries(
            {"program": st.just("rosclingo run.py"), "arguments": st.lists(texts, max_size=2)},
            optional={
                "files": files, "versions": st.just({"clingo": "5.7"}), "directory": texts,
                "solvers": st.just({"planner": "/planner"}),
                "parameters": st.just({"patience": 1.0}),
                "paths": st.dictionaries(names, names), "actuators": st.lists(names, max_size=2),
            },
        )  # fmt: skip
        return said.map(lambda value: json.dumps(value).encode())

    def read(self, data: bytes) -> None:
        """Decodes it, and uses it."""
        found = Launched.decode("/planner", data.decode("utf-8", "surrogateescape"))
        found.digests()

    def check(self, err: Exception) -> None:
        """Checks that the node is named."""
        assert "/planner/about" in str(err), str(err)


def doors() -> List[Door]:
    """Returns the doors."""
    return [BagDoor(), PddlDoor(), AboutDoor()]
