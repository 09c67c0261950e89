"""Longest paths for programs: on random graphs beside an enumeration, and what is refused."""

from __future__ import annotations

import random
from typing import Dict, Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, CleanupDomains, Ground, Part, Reply

ASK = """
#program ask(g).
begins(g,I,N) :- I = 0..7, N = @longest_path(lag,g,I).
"""
Lags = Dict[Tuple[int, int], int]


@pytest.fixture
def engine() -> Engine:
    engine = Engine(Options())
    engine.run([Add("base", (), ASK)])
    return engine


def add(engine: Engine, lags: Lags, graph: int) -> Reply:
    facts = " ".join(f"lag({a},{b},{n},{graph})." for (a, b), n in lags.items())
    return engine.run([Add(f"graph{graph}", (), facts), Ground((Part(f"graph{graph}"),))])


def ask(engine: Engine, graph: int) -> Reply:
    return engine.run([Ground((Part("ask", (str(graph),)),))])


def begins(engine: Engine, graph: int) -> Dict[int, int]:
    symbols = [text[7:-1].split(",") for text in engine.solve().symbols if text[:7] == "begins("]
    return {int(node): int(n) for key, node, n in symbols if int(key) == graph}


def longest(lags: Lags, node: int) -> int:
    return max((longest(lags, a) + n for (a, b), n in lags.items() if b == node), default=0)


def draw(dice: random.Random) -> Lags:
    order = dice.sample(range(8), 8)
    pairs = [(order[i], order[j]) for i in range(8) for j in range(i + 1, 8)]
    return {pair: dice.randint(0, 9) for pair in dice.sample(pairs, 12)}


@pytest.mark.parametrize("seed", range(4))
def test_paths_are_the_longest_ones(engine: Engine, seed: int) -> None:
    """More graphs than are kept come one after the other; atoms are cleaned up in between."""
    dice = random.Random(seed)
    for graph in range(6):
        lags = draw(dice)
        assert not add(engine, lags, graph).failure
        if graph == 3:
            engine.run([CleanupDomains()])
        assert not ask(engine, graph).failure
        assert begins(engine, graph) == {node: longest(lags, node) for node in range(8)}


def test_a_circle_is_refused(engine: Engine) -> None:
    add(engine, {(0, 1): 1, (1, 2): 1, (2, 1): 0}, 5)
    assert "lag/4 has a circle in graph 5" in str(ask(engine, 5).failure)


def test_a_negative_length_is_refused(engine: Engine) -> None:
    add(engine, {(0, 1): -1}, 5)
    assert "lag(0,1,-1,5) says a length that is no whole number from 0 on" in str(
        ask(engine, 5).failure
    )
