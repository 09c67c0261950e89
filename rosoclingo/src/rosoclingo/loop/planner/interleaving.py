"""Schedules searches of several horizons, where one after the other takes too long.

The shortest horizon with a plan is often hard to prove to be the shortest, while a longer one has a
plan that is found at once. So several horizons take turns, and each gets a fixed share of the time
of the one before it, which is Rintanen's algorithm B ("Evaluation strategies for planning as
satisfiability", 2004); horizons grow geometrically, and so do the turns. With several,
the first turn of each round is that of the shortest horizon that is not refuted, and each round has
one horizon more at its end: so a plan is found in the end if longer horizons have plans, too.
"""

from __future__ import annotations

import math
from typing import Iterator, List, NamedTuple, Set


class Turn(NamedTuple):
    """A search with a horizon.

    Attributes:
        horizon: The horizon.
        seconds: How long the search may take.
    """

    horizon: int
    seconds: float


class Interleaving:
    """Shares time among horizons. Not thread-safe.

    >>> order = Interleaving(0, width=3)
    >>> turns = order.turns()
    >>> [next(turns).horizon for _ in range(3)]
    [0, 1, 2]
    >>> order.refute(0), order.refute(1)
    (None, None)
    >>> [next(turns).horizon for _ in range(3)]
    [2, 3, 4]
    """

    def __init__(
        self,
        first: int,
        last: float = math.inf,
        *,
        width: int = 6,
        growth: float = 1.15,
        seconds: float = 0.05,
        share: float = 0.85,
        lengthening: float = 1.5,
    ) -> None:
        """Begins with a horizon.

        Args:
            first: The first horizon, 0 or more.
            last: The last one.
            width: How many horizons take turns at first.
            growth: The factor by which a horizon is longer than the one before it; it is longer by
                one at least.
            seconds: How long the first turn of the first horizon may take.
            share: The part of that which the next horizon gets, and so on.
            lengthening: The factor by which turns are longer in the next round.
        """
        self._first = self._next = first
        self._last = last
        self._refuted: Set[int] = set()
        self._width = width
        self._growth = growth
        self._seconds = seconds
        self._share = share
        self._lengthening = lengthening
        self._open: List[int] = []

    def turns(self) -> Iterator[Turn]:
        """Yields one turn after the other, until all horizons are refuted."""
        while True:
            while len(self._open) < self._width and self._next <= self._last:
                self._open.append(self._next)
                self._next = max(self._next + 1, int(self._next * self._growth))
            while self._first in self._refuted:
                self._first += 1
            if self._first > self._last:
                return
            fills_gaps = self._width > 1 or self._next > self._last
            if fills_gaps and self._first not in self._open:
                self._open.insert(0, self._first)
            for place, horizon in enumerate(tuple(self._open)):
                yield Turn(horizon, self._seconds * self._share**place)
            self._seconds *= self._lengthening
            if self._width > 1:
                self._width += 1

    def refute(self, horizon: int) -> None:
        """Gives no more turns to a horizon, with which there is no plan."""
        self._refuted.add(horizon)
        if horizon in self._open:
            self._open.remove(horizon)
