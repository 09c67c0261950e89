"""Shortest ways for programs: on random graphs beside SciPy, and what is refused."""

from __future__ import annotations

import random
from typing import Dict, List, Tuple, Union

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Policy
from rosclingo.wire.commands import Add, CleanupDomains, Ground, Part, Reply, Restart

ASK = """
#program graph(g).
#program ask(g,a,b).
far(g,a,b,N) :- N = @shortest_distance(way,g,a,b).
leg(g,a,b,M,W,N) :- (M,W,N) = @shortest_route(way,g,a,b).
"""
Ways = Dict[Tuple[int, int], int]
Graph = Union[int, str]
CLOSED = 0


@pytest.fixture
def engine() -> Engine:
    return Engine(Options())


def add(engine: Engine, ways: Ways, graph: Graph) -> Reply:
    facts = " ".join(f"way({a},{b},{n or '#sup'},{graph})." for (a, b), n in sorted(ways.items()))
    name = "graph" + "".join(filter(str.isalnum, str(graph)))
    return engine.run([Add(name, (), facts), Ground((Part(name),))])


def ask(engine: Engine, graph: Graph, begin: int, end: int) -> Reply:
    return engine.run([Ground((Part("ask", (str(graph), str(begin), str(end))),))])


def found(engine: Engine, name: str, graph: Graph, begin: int, end: int) -> List[List[int]]:
    """Returns the last arguments of the atoms of a predicate about a way."""
    start = f"{name}({graph},{begin},{end},"
    symbols = [text for text in engine.solve().symbols if text.startswith(start)]
    return [[int(word) for word in text[len(start) : -1].split(",")] for text in symbols]


