"""Short journals for the tests of replaying."""

from __future__ import annotations

from typing import List, Sequence, Tuple

from rosoclingo.bags.read.run import Run
from rosoclingo.loop.journal import Entry, Fields, Record, decode

Made = Tuple[str, str, str, int]
"""Kind, id, text and step."""

ASK: List[Made] = [("waiting", "", "", 0), ("goal", "g", "visit(3)", 0), ("command", "", "idle", 0)]


def drive(*targets: int, first: int = 1) -> List[Made]:
    """A robot that goes somewhere, and says each time that it is there."""
    made: List[Made] = []
    for step, target in enumerate(targets, first):
        made += [
            ("action", "robot", f"go({target})", step),
            ("command", "", f"commit_actions({step})", step),
            ("waiting", "", "", step),
            ("message", "robot", "success", step),
            ("command", "", "idle", step),
        ]
    return made


def status(word: str, step: int, goal: str = "g") -> List[Made]:
    """A status of a goal, and the command that sets it."""
    return [("status", goal, word, step), ("command", "", f"status_update({step})", step)]


END: List[Made] = [("waiting", "", "", 2)]
RUN: List[Made] = ASK + status("accepted", 1) + drive(2, 3) + status("succeeded", 2) + END


def run(made: Sequence[Made], gap: float = 1.0, has_journal: bool = True) -> Run:
    """Makes a run whose events follow each other after so many seconds."""
    return run_of(records(made), gap, has_journal)


def run_of(made: Sequence[Record], gap: float = 1.0, has_journal: bool = True) -> Run:
    return Run(
        [
            Entry(record.event, record.step, record.horizon, number, number * gap)
            for number, record in enumerate(made, 1)
        ],
        has_journal,
    )


def records(made: Sequence[Made]) -> List[Record]:
    """Makes events; goals with a status have the slot 1."""
    return [
        Record(decode(Fields(kind, identifier, text, ("1",) if kind == "status" else ())), step)
        for kind, identifier, text, step in made
    ]
