"""Plans in layers: finds out how many layers a plan needs, wish by wish or all wishes at once.

An encoding with the parts ``layer(k,n)`` and ``goal(k,n)`` says in an answer set of search K, by
``layers(K,N,M)``, that its plan has N layers at least, and that M wishes are to be granted. Then
layers are grounded as needed, and with ``goal(K,N,I)``, an external, I of the wishes are granted
after N layers, and nothing is done in later ones. By ``layers_with(K,P)``, a part ``P(k,n)`` is
grounded with each layer. An answer set asks for ``attained(K,N,ID)`` for
each request that is met.

Two ways to search take turns, each for longer than the other one before:

- all wishes at once, where several numbers of layers take turns;
- one wish after the other: what was found for some of them stays, by assumptions, and the plan goes
  on from there. That is quick for any number of wishes, unless some order of them is a dead end.

If that takes too long, the plan is for those requests that are met with what was found for some
wishes, and the others wait for news.
"""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Iterator, List, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.interleaving import Interleaving
from rosoclingo.loop.planner.neighbourhoods import Neighbourhood
from rosoclingo.loop.planner.seeding import Seed
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.solver import Solver

_LAYERS, _LAYERS_BEFORE, _LAYERS_WITH = "layers(", "layers_before(", "layers_with("
_GRANTED = "granted("
_ATTAINED = "ground(attained("
_SPARE = 1  # layers that are grounded in advance, as that costs less than one by one
_AT_ONCE_SECONDS = 0.05  # which each way to search has at first
_ONE_BY_ONE_SECONDS = 0.2
_LENGTHENING = 1.5
_POLISH_SECONDS = 0.01
_SAME_SECONDS = 0.2  # which may be taken to find out whether what is left of a plan fits
_SEED_LAYERS = 10  # which are grounded for a seed before it is looked for news again
_SEED_SECONDS = 2.0  # which may be taken to find out whether a seed fits
_MOST_SECONDS = 30.0  # after which there is no plan for any request
_MOST_LAYERS = 64  # more than needed at least, that are tried
_LONGER_PART = 4  # a plan may have a fourth more layers when it is proven the best,
_MOST_LONGER = 2  # until it may have twice as many
_MORE_SECONDS = 5.0  # after which there is one for some of them only, if there is no progress


@dataclass
class LayersState:
    """Keeps what is known of the layers of the latest search; all of it is saved.

    Attributes:
        search: Its number.
        grounded: The last layer that is grounded.
        is_decided: Whether it is known how many there are.
        goal: The external ``goal(K,N,I)`` that is true, if any is.
    """

    search: int = 0
    grounded: int = 0
    is_decided: bool = False
    goal: str = ""

    def begin(self, search: int) -> None:
        """Forgets all for a new search."""
        self.search, self.grounded, self.goal = search, 0, ""
        self.is_decided = False


@dataclass(frozen=True)
class WantedLayers:
    """Says which layers an answer set needs. Immutable.

    Attributes:
        search: The number of the search.
        least: How many there are at least.
        wishes: How many wishes are to be granted.
        before: How many what is left of the plan before has; 0 if there is none.
        kept: How many wishes that grants.
        parts: The names of the parts that are grounded for each layer.
    """

    search: int
    least: int
    wishes: int
    before: int = 0
    kept: int = 0
    parts: Tuple[str, ...] = ("layer", "goal")

    @classmethod
    def of(cls, symbols: Sequence[str]) -> Optional[WantedLayers]:
        """Reads an answer set; None if it needs no layers.

        >>> wanted = WantedLayers.of(["layers(2,4,1)", "layers_before(2,7,1)", "layers_with(2,x)"])
        >>> wanted.least, wanted.before, wanted.kept, wanted.parts
        (4, 7, 1, ('layer', 'x', 'goal'))
        """
        for search, least, wishes in _numbers(symbols, _LAYERS, 3):
            before = list(_numbers(symbols, _LAYERS_BEFORE, 3)) or [[search, 0, 0]]
            more = (name for _, name in _terms(symbols, _LAYERS_WITH, 2))
            _, layers, kept = before[0]
            return cls(search, least, wishes, layers, kept, ("layer", *more, "goal"))
        return None