def draw(dice: random.Random, places: int, longest: int) -> Ways:
    pairs = [(a, b) for a in range(places) for b in range(places) if a != b]
    return {pair: dice.randint(1, longest) for pair in dice.sample(pairs, len(pairs) // 3)}


@pytest.mark.parametrize("longest", [1, 9])
@pytest.mark.parametrize("seed", range(4))
def test_ways_are_the_shortest_ones(engine: Engine, seed: int, longest: int) -> None:
    """Graphs come one after the other, and are asked for in any order."""
    dice = random.Random(seed)
    assert engine.run([Add("base", (), ASK), Ground((Part("base"),))]).failure is None
    graphs: Dict[Graph, Ways] = {}
    for graph in range(6):
        graphs[graph] = draw(dice, dice.randint(2, 8), longest)
        assert add(engine, graphs[graph], graph).failure is None
        for _ in range(6):
            check(engine, dice, dice.randint(0, graph), graphs)


@pytest.mark.costly
@pytest.mark.parametrize("adds", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_a_graph_may_be_another_one_with_changes(engine: Engine, seed: int, adds: bool) -> None:
    """Ways are closed or take longer; others are new or take less. Changes may be changed."""
    dice = random.Random(seed)
    assert engine.run([Add("base", (), ASK), Ground((Part("base"),))]).failure is None
    base = draw(dice, 9, seed % 3 + 1)
    graphs: Dict[Graph, Ways] = {0: base}
    add(engine, base, 0)
    name: Graph = 0
    for number in range(6):
        name = f"({dice.choice(sorted(graphs, key=str))},{number})"
        before = graphs[_base(name)]
        pairs = dice.sample(sorted(before), min(len(before), dice.randint(0, 9)))
        changes = {pair: dice.choice([CLOSED, before[pair] + dice.randint(0, 2)]) for pair in pairs}
        if adds:
            changes.update(dice.sample(sorted(draw(dice, 9, 3).items()), 2))
        assert add(engine, changes, name).failure is None
        graphs[name] = {pair: n for pair, n in {**before, **changes}.items() if n != CLOSED}
        for _ in range(12):
            check(engine, dice, dice.choice(sorted(graphs, key=str)), graphs)


def _base(name: str) -> Graph:
    base = name[1 : name.rindex(",")]
    return int(base) if base.isdigit() else base


def check(engine: Engine, dice: random.Random, graph: Graph, graphs: Dict[Graph, Ways]) -> None:
    ways = graphs[graph]
    begin, end = dice.randint(0, 8), dice.randint(0, 8)
    assert ask(engine, graph, begin, end).failure is None
    table = np.zeros((9, 9))
    for (a, b), length in ways.items():
        table[a, b] = length
    distances = dijkstra(csr_array(table))[:, end]
    if np.isinf(distances[begin]):
        assert found(engine, "far", graph, begin, end) == []
        assert found(engine, "leg", graph, begin, end) == []
        return
    assert found(engine, "far", graph, begin, end) == [[distances[begin]]]
    here, left = begin, distances[begin]
    for before, there, after in sorted(found(engine, "leg", graph, begin, end), reverse=True):
        assert before == left
        ahead = [b for (a, b), n in ways.items() if a == here and distances[b] + n == left]
        assert there == min(ahead)
        here, left = there, after
    assert (here, left) == (end, 0)


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ("way(a,b,0,g).", "way(a,b,0,g) says a length that is no whole number from 1 on"),
        ("way(a,b,far,g).", "way(a,b,far,g) says a length that is no whole number from 1 on"),
        ("{ way(a,b,1,g) }.", "way(a,b,1,g) is no fact"),
        ("way(a,b,#sup,g).", "way(a,b,#sup,g) says a length that is no whole number from 1 on"),
    ],
)
def test_what_is_no_graph_is_refused(engine: Engine, facts: str, said: str) -> None:
    ask = "#program ask. far(N) :- N = @shortest_distance(way,g,a,b)."
    reply = engine.run([Add("base", (), facts + ask), Ground((Part("base"),))])
    assert reply.failure is None
    for _ in range(2):
        failure = engine.run([Ground((Part("ask"),))]).failure
        assert failure is not None
        assert said in failure.message


@pytest.mark.parametrize("name", ["7", "-way", "way(a)", '"way"'])
def test_a_name_is_a_constant(engine: Engine, name: str) -> None:
    program = f"-way(a,b,1,g). way(b,a,1,g). far(N) :- N = @shortest_distance({name},g,a,b)."
    failure = engine.run([Add("base", (), program), Ground((Part("base"),))]).failure
    assert failure is not None
    assert f"{name} is no name of a predicate" in failure.message


def test_a_place_is_where_it_is(engine: Engine) -> None:
    """So it is even if no way leads there; no fact is a graph without ways."""
    program = "far(X,N) :- X = (a;b), N = @shortest_distance(way,g,a,X)."
    assert engine.run([Add("base", (), program), Ground((Part("base"),))]).failure is None
    assert engine.solve().symbols == ("far(a,0)",)


def test_graphs_are_there_after_a_cleanup_and_go_with_a_restart(engine: Engine) -> None:
    engine.run([Add("base", (), ASK), Ground((Part("base"),))])
    add(engine, {(1, 2): 3}, 1)
    ask(engine, 1, 1, 2)
    assert engine.run([CleanupDomains()]).failure is None
    add(engine, {(1, 2): 4}, 2)
    for graph, distance in ((1, 3), (2, 4)):
        ask(engine, graph, 1, 2)
        assert found(engine, "far", graph, 1, 2) == [[distance]]
    engine.run([Restart(), Add("base", (), ASK), Ground((Part("base"),))])
    ask(engine, 1, 1, 2)
    assert found(engine, "far", 1, 1, 2) == []


def test_a_script_may_have_a_function_of_that_name() -> None:
    engine = Engine(Options(), Policy(allow_scripts=True))
    script = "#script (python)\ndef shortest_distance(*_):\n    from clingo import Number\n"
    script += "    return Number(42)\n#end.\n"
    program = f"{script}far(N) :- N = @shortest_distance(way,g,a,b)."
    reply = engine.run([Add("base", (), program), Ground((Part("base"),))])
    assert reply.failure is None
    assert engine.solve().symbols == ("far(42)",)
