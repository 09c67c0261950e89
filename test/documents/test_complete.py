"""No command that the documents print is forgotten.

A test takes one section: it has to type all that stands there, literally and in this order, but for
what ``NOT_TYPED`` names, and each command has to do what the text says. Needs a sourced workspace.
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path

from page import NOT_TYPED, is_left_out
from readmes import DOCUMENTS, ROOT, sections


def test_nothing_is_forgotten() -> None:
    """Each printed command is typed, each output compared, and no test names another one."""
    files = sorted(Path(__file__).parent.glob("test_*.py"))
    modules = [importlib.import_module(file.stem) for file in files]
    tests = [one for module in modules for name, one in vars(module).items() if name[:5] == "test_"]
    marks = [mark for test in tests for mark in getattr(test, "pytestmark", [])]
    tested = {mark.args for mark in marks if mark.name == "readme"}
    printed = [(name, *part) for name in DOCUMENTS for part in sections(name)]
    pieces = [piece for _, _, found in printed for piece in found]
    for readme, heading, found in printed:
        typed = [piece for piece in found if not is_left_out(piece)]
        assert not typed or (readme, heading) in tested, f"{readme}, {heading}: {typed}"
    sources = [file.read_text() for file in (*files, *ROOT.glob("*/test/system/*.py"))]
    compares = re.compile(r'check_output\(\s*"([^"]+)",\s*"([^"]+)",')
    assert {found for source in sources for found in compares.findall(source)} == {
        (readme, heading)
        for readme, heading, found in printed
        if any(piece.kind == "output" for piece in found)
    }
    for entry, reason in NOT_TYPED.items():
        assert any(piece.text.startswith(entry) for piece in pieces), f"{entry} ({reason})"
