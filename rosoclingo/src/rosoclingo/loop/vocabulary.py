"""Which events the planner's encoding declares, and why it does not declare others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.demand import Demand, Pair

ANY_EVENT = "_,_"
"""Stands for the source and content of any event, of a source that declares none of its own."""

_ORDINALS = ("first", "second", "third", "fourth", "fifth")


@dataclass
class Vocabulary:
    """The events that the planner's encoding declares, whatever the step; all of it is saved."""

    _pairs: Set[str] = field(default_factory=set)
    _grounded: int = 0  # how many steps were grounded when they were seen

    def learn(self, externals: Iterable[str], grounded: int) -> None:
        """Adds the events among the planner's externals.

        Args:
            externals: All externals, as clingo prints them.
            grounded: How many steps are grounded.
        """
        for atom in externals:
            if atom.startswith("event("):  # there may be a million, too many for split_term
                self._pairs.add(atom[len("event(") : atom.rindex(",")])
        self._grounded = grounded

    def knows(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Whether there is one of these events; none is missed before a step after step 0."""
        return grounded <= 1 or any(self.has(*pair) for pair in pairs)

    def is_sure(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Whether it has seen all steps, if so many are grounded."""
        return self._grounded == grounded

    def has(self, source: str, content: str) -> bool:
        """Whether there is such an event in a step that was grounded when it last learned."""
        return f"{source},{content}" in self._pairs or (
            ANY_EVENT in self._pairs and not self._of(f"{source},")
        )

    def explain(self, source: str, content: str) -> str:
        """Says why there is no such event, by comparing it with those that there are."""
        return explain(content, [pair[len(source) + 1 :] for pair in self._of(f"{source},")])

    def _of(self, prefix: str) -> List[str]:
        return sorted(pair for pair in self._pairs if pair.startswith(prefix)) if prefix else []


class ToldVocabulary:
    """The events that an encoding knows which is told them, as far as it was asked.

    Its examples spare it questions: a request is unknown which has an argument that no example of
    its form has at this place.
    """

    def __init__(self, demand: Demand, slots: Iterable[str]) -> None:
        self._demand = demand
        self._slots = frozenset(slots)  # requests come from them, and from nobody else
        self._arguments: Dict[Tuple[str, int], List[Set[str]]] = {}  # of the examples of each form
        for example in demand.examples:
            name, arguments = split_term(example)
            places = self._arguments.setdefault((name, len(arguments)), [set() for _ in arguments])
            for known, argument in zip(places, arguments):
                known.add(argument)

    def knows(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Whether the encoding knows one of the pairs."""
        return any(self._demand.declared.get(pair, False) for pair in pairs)

    def is_sure(self, pairs: Sequence[Pair], grounded: int) -> bool:
        """Whether it was asked about all of the pairs, or need not be."""
        return all(pair in self._demand.declared or self._is_foreign(pair) for pair in pairs)

    def _is_foreign(self, pair: Pair) -> bool:
        """Whether the examples exclude a request."""
        source, content = pair
        if not self._arguments or source not in self._slots:
            return False
        name, arguments = split_term(content)
        places = self._arguments.get((name, len(arguments)))
        return places is None or any(
            argument not in known for known, argument in zip(places, arguments)
        )

    def learn(self, externals: object, grounded: int) -> None:
        """Learns nothing: the encoding is asked about each pair."""

    def explain(self, source: str, content: str) -> str:
        """Says why there is no such event."""
        if self._demand.examples:
            return explain(content, sorted(self._demand.examples))
        declared = self._demand.declared.items()
        return no_request_like(content, [c for (s, c), known in declared if known and s == source])


def explain(request: str, known: Sequence[str]) -> str:
    """Says why a request is unknown, by comparing it with known ones.

    Args:
        request: The request, as clingo prints it.
        known: The known ones likewise, and what else is known.
    """
    name, arguments = split_term(request)
    alike = [
        (other, split_term(other)[1])
        for other in known
        if name and arguments and other.startswith(f"{name}(")
    ]
    alike = [(other, others) for other, others in alike if len(others) == len(arguments)]
    if not alike:
        return no_request_like(request, known)
    for number, argument in enumerate(arguments):
        if all(others[number] != argument for _, others in alike):
            place = _ORDINALS[number] if number < len(_ORDINALS) else f"{number + 1}th"
            return (
                f"{shorten(argument)} is unknown as the {place} argument of {name}; a request that "
                f"it knows is {shorten(alike[0][0])}"
            )
    return f"{shorten(' and '.join(arguments))} do not go together in {name}"


def no_request_like(request: str, known: Sequence[str]) -> str:
    """Says that a request is unknown, and which one is not."""
    example = next((other for other in known if "(" in other), "")
    example = f"; one that it knows is {shorten(example)}" if example else ""
    return f"there is no request like {shorten(request)}{example}"
