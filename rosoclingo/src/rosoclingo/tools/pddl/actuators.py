"""Finds the actuator of each action, of which PDDL says nothing."""

from __future__ import annotations

from typing import List, Sequence, Set

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.domain import Domain, Problem
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.names import Identifiers


class Actuators:
    """Finds an actuator among the objects of an action.

    Attributes:
        names: The terms of all actuators that were found.
    """

    def __init__(
        self,
        domain: Domain,
        problem: Problem,
        names: Identifiers,
        kinds: Sequence[str],
        default: str,
    ) -> None:
        """Finds the actuators of a problem.

        Args:
            domain: The domain.
            problem: The problem.
            names: Has terms for all names.
            kinds: Types whose objects are actuators, or predicates that hold for them at first.
            default: The term of the actuator that does all other actions.

        Raises:
            PddlError: There is no object of some kind, or a number for one.
        """
        self.names: List[str] = []
        self._terms = names
        self._default = default
        self._objects: Set[str] = set()
        objects = {**domain.constants, **problem.objects}
        for kind in kinds:
            found = {each for each, its in objects.items() if domain.is_kind_of(its, kind.lower())}
            found |= {
                atom.parts[1].text
                for atom in problem.init
                if atom.head == kind.lower() and len(atom.parts) == 2
            }
            if not found:
                types = sorted({*objects.values()} - {"object"})
                known = f"; there are the types {', '.join(types)}" if types else ""
                raise PddlError(
                    f"--actuators {shorten(kind)}: no object is of this type, and for none "
                    f"does a predicate of this name hold{known}"
                )
            self._objects |= found
        for each in sorted(self._objects):
            if each.isdigit():
                raise PddlError(f"--actuators: {each} cannot be an actuator, as slots for requests "
                                "are numbers: give it a name")  # fmt: skip

    def of(self, objects: Sequence[str]) -> str:
        """Returns the actuator of an action with these objects: the first actuator among them."""
        own = next((each for each in objects if each in self._objects), None)
        term = self._default if own is None else self._terms.term(own)
        if term not in self.names:
            self.names.append(term)
        return term
