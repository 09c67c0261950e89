"""A profile as text, in columns, and as values for JSON."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import Any, Dict, Iterator, List, Sequence, Tuple

from rosoclingo.tools.profile.counting import Counts, VariableValues, total
from rosoclingo.tools.profile.marking import Statement
from rosoclingo.tools.profile.measuring import Horizon, SolverTrace, by_horizon

_MOST_ROWS = 10  # of a table
_COLUMNS = 100
_RIGHT = ">"


@dataclass(frozen=True)
class Profile:
    """A profile: the time and the ground instances of a run.

    Attributes:
        trace: What the planner's solver has done.
        counts: What it has grounded.
        variables: For each of the largest statements, by its number, the values of its variables.
        advice: What to do.
    """

    trace: SolverTrace
    counts: Counts
    variables: Dict[int, Dict[str, VariableValues]]
    advice: Sequence[str]

    def describe(self) -> str:
        """Returns it as text."""
        counts, horizons = self.counts, by_horizon(self.trace)
        tables = [
            _table(("horizon", "atoms", "instances", "grounding", "search", "searches", ""),
                   _horizon_rows(horizons, counts), "<>>>>><"),
            _table(("part", "instances", "in a step"), _part_rows(counts), "<>>"),
            _table(("predicate", "atoms", "in a step", "parts"), _predicate_rows(counts), "<>><"),
            _table(("instances", "in a step", "statement", "", "variables"),
                   _statement_rows(self), ">><<<"),
        ]  # fmt: skip
        paragraphs = [f"profile: {_summary(self, horizons)}", *filter(None, tables)]
        if self.advice:
            paragraphs.append("\n".join(["what to do:", *map(_wrap, self.advice)]))
        return "\n\n".join(paragraphs)

    def values(self) -> Dict[str, Any]:
        """Returns it for JSON."""
        counts = self.counts
        return {
            "horizons": [
                {
                    "horizon": number,
                    "atoms": _of(counts, number)[0],
                    "instances": _of(counts, number)[1],
                    "grounding": one.grounding,
                    "search": one.searching,
                    "searches": one.searches,
                    "results": [result.value for result in one.results],
                }
                for number, one in by_horizon(self.trace).items()
            ],
            "predicates": [
                {
                    "name": name,
                    "arity": arity,
                    "atoms": total(steps),
                    "in_step": counts.in_step(steps),
                }
                for (name, arity), steps in sorted(counts.atoms.items())
            ],
            "statements": [
                {
                    "file": one.file,
                    "line": one.line,
                    "text": one.text,
                    "part": one.part,
                    "instances": total(steps),
                    "in_step": counts.in_step(steps),
                }
                for one, steps in zip(counts.statements, counts.instances)
                if one.markers
            ],
            "advice": list(self.advice),
        }


def largest(counts: Counts) -> List[int]:
    """Returns the numbers of the statements with the most instances, these first."""
    numbers = [n for n, steps in enumerate(counts.instances) if counts.statements[n].markers]
    numbers = [n for n in numbers if total(counts.instances[n])]
    return sorted(numbers, key=lambda n: -total(counts.instances[n]))[:_MOST_ROWS]


def _summary(profile: Profile, horizons: Dict[int, Horizon]) -> str:
    grounding = sum(one.grounding for one in horizons.values())
    searching = sum(one.searching for one in horizons.values())
    counts = profile.counts
    said = (
        f"grounding took {grounding:.2f} s, for {counts.all_atoms:,} atoms and "
        f"{counts.total:,} ground instances; searches took {searching:.2f} s"
    )
    if searching > grounding:
        number, one = max(horizons.items(), key=lambda pair: pair[1].searching)
        return (
            f"{said}\nmost goes into searches, {_percent(searching, grounding + searching)} of the "
            f"time, and of that {_percent(one.searching, searching)} into horizon {number}"
        )
    numbers = largest(counts)
    if not numbers:
        return said
    number = numbers[0]
    share = _percent(total(counts.instances[number]), counts.total)
    return (
        f"{said}\nmost goes into grounding, {_percent(grounding, grounding + searching)} of the "
        f"time, and there into {counts.statements[number].place}, {share} of the instances"
    )


def _horizon_rows(horizons: Dict[int, Horizon], counts: Counts) -> Iterator[Tuple[str, ...]]:
    numbers = list(horizons)
    size = max(1, -(-len(numbers) // _MOST_ROWS))  # how many in a row
    for begin in range(0, len(numbers), size):
        row = numbers[begin : begin + size]
        found = [horizons[number] for number in row]
        atoms, instances = (sum(column) for column in zip(*(_of(counts, n) for n in row)))
        results = dict.fromkeys(result.value for one in found for result in one.results)
        yield (
            f"{row[0]}" if len(row) == 1 else f"{row[0]}-{row[-1]}",
            f"{atoms:,}",
            f"{instances:,}",
            f"{sum(one.grounding for one in found):.3f} s",
            f"{sum(one.searching for one in found):.3f} s",
            f"{sum(one.searches for one in found)}",
            ", ".join(results),
        )


def _of(counts: Counts, step: int) -> Tuple[int, int]:
    """Returns the atoms and instances of a step; with step 0 is what belongs to none."""
    steps = (0, None) if step == 0 else (step,)
    return (
        sum(one.get(key, 0) for one in counts.atoms.values() for key in steps),
        sum(one.get(key, 0) for one in counts.instances for key in steps),
    )


def _part_rows(counts: Counts) -> Iterator[Tuple[str, ...]]:
    found: Dict[str, Tuple[int, int]] = {}
    for statement, steps in zip(counts.statements, counts.instances):
        part = _part(statement)
        before = found.get(part, (0, 0))
        found[part] = before[0] + total(steps), before[1] + counts.in_step(steps)
    for part, (everything, in_step) in found.items():
        if everything:
            yield part, f"{everything:,}", f"{in_step:,}" if in_step else ""


def _predicate_rows(counts: Counts) -> Iterator[Tuple[str, ...]]:
    ranked = sorted(counts.atoms.items(), key=lambda pair: -total(pair[1]))
    for signature, steps in ranked[:_MOST_ROWS]:
        parts = dict.fromkeys(_part(one) for one in counts.statements if signature in one.heads)
        in_step = counts.in_step(steps)
        name = f"{signature[0]}/{signature[1]}"
        yield name, f"{total(steps):,}", f"{in_step:,}" if in_step else "", ", ".join(parts)


def _part(statement: Statement) -> str:
    inside = f"({','.join(statement.parameters)})" if statement.parameters else ""
    return f"{statement.part}{inside}"


def _statement_rows(profile: Profile) -> Iterator[Tuple[str, ...]]:
    counts = profile.counts
    for number in largest(counts):
        statement, steps = counts.statements[number], counts.instances[number]
        in_step = counts.in_step(steps)
        variables = sorted(profile.variables.get(number, {}).items(), key=lambda v: -v[1].number)
        yield (
            f"{total(steps):,}",
            f"{in_step:,}" if in_step else "",
            statement.place,
            statement.text,
            " ".join(f"{name}:{found.number:,}" for name, found in variables),
        )


def _wrap(text: str) -> str:
    return textwrap.fill(
        text,
        _COLUMNS,
        initial_indent="    - ",
        subsequent_indent="      ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _percent(part: float, whole: float) -> str:
    return f"{100 * part / whole:.0f} %" if whole else "0 %"


def _table(heads: Sequence[str], rows: Iterator[Tuple[str, ...]], sides: str) -> str:
    """Returns a table; nothing if it has no rows."""
    cells = [tuple(heads), *rows]
    if len(cells) == 1:
        return ""
    widths = [max(map(len, column)) for column in zip(*cells)]
    return "\n".join(
        "    "
        + "  ".join(
            cell.rjust(width) if side == _RIGHT else cell.ljust(width)
            for cell, width, side in zip(row, widths, sides)
        ).rstrip()
        for row in cells
    )
