"""The events that the planner's encoding declares, and explanations of undeclared ones.

>>> explain("brign(o9)", ["bring(o1)", "bring(o9)"])
'there is no request like brign(o9); one that it knows is bring(o1); did you mean bring(o9)?'
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from itertools import combinations
from typing import ClassVar, Collection, Dict, Iterable, List, Optional, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.planner.demand import Demand, Pair
from rosoclingo.loop.values.atoms import EVENT
from rosoclingo.loop.words import BUSY, INTERRUPTED, PASSED

KnownMessages = Dict[str, Set[str]]
"""The values of messages that are known, for each id."""

ANY_EVENT = "_,_"
"""Stands for the source and content of any event, of a source that declares none of its own."""

_LONGEST = 200  # characters of a request for which it is looked what was meant
_MOST_ALIKE = 1000  # requests, or arguments at a place, with which it is compared

_OWN = frozenset(("_", PASSED, INTERRUPTED, BUSY))  # never messages, or rosoclingo's own

_ORDINALS = ("first", "second", "third", "fourth", "fifth")


@dataclass
class Vocabulary:
    """The events that the planner's encoding declares, in any step; all of it is saved.

    Attributes:
        ONLY_GROWS: That nothing is removed from its sets, so that one that is as long is the same.
    """

    ONLY_GROWS: ClassVar[bool] = True

    _pairs: Set[str] = field(default_factory=set)
    _grounded: int = 0  # how many steps were grounded when they were seen

    def __post_init__(self) -> None:
        self._messages: KnownMessages = {}  # that it has seen
        self._sorted = 0  # how many pairs there were when these were looked for

    def learn(self, externals: Iterable[str], grounded: int) -> None:
        """Adds the events among the planner's externals.

        Args:
            externals: All externals, as clingo prints them.
            grounded: How many steps are grounded.
        """
        for atom in externals:
            if atom.startswith(EVENT):  # there may be a million, too many for split_term
                self._pairs.add(atom[len(EVENT) : atom.rindex(",")])
        self._grounded = grounded

    def knows(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Returns whether one of these events is declared; true before step 1 is grounded."""
        return grounded <= 1 or any(self.has(*pair) for pair in pairs)

    def is_sure(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Returns whether it has learned all grounded steps."""
        return self._grounded == grounded

    def has(self, source: str, content: str) -> bool:
        """Returns whether such an event is declared in a learned step."""
        return f"{source},{content}" in self._pairs or (
            ANY_EVENT in self._pairs and not self._of(f"{source},")
        )

    def declares(self, pair: Pair) -> Optional[bool]:
        """Returns whether just this event is declared; None before step 1 is learned."""
        is_there = ",".join(pair) in self._pairs
        return is_there if is_there or self._grounded > 1 else None

    def explain(self, source: str, content: str) -> str:
        """Explains why an event is undeclared, by comparing it with declared ones."""
        return explain(content, [pair[len(source) + 1 :] for pair in self._of(f"{source},")])

    def suggest(self, source: str, content: str, others: Collection[str]) -> str:
        """Returns "did you mean" with a known message that is like an unknown one; else empty.

        Args:
            source: The id of a message that there is not.
            content: Its value.
            others: The sources of events that are no messages.
        """
        if self._sorted != len(self._pairs):
            self._messages = _messages(map(_split, self._pairs), others)
            self._sorted = len(self._pairs)
        return suggest(source, content, self._messages)

    def _of(self, prefix: str) -> List[str]:
        return sorted(pair for pair in self._pairs if pair.startswith(prefix)) if prefix else []


class ToldVocabulary:
    """Cache of declared events, for an encoding that is told its events by grounding.

    Its examples spare it questions: a request is unknown which has an argument that no example of
    its form has at this place. The constant ``any`` in an example stands for every term.
    """

    def __init__(self, demand: Demand, slots: Iterable[str]) -> None:
        self._demand = demand
        self._slots = frozenset(slots)  # the only sources of requests
        self._arguments: Dict[Tuple[str, int], List[Set[str]]] = {}  # of the examples of each form
        for _, example in demand.requests:
            name, arguments = split_term(example)
            places = self._arguments.setdefault((name, len(arguments)), [set() for _ in arguments])
            for known, argument in zip(places, arguments):
                known.add(argument)

    def knows(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Returns whether the encoding declares one of the pairs."""
        return any(self._demand.declared.get(pair, False) for pair in pairs)

    def is_sure(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Returns whether the encoding was asked about all pairs that examples do not exclude."""
        return all(pair in self._demand.declared or self._is_foreign(pair) for pair in pairs)

    def _is_foreign(self, pair: Pair) -> bool:
        """Returns whether the examples exclude a request."""
        source, content = pair
        if not self._arguments or source not in self._slots:
            return False
        name, arguments = split_term(content)
        places = self._arguments.get((name, len(arguments)))
        return places is None or any(
            not _is_one_of(argument, known) for known, argument in zip(places, arguments)
        )

    def declares(self, pair: Pair) -> Optional[bool]:
        """Returns whether the encoding declares just this event; None if it was not asked."""
        return self._demand.declared.get(pair)

    def learn(self, externals: object, grounded: int) -> None:
        """Learns nothing: the encoding is asked about each pair."""

    def explain(self, source: str, content: str) -> str:
        """Explains why an event is undeclared, by comparing it with declared ones."""
        examples = sorted({example for _, example in self._demand.requests})
        if examples:
            return explain(content, examples, are_examples=True)
        declared = self._demand.declared.items()
        others = [c for (s, c), known in declared if known and s == source]
        if others:
            return no_request_like(content, others)
        return f"the encoding declares no request {shorten(content)}"

    def suggest(self, source: str, content: str, others: Collection[str]) -> str:
        """Suggests a message as :meth:`Vocabulary.suggest`, from examples and earlier questions."""
        asked = [pair for pair, known in self._demand.declared.items() if known]
        return suggest(source, content, _messages([*self._demand.messages, *asked], others))


def _is_one_of(term: str, known: Collection[str]) -> bool:
    return term in known or any(_fits(term, example) for example in known if "any" in example)


def _fits(term: str, example: str) -> bool:
    """Returns whether a term matches an example, in which ``any`` stands for every term."""
    if example in (term, "any"):
        return True
    (name, arguments), (same, others) = split_term(term), split_term(example)
    return (
        bool(arguments)
        and (name, len(arguments)) == (same, len(others))
        and all(map(_fits, arguments, others))
    )


def explain(request: str, known: Sequence[str], *, are_examples: bool = False) -> str:
    """Explains why a request is unknown, by comparing it with known ones, with a suggestion.

    Args:
        request: The request, as clingo prints it.
        known: The known ones with their sources, and what else is known.
        are_examples: Whether others are known that have the same arguments at the same places.
    """
    meant = _meant(request, known, are_examples)
    return _reason(request, known) + (f"; did you mean {meant}?" if meant else "")


def _reason(request: str, known: Sequence[str]) -> str:
    name, arguments = split_term(request)
    alike = [
        (other, split_term(other)[1])
        for other in known
        if name and arguments and other.startswith(f"{name}(")
    ]
    alike = [(other, others) for other, others in alike if len(others) == len(arguments)]
    if not alike:
        return no_request_like(request, known)
    for place, argument in enumerate(arguments):
        if not _is_one_of(argument, [others[place] for _, others in alike]):
            ordinal = _ORDINALS[place] if place < len(_ORDINALS) else f"{place + 1}th"
            return (
                f"{shorten(argument)} is unknown as the {ordinal} argument of {name}; a request "
                f"that it knows is {shorten(alike[0][0])}"
            )
    return f"{shorten(' and '.join(arguments))} do not go together in {name}"


def no_request_like(request: str, known: Sequence[str]) -> str:
    """Returns that a request is unknown, and names a known one."""
    example = next((other for other in known if "(" in other), "")
    example = f"; one that it knows is {shorten(example)}" if example else ""
    return f"there is no request like {shorten(request)}{example}"


def suggest(source: str, content: str, known: KnownMessages) -> str:
    """Returns "did you mean" with a known message that is like an unknown one; else empty.

    >>> suggest("info", "opne(3)", {"info": {"open(3)", "open(4)"}, "robot": {"success"}})
    '; did you mean open(3)?'
    >>> suggest("inof", "open(3)", {"info": {"open(3)", "open(4)"}, "robot": {"success"}})
    '; did you mean id info, value open(3)?'
    """
    if content in known.get(source, ()):
        return ""
    meant = _meant(content, sorted(known.get(source, ())), False)
    if meant:
        return f"; did you mean {shorten(meant)}?"
    sources = sorted(other for other, contents in known.items() if content in contents)
    source = _closest(source, sources or known) or next(iter(sources), "")
    if not source:
        return ""
    meant = content if sources else _meant(content, sorted(known[source]), False)
    return f"; did you mean id {shorten(source)}, value {shorten(meant)}?" if meant else ""


def _messages(pairs: Iterable[Tuple[str, str]], others: Collection[str]) -> KnownMessages:
    messages: KnownMessages = {}
    for source, content in pairs:
        if source not in others and content not in _OWN:
            messages.setdefault(source, set()).add(content)
    return messages


def _split(pair: str) -> Tuple[str, str]:
    """Returns source and content of an event."""
    source, _, content = pair.partition(",")
    if "(" in source or '"' in source:
        source, content = split_term(f"{EVENT}{pair})")[1]
    return source, content


def _meant(request: str, known: Sequence[str], are_examples: bool) -> str:
    """Returns the known request that is most like another one; nothing if none is like it."""
    name, arguments = split_term(request)
    if len(request) > _LONGEST or not name:
        return ""
    name = _closest(name, {other.partition("(")[0] for other in known if other != "cancel"})
    alike = [other for other in known if other == name or other.startswith(f"{name}(")]
    same = [others for others in (split_term(o)[1] for o in alike) if len(others) == len(arguments)]
    if same:
        filled = _fill(arguments, same, are_examples)
        if not all(filled):
            return ""
        meant = f"{name}({','.join(filled)})" if filled else name
        if meant != request and (
            meant in alike or (are_examples and _is_shaped(filled, {_shape(o) for o in same}))
        ):
            return meant
    return next(iter(difflib.get_close_matches(request, alike[:_MOST_ALIKE], 1)), "")


def _fill(arguments: List[str], rows: List[List[str]], are_examples: bool) -> List[str]:
    """Replaces each unknown argument by the closest known one; by an empty one if none is.

    Args:
        arguments: The arguments of a request.
        rows: Those of known requests of its form.
        are_examples: Whether there are others, with the same arguments at the same places.
    """
    filled = list(arguments)
    columns = [set(column) for column in zip(*rows)]
    unknown = [p for p, known in enumerate(columns) if not _is_one_of(filled[p], known)]
    if not are_examples:
        rows = [
            row
            for row in rows
            if all(p in unknown or row[p] == word for p, word in enumerate(filled))
        ]
    shapes = {_shape(row) for row in rows}
    for place in unknown:
        fitting = {
            other
            for other in {row[place] for row in rows}
            if _is_shaped([*filled[:place], other, *filled[place + 1 :]], shapes)
        }
        word = filled[place]
        filled[place] = _closest(word, fitting) or _closest(word, columns[place])
        if not are_examples:
            rows = [row for row in rows if row[place] == filled[place]]
    return filled


def _shape(arguments: Sequence[str]) -> Tuple[int, ...]:
    """Returns for each argument the first place of an equal one; -1 if it stands for others."""
    return tuple(-1 if "any" in word else arguments.index(word) for word in arguments)


def _is_shaped(arguments: Sequence[str], shapes: Iterable[Tuple[int, ...]]) -> bool:
    """Returns whether the same arguments are equal to each other as in a known request."""
    return any(
        all(
            (one == other) == (first == second)
            for (one, first), (other, second) in combinations(zip(arguments, shape), 2)
            if -1 not in (first, second)
        )
        for shape in shapes
    )


def _closest(word: str, known: Collection[str]) -> str:
    """Returns the known word that is most like another one; of numbers, the next one."""
    value = number(word)
    if _is_one_of(word, known):
        return word
    if value is None:
        return next(iter(difflib.get_close_matches(word, sorted(known)[:_MOST_ALIKE], 1)), "")
    numbers = [other for other in map(number, known) if other is not None]
    return str(min(numbers, key=lambda other: (abs(other - value), other))) if numbers else ""
