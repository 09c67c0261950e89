"""Schedules searches of several horizons, where one after the other takes too long.

The shortest horizon with a plan is often hard to prove to be the shortest, while a longer one has a
plan that is found at once. So several horizons take turns, and each gets a fixed share of the time
of the one before it, which is Rintanen's algorithm B ("Evaluation strategies for planning as
satisfiability", 2004); horizons grow geometrically, and so do the turns. With several,
the first turn of each round is that of the shortest horizon that is not refuted, and each round has
one horizon more at its end: so a plan is found in the end if longer horizons have plans, too.

A plan without pauses, with an action in each step up to the last one, is often found much
sooner than any plan, but takes long turns: those are for two longer horizons only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import count
from typing import Iterator, List, NamedTuple, Set


class Turn(NamedTuple):
    """A search with a horizon.

    Attributes:
        horizon: The horizon.
        seconds: How long the search may take.
        is_unbroken: Whether it is for plans without pauses.
        restarts_dynamically: Whether the solver restarts as the quality of what it learns says, and
            not by its own default.
    """

    horizon: int
    seconds: float
    is_unbroken: bool = False
    restarts_dynamically: bool = False


@dataclass(eq=False)
class Interleaving:
    """Shares time among horizons. Not thread-safe.

    Attributes:
        first: The first horizon that is not refuted, 0 or more.
        last: The last one.
        width: How many horizons take turns; one more in each round.
        growth: The factor by which a horizon is longer than the one before it; it is longer by one
            at least.
        seconds: How long the turn of the first of these may take, from round to round longer.
        share: The part of that which the next horizon gets, and so on.
        lengthening: The factor by which turns are longer in the next round.

    >>> order = Interleaving(0, width=3)
    >>> turns = order.turns()
    >>> [next(turns).horizon for _ in range(3)]
    [0, 1, 2]
    >>> order.refute(0), order.refute(1)
    (None, None)
    >>> [next(turns).horizon for _ in range(3)]
    [2, 3, 4]
    """

    first: int
    last: float = math.inf
    width: int = 6
    growth: float = 1.15
    seconds: float = 0.05
    share: float = 0.85
    lengthening: float = 1.5

    def __post_init__(self) -> None:
        self._next = self.first
        self._refuted: Set[int] = set()
        self._open: List[int] = []

    def turns(self) -> Iterator[Turn]:
        """Yields one turn after the other, until all horizons are refuted."""
        while True:
            while len(self._open) < self.width and self._next <= self.last:
                self._open.append(self._next)
                self._next = max(self._next + 1, int(self._next * self.growth))
            while self.first in self._refuted:
                self.first += 1
            if self.first > self.last:
                return
            fills_gaps = self.width > 1 or self._next > self.last
            if fills_gaps and self.first not in self._open:
                self._open.insert(0, self.first)
            for place, horizon in enumerate(tuple(self._open)):
                yield Turn(horizon, self.seconds * self.share**place)
            self.seconds *= self.lengthening
            if self.width > 1:
                self.width += 1

    def refute(self, horizon: int) -> None:
        """Ends the turns of a horizon that is proven to have no plan."""
        self._refuted.add(horizon)
        if horizon in self._open:
            self._open.remove(horizon)


_AHEAD = 1.4  # the first horizon for plans without pauses, in terms of the one that is asked for
_FURTHER = 1.25  # the factor by which the next one is longer
_MOST = 4  # times the horizon that is asked for is the longest one
_PAIR = 2  # how many of them take turns
_SECONDS = 2.0  # how long the first turn of each may take
_LENGTHENING = 1.5
_ROUNDS = 2  # in which other plans have little time and the same horizons
_LITTLE, _SAME = 0.15, 1.0  # the time for other plans, in terms of that for plans without pauses


class UnbrokenFirst:
    """Shares time between plans without pauses and all others. Not thread-safe.

    At first, the others are looked for with the same horizons: further steps that are grounded make
    each search slower. Every other round, from the first one on, has dynamic restarts: some tasks
    that take minutes with one strategy take seconds with the other.
    """

    def __init__(self, asked: int, last: float, others: Interleaving) -> None:
        """Begins with a horizon.

        Args:
            asked: The horizon that is asked for.
            last: The last one.
            others: Shares time among horizons for all plans.
        """
        self._others = others
        self._next = max(asked + 1, asked * _AHEAD)
        self._longest = min(last, max(asked, 1) * _MOST)
        self._last = last
        self._open: List[int] = []

    def turns(self) -> Iterator[Turn]:
        """Yields one turn after the other, until all horizons are refuted for all plans."""
        others = self._others.turns()
        for number in count():
            is_near = number < _ROUNDS
            is_dynamic = number % 2 == 0
            self._fill(is_near)
            seconds = _SECONDS * _LENGTHENING**number
            for horizon in tuple(self._open):
                yield Turn(horizon, seconds, True, is_dynamic)
            left = _PAIR * seconds * (_LITTLE if is_near else _SAME)
            while left > 0 or not self._open:
                self._fill(is_near)
                turn = next(others, None)
                if turn is None:
                    return
                yield turn._replace(restarts_dynamically=is_dynamic)
                left -= turn.seconds

    def _fill(self, is_near: bool) -> None:
        while len(self._open) < _PAIR and self._next <= self._longest:
            self._open.append(int(self._next))
            self._next = max(self._next + 1, self._next * _FURTHER)
        self._others.last = max(self._open) if is_near and self._open else self._last

    def refute(self, turn: Turn) -> None:
        """Ends a horizon's turns; for plans without pauses, those of shorter horizons, too."""
        if not turn.is_unbroken:
            self._others.refute(turn.horizon)
        self._open = [one for one in self._open if one > turn.horizon]
