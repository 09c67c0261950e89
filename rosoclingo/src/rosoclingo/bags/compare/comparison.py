"""Compares the outputs of a run with those of its replay or another run. Needs no ROS."""

from __future__ import annotations

import difflib
import enum
from dataclasses import dataclass, replace
from itertools import groupby, takewhile, zip_longest
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from rosoclingo.bags.compare.history import OPEN_GOAL, Cell, GoalHistory, History
from rosoclingo.bags.compare.pairing import Moved, moved, with_ids_of
from rosoclingo.bags.read.run import Output, Run
from rosoclingo.loop.journal import ActionPublished, StatusSet

_MOST_TO_ALIGN = 2000  # rows; longer ones are compared one by one


class Level(enum.Enum):
    """The strictness of a comparison."""

    EXACT = "exact"
    EQUIVALENT = "equivalent"
    OUTCOME = "outcome"


@dataclass(frozen=True)
class Stall:
    """The replayed loop waited in vain for outputs that the recording has before the next input.

    Attributes:
        position: How many of the expected outputs come before the first one that is missing.
        pending: The actuators whose answers the loop waited for.
    """

    position: int
    pending: Tuple[str, ...]


@dataclass(frozen=True)
class GoalPair:
    """A goal in both runs.

    Attributes:
        id: That of actionlib; the recorded one if two runs have different ones.
        request: The request.
        expected: Its outcome in the recording; None if it is not there.
        seen: Its outcome in the replay; None if it is not there.
        same: Whether that is the same at the level of the comparison.
    """

    id: str
    request: str
    expected: Optional[GoalHistory]
    seen: Optional[GoalHistory]
    same: bool


