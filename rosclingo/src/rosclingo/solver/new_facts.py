"""Reads facts of a program as they are grounded, for the functions that its rules call."""

from __future__ import annotations

from typing import Callable, Dict, Iterator, List, Tuple

import clingo
from clingo.symbolic_atoms import SymbolicAtom, SymbolicAtoms

from rosclingo.errors import shorten
from rosclingo.solver.patches import atoms_after


def symbol_key(symbol: clingo.Symbol) -> int:
    """Returns the number by which clingo knows a symbol, which is quicker than to hash that."""
    key: int = symbol._rep
    return key


class NewFacts:
    """Reads each fact of a predicate once, in the order in which they came.

    One thread makes the calls.
    """

    def __init__(self, atoms: Callable[[], SymbolicAtoms]) -> None:
        """Has read nothing yet.

        Args:
            atoms: Returns the solver's atoms.
        """
        self._atoms = atoms
        self._last: Dict[Tuple[str, int], SymbolicAtom] = {}

    def forget(self) -> None:
        """Has all facts read anew: after a cleanup of the solver's atoms."""
        self._last.clear()

    def read(self, name: str, arity: int) -> Iterator[List[clingo.Symbol]]:
        """Yields the arguments of the facts that have come since the last time.

        Args:
            name: The predicate.
            arity: The number of its arguments.

        Raises:
            ValueError: An atom of the predicate is no fact.
        """
        signature = name, arity
        for atom in atoms_after(self._last.get(signature), self._atoms(), name, arity):
            self._last[signature] = atom
            if not atom.is_fact:
                raise ValueError(f"{shorten(str(atom.symbol))} is no fact")
            yield atom.symbol.arguments
