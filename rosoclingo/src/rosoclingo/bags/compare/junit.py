"""Writes a comparison for tools of continuous integration, as JUnit's XML. Needs no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import List, NamedTuple, Tuple
from xml.etree import ElementTree

from rosclingo.wire.characters import carried
from rosoclingo.bags.compare.comparison import Comparison
from rosoclingo.bags.compare.text_report import describe, describe_goal
from rosoclingo.errors import BagError


class Suite(NamedTuple):
    """The names of a test suite: ``replay of run.bag``, and of its test cases: ``replay.run``."""

    name: str
    group: str


def write_results(file: Path, suite: Suite, comparison: Comparison, seconds: float) -> None:
    """Writes a test case for each goal, and one for the plan.

    Args:
        file: What is written.
        suite: What the results are called.
        comparison: What came out.
        seconds: How long it took.

    Raises:
        BagError: The file cannot be written.
    """
    cases: List[Tuple[str, str]] = []
    for number, pair in enumerate(comparison.goals, 1):
        said = "" if pair.same else "\n".join(describe_goal(pair))
        cases.append((f"goal {number} {pair.request}", said))
    cases.append(("plan", "" if comparison.same_plan else describe(comparison)))
    kind = ("failure", f"not as recorded, at level {comparison.level.value}")
    _write(file, suite, cases, kind, seconds)


def write_error(file: Path, suite: Suite, reason: str) -> None:
    """Writes an error in the place of results.

    Raises:
        BagError: The file cannot be written.
    """
    _write(file, suite, [("plan", reason)], ("error", f"no {carried(suite.name)}"), 0.0)


def _write(
    file: Path, suite: Suite, cases: List[Tuple[str, str]], found: Tuple[str, str], seconds: float
) -> None:
    kind, message = found
    bad = str(sum(bool(text) for _, text in cases))
    root = ElementTree.Element(
        "testsuite", name=carried(suite.name), tests=str(len(cases)),
        failures=bad if kind == "failure" else "0", errors=bad if kind == "error" else "0",
        time=f"{seconds:.3f}",
    )  # fmt: skip
    for name, text in cases:
        case = ElementTree.SubElement(
            root, "testcase", classname=carried(suite.group), name=carried(name),
            time=f"{seconds / len(cases):.3f}",
        )  # fmt: skip
        if text:
            ElementTree.SubElement(case, kind, message=message, type=kind).text = carried(text)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)
    except OSError as err:
        raise BagError(
            f"{file}: {err.strerror}; give a name in a folder that can be written to"
        ) from err
