"""No short program of a client has clingo ground for minutes, and no real one is refused."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Callable

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, Ground, Load, Part

THEORY = "#theory t { e {}; &d/0: e, any }. "
LITERALS, COMPARISONS, AGGREGATES = (
    "more than 500 literals", "more than 100 comparisons", "more than 30 conditional literals",
)  # fmt: skip
TOO_LARGE = [
    (f"a. b :- {','.join(['a'] * 100_000)}.", LITERALS),
    (f"b :- {';'.join(['not a'] * 501)}.", LITERALS),
    (f":- {','.join(f'a({n})' for n in range(501))}.", LITERALS),
    (f"#show a : {','.join(['a'] * 501)}.", LITERALS),
    (f":~ {','.join(['a'] * 501)}. [1]", LITERALS),
    (f"#minimize {{ 1 : {','.join(['a'] * 501)} }}.", LITERALS),
    (f"#external a : {','.join(['a'] * 501)}.", LITERALS),
    (f"#heuristic a : {','.join(['a'] * 501)}. [1,true]", LITERALS),
    (f"{{ a : {','.join(['b'] * 501)} }}.", LITERALS),
    (f"a : {','.join(['b'] * 501)}.", LITERALS),
    (f"a :- b : {','.join(['b'] * 501)}.", LITERALS),
    (f"a :- #count {{ 1 : {','.join(['b'] * 501)} }} > 0.", LITERALS),
    (f"#count {{ 1 : a : {','.join(['b'] * 501)} }}.", LITERALS),
    (f"{THEORY} &d {{ a : {','.join(['b'] * 501)} }}.", LITERALS),
    (f"a :- X0=1, {','.join(f'X{n + 1}=X{n}+1' for n in range(101))}.", COMPARISONS),
    (f"a :- {'<'.join(map(str, range(102)))}.", COMPARISONS),
    (f"a :- {';'.join(['a : b'] * 31)}.", AGGREGATES),
    (f"a :- {','.join(['1 { b }'] * 31)}.", AGGREGATES),
    (f"a :- {','.join(f'X{n} = #count {{ 1 }}' for n in range(31))}.", AGGREGATES),
    (f"{THEORY} a :- {','.join(['&d {}'] * 31)}.", AGGREGATES),
    (f"a :- b : c({';'.join(map(str, range(31)))}).", AGGREGATES),
    (f"a :- {','.join(['b(1;2)'] * 15)}.", "more than 20000 combinations of pools"),
    (f"a({','.join(['(1;2)'] * 40)}).", "more than 20000 combinations of pools"),
    ("a((0;1;2;3;4;5;6;7;8;9),(0;1;2;3;4;5;6;7;8;9))." * 201, "more than 20000 combinations"),
    (f"b :- #count {{ X,{','.join(['(1;2)'] * 15)} : a(X) }} > 0.", "more than 20000 combinations"),
]
REAL = [
    f":- {','.join(['a'] * 500)}.",
    f":- {';'.join(['a : b'] * 30)}.",
    f"{{ {';'.join(f'a({n}) : b({n};{n + 1})' for n in range(1_000))} }}.",
    f"#minimize {{ {';'.join(f'{n},a : a' for n in range(1_000))} }}.",
    f"a({';'.join(map(str, range(10_000)))}).",
    f"a({','.join(['1'] * 1_000)}).",
    f"a({','.join(['(1;2)'] * 10)}).",
    "a(1;2). " * 5_000,
    f":- {','.join(f'a(X{n})' for n in range(14))}"
    f"{''.join(f', X{m} != X{n}' for n in range(14) for m in range(n))}.",
    'a("(1;2);(3;4)"). ' * 3_000,
    f"a :- not 1 {{ {';'.join(map('b({})'.format, range(1_000)))} }}.",
]


@pytest.mark.costly
@pytest.mark.parametrize(("text", "reason"), TOO_LARGE)
def test_a_statement_that_is_too_large(text: str, reason: str) -> None:
    engine = Engine(Options())
    failure = engine.run([Add("base", (), "\n" + text)]).failure
    assert failure is not None
    assert reason in failure.message
    assert "<string>:2:" in failure.message
    assert "a predicate of their own" in failure.message
    assert engine.run([Add("base", (), "fine."), Ground((Part("base"),))]).failure is None


@pytest.mark.costly
@pytest.mark.parametrize("text", REAL)
def test_what_a_real_program_may_have(text: str) -> None:
    assert Engine(Options()).run([Add("base", (), text)]).failure is None


def test_who_is_trusted(tmp_path: Path) -> None:
    """A file of the command line may have anything; one that a client loads may not."""
    file = tmp_path / "a.lp"
    file.write_text(f"a. b :- {','.join(['a'] * 600)}.")
    engine = Engine(Options((str(file),)))
    assert engine.run([Ground((Part("base"),))]).failure is None
    failure = engine.run([Load(str(file))]).failure
    assert failure is not None
    assert f"{file}:1:" in failure.message
    assert LITERALS in failure.message


@pytest.mark.parametrize(
    "nested",
    [lambda n: "(1;" * n + "1" + ")" * n, lambda n: "f(" * n + "1;2" + ")" * n],
)
def test_deep_pools(nested: Callable[[int], str]) -> None:
    """They are counted without a call for each level."""
    text = f"a({nested(sys.getrecursionlimit() + 100)}, (1;2))."
    assert Engine(Options()).run([Add("base", (), text)]).failure is None
