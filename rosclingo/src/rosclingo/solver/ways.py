"""Shortest ways in a graph that a program has as facts, for the rules of the program.

A graph is said by facts P(V,W,N,G): in graph G, one can go from V to W, which takes N. To find a
shortest way in rules would ground an atom for each place around each destination. A rule of a
later part asks for it by a term instead:

>>> from rosclingo.solver.engine import Engine
>>> from rosclingo.solver.options import Options
>>> from rosclingo.wire import commands as wire
>>> program = '''
... way(a,b,2,today). way(b,c,3,today). way(a,c,7,today).
... #program ask.
... far(N) :- N = @shortest_distance(way,today,a,c).
... leg(M,W,N) :- (M,W,N) = @shortest_route(way,today,a,c).
... '''
>>> engine = Engine(Options())
>>> parts = wire.Ground((wire.Part("base"),)), wire.Ground((wire.Part("ask"),))
>>> engine.run([wire.Add("base", (), program), *parts]).failure
>>> engine.solve().symbols[3:]
('far(5)', 'leg(5,b,3)', 'leg(3,c,0)')
"""

from __future__ import annotations

import heapq
from collections import OrderedDict
from typing import Callable, Dict, List, Optional, Set, Tuple

import clingo
from clingo import Function, Number, SymbolType
from clingo.symbolic_atoms import SymbolicAtom, SymbolicAtoms

from rosclingo.errors import shorten
from rosclingo.solver.patches import atoms_after

DISTANCE, ROUTE = "shortest_distance", "shortest_route"
"""The functions; the first argument of a term names the facts of a graph."""

ARITY = 4
"""The number of arguments of these facts, and of the functions."""

_MOST_GRAPHS = 4  # of each predicate that are kept
_FAR = 2**31  # more than clingo's numbers


class ShortestWays:
    """Finds shortest ways in the graphs of one solver. One thread makes the calls.

    The facts of a graph have to be grounded before it is asked for, and are not added to later.
    The graphs that were asked for last are kept; others are read again if they are asked for.
    """

    def __init__(self, atoms: Callable[[], SymbolicAtoms]) -> None:
        """Knows no graph yet.

        Args:
            atoms: Returns the solver's atoms.
        """
        self._atoms = atoms
        self._last: Dict[str, SymbolicAtom] = {}  # for each predicate, what was read last
        self._graphs: Dict[str, OrderedDict[int, _Graph]] = {}
        self._dropped: Dict[str, Set[int]] = {}  # graphs that were read and are not kept
        self._asked: Tuple[int, int] = 0, 0  # the predicate and the graph that were asked for last
        self._found: Optional[_Graph] = None  # that graph

    @property
    def functions(self) -> Dict[str, Callable[..., List[clingo.Symbol]]]:
        """The functions that programs can call, by name."""
        return {DISTANCE: self.distance, ROUTE: self.route}

    def forget(self) -> None:
        """Forgets all graphs, which are read anew: after a cleanup of the solver's atoms."""
        self._last.clear()
        self._graphs.clear()
        self._dropped.clear()
        self._found = None

    def distance(
        self,
        predicate: clingo.Symbol,
        graph: clingo.Symbol,
        begin: clingo.Symbol,
        end: clingo.Symbol,
    ) -> List[clingo.Symbol]:
        """Returns how far it is from one place to another; nothing if there is no way.

        Args:
            predicate: The name of the graph's facts, a constant.
            graph: Their last argument.
            begin: A place.
            end: Another one, or the same.

        Raises:
            ValueError: The name is no constant, or a length is no whole number from 1 on.
        """
        if _key(begin) == _key(end):
            return [Number(0)]
        found = self._graph(predicate, graph)
        distance = found.distance(begin, end) if found else None
        return [] if distance is None else [Number(distance)]

    def route(
        self,
        predicate: clingo.Symbol,
        graph: clingo.Symbol,
        begin: clingo.Symbol,
        end: clingo.Symbol,
    ) -> List[clingo.Symbol]:
        """Returns a shortest way: ``(M,W,N)`` for each leg to W, with M left before, and N after.

        Among several shortest ones, each leg leads to the place that is the first one in clingo's
        order of terms.

        Args:
            predicate: As in :meth:`distance`.
            graph: As there.
            begin: As there.
            end: As there.

        Raises:
            ValueError: As there.
        """
        found = self._graph(predicate, graph)
        return [] if begin == end or found is None else found.route(begin, end)

    def _graph(self, predicate: clingo.Symbol, graph: clingo.Symbol) -> Optional[_Graph]:
        asked = _key(predicate), _key(graph)
        if self._found is None or asked != self._asked:
            self._asked, self._found = asked, self._look_up(predicate, graph)
        return self._found

    def _look_up(self, predicate: clingo.Symbol, graph: clingo.Symbol) -> Optional[_Graph]:
        is_name = predicate.type is SymbolType.Function and not predicate.negative
        if not is_name or predicate.arguments:
            raise ValueError(f"{shorten(str(predicate))} is no name of a predicate")
        name = predicate.name
        graphs = self._graphs.setdefault(name, OrderedDict())
        dropped = self._dropped.setdefault(name, set())
        key = _key(graph)
        if key in dropped:
            self._last.pop(name)
            graphs.clear()
            dropped.clear()
        if key not in graphs:
            try:
                self._read(name, graphs)
            except ValueError:
                self.forget()  # so that it is refused again
                raise
        if key in graphs:
            graphs.move_to_end(key)
        while len(graphs) > _MOST_GRAPHS:
            dropped.add(graphs.popitem(last=False)[0])
        return graphs.get(key)

    def _read(self, name: str, graphs: OrderedDict[int, _Graph]) -> None:
        """Reads the facts that have come since the last time."""
        for atom in atoms_after(self._last.get(name), self._atoms(), name, ARITY):
            self._last[name] = atom
            begin, end, length, graph = atom.symbol.arguments
            if not atom.is_fact:
                raise ValueError(f"{shorten(str(atom.symbol))} is no fact")
            if length.type is not SymbolType.Number or length.number < 1:
                raise ValueError(
                    f"{shorten(str(atom.symbol))} says a length that is no whole number from 1 on"
                )
            found = graphs.get(_key(graph))
            if found is None:
                found = graphs[_key(graph)] = _Graph()
            found.add(begin, end, length.number)


