"""Patches of clingo's Python module, each of which mends a fault that is there in 5.8.3.

rosclingo/test/unit/test_clingo_patches.py has a test of each patch that fails without it.
"""

from __future__ import annotations

from typing import Any, Iterator, Optional, cast

import clingo.core
from clingo import _internal
from clingo.symbolic_atoms import SymbolicAtom, SymbolicAtoms


def decode_all_messages() -> None:
    r"""Has loggers get messages that are no UTF-8, with bytes such as ``\xc3`` in them.

    clingo's parser quotes single bytes of a character outside of ASCII. ``clingo.core._to_str``
    raises ``UnicodeDecodeError`` then, inside of ``_pyclingo_logger_callback``, whose ``onerror``
    ends the process.
    """
    clingo.core._to_str = _to_str  # type: ignore[attr-defined]


def _to_str(c_str: object) -> str:
    ffi = _internal._ffi  # type: ignore[attr-defined]  # clingo has no public way to it
    return ffi.string(c_str).decode("utf-8", "backslashreplace")


def atoms_after(
    last: Optional[SymbolicAtom], atoms: SymbolicAtoms, name: str, arity: int
) -> Iterator[SymbolicAtom]:
    """Returns the atoms of a signature in the order in which they came.

    ``clingo.symbolic_atoms.SymbolicAtoms.by_signature`` can only begin with the first one. Whoever
    reads what is new would read them all each time, which takes 7 ms for 10,000 atoms.

    Args:
        last: The one to begin after, which a cleanup makes invalid; None for all of them.
        atoms: The solver's atoms.
        name: The predicate.
        arity: The number of its arguments.
    """
    if last is None:
        yield from atoms.by_signature(name, arity)
        return
    internal: Any = _internal
    library, call, make = internal._lib, internal._c_call, cast(Any, SymbolicAtom)
    atoms_rep, iterator = cast(Any, atoms)._rep, cast(Any, last)._it
    while True:
        iterator = call(
            "clingo_symbolic_atom_iterator_t",
            library.clingo_symbolic_atoms_next,
            atoms_rep,
            iterator,
        )
        if not call("bool", library.clingo_symbolic_atoms_is_valid, atoms_rep, iterator):
            return
        yield make(atoms_rep, iterator)
