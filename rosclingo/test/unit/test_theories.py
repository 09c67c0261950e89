"""Difference constraints in the solver: what ``--theory dl`` adds, and that all else goes on."""

from __future__ import annotations

import itertools
import sys
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_engine import PIGEONS, UNSAT, add, sat

from rosclingo.errors import ForbiddenError, OptionsError, ProgramError, SolverError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.theories import make_theory
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    CleanupDomains,
    Externals,
    GetExternals,
    Ground,
    Improvement,
    Load,
    Outcome,
    Part,
    Restart,
    Result,
    Truth,
)

# Two jobs of a robot, in any order: each begins when the other has ended.
JOBS = """
{ first(a) }. #show first/1.
&diff { b-a } >= 3 :- first(a).
&diff { a-b } >= 2 :- not first(a).
&diff { a-0 } >= 0. &diff { b-0 } >= 0.
"""


@pytest.fixture
def engine() -> Engine:
    return Engine(Options(theory="dl"))


def values(engine: Engine, *assumptions: Assumption) -> List[str]:
    outcome = engine.solve(assumptions)
    assert (outcome.result, outcome.interrupted) == (Result.SAT, False)
    return sorted(outcome.symbols)


def test_values_are_in_the_answer_set(engine: Engine) -> None:
    add(engine, JOBS)
    assert values(engine, Assumption("first(a)", True)) == ["dl(a,0)", "dl(b,3)", "first(a)"]
    assert values(engine, Assumption("first(a)", False)) == ["dl(a,2)", "dl(b,0)"]


def test_what_is_shown_comes_first(engine: Engine) -> None:
    add(engine, "a. b. &diff { (x,f(1))-0 } >= 4. #show b/0.")
    assert engine.solve() == sat("b", "dl((x,f(1)),4)")


def test_a_negative_cycle(engine: Engine) -> None:
    add(engine, JOBS)
    add(engine, "#external late. &diff { b-a } <= 1 :- not late. :- not first(a).", "limit")
    assert engine.solve() == UNSAT
    engine.apply(AssignExternal("late", Truth.TRUE))
    assert values(engine) == ["dl(a,0)", "dl(b,3)", "first(a)"]


def test_without_the_theory_its_atoms_are_not_defined() -> None:
    engine = Engine(Options())
    with pytest.raises(ProgramError, match="no definition found for theory atom") as caught:
        add(engine, JOBS)
    assert str(caught.value).endswith("\nthe option --theory dl defines it")
    with pytest.raises(ProgramError, match="no definition found for theory atom") as caught:
        add(engine, "&sum { x } <= 3.")
    assert "--theory" not in str(caught.value)


def test_a_program_without_the_theorys_atoms(engine: Engine) -> None:
    add(engine, "{ a }. :- not a.")
    assert engine.solve() == sat("a")


def test_files_and_what_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "b.lp").write_text("#program more. &diff { y-x } >= 2.", encoding="utf-8")
    file = tmp_path / "a.lp"
    file.write_text("&diff { x-0 } >= 1.", encoding="utf-8")
    engine = Engine(Options((str(file),), theory="dl"))
    engine.apply(Load(str(tmp_path / "b.lp")))
    engine.apply(Ground((Part("base"),)))
    assert engine.solve() == sat("dl(x,1)")
    engine.apply(Ground((Part("more"),)))
    assert values(engine) == ["dl(x,1)", "dl(y,3)"]


def test_an_included_file(tmp_path: Path) -> None:
    (tmp_path / "b.lp").write_text("&diff { x-0 } >= 1.", encoding="utf-8")
    (tmp_path / "a.lp").write_text('#include "b.lp".', encoding="utf-8")
    engine = Engine(Options((str(tmp_path / "a.lp"),), theory="dl"))
    engine.apply(Ground((Part("base"),)))
    assert engine.solve() == sat("dl(x,1)")


# --- many searches ---------------------------------------------------------------------------


