"""Time spans in which an operator held something, from the messages of ``~held``.

>>> history = HoldHistory()
>>> history.add(1.0, True, ["robot"], [])
>>> history.add(3.5, False, [], [("robot", "go(2)", "approval")])
>>> [(one.began, one.ended, one.kind, one.name) for one in history.spans]
[(1.0, 3.5, 'hold', 'paused, robot on hold'), (3.5, None, 'approval', 'robot: go(2) for approval')]
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Deque, Iterable, Optional, Sequence, Tuple

from rosclingo.wire.term_text import split_term

HOLD, APPROVAL = "hold", "approval"

HeldRow = Tuple[str, str, str]
"""An actuator, its action, and why that is held: ``approval``, ``hold``, ``pause`` or ``retry``."""


@dataclass(frozen=True)
class HoldSpan:
    """A time in which the same was held.

    Attributes:
        began: When it began, in seconds.
        ended: When it ended; None if it has not.
        kind: ``hold`` if the run was paused or an actuator on hold, ``approval`` if actions only
            waited for one.
        name: What was held, in words.
    """

    began: float
    ended: Optional[float]
    kind: str
    name: str


class HoldHistory:
    """The last spans, in order; they do not overlap."""

    def __init__(self, most: Optional[int] = None) -> None:
        """Begins, with nothing held.

        Args:
            most: How many spans are kept; None for all.
        """
        self.spans: Deque[HoldSpan] = deque(maxlen=most)

    def add(
        self, seconds: float, is_paused: bool, on_hold: Sequence[str], held: Iterable[HeldRow]
    ) -> None:
        """Adds a message of ``~held``.

        Args:
            seconds: When it came.
            is_paused: Whether the run is paused.
            on_hold: The actuators that are on hold.
            held: The actions that are held.
        """
        stops = ["paused"] * is_paused + [f"{name} on hold" for name in on_hold]
        waits = [f"{who}: {what} for approval" for who, what, why in held if why == APPROVAL]
        kind, name = HOLD if stops else APPROVAL, ", ".join((*stops, *waits))
        last = self.spans[-1] if self.spans else None
        if last is not None and last.ended is None:
            if (last.kind, last.name) == (kind, name):
                return
            self.spans[-1] = replace(last, ended=max(seconds, last.began))
        if name:
            self.spans.append(HoldSpan(seconds, None, kind, name))


def read_held(held: Sequence[str], reasons: Sequence[str]) -> Tuple[HeldRow, ...]:
    """Reads the actions of a message of ``~held``; an atom that is none is skipped."""
    found = []
    for atom, reason in zip(held, reasons):
        name, arguments = split_term(atom)
        if name == "do" and len(arguments) == 2:
            found.append((arguments[0], arguments[1], reason))
    return tuple(found)
