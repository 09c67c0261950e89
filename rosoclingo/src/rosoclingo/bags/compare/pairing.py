"""Pairs the goals and inputs of two runs that were recorded independently. Needs no ROS."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from dataclasses import dataclass, replace
from typing import Deque, Dict, Optional, Sequence, Tuple

from rosclingo.wire.term_text import compact
from rosoclingo.bags.compare.history import Cell
from rosoclingo.bags.read.run import Run
from rosoclingo.loop.journal import CancelArrived, Event, GoalArrived, StatusSet

InputCells = Tuple[Sequence[Cell], Sequence[Cell]]
"""What a run has taken before a place, and after it."""


@dataclass(frozen=True)
class Moved:
    """An input that two runs have taken at different times, or only one of them.

    Attributes:
        expected: The input in the first run; None if it never came.
        seen: The input in the second run; None if it never came.
        in_time: Whether it came before the place in question, in the first run and in the second.
    """

    expected: Optional[Cell]
    seen: Optional[Cell]
    in_time: Tuple[bool, bool]


def with_ids_of(expected: Run, seen: Run) -> Run:
    """Renames the goals of a run to the ids and the spelling that they have in another one.

    Clients make the ids of the time, so that each run has its own. The first goal with a request
    belongs to the first one with this request in the other run, the second to the second.

    Args:
        expected: The run whose ids are taken.
        seen: The run that is changed.
    """
    free: Dict[str, Deque[str]] = defaultdict(deque)
    for identifier, request in expected.requests.items():
        free[compact(request)].append(identifier)
    ids: Dict[str, str] = {}
    for identifier, request in seen.requests.items():
        same = free[compact(request)]
        if same:
            ids[identifier] = same.popleft()
        elif identifier in expected.requests:
            ids[identifier] = f"{identifier}, seen"

    def changed(event: Event) -> Event:
        if not isinstance(event, (GoalArrived, CancelArrived, StatusSet)) or event.goal not in ids:
            return event
        goal = ids[event.goal]
        if isinstance(event, GoalArrived):
            return replace(event, goal=goal, request=expected.requests.get(goal, event.request))
        return replace(event, goal=goal)

    entries = [replace(entry, event=changed(entry.event)) for entry in seen.recorded]
    return Run(entries, seen.has_journal)


def moved(expected: InputCells, seen: InputCells) -> Tuple[Moved, ...]:
    """Returns the inputs that only one run had taken before a place, or both in other steps.

    Args:
        expected: The inputs of the first run.
        seen: Those of the second run.
    """
    early, new_early = _numbered(expected[0]), _numbered(seen[0])
    old, new = _numbered([*expected[0], *expected[1]]), _numbered([*seen[0], *seen[1]])
    inputs = {
        key: Moved(old.get(key), new.get(key), (key in early, key in new_early))
        for key in {**early, **new_early}
    }
    return tuple(
        one for key, one in inputs.items() if one.in_time != (True, True) or old[key] != new[key]
    )


def _numbered(cells: Sequence[Cell]) -> Dict[Tuple[str, int], Cell]:
    """Returns inputs by their text, and a number that tells equal ones apart."""
    counts: Counter[str] = Counter()
    numbered: Dict[Tuple[str, int], Cell] = {}
    for cell in cells:
        numbered[cell.text, counts[cell.text]] = cell
        counts[cell.text] += 1
    return numbered
