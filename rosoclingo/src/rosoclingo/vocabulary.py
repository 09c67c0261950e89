"""Which events the planner's encoding declares, and why it does not declare others."""

from __future__ import annotations

from typing import Iterable, List, Sequence, Set, Tuple

from clingo import SymbolType

from rosclingo.errors import shorten
from rosclingo.terms import parse_term

ANY_EVENT = "_,_"
"""Stands for the source and content of any event, of a source that declares none of its own."""

_ORDINALS = ("first", "second", "third", "fourth", "fifth")


class Vocabulary:
    """The events that the planner's encoding declares, whatever the step."""

    def __init__(self) -> None:
        self._pairs: Set[str] = set()
        self._grounded = 0

    def learn(self, externals: Iterable[str], grounded: int) -> None:
        """Adds the events among the planner's externals.

        Args:
            externals: All externals, as clingo prints them.
            grounded: How many steps are grounded.
        """
        for atom in externals:
            if atom.startswith("event("):
                self._pairs.add(atom[len("event(") : atom.rindex(",")])
        self._grounded = grounded

    def knows(self, pairs: Sequence[Tuple[str, str]], grounded: int) -> bool:
        """Whether there is one of these events; none is missed before a step after step 0."""
        return grounded <= 1 or any(self.has(*pair) for pair in pairs)

    def is_sure(self, pairs: Sequence[Tuple[str, str]], grounded: int) -> bool:
        """Whether it has seen all steps, if so many are grounded."""
        return self._grounded == grounded

    def has(self, source: str, content: str) -> bool:
        """Whether there is such an event in a step that was grounded when it last learned."""
        return f"{source},{content}" in self._pairs or (
            ANY_EVENT in self._pairs and not self._of(f"{source},")
        )

    def explain(self, source: str, content: str) -> str:
        """Says why there is no such event, by comparing it with those that there are."""
        symbol = parse_term(content)
        prefix = f"{source},{symbol.name}(" if symbol.type is SymbolType.Function else ""
        arity = len(symbol.arguments) if prefix else 0
        alike = [
            other
            for other in (parse_term(p[len(source) + 1 :]) for p in self._of(prefix) if arity)
            if other.match(symbol.name, arity)
        ]
        if not alike:
            known = next((p[len(source) + 1 :] for p in self._of(f"{source},") if "(" in p), "")
            example = f"; one that it knows is {shorten(known)}" if known else ""
            return f"there is no request like {shorten(content)}{example}"
        for number, argument in enumerate(symbol.arguments):
            if all(other.arguments[number] != argument for other in alike):
                place = _ORDINALS[number] if number < len(_ORDINALS) else f"{number + 1}th"
                return (
                    f"{shorten(str(argument))} is unknown as the {place} argument of "
                    f"{symbol.name}; a request that it knows is {shorten(str(alike[0]))}"
                )
        together = shorten(" and ".join(map(str, symbol.arguments)))
        return f"{together} do not go together in {symbol.name}"

    def _of(self, prefix: str) -> List[str]:
        return sorted(pair for pair in self._pairs if pair.startswith(prefix)) if prefix else []
