"""Which events the planner's encoding declares, and why it does not declare others."""

from __future__ import annotations

from typing import Iterable, List, Sequence, Set, Tuple

from rosclingo.errors import shorten
from rosclingo.solver.terms import split_term

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
        return explain(content, [pair[len(source) + 1 :] for pair in self._of(f"{source},")])

    def _of(self, prefix: str) -> List[str]:
        return sorted(pair for pair in self._pairs if pair.startswith(prefix)) if prefix else []


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
