"""Old forms of Python, XML, encodings and bags, as docs/compatibility.md has them in tables."""

from __future__ import annotations

import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple
from xml.etree import ElementTree

import pytest
from conftest import PACKAGE
from readmes import ROOT, rows

from rosclingo.errors import ProgramError, XmlError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.terms import parse_term
from rosclingo.wire.xml_codec import decode_commands
from rosoclingo.bags.topics import LOOP_TYPES

PAGE = "docs/compatibility.md"
OLD = sorted((PACKAGE / "test" / "old").glob("*.py2"))


def code(cell: str) -> str:
    """Returns what a cell has between backticks."""
    return cell.strip("`")


@pytest.fixture(scope="module")
def convert() -> Callable[[str], str]:
    """Converts a program by 2to3; leaves the test out where there is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it says that it will be gone
        refactor = pytest.importorskip("lib2to3.refactor")
    tool = refactor.RefactoringTool(refactor.get_fixers_from_package("lib2to3.fixes"))
    return lambda text: str(tool.refactor_string(f"{text}\n", "old"))[:-1]


@pytest.mark.parametrize("old", OLD, ids=lambda path: path.stem)
def test_what_the_system_tests_run(convert: Callable[[str], str], old: Path) -> None:
    assert convert(old.read_text()) == old.with_suffix(".py3").read_text()


SECTION = rows(PAGE, "Clients and interfaces")
CHANGED = [(code(old), code(new)) for old, new in (row for row in SECTION if len(row) == 2)]
LEFT = [(code(old), code(new)) for old, new, _ in (row for row in SECTION if len(row) == 3)]


@pytest.mark.parametrize(("old", "new"), CHANGED)
def test_2to3_changes_it(convert: Callable[[str], str], old: str, new: str) -> None:
    compile(new, "new", "exec")
    assert convert(old) == new


# What the lines that 2to3 leaves set: the name, what it is in Python 2, and how they fail here.
SET: Dict[str, Tuple[Any, Any]] = {
    "middle": (3, AssertionError),
    "places": (["o1"], AttributeError),
    "names": (["a", ""], TypeError),
    "seen": ({1}, (TypeError, ValueError)),
    "import": ("Function", ImportError),
}


@pytest.mark.parametrize(("old", "new"), LEFT)
def test_by_hand(old: str, new: str, tmp_path: Path) -> None:
    """As it is, it fails or does something else; as the page says, it does what it did."""
    wanted, errors = SET[new.partition(" ")[0]]
    assert did(new, tmp_path) == wanted
    if sys.version_info >= (3, 9) or "getchildren" not in old:
        with pytest.raises(errors):
            assert did(old, tmp_path) == wanted


@pytest.mark.parametrize("old", [old for old, _ in LEFT])
def test_2to3_leaves_it(convert: Callable[[str], str], old: str) -> None:
    assert convert(old) == old


def did(program: str, folder: Path) -> Any:
    """Runs a line, and returns the value that it sets."""
    (folder / "seen").write_bytes(pickle.dumps({1}, protocol=2))
    space: Dict[str, Any] = {
        "size": 7,
        "root": ElementTree.fromstring("<map><o1/></map>"),
        "check_output": subprocess.check_output,
        "command": ["echo", "a"],
        "pickle": pickle,
        "path": folder / "seen",
    }
    exec(program, space)
    name, _, rest = program.partition(" ")
    if name == "import":
        return space[rest].Function.__name__
    return [place.tag for place in space[name]] if name == "places" else space[name]


def test_blanks_and_tabs_in_one_block() -> None:
    with pytest.raises(TabError):
        compile("if True:\n        a = 1\n\tb = 2\n", "old", "exec")


def test_the_manuals_programs_are_there() -> None:
    """But for one that the manual has in a package of another name, as the page says."""
    slips = []
    for command, now in rows(PAGE, "Commands"):
        for package, name in re.findall(r"`(ros\w+) ([\w.-]+\.(?:py|launch))", command):
            folder = ROOT / package / ("launch" if name.endswith(".launch") else "nodes")
            if now.startswith("a slip"):
                slips.append(folder / name)
            else:
                assert (folder / name).is_file(), command
    assert [slip.is_file() for slip in slips] == [False]


@pytest.mark.parametrize(("element", "outcome"), rows(PAGE, "Control requests"))
def test_control_requests(element: str, outcome: str) -> None:
    request = f"<commands>{code(element)}</commands>"
    refused, message = refusal(outcome)
    if not refused:
        assert len(decode_commands(request)) == 1
    else:
        with pytest.raises(XmlError, match=re.escape(message)):
            decode_commands(request)


@pytest.mark.parametrize(("statement", "outcome"), rows(PAGE, "Encodings"))
def test_statements(statement: str, outcome: str, tmp_path: Path) -> None:
    file = tmp_path / "old.lp"
    file.write_text(code(statement).replace(") import", ")\nimport"))
    refused, message = refusal(outcome)
    if not refused:
        Engine(Options((str(file),)))
    else:
        with pytest.raises(ProgramError, match=re.escape(message)):
            Engine(Options((str(file),)))


def refusal(outcome: str) -> Tuple[bool, str]:
    """Returns whether something is refused, and what has to be in the message."""
    word, _, message = outcome.partition(": ")
    assert re.split(r"\W", word)[0] in ("read", "refused"), outcome
    return word == "refused", message.partition(";")[0] if "known are" not in message else message


def test_a_request_with_arithmetic() -> None:
    assert str(parse_term("p( 1+2 )")) == "p(3)"


def effects(page: str, heading: str) -> Dict[str, str]:
    """Returns what a page says of playing each topic of the planning loop."""
    table: List[List[str]] = rows(page, heading)
    return {
        name: effect
        for names, effect, *_ in table
        if "of the solvers" not in names
        for name in re.findall(r"`~(\w+)`", names)
    }


def test_what_is_safe_to_play() -> None:
    """Each recorded topic is named, and both pages say the same."""
    all_topics = effects("docs/bags.md", "rosbag play")
    assert set(all_topics) == set(LOOP_TYPES)
    for topic, effect in effects(PAGE, "Bags").items():
        assert all_topics[topic].startswith(effect), topic
