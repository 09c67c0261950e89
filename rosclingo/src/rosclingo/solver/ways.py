"""Shortest ways in a graph that a program has as facts, for the rules of the program.

A graph is said by facts P(V,W,N,G): in graph G, one can go from V to W, which takes N. To find a
shortest way in rules would ground an atom for each place around each destination. A rule of a
later part computes it by a term instead:

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

A graph (G,H) has the ways of graph G, but where its own facts say something else: a length, or
``#sup`` for a way that is closed. So what changes can be said without all that stays:

>>> program = '''
... way(b,c,#sup,(today,closed)).
... #program again.
... far(N) :- N = @shortest_distance(way,(today,closed),a,c).
... '''
>>> parts = wire.Ground((wire.Part("more"),)), wire.Ground((wire.Part("again"),))
>>> engine.run([wire.Add("more", (), program), *parts]).failure
>>> [text for text in engine.solve().symbols if text.startswith("far")]
['far(5)', 'far(7)']
"""

from __future__ import annotations

import heapq
from collections import OrderedDict
from typing import Callable, Dict, List, Optional, Set, Tuple

import clingo
from clingo import Function, Number, SymbolType
from clingo.symbolic_atoms import SymbolicAtoms

from rosclingo.errors import shorten
from rosclingo.solver.new_facts import NewFacts, symbol_key

DISTANCE, ROUTE = "shortest_distance", "shortest_route"
"""The functions; the first argument of a term names the facts of a graph."""

ARITY = 4
"""The number of arguments of these facts, and of the functions."""

_MOST_GRAPHS = 4  # of each predicate that are kept
_FAR = 2**31  # more than clingo's numbers

_Facts = List[Tuple[clingo.Symbol, clingo.Symbol, int]]
_Ways = List[Tuple[int, int]]


