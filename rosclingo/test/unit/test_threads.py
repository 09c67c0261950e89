"""Solvers with several threads: what is asked for, and that they do what one thread does."""

from __future__ import annotations

import os
import threading
from typing import List

import pytest

from rosclingo.errors import OptionsError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.threads import AUTO, read_threads, spare_cores, with_threads
from rosclingo.wire.commands import (
    Add,
    Assumption,
    GetStats,
    Ground,
    Improvement,
    Part,
    Restart,
    Result,
    Stats,
)

PIGEONS = "1 { in(P,H) : H = 1..13 } 1 :- P = 1..14. :- in(P,H), in(Q,H), P < Q."


def engine(text: str, theory: str = "") -> Engine:
    made = Engine(Options(theory=theory))
    made.use_threads(2)
    reply = made.run([Add("base", (), text), Ground((Part("base"),))])
    assert reply.failure is None, reply.failure
    return made


def concurrency(solver: Engine) -> float:
    (stats,) = solver.run([GetStats()]).answers
    assert isinstance(stats, Stats)
    return float(stats.values["summary"]["concurrency"])


@pytest.mark.parametrize(("value", "threads"), [(1, 1), ("4", 4), (64, 64)])
def test_a_number_of_threads(value: object, threads: int) -> None:
    assert read_threads(value) == threads


@pytest.mark.parametrize("value", [0, -1, 65, "two", "", 1.5, True, "²", "9" * 5000])
def test_no_number_of_threads(value: object) -> None:
    with pytest.raises(ValueError, match="from 1 to 64, or auto"):
        read_threads(value)


@pytest.mark.parametrize(("cores", "threads"), [(1, 1), (2, 1), (3, 1), (4, 2), (8, 6), (64, 8)])
def test_spare_cores(monkeypatch: pytest.MonkeyPatch, cores: int, threads: int) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {*range(cores)})
    assert spare_cores() == read_threads(AUTO) == threads


def test_one_thread_changes_nothing() -> None:
    options = Options(clingo=("-t", "2"))
    assert with_threads(options, 1) is options


@pytest.mark.parametrize("option", [("-t", "2"), ("-t2",), ("--parallel-mode=3",)])
def test_two_numbers_of_threads_are_refused(option: List[str]) -> None:
    with pytest.raises(OptionsError, match=f"2 threads .* by option {option[0]} .*; leave out one"):
        Engine(Options(clingo=tuple(option))).use_threads(2)


def test_threads_stay_after_a_restart() -> None:
    solver = engine("{ a }.")
    assert solver.solve().result is Result.SAT
    assert concurrency(solver) == 2
    solver.run([Restart(), Ground((Part("base"),))])
    solver.solve()
    assert concurrency(solver) == 2


def test_a_search_with_threads_is_ended_and_another_one_begun() -> None:
    solver = engine(PIGEONS)
    for _ in range(2):
        stop = threading.Event()
        timer = threading.Timer(0.2, stop.set)
        timer.start()
        outcome = solver.solve((), stop.is_set)
        assert (outcome.result, outcome.interrupted) == (Result.UNKNOWN, True)
        timer.join()
    assert solver.solve([Assumption("in(1,1)", False)], lambda: True).interrupted


def test_the_optimum_is_that_of_one_thread() -> None:
    text = (
        "1 { at(X,Y) : Y = 1..8 } 1 :- X = 1..8. :- at(X,Y), at(Z,Y), X < Z. "
        "#minimize { |X-Y|*((X*Y)\\7),X,Y : at(X,Y) }. #show at/2."
    )
    found: List[Improvement] = []
    solver = engine(text)
    outcome = solver.solve((), None, found.append)
    costs = [one.cost for one in found]
    assert costs == sorted(costs, reverse=True)
    alone: List[Improvement] = []
    single = Engine(Options())
    single.run([Add("base", (), text), Ground((Part("base"),))])
    single.solve((), None, alone.append)
    assert found[-1].cost == alone[-1].cost
    assert outcome.symbols == found[-1].symbols
    assert len(outcome.symbols) == 8


def test_assumptions_have_a_core() -> None:
    solver = engine("{ a; b; c }. :- a, b.")
    given = [Assumption("a", True), Assumption("b", True), Assumption("c", True)]
    assert solver.solve(given).result is Result.UNSAT
    assert {one.name for one in solver.core} == {"a", "b"}
    assert solver.solve(given[1:]).result is Result.SAT


def test_difference_constraints() -> None:
    pytest.importorskip("clingodl")
    solver = engine(
        "{ first(a) }. #show first/1. &diff { b-a } >= 3 :- first(a). "
        "&diff { a-b } >= 2 :- not first(a).",
        theory="dl",
    )
    for value, expected in ((True, {"dl(a,0)", "dl(b,3)"}), (False, {"dl(a,2)", "dl(b,0)"})):
        outcome = solver.solve([Assumption("first(a)", value)])
        assert outcome.result is Result.SAT
        assert {one for one in outcome.symbols if one.startswith("dl")} == expected
