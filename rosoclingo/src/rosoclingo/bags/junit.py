"""Writes a comparison for tools of continuous integration, as JUnit's XML. Needs no ROS."""

from __future__ import annotations

import re
from pathlib import Path
from typing import List, Tuple
from xml.etree import ElementTree

from rosoclingo.bags.comparison import Comparison
from rosoclingo.bags.errors import BagWriteError
from rosoclingo.bags.show import describe, describe_goal

_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML


def write_results(file: Path, bag: Path, comparison: Comparison, seconds: float) -> None:
    """Writes a test case for each goal, and one for the plan.

    Args:
        file: What is written.
        bag: The bag that was replayed.
        comparison: What came out.
        seconds: How long the replay took.

    Raises:
        BagWriteError: The file cannot be written.
    """
    cases: List[Tuple[str, str]] = []
    for number, pair in enumerate(comparison.goals, 1):
        said = "" if pair.same else "\n".join(describe_goal(pair))
        cases.append((f"goal {number} {pair.request}", said))
    cases.append(("plan", "" if comparison.same_plan else describe(comparison)))
    kind = ("failure", f"not as recorded, at level {comparison.level.value}")
    _write(file, bag, cases, kind, seconds)


def write_error(file: Path, bag: Path, reason: str) -> None:
    """Writes that a bag could not be replayed.

    Raises:
        BagWriteError: The file cannot be written.
    """
    _write(file, bag, [("plan", reason)], ("error", "the bag cannot be replayed"), 0.0)


def _write(
    file: Path, bag: Path, cases: List[Tuple[str, str]], found: Tuple[str, str], seconds: float
) -> None:
    kind, message = found
    bad = str(sum(bool(text) for _, text in cases))
    suite = ElementTree.Element(
        "testsuite", name=f"replay of {_clean(bag.name)}", tests=str(len(cases)),
        failures=bad if kind == "failure" else "0", errors=bad if kind == "error" else "0",
        time=f"{seconds:.3f}",
    )  # fmt: skip
    for name, text in cases:
        case = ElementTree.SubElement(
            suite, "testcase", classname=f"replay.{_clean(bag.stem)}", name=_clean(name),
            time=f"{seconds / len(cases):.3f}",
        )  # fmt: skip
        if text:
            ElementTree.SubElement(case, kind, message=message, type=kind).text = _clean(text)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        ElementTree.ElementTree(suite).write(file, encoding="utf-8", xml_declaration=True)
    except OSError as err:
        raise BagWriteError(
            f"{file}: {err.strerror}; give a name in a folder that can be written to"
        ) from err


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
