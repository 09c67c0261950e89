"""Large neighbourhood search: what is kept of a plan, and that it finds the best one."""

from __future__ import annotations

import random
from typing import List, Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    Ground,
    Outcome,
    Part,
    Restart,
    Truth,
)
from rosoclingo.loop.planner.demand import Demand
from rosoclingo.loop.planner.local_search import Incumbent, LocalSearch, below
from rosoclingo.loop.planner.neighbourhoods import (
    Neighbourhood,
    Neighbourhoods,
    says_choices,
    shown_choices,
)

# A tour of 12 points on a circle, 1 to 12, that begins at point 0.
TOUR = """
point(1..12). cost(X,J,C) :- X = 0..12, point(J), X != J, C = #min { |X-J| ; 13-|X-J| }.
{ next(X,J) : cost(X,J,_) } = 1 :- point(J).
:- X = 0..12, 2 { next(X,J) }.
#edge (X,J) : next(X,J).
#minimize { C,X,J : next(X,J), cost(X,J,C) }.
#show keep(next(X,J),J,X) : next(X,J).
#show close(X,J) : cost(X,J,C), C < 3.
#show.
"""
GROUPS = [str(number) for number in range(1, 13)]


@pytest.fixture
def engine() -> Engine:
    engine = Engine(Options())
    assert engine.run([Add("base", (), TOUR), Ground((Part("base"),))]).failure is None
    return engine


def worst(engine: Engine) -> Incumbent:
    """Returns the tour that goes to and fro."""
    order = [0, 7, 1, 8, 2, 9, 3, 10, 4, 11, 5, 12, 6]
    kept = [Assumption(f"next({x},{j})", True) for x, j in zip(order, order[1:])]
    found: List[Tuple[int, ...]] = []
    outcome = engine.solve(kept, None, lambda one: found.append(one.cost))
    return Incumbent(found[-1], outcome.symbols)


def search(engine: Engine, hoods: Neighbourhoods) -> LocalSearch:
    def cost(_: Outcome, found: object) -> Tuple[int, ...]:
        return found[-1].cost if found else ()  # type: ignore[index]

    return LocalSearch(engine, hoods, cost)


@pytest.mark.costly
def test_a_plan_is_improved_and_proven_the_best(engine: Engine) -> None:
    begin = worst(engine)
    assert begin.cost > (60,)
    best = search(engine, Neighbourhoods()).descend(begin, lambda: False)
    assert (best.cost, best.is_best) == ((12,), True)
    assert says_choices(best.symbols)


def test_it_ends_when_it_is_called(engine: Engine) -> None:
    begin = worst(engine)
    assert search(engine, Neighbourhoods()).descend(begin, lambda: True) == begin


@pytest.mark.costly
def test_a_plan_that_says_nothing_is_searched_as_a_whole(engine: Engine) -> None:
    begin = Incumbent(worst(engine).cost, ())
    best = search(engine, Neighbourhoods()).descend(begin, lambda: False)
    assert (best.cost, best.is_best) == ((12,), True)


def test_longer_plans_are_tried_when_one_is_the_best(engine: Engine) -> None:
    rules = "#external more. { long }. :- long, not more. #minimize { 3 : not long ; 1 : long }."
    engine.run([Restart(), Add("base", (), rules), Ground((Part("base"),))])
    left = [True]

    def lengthen() -> bool:
        engine.run([AssignExternal("more", Truth.TRUE)])
        return bool(left) and left.pop()

    begin = Incumbent((3,), ())
    best = search(engine, Neighbourhoods()).descend(begin, lambda: False, lengthen=lengthen)
    assert (best.cost, best.is_best, left) == ((1,), True, [])


def test_what_is_free_is_not_assumed(engine: Engine) -> None:
    plan = Neighbourhood.of(worst(engine).symbols)
    assert plan is not None
    assert plan.groups == sorted(GROUPS)
    assert len(plan.assumptions(set())) == len(GROUPS)
    dice = random.Random(0)
    for size in (1, 5, 12, 20):
        free = plan.around("3", size, dice)
        assert "3" in free
        assert len(free) == min(size, 12)
        kept = {one.name for one in plan.assumptions(free)}
        assert len(kept) == 12 - len(free)
        assert not [name for name in kept for group in free if name.endswith(f",{group})")]


def test_groups_that_are_new_come_first(engine: Engine) -> None:
    plan = Neighbourhood.of(worst(engine).symbols)
    hoods = Neighbourhoods()
    assert plan is not None
    assert hoods.begin(plan) == []
    more = Neighbourhood([("a", "x", "y"), *((g, g, g) for g in GROUPS)], [])
    assert hoods.begin(more) == ["x"]
    hoods.grow()
    assert hoods.size > 8
    hoods.begin(more)
    assert hoods.size == 8


def test_only_critical_groups_are_worth_a_try() -> None:
    kept = [f"keep(next({n - 1},{n}),{n},{n - 1})" for n in range(1, 13)]
    plan = Neighbourhood.of([*kept, "critical(3)", "critical(7)", "critical(elsewhere)"])
    assert plan is not None
    assert plan.critical == ["3", "7"]
    hoods = Neighbourhoods()
    hoods.begin(plan)
    assert hoods.size == 4
    seeds = hoods.seeds(plan)
    assert set(seeds) == {"3", "7"}
    assert len(seeds) == len(plan.groups)
    plan = Neighbourhood.of(kept)
    assert plan is not None
    assert plan.critical == plan.groups


@pytest.mark.costly
def test_the_best_of_some_choices_is_not_proven_the_best_of_all(engine: Engine) -> None:
    program = "#program more. #show restricted : 0 = 0."
    assert engine.run([Add("more", (), program), Ground((Part("more"),))]).failure is None
    best = search(engine, Neighbourhoods()).descend(worst(engine), lambda: False)
    assert (best.cost, best.is_best) == ((12,), False)


def test_choices_that_are_atoms() -> None:
    symbols = ("choices(pick,2)", "close(2,1)", "pick(a,1)", "pick(b,2)", "pick(c)", "put(d,1)")
    plan = Neighbourhood.of(symbols)
    assert plan is not None
    assert plan.groups == ["1", "2"]
    assert [one.name for one in plan.assumptions({"1"})] == ["pick(b,2)"]
    demand = Demand()
    assert demand.asks(symbols)
    asked = [(part.name, part.parameters) for part in demand.asked_for(symbols)]
    assert asked == [("pick", ("a", "1")), ("pick", ("b", "2"))]
    assert not demand.asks(symbols)


@pytest.mark.parametrize(
    "symbols",
    [(), ("do(a,b,1)",), ("close(a,b)",), ("keep(a,b)",), ("choices(do,1)", "close(a,b)"),
     ("choices(do)", "do(a,b,1)"), ("choices(do,4)", "do(a,b,1)"), ("choices(do,x)", "do(a,b,1)")],
)  # fmt: skip
def test_no_choices(symbols: Tuple[str, ...]) -> None:
    assert Neighbourhood.of(symbols) is None
    assert not list(shown_choices(symbols))


@pytest.mark.parametrize(
    ("cost", "bound"),
    [((3,), (2,)), ((0, 4), (0, 3)), ((1, 0), (0, 2**31 - 1)), ((0,), (-1,)),
     ((2, 0, 0), (1, 2**31 - 1, 2**31 - 1))],
)  # fmt: skip
def test_what_is_below_a_cost(cost: Tuple[int, ...], bound: Tuple[int, ...]) -> None:
    assert below(cost) == bound
