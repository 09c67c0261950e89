"""Counts a planner's atoms and ground instances, by grounding once more with markers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Iterable, List, Mapping, Optional, Sequence, Tuple

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Program
from rosclingo.wire import commands as wire
from rosoclingo.tools.profile.marking import MARKER, PredicateSignature, Statement, mark


@dataclass(frozen=True)
class Counts:
    """The numbers of atoms and ground instances of a run.

    What was grounded again, such as after a reset, counts again.

    Attributes:
        atoms: Each predicate with the number of its atoms.
        instances: Each statement with the number of its ground instances.
    """

    atoms: Mapping[PredicateSignature, int]
    instances: Sequence[Tuple[Statement, int]]


class _CountingEngine(Engine):
    """A solver that counts the atoms that come. It does not search."""

    def __init__(self, options: Options) -> None:
        self.statements: List[Statement] = []
        self._counted: Counter[PredicateSignature] = Counter()  # before the last restart or cleanup
        self._kept: Counter[PredicateSignature] = Counter()  # of these, what is still there
        super().__init__(options, rewrite=self._mark)

    def _mark(self, program: Program) -> Program:
        marked, self.statements = mark(program)
        return marked

    def apply(self, command: wire.Command) -> Optional[wire.Answer]:
        if not isinstance(command, (wire.Restart, wire.CleanupDomains)):
            return super().apply(command)
        self._counted = self.count()
        answer = super().apply(command)
        self._kept = self._atoms()
        return answer

    def count(self) -> Counter[PredicateSignature]:
        """Returns how many atoms of each predicate have come."""
        counted = self._counted + self._atoms()
        counted.subtract(self._kept)
        return counted

    def _atoms(self) -> Counter[PredicateSignature]:
        atoms = self._control.symbolic_atoms
        return Counter({
            (name if positive else f"-{name}", arity): sum(
                1 for _ in atoms.by_signature(name, arity, positive)
            )
            for name, arity, positive in atoms.signatures
        })  # fmt: skip


def count(options: Options, commands: Iterable[wire.Command]) -> Counts:
    """Repeats what a planner's solver has grounded, and counts it.

    Args:
        options: The solver's command line.
        commands: The commands on which it depends what is grounded.
    """
    engine = _CountingEngine(options)
    for command in commands:
        engine.apply(command)
    found = engine.count()
    return Counts(
        {key: number for key, number in found.items() if not key[0].startswith(MARKER)},
        [(one, sum(found[marker] for marker in one.markers)) for one in engine.statements],
    )
