"""Plans in layers: finds the number of layers, wish by wish or for all wishes at once.

An encoding with the parts ``layer(k,n)`` and ``goal(k,n)`` says in an answer set of search K, by
``layers(K,N,M)``, that its plan has N layers at least, and that M wishes are to be granted. Then
layers are grounded as needed, and with ``goal(K,N,I)``, an external, I of the wishes are granted
after N layers, and nothing is done in later ones. By ``layers_with(K,P)``, a part ``P(k,n)`` is
grounded with each layer. An answer set requests ``attained(K,N,ID)`` for
each request that is met.

Two ways to search take turns, each for longer than the other one before:

- all wishes at once, where several numbers of layers take turns;
- one wish after the other: what was found for some of them stays, by assumptions, and the plan goes
  on from there. That is quick for any number of wishes, unless some order of them is a dead end.

If that takes too long, the plan is for those requests that are met with what was found for some
wishes, and the others wait for news.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Callable, Iterator, List, Optional, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.journal import Ended, SearchEnded
from rosoclingo.loop.planner.interleaving import Interleaving
from rosoclingo.loop.planner.local_search import below
from rosoclingo.loop.planner.neighbourhoods import Neighbourhood
from rosoclingo.loop.planner.work import Work
from rosoclingo.loop.quality import Quality

_LAYERS, _LAYERS_BEFORE, _LAYERS_WITH = "layers(", "layers_before(", "layers_with("
_LAYERS_FIRST, _FIRST = "layers_first(", "first"
_GRANTED = "granted("
_ATTAINED = "ground(attained("
_SPARE = 1  # layers that are grounded in advance, as that costs less than one by one
_AT_ONCE_SECONDS = 0.05  # which each way to search has at first
_ONE_BY_ONE_SECONDS = 0.2
_FIRST_SECONDS = 1.0  # which the search has at first for what has waited long
_LENGTHENING = 1.5
_POLISH_SECONDS = 0.01
_SAME_SECONDS = 0.2  # to find out whether the rest of a plan fits
_MOST_SECONDS = 30.0  # after which there is no plan for any request
_MOST_LAYERS = 64  # more than needed at least, that are tried
_LONGER_PART = 4  # a plan may have a fourth more layers when it is proven the best,
_MOST_LONGER = 2  # until it may have twice as many
_MORE_SECONDS = 5.0  # after which there is one for some of them only, if there is no progress


@dataclass
class LayersState:
    """Layers of the latest search, as far as they are decided; all of it is saved.

    Attributes:
        search: Its number.
        grounded: The last layer that is grounded.
        is_decided: Whether it is known how many there are.
        goal: The external ``goal(K,N,I)`` that is true, if any is.
        missing: How many wishes the plan does not grant, though it is not proven that none does.
    """

    search: int = 0
    grounded: int = 0
    is_decided: bool = False
    goal: str = ""
    missing: int = 0

    def begin(self, search: int) -> None:
        """Resets the state for a new search."""
        self.search, self.grounded, self.goal = search, 0, ""
        self.is_decided = False
        self.missing = 0


@dataclass(frozen=True)
class WantedLayers:
    """The layers that an answer set needs. Immutable.

    Attributes:
        search: The number of the search.
        least: How many there are at least.
        wishes: How many wishes are to be granted.
        before: How many layers the rest of the plan before has; 0 if there is none.
        kept: How many wishes that grants.
        parts: The names of the parts that are grounded for each layer.
        has_first: Whether some requests have waited long.
    """

    search: int
    least: int
    wishes: int
    before: int = 0
    kept: int = 0
    parts: Tuple[str, ...] = ("layer", "goal")
    has_first: bool = False

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
            has_first = any(text.startswith(_LAYERS_FIRST) for text in symbols)
            return cls(search, least, wishes, layers, kept, ("layer", *more, "goal"), has_first)
        return None


@dataclass(eq=False)
class LayeredSearch:
    """Finds a number of layers with which there is a plan. One thread makes the calls.

    Attributes:
        solver: The planner's solver.
        run: Runs commands.
        state: The layers as far as they are decided; changes.
        cost: Returns what the last answer set of a search costs; nothing if there is none.
    """

    solver: Work
    run: Callable[..., object]
    state: LayersState
    cost: Callable[[wire.Outcome, Sequence[wire.Improvement]], Tuple[int, ...]]

    def wanted(self, symbols: Sequence[str]) -> Optional[WantedLayers]:
        """Returns the layers that an answer set needs and that are undecided."""
        wanted = WantedLayers.of(symbols)
        if wanted is None:
            return None
        if wanted.search != self.state.search:
            self.state.begin(wanted.search)
        return None if self.state.is_decided else wanted

    def take(self, wanted: WantedLayers, ended: SearchEnded) -> None:
        """Applies the effects of a recorded search to the solver."""
        self._ask(wanted, ended.horizon, ended.granted, grounded=ended.grounded)
        self.state.is_decided = True
        self.state.missing = ended.missing

    def keep(self, wanted: WantedLayers) -> None:
        """Sets the number of layers to that of the rest of the plan before."""
        self._ask(wanted, max(1, wanted.before), wanted.kept)
        self.state.is_decided = True

    def longer(self, wanted: WantedLayers, layers: int, wishes: int) -> Callable[[], bool]:
        """Returns a function that allows plans with more layers, up to twice as many.

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
            same: The assumption that the plan has the rest of the one before, if that is to be
                tried first.
        """
        at_once = _Way(self, wanted, first=wanted.least, wishes=wanted.wishes)
        one_by_one = _OneByOne(self, wanted)
        turns: List[Tuple[_Way, float]] = [(at_once, _AT_ONCE_SECONDS)]
        if wanted.wishes > 1:
            turns.append((one_by_one, _ONE_BY_ONE_SECONDS))
        first: Optional[_Way] = None
        if wanted.has_first and wanted.wishes > 1:
            assumed = [wire.Assumption(f"{_FIRST}({wanted.search})", True)]
            first = _Way(self, wanted, first=1, wishes=1, assumed=assumed)
            turns.insert(0, (first, _FIRST_SECONDS))
        if same is not None and wanted.before:
            before = max(wanted.before, wanted.least)
            kept = _Way(self, wanted, first=before, wishes=wanted.wishes, assumed=[same])
            turns.insert(0, (kept, _SAME_SECONDS))
        begin = self.solver.seconds
        while turns and not one_by_one.is_over(begin):
            way, seconds = turns.pop(0)
            found = self._take_turn(way, seconds, stopped)
            if found is not None and way is first:
                found = one_by_one.go_on(found)
                at_once.assume(one_by_one.assumed)
                way.is_through = True
            if found is not None:
                return self._ended(wanted, found, wanted.wishes)
            if stopped():
                return SearchEnded(Ended.CALLED)
            if not way.is_through:
                turns.append((way, seconds * _LENGTHENING))
        granted = one_by_one.granted
        partial = one_by_one.partial or SearchEnded(Ended.LAYERED, horizon=1)
        is_refuted = at_once.is_through and not at_once.has_assumed
        missing = wanted.wishes - granted
        missing = 0 if is_refuted and missing == 1 else missing
        return self._ended(wanted, partial, granted, missing)

    def find_more(
        self,
        wanted: WantedLayers,
        stopped: Callable[[], bool],
        *,
        same: wire.Assumption,
        seconds: float,
    ) -> SearchEnded:
        """Searches for a plan that grants more wishes than the rest of the plan before.

        It ends when all are granted; when told to stop; or when for a time no further wish was
        granted. Then it says what was found until then.

        Args:
            wanted: What the encoding says of layers.
            stopped: Whether the search has to end.
            same: The assumption that the plan has the rest of the one before.
            seconds: That time, in seconds of work.
        """
        one_by_one = _OneByOne(self, wanted)
        if wanted.before:
            _, left = self.attempt(
                wanted, wanted.before, wanted.kept, stopped, seconds=seconds, assumed=[same]
            )
            if left is not None:
                found = one_by_one.go_on(left)
                if found is not None:
                    return self._ended(wanted, found, wanted.wishes)
        at_least = one_by_one.granted
        free = _Way(self, wanted, first=wanted.least, wishes=at_least + 1)
        turns: List[Tuple[_Way, float]] = [
            (one_by_one, _ONE_BY_ONE_SECONDS), (free, _ONE_BY_ONE_SECONDS),
        ]  # fmt: skip
        if at_least + 1 < wanted.wishes:
            turns.append(
                (_Way(self, wanted, first=wanted.least, wishes=wanted.wishes), _AT_ONCE_SECONDS)
            )
        begin = self.solver.seconds
        is_refuted = False
        while turns and not (stopped() or one_by_one.is_late(begin, seconds)):
            way, turn = turns.pop(0)
            found = self._take_turn(way, turn, stopped)
            if way is free and way.is_through and one_by_one.granted == at_least:
                is_refuted = True
                break
            if way is free and found is not None:
                found = one_by_one.go_on(found) if one_by_one.granted == at_least else None
                way.is_through = True
            if found is not None:
                return self._ended(wanted, found, wanted.wishes)
            if not way.is_through:
                turns.append((way, turn * _LENGTHENING))
        partial = one_by_one.partial or SearchEnded(Ended.LAYERED, horizon=1)
        granted = one_by_one.granted
        missing = 0 if is_refuted else wanted.wishes - max(granted, wanted.kept)
        return self._ended(wanted, partial, granted, missing)

    def _take_turn(
        self, way: _Way, seconds: float, stopped: Callable[[], bool]
    ) -> Optional[SearchEnded]:
        """Searches in one way within a budget, in seconds of work."""
        end = self.solver.seconds + seconds
        while not (stopped() or self.solver.seconds > end or way.is_through):
            found = way.turn(stopped)
            if found is not None:
                return found
        return None

    def _ended(
        self, wanted: WantedLayers, found: SearchEnded, granted: int, missing: int = 0
    ) -> SearchEnded:
        """Demands so many wishes from now on, with the layers of a plan."""
        self._ask(wanted, found.horizon, granted)
        self.state.is_decided = True
        self.state.missing = missing
        return replace(found, grounded=self.state.grounded, granted=granted, missing=missing)

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
            seconds: How long it may take, in seconds of work.
            assumed: The assumptions.
            polish: How long to look for a cheaper plan when there is one, in seconds.

        Returns:
            The result, and the plan, if one was found.
        """
        self._ask(wanted, layers, wishes)
        found: List[wire.Improvement] = []
        limit = self.solver.limit(seconds)
        outcome = self.solver.solve(
            (*assumed, limit), lambda: stopped() or bool(found), found.append
        )
        symbols = outcome.symbols or (found[-1].symbols if found else ())
        if not symbols:
            return outcome.result, None
        cost = self.cost(outcome, found)
        if cost and polish and not stopped():
            better: List[wire.Improvement] = []
            bound, limit = wire.CostBound(below(cost)), self.solver.limit(polish)
            outcome = self.solver.solve((*assumed, bound, limit), stopped, better.append)
            if better:
                cost, symbols = self.cost(outcome, better), outcome.symbols or better[-1].symbols
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
            self.run(*commands)
        state.grounded, state.goal = max(state.grounded, last), goal


