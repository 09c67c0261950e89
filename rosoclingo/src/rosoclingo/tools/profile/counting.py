"""Counts a planner's ground instances, by grounding once more with markers."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Set, Tuple

import clingo
from clingo.symbolic_atoms import SymbolicAtom

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.patches import atoms_after
from rosclingo.solver.programs import Program
from rosclingo.wire import commands as wire
from rosoclingo.tools.profile.marking import MARKER, Marker, PredicateSignature, Statement, mark
from rosoclingo.tools.profile.measuring import Grounding, SolverTrace

Steps = Dict[Optional[int], int]
"""How many there are for each step; None for what belongs to no step."""

_MOST_LOOKED_AT = 30_000  # atoms of a marker


@dataclass(frozen=True)
class VariableValues:
    """The values of a variable.

    Attributes:
        number: How many there are.
        span: The least and the greatest one, if all are numbers.
    """

    number: int
    span: Optional[Tuple[int, int]] = None


@dataclass
class Counts:
    """The numbers of ground instances and atoms of a run.

    Attributes:
        statements: All statements, in the order of the files.
        instances: For each of these, its ground instances.
        atoms: For each predicate, its atoms.
        times: How often each step was grounded, as after resets.
    """

    statements: Sequence[Statement] = ()
    instances: List[Steps] = field(default_factory=list)
    atoms: Dict[PredicateSignature, Steps] = field(default_factory=dict)
    times: Steps = field(default_factory=dict)

    @property
    def total(self) -> int:
        """All ground instances."""
        return sum(total(one) for one in self.instances)

    @property
    def all_atoms(self) -> int:
        """All atoms."""
        return sum(total(one) for one in self.atoms.values())

    def in_step(self, steps: Steps) -> int:
        """Returns how many there are in the step, after step 0, that has the most."""
        return max((self.of_step(steps, step) for step in self._later(steps)), default=0)

    def busiest(self, steps: Steps) -> Optional[int]:
        """Returns that step."""
        later = self._later(steps)
        return max(later, key=lambda step: self.of_step(steps, step), default=None)

    def of_step(self, steps: Steps, step: Optional[int]) -> int:
        """Returns how many there are in a step; the mean, if it was grounded several times."""
        return round(steps.get(step, 0) / max(1, self.times.get(step, 1)))

    def _later(self, steps: Steps) -> List[int]:
        return sorted(step for step in steps if step)


def total(steps: Steps) -> int:
    """Returns how many there are in all."""
    return sum(steps.values())


class CountingEngine(Engine):
    """A solver that counts what it grounds. It does not search. One thread makes the calls."""

    def __init__(self, options: Options) -> None:
        """Loads the files, marked."""
        self._statements: List[Statement] = []
        super().__init__(options, rewrite=self._mark)
        self._last: Dict[PredicateSignature, SymbolicAtom] = {}
        self._steps: Dict[PredicateSignature, Steps] = {}
        self._times: Steps = {}
        # Before the first atom of a step.
        self._begins: Dict[Tuple[PredicateSignature, Optional[int]], Optional[SymbolicAtom]] = {}
        self._grounded: Set[str] = set()  # names of parts

    def _mark(self, program: Program) -> Program:
        marked, self._statements = mark(program)
        return marked

    def replay(self, grounding: Grounding) -> None:
        """Repeats the groundings of another solver."""
        command, step = grounding.command, grounding.step
        if isinstance(command, (wire.Restart, wire.CleanupDomains)):
            self._last.clear()
            self._begins.clear()
        self.apply(command)
        if isinstance(command, wire.CleanupDomains):
            self._new_atoms(None)  # none of them is new
        if not isinstance(command, wire.Ground):
            return
        self._times[step] = self._times.get(step, 0) + 1
        self._grounded.update(part.name for part in command.parts)
        for signature, number in self._new_atoms(step).items():
            steps = self._steps.setdefault(signature, {})
            steps[step] = steps.get(step, 0) + number

    def _new_atoms(self, step: Optional[int]) -> Dict[PredicateSignature, int]:
        """Counts the atoms of each predicate that have come, for a step."""
        atoms = self._control.symbolic_atoms
        found: Dict[PredicateSignature, int] = {}
        for name, arity, positive in atoms.signatures:
            signature = (name if positive else f"-{name}", arity)
            before = last = self._last.get(signature)
            number = 0
            for atom in self._after(before, name, arity, positive):
                number += 1
                last = atom
            if number and last is not None:
                self._last[signature] = last
                self._begins.setdefault((signature, step), before)
                found[signature] = number
        return found

    def _after(
        self, last: Optional[SymbolicAtom], name: str, arity: int, positive: bool = True
    ) -> Iterator[SymbolicAtom]:
        atoms = self._control.symbolic_atoms
        if last is None:
            return atoms.by_signature(name, arity, positive)
        return atoms_after(last, atoms, name, arity)

    def counts(self) -> Counts:
        """Returns the counts."""
        instances: List[Steps] = []
        for statement in self._statements:
            steps: Counter[Optional[int]] = Counter()
            for marker in statement.markers:
                steps.update(self._steps.get(marker.signature, {}))
            if not statement.markers and statement.part in self._grounded:
                steps[None] = 1
            instances.append(dict(steps))
        atoms = {key: one for key, one in self._steps.items() if not key[0].startswith(MARKER)}
        return Counts(self._statements, instances, atoms, self._times)

    def values(self, marker: Marker, step: Optional[int]) -> Dict[str, VariableValues]:
        """Returns the values of a statement's variables in the instances of a step.

        Args:
            marker: What the instances are counted by.
            step: The step; None for all.

        Returns:
            For each variable, its values. Of very many instances, only the first ones are looked
            at.
        """
        seen: Dict[int, Set[clingo.Symbol]] = {
            place: set() for place, name in enumerate(marker.arguments) if name
        }
        begin = self._begins.get((marker.signature, step))
        for atom in itertools.islice(self._after(begin, *marker.signature), _MOST_LOOKED_AT):
            arguments = atom.symbol.arguments
            if step is not None and arguments[0] != clingo.Number(step):
                break  # of the next step
            for place, values in seen.items():
                values.add(arguments[place])
        return {marker.arguments[place]: _summary(values) for place, values in seen.items()}


def count(
    options: Options, trace: SolverTrace, tell: Callable[[str], None] = lambda _: None
) -> Tuple[Counts, CountingEngine]:
    """Repeats the groundings of a planner's solver, and counts the instances.

    Args:
        options: The solver's command line.
        trace: What it has done.
        tell: Called with how far that is.

    Returns:
        What was counted, and the solver that did so.
    """
    engine = CountingEngine(options)
    groundings = trace.groundings
    for number, grounding in enumerate(groundings):
        tell(f"counting what was grounded, {100 * number // len(groundings)} %")
        engine.replay(grounding)
    return engine.counts(), engine


def _summary(symbols: Set[clingo.Symbol]) -> VariableValues:
    numbers = [one.number for one in symbols if one.type is clingo.SymbolType.Number]
    if not numbers or len(numbers) < len(symbols):
        return VariableValues(len(symbols))
    return VariableValues(len(symbols), (min(numbers), max(numbers)))
