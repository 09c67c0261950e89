"""Grounding on demand: events that are told by grounding, and parts that an encoding requests.

An encoding opts in by the parts that it has: ``event(s,c)`` and ``event(s,c,t)`` for told events,
``search(k,t)``, grounded before a search, and with it ``improve(k,t)`` if the search is
for a better plan, ``prefer(k,t)`` if it is to begin with the rest of the plan before,
``at_once(k,t)`` if its plan is to go out at once, or ``relax(k,t)`` if one with fewer choices has
found no plan. Then it may request parts: by externals ``ground(P)``, by terms ``ground(P)`` and
``ground_last(P)`` in its answer sets.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from itertools import chain
from typing import Deque, Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.commands import AssignExternal, Command, Ground, Part, Programs, Truth
from rosclingo.wire.term_text import number, split_term
from rosoclingo.errors import PlannerError
from rosoclingo.loop.planner.neighbourhoods import shown_choices
from rosoclingo.loop.planner.task_search import LIBRARY_PARTS, TASK
from rosoclingo.loop.values.atoms import EVENT

Pair = Tuple[str, str]
"""Source and content of an event."""

TOLD = "event/2"
"""The signature of the externals that say which pairs are known."""

_EVENT, _TOLD, _SEARCH = ("event", 2), ("event", 3), ("search", 2)
_IMPROVE, _PREFER, _RELAX = ("improve", 2), ("prefer", 2), ("relax", 2)
_AT_ONCE = ("at_once", 2)
_LAYER, _GOAL = ("layer", 2), ("goal", 2)
_RESERVED = (
    "event", "search", "improve", "prefer", "at_once", "relax", "facts", "state", "transition",
    "query",
)  # fmt: skip
_ASKS, _ASKS_LAST = "ground(", "ground_last("
_HORIZON = "horizon("
_MOST_RELAXED = 2  # times that one search is repeated with more choices
_MOST_UNKNOWN = 10_000  # pairs that the encoding does not know, and of which that is remembered


@dataclass
class Demand:
    """State of grounding on demand for one encoding. All of it is saved; one thread uses it.

    Attributes:
        tells: Whether the encoding is told its events by grounding.
        declared: Whether it knows a pair, for each that it was asked about.
        requests: Requests that it has declared as examples, each with its slot; sorted.
        messages: Messages that it has declared as examples, to compare unknown ones with.
        improves: Whether a better plan can be looked for while the one that was found is executed.
        prefers: Whether a search can begin with the rest of the plan before.
        hastens: Whether a search can construct a plan at once, which is improved later.
        relaxes: Whether a search that has found no plan can be repeated with more choices.
        has_layers: Whether plans have layers, see :mod:`rosoclingo.loop.planner.layers`.
        has_tasks: Whether it shows their task, see :mod:`rosoclingo.loop.planner.task_search`.
        is_constrained: Whether it adds to what the library plans with, so that only clingo knows
            all of the task.
    """

    tells: bool = False
    declared: Dict[Pair, bool] = field(default_factory=dict)
    requests: List[Pair] = field(default_factory=list)
    messages: List[Pair] = field(default_factory=list)
    improves: bool = False
    prefers: bool = False
    hastens: bool = False
    relaxes: bool = False
    has_layers: bool = False
    has_tasks: bool = False
    is_constrained: bool = False
    _searches: bool = False  # whether it has the part for that
    _unknown: Deque[Pair] = field(default_factory=deque)  # in the order in which they were asked
    _pending: List[Part] = field(default_factory=list)  # told, and not grounded yet
    _steps: List[int] = field(default_factory=list)  # of the current plan, not grounded yet
    _queries: Dict[str, Truth] = field(default_factory=dict)  # the horizon, not set yet
    _grounded: Set[str] = field(default_factory=set)  # the parts that answer sets have requested
    _count: int = 0  # searches
    _has_news: bool = True  # since the last search
    _relaxed: int = 0  # searches in a row that had more choices than the one before

    def __bool__(self) -> bool:
        """Returns whether the encoding has opted in."""
        return self.tells or self._searches

    @property
    def searches(self) -> int:
        """Number of searches with news since the planner began."""
        return self._count

    @property
    def may_relax(self) -> bool:
        """True if the last search can be repeated with more choices."""
        return self.relaxes and self._count > 0 and self._relaxed < _MOST_RELAXED

    def begin(self, programs: Programs) -> None:
        """Resets for a planner that begins again, and reads from its parts what it opts into.

        Raises:
            PlannerError: One of the two parts for told events is missing.
        """
        parts = programs.parts
        has_event, has_told = _EVENT in parts, _TOLD in parts
        if has_event != has_told:
            has, lacks = ("s,c", "s,c,t") if has_event else ("s,c,t", "s,c")
            raise PlannerError(
                f"the planner's encoding has the part event({has}) and lacks event({lacks}): an "
                "encoding that is told its events by grounding has both"
            )
        self.tells, self._searches = has_told, _SEARCH in parts
        self.improves = self._searches and _IMPROVE in parts
        self.prefers = self.improves and _PREFER in parts
        self.hastens = self.improves and _AT_ONCE in parts
        self.relaxes = self._searches and _RELAX in parts
        self.has_layers = self._searches and _LAYER in parts and _GOAL in parts
        self.has_tasks = self.has_layers and TASK in parts
        self.is_constrained = not programs.extended.isdisjoint(LIBRARY_PARTS)
        self._pending.clear()
        self._steps.clear()
        self._queries.clear()
        self._grounded.clear()
        self._count = 0
        self._has_news = True
        self._relaxed = 0

    def ground(self, parts: Sequence[Part]) -> Ground:
        """Returns the command that grounds parts, and all parts that these request."""
        return Ground(tuple(parts), asking=True, reserved=_RESERVED)

    def learn_examples(self, externals: Iterable[str], slots: Sequence[str]) -> None:
        """Looks for examples of requests and messages among the externals of a fresh solver.

        Args:
            externals: The externals, as clingo prints them.
            slots: The ids that its encoding has for goals.
        """
        if not self.tells:
            return
        events = (split_term(atom)[1] for atom in externals if atom.startswith(EVENT))
        pairs = [(event[0], event[1]) for event in events if len(event) == _EVENT[1]]
        self.requests = sorted(pair for pair in pairs if pair[0] in slots)
        self.messages = sorted(pair for pair in pairs if pair[0] not in slots)

    # What it is told.

    def note_news(self) -> None:
        """Marks that there is news since the last search."""
        self._has_news = True

    def tell(self, atoms: Sequence[str]) -> None:
        """Queues events, which are told before the next command is run."""
        for atom in atoms:
            self._pending.append(Part("event", tuple(split_term(atom)[1])))
            self._has_news = True

    def set_query(self, query: str, value: Truth) -> None:
        """Queues the value of an external ``query(T)``, set before the next command is run."""
        self._queries[query] = value

    def add_steps(self, steps: Iterable[int]) -> None:
        """Queues steps, which are grounded before the next command is run."""
        self._steps += steps

    def take_pending(self) -> List[Command]:
        """Empties the queue, and returns the commands that ground and tell it."""
        pending, self._pending = self._pending, []
        steps, self._steps = self._steps, []
        queries, self._queries = self._queries, {}
        commands: List[Command] = []
        if steps:
            commands.append(self.ground([part for step in steps for part in step_parts(step)]))
        commands += [AssignExternal(*query) for query in queries.items()]
        if pending:
            commands.append(self.ground(pending))
        return commands

    def questions(self, pairs: Sequence[Pair]) -> List[Pair]:
        """Returns the pairs about which the encoding has to be asked."""
        new = [pair for pair in dict.fromkeys(pairs) if pair not in self.declared]
        examples = (self.requests, self.messages)
        known = [pair for pair in new if any(_contains(some, pair) for some in examples)]
        self.declared.update((pair, True) for pair in known)
        return [pair for pair in new if pair not in self.declared]

    def ask(self, pairs: Sequence[Pair]) -> List[Command]:
        """Returns the commands that fail at the first undeclared pair.

        The first one grounds; the others are one for each pair.
        """
        return [
            Ground(tuple(Part("event", pair) for pair in pairs)),
            *(AssignExternal(f"{EVENT}{source},{value})", Truth.FALSE) for source, value in pairs),
        ]

    def learn(self, pair: Pair, known: bool) -> None:
        """Caches whether the encoding declares a pair; the oldest unknown ones are evicted."""
        self.declared[pair] = known
        if not known:
            self._unknown.append(pair)
            if len(self._unknown) > _MOST_UNKNOWN:
                del self.declared[self._unknown.popleft()]

    # Its requests for parts.

    def prepare(self, step: int, *, prefers: bool = False, hastens: bool = False) -> List[Command]:
        """Returns the commands to be run before a search: one, or none.

        Args:
            step: The current step.
            prefers: Whether it is to begin with the rest of the plan before.
            hastens: Whether its plan is to go out at once, and improved later.
        """
        if not (self._searches and self._has_news):
            return []
        names = [name for name, has in (("prefer", prefers), ("at_once", hastens)) if has]
        return [self.begin_search(step, "search", *names)]

    def begin_search(self, step: int, *names: str) -> Command:
        """Returns the command to be run before a search, with news or without.

        Args:
            step: The current step.
            names: The parts to be grounded, such as ``search`` with ``improve`` or ``relax``.
        """
        self._count += 1
        self._has_news = False
        self._relaxed = self._relaxed + 1 if "relax" in names else 0
        arguments = (str(self._count), str(step))
        return self.ground([Part(name, arguments) for name in names])

    def asks(self, symbols: Sequence[str], *, completes: bool = True) -> bool:
        """Returns whether an answer set requests a part that is still to be grounded.

        Args:
            symbols: The answer set.
            completes: Whether parts count, too, that only complete its plan.
        """
        shown = (text for text, _ in shown_choices(symbols))
        return any(text not in self._grounded for text in chain(_asking(symbols, completes), shown))

    def can_wait(self, symbols: Sequence[str]) -> bool:
        """Returns whether an answer set leaves parts of its plan to a later search."""
        return any(text.startswith(_ASKS_LAST) for text in symbols)

    def asked_for(self, symbols: Sequence[str], *, completes: bool = True) -> List[Part]:
        """Returns the parts that an answer set requests and that are not grounded yet.

        Args:
            symbols: The answer set.
            completes: Whether also those that complete its plan, by ``ground_last(P)``.

        Raises:
            PlannerError: It requests something that is no part or is reserved.
        """
        asking = ((text, split_term(text)[1]) for text in _asking(symbols, completes))
        asked = [(text, arguments[0]) for text, arguments in asking if len(arguments) == 1]
        asked += [(text, text) for text, _ in shown_choices(symbols)]
        parts = []
        for text, part in asked:
            if text in self._grounded:
                continue
            name, arguments = split_term(part)
            if not name or name == "base" or name in _RESERVED or name.startswith("-"):
                raise PlannerError(
                    f"the planner's answer set asks for {shorten(part)} by {shorten(text)}, "
                    "which cannot be asked for"
                )
            self._grounded.add(text)
            parts.append(Part(name, tuple(arguments)))
        return parts


def _asking(symbols: Sequence[str], completes: bool) -> Iterator[str]:
    asks = (_ASKS, _ASKS_LAST) if completes else (_ASKS,)
    return (text for text in symbols if text.startswith(asks))


def _contains(pairs: Sequence[Pair], pair: Pair) -> bool:
    """Returns whether a sorted sequence contains a pair, by bisection."""
    index = bisect_left(pairs, pair)
    return index < len(pairs) and pairs[index] == pair


def step_parts(step: int) -> List[Part]:
    """Returns the parts of a step; step 0 has no transition."""
    return [Part(name, (str(step),)) for name in ("state", "transition", "query")]


def needed_horizon(symbols: Sequence[str]) -> Optional[int]:
    """Returns the N of ``horizon(N)`` in an answer set, which is a plan for horizons from N on."""
    needed = None
    for text in symbols:
        if text.startswith(_HORIZON):
            horizon = number(text[len(_HORIZON) : -1])
            if horizon is not None:
                needed = max(horizon, needed or 0)
    return needed
