"""Each patch of clingo's Python module: what goes wrong without it."""

from __future__ import annotations

import subprocess
import sys
from typing import Any, List

import clingo
import pytest
from clingo.symbolic_atoms import SymbolicAtom

from rosclingo.solver.patches import atoms_after

# In a process of its own, which clingo would end.
HALF_A_CHARACTER = r"""
from clingo import ast
from rosclingo.solver.controls import ClingoMessages

messages = ClingoMessages()
try:
    ast.parse_string("a.\n\u00e4.", lambda _: None, logger=messages)
except RuntimeError:
    print(ascii(messages.text()))
"""


def test_a_message_with_half_a_character() -> None:
    code = [sys.executable, "-c", HALF_A_CHARACTER]
    assert r"\\xc3" in subprocess.run(code, capture_output=True, text=True, check=True).stdout


def test_each_atom_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    made: List[object] = []
    make: Any = SymbolicAtom.__init__

    def note(self: SymbolicAtom, *arguments: object) -> None:
        made.append(self)
        make(self, *arguments)

    monkeypatch.setattr(SymbolicAtom, "__init__", note)
    control = clingo.Control()
    control.add("part", ["k"], "p(1..100,k). q(1..100,k).")
    last = None
    for k in range(3):
        control.ground([("part", [clingo.Number(k)])])
        found = list(atoms_after(last, control.symbolic_atoms, "p", 2))
        last = found[-1]
        assert [str(one.symbol) for one in found] == [f"p({n},{k})" for n in range(1, 101)]
    assert len(made) == 300