class ShortestWays:
    """Finds shortest ways in the graphs of one solver. One thread makes the calls.

    The facts of a graph have to be grounded before it is asked for, and are not added to later.
    Distances are kept for the graphs that were asked for last.
    """

    def __init__(self, atoms: Callable[[], SymbolicAtoms]) -> None:
        """Knows no graph yet.

        Args:
            atoms: Returns the solver's atoms.
        """
        self._new_facts = NewFacts(atoms)
        self._facts: Dict[str, Dict[int, _Facts]] = {}
        self._graphs: Dict[str, OrderedDict[int, _Graph]] = {}
        self._asked: Tuple[int, int] = 0, 0  # the predicate and the graph that were asked for last
        self._found: Optional[_Graph] = None  # that graph

    @property
    def functions(self) -> Dict[str, Callable[..., List[clingo.Symbol]]]:
        """The functions that programs can call, by name."""
        return {DISTANCE: self.distance, ROUTE: self.route}

    def forget(self) -> None:
        """Forgets all graphs, which are read anew: after a cleanup of the solver's atoms."""
        self._new_facts.forget()
        self._facts.clear()
        self._graphs.clear()
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
            graph: Their last argument; a tuple (G,H) for G with the changes that its facts say.
            begin: A place.
            end: Another one, or the same.

        Raises:
            ValueError: The name is no constant, or a length is no whole number from 1 on.
        """
        if symbol_key(begin) == symbol_key(end):
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
        asked = symbol_key(predicate), symbol_key(graph)
        if self._found is None or asked != self._asked:
            self._asked, self._found = asked, self._look_up(predicate, graph)
        return self._found

    def _look_up(self, predicate: clingo.Symbol, graph: clingo.Symbol) -> Optional[_Graph]:
        is_name = predicate.type is SymbolType.Function and not predicate.negative
        if not is_name or predicate.arguments:
            raise ValueError(f"{shorten(str(predicate))} is no name of a predicate")
        name = predicate.name
        facts = self._facts.setdefault(name, {})
        graphs = self._graphs.setdefault(name, OrderedDict())
        try:
            self._read(name, facts, graphs)
            found = self._find(facts, graphs, graph)
        except (ValueError, RecursionError):
            self.forget()  # so that it is refused again
            raise
        while len(graphs) > _MOST_GRAPHS:
            graphs.popitem(last=False)
        return found

    def _find(
        self, facts: Dict[int, _Facts], graphs: OrderedDict[int, _Graph], graph: clingo.Symbol
    ) -> Optional[_Graph]:
        """Returns a graph, which is made if it is not kept; None if nothing is said of it."""
        key = symbol_key(graph)
        base = self._find(facts, graphs, graph.arguments[0]) if _has_base(graph) else None
        said = facts.get(key)
        if said is None:
            return base
        if key in graphs:
            graphs.move_to_end(key)
        else:
            graphs[key] = _Graph(said, base)
        return graphs[key]

    def _read(self, name: str, facts: Dict[int, _Facts], graphs: OrderedDict[int, _Graph]) -> None:
        """Reads the facts that have come since the last time."""
        for arguments in self._new_facts.read(name, ARITY):
            begin, end, length, graph = arguments
            is_closed = length.type is SymbolType.Supremum and _has_base(graph)
            if not is_closed and (length.type is not SymbolType.Number or length.number < 1):
                raise ValueError(
                    f"{shorten(str(Function(name, arguments)))} says a length that is no whole "
                    "number from 1 on"
                )
            key = symbol_key(graph)
            if key not in facts:
                facts[key] = []
            facts[key].append((begin, end, _FAR if is_closed else length.number))


def _has_base(graph: clingo.Symbol) -> bool:
    """Tells whether a graph is another one with changes, by its name: a tuple (G,H)."""
    return graph.type is SymbolType.Function and not graph.name and len(graph.arguments) == 2


class _Graph:
    """A graph whose places have numbers; another graph with changes, or one of its own."""

    def __init__(self, facts: _Facts, base: Optional[_Graph]) -> None:
        """Makes a graph.

        Args:
            facts: Its ways, or those that are not as in another one.
            base: That other one.
        """
        self._base = base
        self._places: List[clingo.Symbol] = list(base._places) if base else []
        self._numbers: Dict[int, int] = dict(base._numbers) if base else {}
        self._from: List[_Ways] = list(base._from) if base else []  # where one comes from
        self._to: List[_Ways] = list(base._to) if base else []  # where one can go
        self._tables: Dict[int, _Table] = {}  # by the destination
        said: Dict[Tuple[int, int], int] = {}
        for begin, end, length in facts:
            pair = self._number(begin), self._number(end)
            said[pair] = min(length, said.get(pair, length))
        for (first, last), length in said.items():
            if base is not None:
                if length < min((n for to, n in self._to[first] if to == last), default=_FAR):
                    self._base = None  # there may be shorter ways than before
                self._from[last] = [way for way in self._from[last] if way[0] != first]
                self._to[first] = [way for way in self._to[first] if way[0] != last]
            if length < _FAR:
                self._from[last].append((first, length))
                self._to[first].append((last, length))

    def _number(self, place: clingo.Symbol) -> int:
        number = self._numbers.setdefault(symbol_key(place), len(self._places))
        if number == len(self._places):
            self._places.append(place)
            self._from.append([])
            self._to.append([])
        return number

    def distance(self, begin: clingo.Symbol, end: clingo.Symbol) -> Optional[int]:
        """Returns how far it is; None if there is no way."""
        first, last = self._numbers.get(symbol_key(begin)), self._numbers.get(symbol_key(end))
        if first is None or last is None:
            return None
        distance = self._table(first, last).distance(first)
        return distance if distance < _FAR else None

    def route(self, begin: clingo.Symbol, end: clingo.Symbol) -> List[clingo.Symbol]:
        """Returns the legs of a shortest way."""
        if self.distance(begin, end) is None:
            return []
        first, last = self._numbers[symbol_key(begin)], self._numbers[symbol_key(end)]
        table = self._table(first, last)
        places = self._walk(table, first, last, in_order=True)
        left = [table.distances[place] for place in (first, *places)]
        return [
            Function("", [Number(before), self._places[place], Number(after)])
            for before, place, after in zip(left, places, left[1:])
        ]

    def _table(self, first: int, last: int) -> _Table:
        """Returns a table that knows how far it is from one place to another.

        Ways that are closed or have become longer change nothing where a shortest one of before is
        still open.
        """
        own = self._tables.get(last)
        if own is None and self._base is not None and max(first, last) < len(self._base._places):
            before = self._base._table(first, last)
            if before.distance(first) >= _FAR or self._walk(before, first, last):
                return before
        if own is None:
            own = self._tables[last] = _Table(last, self._from)
        return own

    def _walk(self, table: _Table, first: int, last: int, *, in_order: bool = False) -> List[int]:
        """Returns the places of a shortest way by a table; none if all of these are closed.

        Args:
            table: Says how far it is.
            first: The place where it begins.
            last: The destination.
            in_order: Whether each leg is the first one by the name of its place.
        """
        walked, tried = [first], [self._legs(table, first, in_order)]
        failed: Set[int] = set()
        while walked and walked[-1] != last:
            if not tried[-1]:
                failed.add(walked.pop())
                tried.pop()
                continue
            place = tried[-1].pop()
            if place not in failed:
                walked.append(place)
                tried.append(self._legs(table, place, in_order))
        return walked[1:]

    def _legs(self, table: _Table, place: int, in_order: bool) -> List[int]:
        """Returns where a shortest way may go next, the one to try first at the end."""
        distances = table.distances
        left = distances[place]
        legs = [to for to, length in self._to[place] if distances[to] + length == left]
        if in_order and len(legs) > 1:
            legs.sort(key=lambda to: self._places[to], reverse=True)
        return legs


class _Table:
    """Distances to one destination: Dijkstra's algorithm, no farther than was asked for so far.

    Attributes:
        distances: Of all places; upper bounds where it is farther than that.
    """

    def __init__(self, end: int, ways: List[_Ways]) -> None:
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
