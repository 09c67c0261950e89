"""Makes clingo's solvers, and collects their messages."""

from __future__ import annotations

from typing import Any, Iterator, List, Optional, Sequence, cast

import clingo
import clingo.core
from clingo import _internal
from clingo.symbolic_atoms import SymbolicAtom, SymbolicAtoms

from rosclingo.errors import OptionsError


def _lenient(c_str: object) -> str:
    ffi = _internal._ffi  # type: ignore[attr-defined]  # clingo has no public way to it
    return ffi.string(c_str).decode("utf-8", "backslashreplace")


# clingo quotes single bytes of a character outside of ASCII. Its Python module fails to decode
# such a message inside of a callback that must not fail, which ends the process.
clingo.core._to_str = _lenient  # type: ignore[attr-defined]


def new_control(
    options: Sequence[str], messages: Messages, *, has_heuristics: bool = False
) -> clingo.Control:
    """Makes a solver.

    Args:
        options: Those of the command line.
        messages: Collects clingo's messages.
        has_heuristics: Whether its program has ``#heuristic`` statements, as encodings for planning
            have. Those have many small cardinality constraints, and rewriting these takes longer
            than it saves, so it is off unless the command line says something else.

    Raises:
        OptionsError: clingo refuses an option.
    """
    says_more = any(option.startswith(("--trans-ext", "--config")) for option in options)
    added = [] if says_more or not has_heuristics else ["--trans-ext=no"]
    try:
        return clingo.Control([*options, *added], logger=messages)
    except RuntimeError as err:
        detail = messages.text() or str(err)
        raise OptionsError(f"clingo refuses the options {' '.join(options)}: {detail}") from err


def use_heuristics(control: clingo.Control, options: Sequence[str]) -> None:
    """Makes a solver use the ``#heuristic`` statements of its program.

    clingo ignores them otherwise.

    Args:
        control: The solver.
        options: Those that it was made with; if they name a heuristic, that one stays.
    """
    if not any(option.startswith("--heu") for option in options):
        cast(Any, control.configuration.solver).heuristic = "Domain"


class Messages:
    """Collects clingo's messages; an instance serves as its logger.

    Nothing may be raised from here: it would end the process.
    """

    def __init__(self) -> None:
        self._messages: List[str] = []

    def __call__(self, code: clingo.MessageCode, message: str) -> None:
        """Collects a message."""
        self._messages.append(message.strip())

    def text(self) -> str:
        """Returns the messages collected so far and forgets them."""
        text = "\n".join(self._messages)
        self._messages.clear()
        return text


def atoms_after(
    last: Optional[SymbolicAtom], atoms: SymbolicAtoms, name: str, arity: int
) -> Iterator[SymbolicAtom]:
    """Returns the atoms of a signature in the order in which they came.

    clingo's Python module always begins with the first one, which takes the longer the more there
    are.

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
