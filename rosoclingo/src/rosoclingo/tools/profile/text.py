"""A profile as text, in columns, and as values for JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple

from rosoclingo.tools.profile.counting import Counts
from rosoclingo.tools.profile.marking import PredicateSignature, Statement
from rosoclingo.tools.profile.measuring import SolverTrace

_MOST_ROWS = 10  # of a table


@dataclass(frozen=True)
class Profile:
    """A profile: the time, the atoms and the ground instances of a run.

    Attributes:
        trace: What the planner's solver has done.
        counts: What it has grounded.
    """

    trace: SolverTrace
    counts: Counts

    def describe(self) -> str:
        """Returns it as text."""
        trace, atoms, instances = self.trace, self._atoms(), self._instances()
        searches = "1 search" if trace.searches == 1 else f"{trace.searches} searches"
        return "\n\n".join([
            f"profile: grounding took {trace.grounding:.2f} s, for "
            f"{sum(number for _, number in atoms):,} atoms and "
            f"{sum(number for _, number in instances):,} ground instances; "
            f"{searches} took {trace.searching:.2f} s",
            _table(
                ("atoms", "predicate"),
                [(f"{number:,}", f"{name}/{arity}") for (name, arity), number in atoms],
            ),
            _table(
                ("instances", "statement", ""),
                [(f"{number:,}", f"{one.file}:{one.line}", one.text) for one, number in instances],
            ),
        ])  # fmt: skip

    def values(self) -> Dict[str, Any]:
        """Returns it for JSON."""
        trace = self.trace
        return {
            "grounding": trace.grounding,
            "search": trace.searching,
            "searches": trace.searches,
            "predicates": [
                {"name": name, "arity": arity, "atoms": number}
                for (name, arity), number in self._atoms()
            ],
            "statements": [
                {"file": one.file, "line": one.line, "text": one.text, "instances": number}
                for one, number in self._instances()
            ],
        }

    def _atoms(self) -> List[Tuple[PredicateSignature, int]]:
        return sorted(self.counts.atoms.items(), key=lambda pair: -pair[1])

    def _instances(self) -> List[Tuple[Statement, int]]:
        return sorted(self.counts.instances, key=lambda pair: -pair[1])


def _table(heads: Tuple[str, ...], rows: Sequence[Tuple[str, ...]]) -> str:
    """Returns a table of the first rows, whose first column has numbers."""
    cells = [heads, *rows[:_MOST_ROWS]]
    widths = [max(map(len, column)) for column in zip(*cells)]
    return "\n".join(
        "    "
        + "  ".join(
            [row[0].rjust(widths[0]), *(c.ljust(w) for c, w in zip(row[1:], widths[1:]))]
        ).rstrip()
        for row in cells
    )