def test_steps(engine: Engine) -> None:
    engine.apply(Add("step", ("t",), "&diff { at(t)-at(t-1) } >= t. #external query(t). #show."))
    engine.apply(Add("query", ("t",), "&diff { at(t)-0 } <= 6 :- query(t)."))
    engine.apply(Add("base", (), "&diff { at(0)-0 } >= 1."))
    engine.apply(Ground((Part("base"),)))
    ends = {}
    for step in range(1, 5):
        parts = tuple(Part(name, (str(step),)) for name in ("step", "query"))
        engine.apply(Ground(parts))
        engine.apply(AssignExternal(f"query({step})", Truth.TRUE))
        ends[step] = engine.solve()
        engine.apply(AssignExternal(f"query({step})", Truth.FALSE))
    assert sorted(ends[2].symbols) == ["dl(at(0),1)", "dl(at(1),2)", "dl(at(2),4)"]
    assert ends[3].result is ends[4].result is Result.UNSAT
    assert "dl(at(4),11)" in values(engine)
    engine.apply(CleanupDomains())
    assert "dl(at(4),11)" in values(engine)
    externals = engine.apply(GetExternals())
    assert isinstance(externals, Externals)
    assert [name for name, _ in externals.values] == [f"query({step})" for step in range(1, 5)]


def test_the_core_of_assumptions(engine: Engine) -> None:
    add(engine, "{ a; b; c }. &diff { x-0 } >= 3 :- a. &diff { x-0 } <= 2 :- b.")
    assumed = [Assumption(name, True) for name in "abc"]
    assert engine.solve(assumed) == UNSAT
    assert {assumption.name for assumption in engine.core} == {"a", "b"}
    assert engine.solve(assumed[1:]).result is Result.SAT


def test_asking(engine: Engine) -> None:
    engine.apply(Add("base", (), "&diff { x(0)-0 } >= 0. #external ground(more(1))."))
    rules = "&diff { x(n)-x(n-1) } >= 2. #external ground(more(n+1)) : n < 3."
    engine.apply(Add("more", ("n",), rules))
    engine.apply(Ground((Part("base"),), asking=True))
    assert values(engine) == ["dl(x(0),0)", "dl(x(1),2)", "dl(x(2),4)", "dl(x(3),6)"]


