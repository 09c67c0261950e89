"""The library's shortest ways, on random graphs, against a search without a solver."""

from __future__ import annotations

import random
from collections import deque
from pathlib import Path
from typing import Dict, List, Sequence, Set, Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.solver import Planner

LIBRARY = Path(__file__).resolve().parents[2] / "lib"
ENCODING = f"""
#include "{LIBRARY / "distances.lp"}".
#program base. {{ways}}
#program event(s,c). #external event(s,c).
#program query(t). #external query(t).
#program present(k,t).
need(A,B,k) :- told(need,pair(A,B),t).
closed(A,B,k) :- told(close,pair(A,B),t).
#program legs(k).
travels(A,B,k) :- need(A,B,k), distance(A,B,N,k).
#show distance(A,B,N) : need(A,B,k), distance(A,B,N,k), not newer(k).
#external ground(follow(k)).
#program follow(k).
#show route(A,B,W,N) : route(A,B,W,N,k), not newer(k).
"""

Pair = Tuple[int, int]


def distance(ways: Set[Pair], begin: int, end: int) -> int:
    """Returns how many steps it takes; -1 says that there is no way."""
    steps, rest = {begin: 0}, deque([begin])
    while rest:
        place = rest.popleft()
        for origin, destination in ways:
            if origin == place and destination not in steps:
                steps[destination] = steps[place] + 1
                rest.append(destination)
    return steps.get(end, -1)


def numbers(symbols: Sequence[str], name: str) -> List[List[int]]:
    terms = [split_term(symbol) for symbol in symbols]
    return [[int(argument) for argument in rest] for found, rest in terms if found == name]


def told(name: str, pairs: Sequence[Pair], step: int) -> List[str]:
    return [f"event({name},pair({a},{b}),{step})" for a, b in pairs]


@pytest.mark.parametrize("one_way", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_ways_are_the_shortest_ones(seed: int, one_way: bool, tmp_path: Path) -> None:
    """Places have dead ends next to them, and nothing leads to some; ways close and open again."""
    dice = random.Random(f"{seed} {one_way}")
    places = range(dice.randint(2, 9))
    pairs = {(a, b) for a in places for b in places if a < b and dice.random() < 0.4}
    pairs |= {(place, 10 + place) for place in places if dice.random() < 0.5} | {(20, 21)}
    ways = pairs | {(b, a) for a, b in pairs}
    if one_way:
        ways -= set(dice.sample(sorted(ways), len(ways) // 6))
    known = sorted({place for way in ways for place in way})
    file = tmp_path / "encoding.lp"
    file.write_text(ENCODING.format(ways=" ".join(f"way({a},{b})." for a, b in sorted(ways))))
    planner = Planner(Engine(Options((str(file),))))
    planner.begin()
    for step in range(6):
        closed: Set[Pair] = set()
        if dice.random() < 0.5:
            closed = set(dice.sample(sorted(ways), dice.randint(1, len(ways) // 3 + 1)))
        if dice.random() < 0.5:  # both directions are
            closed |= {(b, a) for a, b in closed}
        center = dice.choice(known)
        needs = [(dice.choice(known), dice.choice([center, *known])) for _ in range(4)]
        needs += [(dice.choice(known), center), (center, dice.choice(known))]
        atoms = told("need", needs, step) + told("close", sorted(closed), step)
        assert not planner.tell(list(dict.fromkeys(atoms)))
        outcome = planner.search(step, step, lambda: False)
        assert outcome.result is Result.SAT
        check(ways - closed, needs, outcome.symbols)


def check(free: Set[Pair], needs: Sequence[Pair], symbols: Sequence[str]) -> None:
    found = {(a, b): n for a, b, n in numbers(symbols, "distance")}
    routes: Dict[Pair, Dict[int, int]] = {}
    for a, b, place, left in numbers(symbols, "route"):
        assert left not in routes.setdefault((a, b), {})
        routes[a, b][left] = place
    for begin, end in needs:
        steps = distance(free, begin, end)
        assert found.get((begin, end), -1) == steps, (begin, end)
        if steps < 0:
            continue
        route = [routes[begin, end][left] for left in range(steps, -1, -1)]
        assert len(routes[begin, end]) == len(route)
        assert (route[0], route[-1]) == (begin, end)
        assert set(zip(route, route[1:])) <= free, (begin, end, route)
