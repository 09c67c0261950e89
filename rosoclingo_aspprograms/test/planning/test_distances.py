"""The library's shortest ways, on random graphs, against a search without a solver."""

from __future__ import annotations

import heapq
import random
from pathlib import Path
from typing import Dict, List, Sequence, Set, Tuple

import pytest
from draws import draws

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.planner import Planner

LIBRARY = Path(__file__).resolve().parents[2] / "lib"
ENCODING = f"""
#include "{LIBRARY / "distances.lp"}".
#program base. {{ways}} {{lengths}}
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
#show route(A,B,M,W,N) : route(A,B,M,W,N,k), not newer(k).
"""

Pair = Tuple[int, int]


def distance(ways: Set[Pair], lengths: Dict[Pair, int], begin: int, end: int) -> int:
    """Returns how long it takes; -1 says that there is no way."""
    found: Dict[int, int] = {}
    rest = [(0, begin)]
    while rest:
        taken, place = heapq.heappop(rest)
        if place not in found:
            found[place] = taken
            for way in ways:
                if way[0] == place:
                    heapq.heappush(rest, (taken + lengths.get(way, 1), way[1]))
    return found.get(end, -1)


def numbers(symbols: Sequence[str], name: str) -> List[List[int]]:
    terms = [split_term(symbol) for symbol in symbols]
    return [[int(argument) for argument in rest] for found, rest in terms if found == name]


def told(name: str, pairs: Sequence[Pair], step: int) -> List[str]:
    return [f"event({name},pair({a},{b}),{step})" for a, b in pairs]


@pytest.mark.parametrize("longest", [1, 4, 40])
@pytest.mark.parametrize("one_way", [False, True])
@pytest.mark.parametrize("seed", draws([2, 4, 6], 20))
def test_ways_are_the_shortest_ones(seed: int, one_way: bool, longest: int, tmp_path: Path) -> None:
    """Places have dead ends next to them, and nothing leads to some; ways close and open again."""
    dice = random.Random(f"{seed} {one_way}")
    places = range(dice.randint(2, 9))
    pairs = {(a, b) for a in places for b in places if a < b and dice.random() < 0.4}
    pairs |= {(place, 10 + place) for place in places if dice.random() < 0.5} | {(20, 21)}
    ways = pairs | {(b, a) for a, b in pairs}
    if one_way:
        ways -= set(dice.sample(sorted(ways), len(ways) // 6))
    lengths: Dict[Pair, int] = {}
    for a, b in sorted(pairs if longest > 1 else ()):
        lengths[a, b] = lengths[b, a] = dice.randint(1, longest)
    known = sorted({place for way in ways for place in way})
    file = tmp_path / "encoding.lp"
    facts = " ".join(f"way({a},{b})." for a, b in sorted(ways))
    said = " ".join(f"length({a},{b},{lengths[a, b]})." for a, b in pairs & lengths.keys())
    file.write_text(ENCODING.format(ways=facts, lengths=said))
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
        check(ways - closed, lengths, needs, outcome.symbols)


def check(
    free: Set[Pair], lengths: Dict[Pair, int], needs: Sequence[Pair], symbols: Sequence[str]
) -> None:
    found = {(a, b): n for a, b, n in numbers(symbols, "distance")}
    routes: Dict[Pair, Dict[int, Pair]] = {}
    for a, b, before, place, left in numbers(symbols, "route"):
        assert before not in routes.setdefault((a, b), {})
        routes[a, b][before] = place, left
    for begin, end in needs:
        taken = distance(free, lengths, begin, end)
        assert found.get((begin, end), -1) == taken, (begin, end)
        here, left, ways = begin, taken, 0
        while left > 0:
            there, rest = routes[begin, end][left]
            assert (here, there) in free, (begin, end, here)
            assert left - rest == lengths.get((here, there), 1)
            here, left, ways = there, rest, ways + 1
        if taken >= 0:
            assert here == end
            assert len(routes.get((begin, end), ())) == ways
