"""Whether a recording has all that a comparison needs. Needs no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import List, Sequence

from rosoclingo.bags.errors import IncompleteBagError
from rosoclingo.bags.model import Entry, Recording
from rosoclingo.bags.read.run import Run

_GAPS_SHOWN = 5


def check(bag: Path, recording: Recording) -> None:
    """Checks that a recording has all events of its run, but for those after its end.

    Args:
        bag: Where it was read from.
        recording: The recording.

    Raises:
        IncompleteBagError: It has not; the message says what is missing and what to do.
    """
    first = recording.entries[0].number if recording.entries else 1
    if first > 1:
        raise IncompleteBagError(
            f"{bag}: the first {first - 1} events of the run are missing; start record.py with "
            "the system (record:=FILE of the launch files)"
        )
    gaps = _gaps(recording.entries)
    if gaps:
        more = f" and {len(gaps) - _GAPS_SHOWN} more gaps" if len(gaps) > _GAPS_SHOWN else ""
        raise IncompleteBagError(
            f"{bag}: of the run's {recording.entries[-1].number} events are missing: "
            f"{', '.join(gaps[:_GAPS_SHOWN])}{more}; what happened then is not known: use an "
            "undamaged copy of the bag, or record again"
        )


def is_empty(run: Run) -> bool:
    """Whether there is nothing in a run that another one could do differently."""
    return not any(run.outputs) and (run.is_open or not run.requests)


def is_cut(run: Run) -> bool:
    """Whether the recording ends while the loop was at work, as far as it tells."""
    return run.has_journal and run.is_open


def _gaps(entries: Sequence[Entry]) -> List[str]:
    """Returns the numbers that are missing: ``3`` or ``5 to 9``."""
    gaps = []
    for before, after in zip(entries, entries[1:]):
        first, last = before.number + 1, after.number - 1
        if first <= last:
            gaps.append(str(first) if first == last else f"{first} to {last}")
    return gaps
