"""Longest paths in an acyclic graph that a program has as facts: the earliest times of a schedule.

A graph is said by facts P(I,J,N,G): in graph G, J begins N after I begins, or later. When each
one begins at the earliest is the length of the longest path there. Rules would ground an atom for
each path; a rule of a later part computes it by a term instead.

With a pair of names, (P,Q), facts Q(I,J,N,G) say that J begins N after I begins at most, so I may
have to begin later. One that contradicts the others is left out:

>>> from rosclingo.solver.engine import Engine
>>> from rosclingo.solver.options import Options
>>> from rosclingo.wire import commands as wire
>>> program = '''
... lag(boil,drain,9,today). lag(chop,fry,2,today). lag(drain,fry,1,today).
... slack(chop,fry,3,today).
... #program ask.
... begins(I,N) :- I = (chop;fry;wash), N = @longest_path(lag,today,I).
... late(I,N) :- I = (chop;fry), N = @longest_path((lag,slack),today,I).
... '''
>>> engine = Engine(Options())
>>> parts = wire.Ground((wire.Part("base"),)), wire.Ground((wire.Part("ask"),))
>>> engine.run([wire.Add("base", (), program), *parts]).failure
>>> sorted(text for text in engine.solve().symbols if text.startswith(("begins", "late")))
['begins(chop,0)', 'begins(fry,10)', 'begins(wash,0)', 'late(chop,7)', 'late(fry,10)']
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Callable, Dict, List, Optional, Tuple

import clingo
from clingo import Function, Number, SymbolType
from clingo.symbolic_atoms import SymbolicAtoms

from rosclingo.errors import shorten
from rosclingo.solver.new_facts import NewFacts, symbol_key

LONGEST = "longest_path"
"""The function; the first argument of a term names the facts of a graph."""

_ARITY = 4

_MOST_GRAPHS = 4  # of each predicate that are kept

_Lags = List[Tuple[int, int, int]]  # nodes by their keys, and the lag


class LongestPaths:
    """Finds longest paths in the graphs of one solver. One thread makes the calls.

    The facts of a graph have to be grounded before it is asked for, and are not added to later.
    The graphs that were grounded last are kept.
    """

    def __init__(self, atoms: Callable[[], SymbolicAtoms]) -> None:
        """Knows no graph yet.

        Args:
            atoms: Returns the solver's atoms.
        """
        self._new_facts = NewFacts(atoms)
        self._lags: Dict[str, OrderedDict[int, _Lags]] = {}
        self._begins: Dict[Tuple[str, str, int], Dict[int, int]] = {}

    @property
    def functions(self) -> Dict[str, Callable[..., List[clingo.Symbol]]]:
        """The functions that programs can call, by name."""
        return {LONGEST: self.longest_path}

    def forget(self) -> None:
        """Forgets all graphs, which are read anew: after a cleanup of the solver's atoms."""
        self._new_facts.forget()
        self._lags.clear()
        self._begins.clear()

    def longest_path(
        self, predicate: clingo.Symbol, graph: clingo.Symbol, node: clingo.Symbol
    ) -> List[clingo.Symbol]:
        """Returns the length of the longest path to a node; 0 if none leads there.

        Args:
            predicate: The name of the graph's facts, a constant; or a pair of that and the name of
                those that say how much later something begins at most.
            graph: Their last argument.
            node: The node.

        Raises:
            ValueError: A name is no constant, a length is no whole number from 0 on, or the graph
                has a circle.
        """
        names = _names(predicate)
        key = names[0], names[-1], symbol_key(graph)
        if key not in self._begins:
            try:
                lags, *others = [self._read(name, key[2]) for name in names]
                begins = _longest(lags)
                if begins is None:
                    raise ValueError(
                        f"{names[0]}/{_ARITY} has a circle in graph {shorten(str(graph))}"
                    )
            except ValueError:
                self.forget()  # so that it is refused again
                raise
            self._begins[key] = _delayed(begins, lags, others[0]) if others else begins
        return [Number(self._begins[key].get(symbol_key(node), 0))]

    def _read(self, name: str, graph: int) -> _Lags:
        """Reads the facts that have come since the last time; returns those of a graph."""
        graphs = self._lags.setdefault(name, OrderedDict())
        for arguments in self._new_facts.read(name, _ARITY):
            first, second, length, key = arguments
            if length.type is not SymbolType.Number or length.number < 0:
                raise ValueError(
                    f"{shorten(str(Function(name, arguments)))} says a length that is no whole "
                    "number from 0 on"
                )
            lag = symbol_key(first), symbol_key(second), length.number
            graphs.setdefault(symbol_key(key), []).append(lag)
        while len(graphs) > _MOST_GRAPHS:
            old, _ = graphs.popitem(last=False)
            for known in [one for one in self._begins if name in one[:2] and one[2] == old]:
                del self._begins[known]
        return graphs.get(graph, [])


def _names(predicate: clingo.Symbol) -> List[str]:
    """Returns the name of a predicate, or the two of a pair."""
    is_pair = predicate.type is SymbolType.Function and not predicate.name
    symbols = predicate.arguments if is_pair else [predicate]
    for symbol in symbols:
        is_name = symbol.type is SymbolType.Function and symbol.name and not symbol.negative
        if not is_name or symbol.arguments or len(symbols) > 2:
            raise ValueError(f"{shorten(str(predicate))} is no name of a predicate")
    return [symbol.name for symbol in symbols]


def _delayed(begins: Dict[int, int], lags: _Lags, slacks: _Lags) -> Dict[int, int]:
    """Returns when nodes begin at the earliest if slacks are kept, as far as they can be.

    Args:
        begins: When they begin without slacks.
        lags: The graph.
        slacks: By how much nodes begin later than others at most.
    """
    kept: _Lags = []
    for slack in slacks:
        trial = [*kept, slack]
        found = begins
        for _ in range(len(trial) + 1):
            late = [
                (first, found.get(second, 0) - most)
                for first, second, most in trial
                if found.get(second, 0) - most > found.get(first, 0)
            ]
            if not late:
                begins, kept = found, trial
                break
            found = dict(found)
            for node, begin in late:
                found[node] = max(begin, found.get(node, 0))
            found = _longest(lags, found) or found
    return begins


def _longest(lags: _Lags, least: Optional[Dict[int, int]] = None) -> Optional[Dict[int, int]]:
    """Returns the length of the longest path to each node; None if there is a circle.

    Args:
        lags: The graph.
        least: Lengths that nodes have at least; none for 0.
    """
    followers: Dict[int, List[Tuple[int, int]]] = {}
    missing: Dict[int, int] = {}
    for first, second, length in lags:
        followers.setdefault(first, []).append((second, length))
        missing[second] = missing.get(second, 0) + 1
        missing.setdefault(first, 0)
    found = {**dict.fromkeys(missing, 0), **(least or {})}
    ready = [node for node, count in missing.items() if count == 0]
    while ready:
        node = ready.pop()
        for follower, length in followers.get(node, ()):
            found[follower] = max(found[follower], found[node] + length)
            missing[follower] -= 1
            if not missing[follower]:
                ready.append(follower)
    return None if any(missing.values()) else found