@dataclass(eq=False)
class LayeredSearch:
    """Finds a number of layers with which there is a plan. One thread makes the calls.

    Attributes:
        solver: The planner's solver.
        run: Runs commands.
        state: What is known of the layers; changes.
        cost: Returns what the last answer set of a search costs; nothing if there is none.
        seed_planner: Another planner's program, which is asked for a plan; None for none.
    """

    solver: Solver
    run: Callable[..., object]
    state: LayersState
    cost: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]]
    seed_planner: Optional[Path]
    _grounding: float = 0.0  # seconds that it took to ground layers

    def wanted(self, symbols: Sequence[str]) -> Optional[WantedLayers]:
        """Returns the layers that an answer set needs and that are not decided yet."""
        wanted = WantedLayers.of(symbols)
        if wanted is None:
            return None
        if wanted.search != self.state.search:
            self.state.begin(wanted.search)
        return None if self.state.is_decided else wanted

    def take(self, wanted: WantedLayers, ended: SearchEnded) -> None:
        """Does to the solver what a search did that has ended."""
        self._ask(wanted, ended.horizon, ended.granted, grounded=ended.grounded)
        self.state.is_decided = True

    def keep(self, wanted: WantedLayers) -> None:
        """Takes as many layers as what is left of the plan before has."""
        self._ask(wanted, wanted.before, wanted.kept)
        self.state.is_decided = True

    def longer(self, wanted: WantedLayers, layers: int, wishes: int) -> Callable[[], bool]:
        """Returns what allows plans with more layers, until there are twice as many.

        Args:
            wanted: What the encoding says of layers.
            layers: How many the plan has.
            wishes: How many wishes are to be granted.
        """
        most = _MOST_LONGER * layers

        def lengthen() -> bool:
            nonlocal layers
            if layers >= most:
                return False
            layers += max(1, layers // _LONGER_PART)
            self._ask(wanted, layers, wishes, spare=0)
            return True

        return lengthen

    def find(
        self, wanted: WantedLayers, stopped: Callable[[], bool], *, same: Optional[wire.Assumption]
    ) -> SearchEnded:
        """Searches until there is a plan, or until told to stop.

        Args:
            wanted: What the encoding says of layers.
            stopped: Whether the search has to end.
            same: The assumption that the plan has what is left of the one before, if that is to be
                tried first.
        """
        seed = Seed(self.solver, self.run, self.seed_planner, wanted.search, stopped)
        with contextlib.closing(seed):
            return self._find(wanted, stopped, same, seed)

    def _find(
        self,
        wanted: WantedLayers,
        stopped: Callable[[], bool],
        same: Optional[wire.Assumption],
        seed: Seed,
    ) -> SearchEnded:
        all_wishes = wanted.wishes
        before = max(wanted.before, wanted.least)
        kept: Optional[_Way] = None
        turns = [(_Way(self, wanted, first=wanted.least, wishes=all_wishes), _AT_ONCE_SECONDS)]
        one_by_one = _OneByOne(self, wanted, first=1, wishes=1)
        if all_wishes > 1:
            turns.append((one_by_one, _ONE_BY_ONE_SECONDS))
        if same is not None and wanted.before:
            kept = _Way(self, wanted, first=before, wishes=all_wishes, assumed=[same])
            turns.insert(0, (kept, _SAME_SECONDS))
        begin = time.monotonic()
        while turns and not one_by_one.is_over(begin, time.monotonic()):
            way, seconds = turns.pop(0)
            if way is not kept:
                seed.begin()
            end = self._searched() + seconds

            def is_over(end: float = end) -> bool:
                is_late = self._searched() > end or time.monotonic() > begin + _MOST_SECONDS
                return stopped() or is_late or seed.is_ready

            while not (is_over() or way.is_through):
                found = way.turn(is_over)
                if found is not None:
                    return self._ended(wanted, found, all_wishes)
            if stopped():
                return SearchEnded(Ended.CALLED)
            if not way.is_through:
                turns.append((way, seconds * _LENGTHENING))
            if seed.is_ready:
                found = self._try_seed(wanted, seed, stopped)
                if found is not None:
                    return self._ended(wanted, found, all_wishes)
        if one_by_one.partial is None:
            return self._ended(wanted, SearchEnded(Ended.LAYERED, horizon=1), 0)
        return self._ended(wanted, one_by_one.partial, one_by_one.granted)

    def _searched(self) -> float:
        """Returns what time it is on a clock that stands still while layers are grounded."""
        return time.monotonic() - self._grounding

    def _try_seed(
        self, wanted: WantedLayers, seed: Seed, stopped: Callable[[], bool]
    ) -> Optional[SearchEnded]:
        """Returns a plan with what another planner has found, if that fits."""
        for least, assumed in seed.take():
            layers = max(least, wanted.least)
            for first in range(self.state.grounded, layers, _SEED_LAYERS):
                if stopped():
                    return None
                self._ask(wanted, min(first + _SEED_LAYERS, layers), wanted.wishes, spare=0)
            result, found = self.attempt(
                wanted, layers, wanted.wishes, stopped, seconds=_SEED_SECONDS, assumed=assumed
            )
            if result is not wire.Result.UNSAT:
                return found
        return None

    def _ended(self, wanted: WantedLayers, found: SearchEnded, granted: int) -> SearchEnded:
        """Has so many wishes granted from now on, with the layers of a plan."""
        self._ask(wanted, found.horizon, granted)
        self.state.is_decided = True
        return replace(found, grounded=self.state.grounded, granted=granted)

    def attempt(
        self,
        wanted: WantedLayers,
        layers: int,
        wishes: int,
        stopped: Callable[[], bool],
        *,
        seconds: float,
        assumed: Sequence[wire.Assumption] = (),
        polish: float = 0.0,
    ) -> Tuple[wire.Result, Optional[SearchEnded]]:
        """Searches with a number of layers.

        Args:
            wanted: What the encoding says of layers.
            layers: How many there are to be.
            wishes: How many wishes are to be granted.
            stopped: Whether it has to end.
            seconds: How long it may take.
            assumed: What is assumed.
            polish: How long to look for a cheaper plan when there is one.

        Returns:
            The result, and the plan, if one was found.
        """
        self._ask(wanted, layers, wishes)
        found: List[wire.Improvement] = []
        end = time.monotonic() + seconds

        def improved(improvement: wire.Improvement) -> None:
            nonlocal end
            end = end if found else time.monotonic() + polish
            found.append(improvement)

        outcome = self.solver.solve(assumed, lambda: stopped() or time.monotonic() > end, improved)
        symbols = outcome.symbols or (found[-1].symbols if found else ())
        if not symbols:
            return outcome.result, None
        cost = self.cost(outcome, found)
        quality = Quality(cost) if cost else None
        return wire.Result.SAT, SearchEnded(
            Ended.LAYERED, symbols, quality, horizon=layers, granted=wishes
        )

    def _ask(
        self,
        wanted: WantedLayers,
        layers: int,
        wishes: int,
        *,
        grounded: Optional[int] = None,
        spare: int = _SPARE,
    ) -> None:
        """Grounds layers, and sets the goal."""
        goal = f"goal({wanted.search},{layers},{wishes})"
        state = self.state
        last = grounded if grounded is not None else layers
        if grounded is None and layers > state.grounded:
            last += spare
        parts = [
            wire.Part(name, (str(wanted.search), str(n)))
            for n in range(state.grounded + 1, last + 1)
            for name in wanted.parts
        ]
        commands: List[wire.Command] = []
        if parts:
            commands.append(wire.Ground(tuple(parts)))
        if state.goal != goal:
            if state.goal:
                commands.append(wire.AssignExternal(state.goal, wire.Truth.FALSE))
            commands.append(wire.AssignExternal(goal, wire.Truth.TRUE))
        if commands:
            begin = time.monotonic()
            self.run(*commands)
            self._grounding += time.monotonic() - begin
        state.grounded, state.goal = max(state.grounded, last), goal


class _Way:
    """Searches for a plan with several numbers of layers in turn.

    Attributes:
        is_through: Whether all of them are refuted.
    """

    is_through = False
    _polish = 0.0

    def __init__(
        self,
        search: LayeredSearch,
        wanted: WantedLayers,
        *,
        first: int,
        wishes: int,
        assumed: Sequence[wire.Assumption] = (),
    ) -> None:
        self._search = search
        self._wanted = wanted
        self._wishes = wishes
        self._assumed = assumed
        self._begin(first)

    def _begin(self, first: int) -> None:
        self._first = first
        self._order = self._interleaving()
        self._turns = self._order.turns()

    @staticmethod
    def _interleaving() -> Interleaving:
        return Interleaving(0, _MOST_LAYERS, width=8, growth=1.4, seconds=0.01, share=0.85)

    def turn(self, stopped: Callable[[], bool]) -> Optional[SearchEnded]:
        """Searches once; returns a plan for all wishes, if one is found."""
        turn = next(self._turns, None)
        if turn is None:
            self.is_through = True
            return None
        offset = turn.horizon
        result, found = self._search.attempt(
            self._wanted, self._first + offset, self._wishes, stopped, seconds=turn.seconds,
            assumed=self._assumed, polish=self._polish,
        )  # fmt: skip
        if result is wire.Result.UNSAT:
            self._order.refute(offset)
        return None if found is None else self._take(found)

    def _take(self, found: SearchEnded) -> Optional[SearchEnded]:
        return found


class _OneByOne(_Way):
    """Searches for a plan for one more wish at a time, and keeps what was planned before.

    Attributes:
        partial: A plan that meets some requests; None if there is none yet.
        granted: How many wishes it grants.
    """

    _polish = _POLISH_SECONDS
    partial: Optional[SearchEnded] = None
    granted = 0
    _last = 0.0  # when it has made progress, on the monotonic clock

    @staticmethod
    def _interleaving() -> Interleaving:
        return Interleaving(0, _MOST_LAYERS, width=6, growth=1.15, seconds=0.05, share=0.85)

    def is_over(self, begin: float, now: float) -> bool:
        """Tells whether searches take too long that began then."""
        if self.partial is None:
            return now > begin + _MOST_SECONDS
        return now > self._last + max(self._last - begin, _MORE_SECONDS)

    def _take(self, found: SearchEnded) -> Optional[SearchEnded]:
        granted = sum(n == str(found.horizon) for _, n, _ in _terms(found.symbols, _GRANTED, 3))
        if granted >= self._wanted.wishes:
            return found
        if any(symbol.startswith(_ATTAINED) for symbol in found.symbols):
            self.partial, self.granted, self._last = found, granted, time.monotonic()
        plan = Neighbourhood.of(found.symbols)
        self._assumed = () if plan is None else plan.assumptions(frozenset())
        self._wishes = max(granted, self._wishes) + 1
        self._begin(found.horizon)
        return None


def _terms(symbols: Sequence[str], name: str, count: int) -> Iterator[List[str]]:
    """Yields the arguments of the terms of an answer set with a name and so many arguments."""
    for text in symbols:
        if text.startswith(name):
            arguments = split_term(text)[1]
            if len(arguments) == count:
                yield arguments


def _numbers(symbols: Sequence[str], name: str, count: int) -> Iterator[List[int]]:
    """Yields them likewise, if all are numbers."""
    for arguments in _terms(symbols, name, count):
        numbers = [number(argument) for argument in arguments]
        if None not in numbers:
            yield [n for n in numbers if n is not None]
