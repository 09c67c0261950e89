"""Formats a comparison as text that is safe on a terminal. Needs no ROS."""

from __future__ import annotations

from typing import List, Optional, Sequence

from rosclingo.terminal import lines as safe_lines
from rosclingo.terminal import one_line
from rosoclingo.bags.compare.comparison import Comparison, ComparisonRow, GoalPair, Level
from rosoclingo.bags.compare.history import Cell, GoalHistory
from rosoclingo.bags.compare.pairing import Moved

_CONTEXT = 3  # rows that are the same, before and after each difference
_MOST_SHOWN = 40  # differences
_WIDEST = 60  # characters of a column
_INPUTS_SHOWN = 8  # before one row, and of those that only one run had taken

CUT = "the recording ends while the loop was at work; what comes after that is not compared"
"""What is to be said of a recording that has no end."""


def describe(comparison: Comparison) -> str:
    """Returns the differences in some lines, nothing if there is none."""
    if not comparison.differences:
        return ""
    parts = [*_goals(comparison), *_lengths(comparison), *_steps(comparison.rows)]
    parts += _inputs(comparison)
    if comparison.failure:
        parts.append(f"given up: {safe_lines(comparison.failure)}")
    return "\n".join(parts)


def summary(comparison: Comparison) -> str:
    """Returns one line: how much is different, and of how much."""
    count = comparison.differences
    said = f"{count} difference{'' if count == 1 else 's'}" if count else "no difference"
    rows = sum(not row.same for row in comparison.rows)
    beside = ""
    if comparison.level is not Level.EXACT and rows and not count:
        beside = f" ({rows} of what was done, which this level allows)"
    counts = f"{_plural(len(comparison.goals), 'goal')}, {_plural(comparison.steps, 'step')}"
    return f"{said} at level {comparison.level.value}{beside}: {counts}"


def speed(seconds: float, recorded: float) -> str:
    """Returns how long a replay took, and how long the recorded run; both in seconds."""
    faster = f", {recorded / seconds:.1f} times as fast as recorded" if seconds > 0 else ""
    return f"{seconds:.1f} s{faster}"


def describe_goal(pair: GoalPair) -> List[str]:
    """Describes the statuses of a goal, in two lines."""
    return [f"  expected  {_goal(pair.expected)}", f"  seen      {_goal(pair.seen)}"]


def _goal(goal: Optional[GoalHistory]) -> str:
    if goal is None:
        return "it did not come"
    said = f"{', '.join(goal.statuses) or 'no status'}; {goal.outcome}"
    return one_line(f"{said} after {_plural(goal.steps, 'step')} with actions")


def _goals(comparison: Comparison) -> List[str]:
    lines: List[str] = []
    different = [(number, pair) for number, pair in enumerate(comparison.goals, 1) if not pair.same]
    for number, pair in different[:_MOST_SHOWN]:
        name = one_line(f"goal {number} {pair.request} ({pair.id}):")
        lines += [name, *describe_goal(pair)]
    return lines + _more(len(different), "goals")


def _lengths(comparison: Comparison) -> List[str]:
    if comparison.steps == comparison.seen_steps:
        return []
    return [f"steps with actions: expected {comparison.steps}, seen {comparison.seen_steps}"]


def _steps(rows: Sequence[ComparisonRow]) -> List[str]:
    """Returns the rows that differ with some around them, in columns."""
    different = [place for place, row in enumerate(rows) if not row.same]
    if not different:
        return []
    shown: List[int] = []
    for place in different[:_MOST_SHOWN]:
        around = range(place - _CONTEXT, place + _CONTEXT + 1)
        shown += [one for one in around if 0 <= one < len(rows) and one > (shown or [-1])[-1]]
    texts = [_cell(rows[place].expected) for place in shown]
    width = max(len("expected"), *map(len, texts))
    lines = [f"   {'step':>5}  {'expected':{width}}  seen"]
    last = -1
    for place, text in zip(shown, texts):
        row = rows[place]
        if place > last + 1:
            lines.append(f"          ... {_plural(place - last - 1, 'row')} alike")
        last = place
        lines += [f"          < {_short(one)}" for one in row.inputs[-_INPUTS_SHOWN:]]
        if row.stall is not None:
            stall = one_line(row.stall)
            lines.append(f"        ! the replay waits for {stall}, and nothing is to be sent")
        mark = "  " if row.same else ">>" if place == different[0] else " >"
        first = "    <- first divergence" if place == different[0] else ""
        line = f"{mark} {_step(row):>5}  {text:{width}}  {_cell(row.seen)}{first}"
        if row.expected or row.seen:
            lines.append(line.rstrip())
    return lines + _more(len(different), "differences")


def _inputs(comparison: Comparison) -> List[str]:
    """Returns lines about inputs that differ, as the likely cause of other differences."""
    inputs = comparison.inputs
    if inputs is None:
        return []
    is_done = any(not row.same for row in comparison.rows)
    when = " until the first divergence" if is_done else ""
    if not inputs:
        return [f"both runs had the same inputs{when}"]
    lines = [f"inputs that the runs did not have at the same time{when}:"]
    lines += [f"  {_moved(one)}" for one in inputs[:_INPUTS_SHOWN]]
    more = len(inputs) - _INPUTS_SHOWN
    return [*lines, f"  ... and {more} more"] if more > 0 else lines


def _moved(one: Moved) -> str:
    text = next(cell.text for cell in (one.expected, one.seen) if cell is not None)
    times = zip(("expected", "seen"), (one.expected, one.seen), one.in_time)
    return f"{_short(text)}: {', '.join(_time(*time) for time in times)}"


def _time(word: str, cell: Optional[Cell], in_time: bool) -> str:
    if cell is None:
        return f"not {word}"
    step = "" if cell.step is None else f" in step {cell.step}"
    return f"{word}{step}" if in_time else f"{word} later{step}"


def _step(row: ComparisonRow) -> str:
    steps = [cell.step for cell in (row.expected, row.seen) if cell and cell.step is not None]
    return "/".join(map(str, dict.fromkeys(steps)))


def _cell(cell: Optional[Cell]) -> str:
    return "-" if cell is None else _short(cell.text)


def _short(text: str) -> str:
    line = one_line(" ".join(text.split()))
    return line if len(line) <= _WIDEST else f"{line[: _WIDEST - 3]}..."


def _more(count: int, what: str) -> List[str]:
    return [f"... and {count - _MOST_SHOWN} more {what}"] if count > _MOST_SHOWN else []


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