class _Way:
    """Searches for a plan with several numbers of layers in turn.

    Attributes:
        is_through: Whether all of them are refuted.
        assumed: The assumptions.
        has_assumed: Whether that was added when some were refuted perhaps.
    """

    is_through = False
    has_assumed = False
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
        self.assumed = assumed
        self._begin(first)

    def assume(self, assumed: Sequence[wire.Assumption]) -> None:
        """Adds assumptions for further searches."""
        self.assumed = assumed
        self.has_assumed = True

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
            assumed=self.assumed, polish=self._polish,
        )  # fmt: skip
        if result is wire.Result.UNSAT:
            self._order.refute(offset)
        return None if found is None else self._take(found)

    def _take(self, found: SearchEnded) -> Optional[SearchEnded]:
        return found


class _OneByOne(_Way):
    """Searches for a plan wish by wish, and keeps the plan for the wishes before.

    Attributes:
        partial: A plan that meets some requests; None if there is none yet.
        granted: How many wishes it grants.
    """

    _polish = _POLISH_SECONDS
    partial: Optional[SearchEnded] = None
    granted = 0
    _last = 0.0  # when it has made progress, on the clock of the work

    def __init__(self, search: LayeredSearch, wanted: WantedLayers) -> None:
        super().__init__(search, wanted, first=1, wishes=1)

    @staticmethod
    def _interleaving() -> Interleaving:
        return Interleaving(0, _MOST_LAYERS, width=6, growth=1.15, seconds=0.05, share=0.85)

    def is_over(self, begin: float) -> bool:
        """Returns whether the search has used up its time, so that its best plan is taken."""
        if self.partial is None:
            return self._now > begin + _MOST_SECONDS
        return self._now > self._last + max(self._last - begin, _MORE_SECONDS)

    def is_late(self, begin: float, seconds: float) -> bool:
        """Returns whether the search stalls: it has granted no other wish for some seconds."""
        return self._now > max(self._last, begin) + seconds

    def go_on(self, found: SearchEnded) -> Optional[SearchEnded]:
        """Extends a plan for some wishes; returns it if it grants all."""
        return self._take(found)

    @property
    def _now(self) -> float:
        return self._search.solver.seconds

    def _take(self, found: SearchEnded) -> Optional[SearchEnded]:
        granted = sum(n == str(found.horizon) for _, n, _ in _terms(found.symbols, _GRANTED, 3))
        if granted >= self._wanted.wishes:
            return found
        if any(symbol.startswith(_ATTAINED) for symbol in found.symbols):
            self.partial, self.granted, self._last = found, granted, self._now
        plan = Neighbourhood.of(found.symbols)
        self.assumed = () if plan is None else plan.assumptions(frozenset())
        self._wishes = granted + 1
        self._begin(found.horizon)
        return None


def _terms(symbols: Sequence[str], name: str, count: int) -> Iterator[List[str]]:
    """Yields the arguments of an answer set's terms with a given name and arity."""
    for text in symbols:
        if text.startswith(name):
            arguments = split_term(text)[1]
            if len(arguments) == count:
                yield arguments


def _numbers(symbols: Sequence[str], name: str, count: int) -> Iterator[List[int]]:
    """Yields the arguments of such terms as integers, if all of them are."""
    for arguments in _terms(symbols, name, count):
        numbers = [number(argument) for argument in arguments]
        if None not in numbers:
            yield [n for n in numbers if n is not None]