def _key(symbol: clingo.Symbol) -> int:
    """Returns the number by which clingo knows a symbol, which is quicker than to hash that."""
    key: int = symbol._rep
    return key


class _Graph:
    """A graph whose places have numbers."""

    def __init__(self) -> None:
        self._places: List[clingo.Symbol] = []
        self._numbers: Dict[int, int] = {}
        self._from: List[List[Tuple[int, int]]] = []  # for each place, where one comes from
        self._to: List[List[Tuple[int, int]]] = []  # where one can go
        self._tables: Dict[int, _Table] = {}  # by the destination

    def add(self, begin: clingo.Symbol, end: clingo.Symbol, length: int) -> None:
        """Adds a way."""
        first, last = self._number(begin), self._number(end)
        self._tables.clear()
        self._from[last].append((first, length))
        self._to[first].append((last, length))

    def _number(self, place: clingo.Symbol) -> int:
        number = self._numbers.setdefault(_key(place), len(self._places))
        if number == len(self._places):
            self._places.append(place)
            self._from.append([])
            self._to.append([])
        return number

    def distance(self, begin: clingo.Symbol, end: clingo.Symbol) -> Optional[int]:
        """Returns how far it is; None if there is no way."""
        first, last = self._numbers.get(_key(begin)), self._numbers.get(_key(end))
        if first is None or last is None:
            return None
        distance = self._table(last).distance(first)
        return distance if distance < _FAR else None

    def route(self, begin: clingo.Symbol, end: clingo.Symbol) -> List[clingo.Symbol]:
        """Returns the legs of a shortest way."""
        left = self.distance(begin, end)
        if left is None:
            return []
        table, here, legs = self._table(self._numbers[_key(end)]), self._numbers[_key(begin)], []
        while left > 0:
            name, here = min(
                (self._places[place], place)
                for place, length in self._to[here]
                if table.distances[place] + length == left
            )
            legs.append(Function("", [Number(left), name, Number(table.distances[here])]))
            left = table.distances[here]
        return legs

    def _table(self, end: int) -> _Table:
        table = self._tables.get(end)
        if table is None:
            table = self._tables[end] = _Table(end, self._from)
        return table


class _Table:
    """Distances to one destination: Dijkstra's algorithm, no farther than was asked for so far.

    Attributes:
        distances: Of all places; upper bounds where it is farther than that.
    """

    def __init__(self, end: int, ways: List[List[Tuple[int, int]]]) -> None:
        self._ways = ways  # for each place, where one comes from
        self.distances = [_FAR] * len(ways)
        self.distances[end] = 0
        self._waves, self._farther = {0: [end]}, [0]  # places by distances, and these in order

    def distance(self, place: int) -> int:
        """Returns how far it is from a place; at least ``_FAR`` if there is no way."""
        distances, ways, waves, farther = self.distances, self._ways, self._waves, self._farther
        while farther and farther[0] < distances[place]:
            taken = heapq.heappop(farther)
            for near in waves.pop(taken):
                if distances[near] < taken:
                    continue
                for before, length in ways[near]:
                    distance = taken + length
                    if distance < distances[before]:
                        distances[before] = distance
                        if distance not in waves:
                            waves[distance] = []
                            heapq.heappush(farther, distance)
                        waves[distance].append(before)
        return distances[place]
