"""Divisions in programs of clients give what clingo's own give, and end no process."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, List

import clingo
import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, Ground, Part

PROGRAMS = [
    "a(X,Y,X/Y,X\\Y) :- X = -9..9, Y = -4..4.",
    "n(1..9). a(X) :- n(X), n(X/2). b(X/2) :- n(X). c(X\\3+X/(X-1)*2) :- n(X).",
    "a(S) :- S = #sum { X/2,X : X = 1..9 }. b(N) :- N = #count { X\\3 : X = 1..9 }.",
    "#const m=7/2. a(m). b(9/2/2). c((9\\5)/2).",
    "a(1/0). b(X) :- X = 1\\0. c. d(x/2) :- c.",
    "{ a(X/2) : X = 2..5 } = 1. #minimize { X\\3,X : a(X) }. :- a(X), X/2 = 0.",
    '#external e(X/2) : X = 4..5. f(X) :- X = "a/b". #show f/1. #show (X/3) : X = 7..8.',
]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda text: text[:30])
def test_as_clingo_does(program: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    file = tmp_path_factory.mktemp("trusted") / "program.lp"
    file.write_text(program)
    expected: List[str] = []
    control = clingo.Control(logger=lambda code, message: None)
    control.add("base", [], program)
    control.ground([("base", [])])
    control.solve(on_model=lambda model: expected.extend(map(str, model.symbols(shown=True))))
    trusted = Engine(Options(files=(str(file),)))
    client = Engine(Options())
    client.apply(Add("base", (), program))
    for engine in (trusted, client):
        engine.apply(Ground((Part("base"),)))
        assert sorted(engine.solve().symbols) == sorted(expected)


def test_without_a_result() -> None:
    engine = Engine(Options())
    engine.apply(
        Add("p", (), "m(-2147483647-1). a(X/Y) :- m(X), Y = -1. b(X\\Y) :- m(X), Y = -1. c.")
    )
    engine.apply(Ground((Part("p"),)))
    assert sorted(engine.solve().symbols) == ["b(0)", "c", "m(-2147483648)"]


def test_a_client_gives_a_trusted_file_what_it_cannot_divide(
    tmp_path: Path, run_python: Callable[[str], str]
) -> None:
    file = tmp_path / "trusted.lp"
    file.write_text("r(X/Y,X\\Y) :- q(X,Y).")
    code = (
        "from rosclingo.wire.commands import Add, Ground, Part\n"
        "from rosclingo.solver.engine import Engine\n"
        "from rosclingo.solver.options import Options\n"
        f"engine = Engine(Options(files=({str(file)!r},)))\n"
        "engine.apply(Add('p', (), 'q(-2147483647-1,-1). q(7,-2).'))\n"
        "engine.apply(Ground((Part('p'), Part('base'))))\n"
        "print([symbol for symbol in engine.solve().symbols if symbol.startswith('r')])"
    )
    assert run_python(code) == "['r(-3,1)']"


@pytest.mark.parametrize("operands", ["", "1", "1,2,3", "a,2", "1,0"])
def test_a_client_calls_the_functions_with_anything(operands: str) -> None:
    engine = Engine(Options())
    program = f"a(@_rosclingo_divide({operands})). b(@_rosclingo_modulo({operands})). c."
    engine.apply(Add("p", (), program))
    engine.apply(Ground((Part("p"),)))
    assert engine.solve().symbols == ("c",)