def test_a_restart(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("&diff { x-0 } >= 1.", encoding="utf-8")
    engine = Engine(Options((str(file),), theory="dl"))
    for _ in range(3):
        engine.apply(Ground((Part("base"),)))
        add(engine, "&diff { y-x } >= 2.", "more")
        assert values(engine) == ["dl(x,1)", "dl(y,3)"]
        add(engine, "&diff { y-x } < 2.", "less")
        assert engine.solve() == UNSAT
        engine.apply(Restart())


def test_optimisation_is_of_what_is_chosen(engine: Engine) -> None:
    add(engine, "1 { takes(1..3) } 1. #minimize { N : takes(N) }. #show.")
    add(engine, "&diff { end-0 } >= N :- takes(N). &diff { end-0 } >= 2.", "more")
    found: List[Improvement] = []
    assert engine.solve((), None, found.append) == sat("dl(end,2)")
    assert (found[-1].cost, found[-1].symbols) == ((1,), ("dl(end,2)",))


def test_an_interrupted_search(engine: Engine, within: Callable[..., Any]) -> None:
    add(engine, f"#external hard. {PIGEONS.replace(' :- P=1..12', ' :- P=1..12, hard')} #show.")
    add(engine, "&diff { x(P,H)-0 } >= P :- at(P,H). &diff { y-0 } >= 4.", "more")
    engine.apply(AssignExternal("hard", Truth.TRUE))
    stop = threading.Event()
    threading.Timer(0.2, stop.set).start()
    outcome = within(10, lambda: engine.solve((), stop.is_set))
    assert outcome == Outcome(Result.UNKNOWN, True)
    engine.apply(AssignExternal("hard", Truth.FALSE))
    assert "dl(y,4)" in engine.solve().symbols


def test_threads() -> None:
    engine = Engine(Options((), ("-t", "2"), theory="dl"))
    add(engine, JOBS)
    for _ in range(20):
        assert values(engine, Assumption("first(a)", True)) == ["dl(a,0)", "dl(b,3)", "first(a)"]


LIMITS = st.dictionaries(
    st.tuples(st.integers(0, 3), st.integers(0, 3)), st.integers(-4, 4), max_size=8
)


@pytest.mark.costly
@given(LIMITS)
def test_values_satisfy_what_can_be_satisfied(limits: Dict[Tuple[int, int], int]) -> None:
    engine = Engine(Options(theory="dl"))
    add(engine, " ".join(f"&diff {{ x({i})-x({j}) }} <= {n}." for (i, j), n in limits.items()))
    paths = {(i, j): limits.get((i, j), 10**6) for i in range(4) for j in range(4)}
    for k, i, j in itertools.product(range(4), repeat=3):
        paths[i, j] = min(paths[i, j], paths[i, k] + paths[k, j])
    outcome = engine.solve()
    if any(paths[i, i] < 0 for i in range(4)):
        assert outcome == UNSAT
        return
    assert outcome.result is Result.SAT
    found = {int(text[5]): int(text[8:-1]) for text in outcome.symbols}
    # A variable that is only compared with itself has no value.
    assert all(found.get(i, 0) - found.get(j, 0) <= n for (i, j), n in limits.items())


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("&diff { x-y; u-v } <= 3.", r"<string>:2:1: the theory dl cannot read '&diff"),
        ("&diff { x-y, z } <= 3.", r"<string>:2:1: the theory dl cannot read '&diff"),
        ("&sum { x } <= 3.", "no definition found for theory atom"),
        ("&diff { x(X)-y } <= 3.", "unsafe"),
        ("#theory dl { }.", "redefinition of theory"),
    ],
)
def test_a_wrong_program_leaves_no_trace(engine: Engine, program: str, message: str) -> None:
    with pytest.raises(ProgramError, match=message):
        engine.apply(Add("base", (), f"a.\n{program}"))
    add(engine, "&diff { x-0 } >= 1.")
    assert engine.solve() == sat("dl(x,1)")


def test_a_wrong_file(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("&diff { x-y; u-v } <= 3.", encoding="utf-8")
    with pytest.raises(ProgramError, match=f"{file}:1:1: the theory dl cannot read"):
        Engine(Options((str(file),), theory="dl"))


def test_scripts_of_clients_are_refused(engine: Engine) -> None:
    with pytest.raises(ForbiddenError):
        engine.apply(Add("base", (), "#script (python) #end. &diff { x-0 } >= 1."))


@pytest.mark.parametrize("program", ["&diff { x+y } <= 1.", "&diff { x-y } <= z."])
def test_what_is_no_difference_is_found_when_it_is_solved(engine: Engine, program: str) -> None:
    add(engine, program)
    with pytest.raises(SolverError, match="only constraints of form &diff"):
        engine.solve()
    engine.apply(Restart())
    add(engine, "&diff { x-0 } >= 1.")
    assert engine.solve() == sat("dl(x,1)")


@pytest.mark.parametrize("name", ["lp", "DL", "clingodl", "../dl"])
def test_an_unknown_theory(name: str) -> None:
    with pytest.raises(OptionsError, match=f"option --theory does not know '{name}'; it knows dl"):
        Engine(Options(theory=name))


def test_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "clingodl", None)  # as if it were not installed
    with pytest.raises(OptionsError) as caught:
        Engine(Options(theory="dl"))
    for piece in (
        "--theory dl",
        "package clingo-dl",
        "python -m pip install 'clingo-dl>=1.5,<1.6'",
    ):
        assert piece in str(caught.value)
    assert make_theory("").name == ""
    Engine(Options())  # which does not need it
