"""Compares what a run has put out with what its replay has put out. Needs no ROS."""

from __future__ import annotations

import difflib
import enum
from dataclasses import dataclass, replace
from itertools import groupby, zip_longest
from typing import Iterator, List, Optional, Sequence, Tuple

from rosoclingo.bags.history import OPEN, Cell, Goal, History
from rosoclingo.bags.model import Entry
from rosoclingo.bags.outputs import Output, Reader, is_open, tidy
from rosoclingo.bags.schedule import Stall

_MOST_TO_ALIGN = 2000  # rows; longer ones are compared one by one


class Level(enum.Enum):
    """How much has to be the same."""

    EXACT = "exact"
    EQUIVALENT = "equivalent"
    OUTCOME = "outcome"


@dataclass(frozen=True)
class GoalPair:
    """A goal in both runs; ``same`` at the level of the comparison."""

    id: str
    request: str
    expected: Goal
    seen: Goal
    same: bool


@dataclass(frozen=True)
class Row:
    """A line of the comparison: what was expected and what was seen at one place.

    Attributes:
        expected: What was recorded; None for nothing.
        seen: What the replay has put out; None for nothing.
        inputs: What had come just before it in the recording.
        stall: The actuators that the replayed loop waited for here in vain, in words; None if it
            did not wait.
    """

    expected: Optional[Cell]
    seen: Optional[Cell]
    inputs: Tuple[str, ...] = ()
    stall: Optional[str] = None

    @property
    def same(self) -> bool:
        """Whether both are the same here."""
        return self.expected == self.seen and self.stall is None


@dataclass(frozen=True)
class Comparison:
    """What is the same in two runs, and what is not.

    Attributes:
        level: How much has to be the same.
        goals: All recorded goals, in the order in which they came.
        rows: What the loop has put out, in order.
        steps: In how many steps the recording has actions.
        seen_steps: In how many the replay has.
        same_plan: Whether what the loop has put out is the same at the level.
        failure: Why the replay was given up, if it was.
    """

    level: Level
    goals: Tuple[GoalPair, ...]
    rows: Tuple[Row, ...]
    steps: int
    seen_steps: int
    same_plan: bool
    failure: str = ""

    @property
    def differences(self) -> int:
        """How many differences count at the level."""
        goals = sum(not pair.same for pair in self.goals) + bool(self.failure)
        if self.level is Level.EXACT:
            return goals + sum(not row.same for row in self.rows)
        return goals + (not self.same_plan and not self.failure)


def compare(
    expected: Sequence[Entry],
    seen: Sequence[Entry],
    level: Level = Level.EXACT,
    *,
    has_journal: bool = True,
    stalls: Sequence[Stall] = (),
    failure: str = "",
) -> Comparison:
    """Compares two journals.

    Args:
        expected: The recorded one.
        seen: That of the replay.
        level: How much has to be the same.
        has_journal: Whether the recording has a journal; else steps are not compared.
        stalls: Where the replay waited in vain.
        failure: Why the replay was given up, if it was.

    Returns:
        What is the same. If the recording ends while the loop was at work, what the replay has done
        afterwards is left out.
    """
    expected, seen = tidy(expected), tidy(seen)
    is_cut = is_open(expected)
    old = History(expected, has_journal, Reader(has_journal))
    new = History(seen, has_journal, Reader())
    goals = tuple(
        _pair(
(identifier, request), old.goals[identifier], new.goals.get(identifier, Goal()),
              level, is_cut)
        for identifier, request in old.requests.items()
    )  # fmt: skip
    rows = _with_stall(_rows(old, new, is_cut), old, stalls)
    if level is Level.EXACT:
        same_plan = all(row.same for row in rows)
    else:
        ends, new_ends = (one.ends(level is Level.EQUIVALENT) for one in (old, new))
        same_plan = ends == (new_ends[: len(ends)] if is_cut else new_ends)
        if level is Level.EQUIVALENT and not is_cut:
            same_plan = same_plan and old.steps == new.steps
    return Comparison(
        level, goals, tuple(rows), old.steps, new.steps, same_plan and not failure, failure
    )


def _pair(goal: Tuple[str, str], old: Goal, new: Goal, level: Level, is_cut: bool) -> GoalPair:
    if is_cut and old.outcome == OPEN:  # it may have ended since
        new = Goal(new.statuses[: len(old.statuses)], OPEN, min(old.steps, new.steps))
    same = {
        Level.EXACT: old.statuses == new.statuses,
        Level.EQUIVALENT: (old.outcome, old.steps) == (new.outcome, new.steps),
        Level.OUTCOME: old.outcome == new.outcome,
    }
    return GoalPair(*goal, old, new, same[level])


def _rows(old: History, new: History, is_cut: bool) -> List[Row]:
    expected = [old.cell(output) for output in _sorted(old.timeline)]
    new.numbers = {**new.numbers, **old.numbers}  # a goal has the same one in both columns
    seen = [new.cell(output) for output in _sorted(new.timeline)]
    rows: List[Row] = []
    place = 0
    for left, right in _align(expected, seen):
        rows.append(Row(left, right, tuple(old.inputs.get(place, ())) if left else ()))
        place += left is not None
    while is_cut and rows and rows[-1].expected is None:
        rows.pop()
    return rows


def _sorted(timeline: Sequence[Output]) -> List[Output]:
    """Puts the actions of a step in the order of their names: they are sent at the same time."""
    ordered: List[Output] = []
    for key, group in groupby(timeline, lambda output: (output.kind, output.step)):
        if key[0] == "action" and key[1] is not None:
            ordered += sorted(group, key=lambda output: output.key)
        else:
            ordered += group
    return ordered


def _align(
    old: Sequence[Cell], new: Sequence[Cell]
) -> Iterator[Tuple[Optional[Cell], Optional[Cell]]]:
    """Puts what is the same side by side."""
    begin = 0
    while begin < min(len(old), len(new)) and old[begin] == new[begin]:
        yield old[begin], new[begin]
        begin += 1
    old, new = old[begin:], new[begin:]
    if max(len(old), len(new)) > _MOST_TO_ALIGN:
        yield from zip_longest(old, new)
        return
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    for _, left, left_end, right, right_end in matcher.get_opcodes():
        yield from zip_longest(old[left:left_end], new[right:right_end])


def _with_stall(rows: List[Row], history: History, stalls: Sequence[Stall]) -> List[Row]:
    """Says at which row the replay waited in vain for the first time; the rest follows from it."""
    if not stalls:
        return rows
    position, waits = stalls[0].position, " and ".join(stalls[0].pending)
    end = len(history.timeline)
    place = history.places[position] if position < len(history.places) else end
    text = f"an answer of {waits}" if waits else "something to come"
    count = 0
    for number, row in enumerate(rows):
        if row.expected is not None:
            if count == place:
                return [*rows[:number], replace(row, stall=text), *rows[number + 1 :]]
            count += 1
    return [*rows, Row(None, None, (), text)]