@dataclass(frozen=True)
class ComparisonRow:
    """A line of the comparison: the expected and the seen output at one place.

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
        """True if both are the same here."""
        return self.expected == self.seen and self.stall is None


@dataclass(frozen=True)
class Comparison:
    """The result of comparing two runs.

    Attributes:
        level: How much has to be the same.
        goals: All recorded goals, in the order in which they came, and then those that are seen
            alone.
        rows: What the loop has put out, in order.
        steps: In how many steps the recording has actions.
        seen_steps: In how many the replay has.
        same_plan: Whether what the loop has put out is the same at the level.
        failure: Why the replay was given up, if it was.
        inputs: What two runs did not take at the same time, until their first difference; None if
            the second run is a replay, which has the inputs of the first.
    """

    level: Level
    goals: Tuple[GoalPair, ...]
    rows: Tuple[ComparisonRow, ...]
    steps: int
    seen_steps: int
    same_plan: bool
    failure: str = ""
    inputs: Optional[Tuple[Moved, ...]] = None

    @property
    def differences(self) -> int:
        """The number of differences that count at the level."""
        goals = sum(not pair.same for pair in self.goals) + bool(self.failure)
        if self.level is Level.EXACT:
            return goals + sum(not row.same for row in self.rows)
        return goals + (not self.same_plan and not self.failure)


def compare(
    expected: Run,
    seen: Run,
    level: Level = Level.EXACT,
    *,
    is_replay: bool = True,
    stalls: Sequence[Stall] = (),
    failure: str = "",
) -> Comparison:
    """Compares two runs; steps only if both have a journal.

    Args:
        expected: The recorded one.
        seen: The replay, or another run.
        level: How much has to be the same.
        is_replay: Whether the second run has the inputs of the first, with their goals' ids.
        stalls: Where the replay waited in vain.
        failure: Why the replay was given up, if it was.

    Returns:
        What is the same. If the recording ends while the loop was at work, what the replay has done
        afterwards is left out.
    """
    if not is_replay:
        seen = with_ids_of(expected, seen)
    is_cut = expected.is_open
    knows_steps = expected.has_journal and seen.has_journal
    old, new = History(expected, knows_steps), History(seen, knows_steps)
    if is_cut:
        del new.timeline[len(old.timeline) :]
    new.numbers = _numbers(old, new)
    goals = [_pair(one, old, new, level, is_cut) for one in old.requests]
    goals += [GoalPair(one, new.requests[one], None, new.goals[one], False)
              for one in _added(old, new, is_cut)]  # fmt: skip
    rows = _with_stall(_rows(old, new), old, stalls)
    if level is Level.EXACT:
        same_plan = all(row.same for row in rows)
    else:
        ends, new_ends = (one.ends(level is Level.EQUIVALENT) for one in (old, new))
        same_plan = ends == (new_ends[: len(ends)] if is_cut else new_ends)
        if level is Level.EQUIVALENT and not is_cut:
            same_plan = same_plan and old.steps == new.steps
    alike = sum(1 for _ in takewhile(lambda row: row.same, rows))
    return Comparison(
        level, tuple(goals), tuple(rows), old.steps, new.steps, same_plan and not failure, failure,
        None if is_replay else moved(_inputs(old, alike), _inputs(new, alike)),
    )  # fmt: skip


def _numbers(old: History, new: History) -> Dict[str, int]:
    """Numbers goals so that each has the same number in both columns."""
    numbers = dict(old.numbers)
    for identifier in new.numbers:
        numbers.setdefault(identifier, len(numbers) + 1)
    return numbers


def _pair(goal: str, old: History, new: History, level: Level, is_cut: bool) -> GoalPair:
    expected, seen = old.goals[goal], new.goals.get(goal)
    if is_cut and expected.outcome == OPEN_GOAL:  # it may have ended since
        if seen is not None:
            statuses = seen.statuses[: len(expected.statuses)]
            seen = GoalHistory(statuses, OPEN_GOAL, min(expected.steps, seen.steps))
        elif not expected.statuses:  # nothing had come of it yet
            seen = expected
    same = (
        seen is not None
        and {
            Level.EXACT: expected.statuses == seen.statuses,
            Level.EQUIVALENT: (expected.outcome, expected.steps) == (seen.outcome, seen.steps),
            Level.OUTCOME: expected.outcome == seen.outcome,
        }[level]
    )
    return GoalPair(goal, old.requests[goal], expected, seen, same)


def _added(old: History, new: History, is_cut: bool) -> List[str]:
    """Returns the goals that only the second run has, but those after the end of the first."""
    goals = list(new.requests)
    if is_cut:
        while goals and goals[-1] not in old.requests:
            goals.pop()
    return [goal for goal in goals if goal not in old.requests]


def _rows(old: History, new: History) -> List[ComparisonRow]:
    expected = [old.cell(output) for output in _sorted(old)]
    seen = [new.cell(output) for output in _sorted(new)]
    rows: List[ComparisonRow] = []
    place = 0
    for left, right in _align(expected, seen):
        inputs = old.inputs.get(place, ()) if left else ()
        rows.append(ComparisonRow(left, right, tuple(old.input(entry).text for entry in inputs)))
        place += left is not None
    return rows


def _sorted(history: History) -> List[Output]:
    """Sorts outputs that happen at the same time: actions by name, statuses by goal."""
    ordered: List[Output] = []
    for (kind, step), group in groupby(history.timeline, lambda one: (type(one.event), one.step)):
        if (kind is ActionPublished and step is not None) or kind is StatusSet:
            ordered += sorted(group, key=lambda output: _place(history, output))
        else:
            ordered += group
    return ordered


def _place(history: History, output: Output) -> Tuple[Any, ...]:
    event = output.event
    if isinstance(event, StatusSet):
        return (history.numbers[event.goal],)
    return (event.actuator, event.action) if isinstance(event, ActionPublished) else ()


def _inputs(history: History, outputs: int) -> Tuple[List[Cell], List[Cell]]:
    """Splits the inputs into those before a number of outputs, and those after it."""
    halves: Tuple[List[Cell], List[Cell]] = [], []
    for place, entries in history.inputs.items():
        halves[place > outputs].extend(map(history.input, entries))
    return halves


def _align(
    old: Sequence[Cell], new: Sequence[Cell]
) -> Iterator[Tuple[Optional[Cell], Optional[Cell]]]:
    """Aligns the outputs of both runs."""
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


def _with_stall(
    rows: List[ComparisonRow], history: History, stalls: Sequence[Stall]
) -> List[ComparisonRow]:
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
    return [*rows, ComparisonRow(None, None, (), text)]
