"""Time spans in which an operator held something, from the messages of ``~held``.

>>> history = HoldHistory()
>>> history.add(1.0, OperatorDecisions.read(True, ["robot"], [], []))
>>> history.add(3.5, OperatorDecisions.read(False, [], ["do(robot,go(2))"], ["approval"]))
>>> [(one.began, one.ended, one.kind, one.name) for one in history.spans]
[(1.0, 3.5, 'hold', 'paused, robot on hold'), (3.5, None, 'approval', 'robot: go(2) for approval')]
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Any, Deque, List, Optional, Sequence, Tuple

from rosclingo.wire.term_text import split_term

HOLD, APPROVAL = "hold", "approval"

HeldRow = Tuple[str, str, str]
"""An actuator, its action, and why that is held: a word of docs/protocol.md, section "Control"."""


@dataclass(frozen=True)
class OperatorDecisions:
    """Decisions of an operator, and the actions that wait for one, from ``~held``.

    Attributes:
        paused: Whether no action begins.
        on_hold: Of which actuators none does.
        held: Each action that is held, with its actuator and why.
        tokens: The token of each of them; none in older messages.
        rejected: Each action that was rejected and is not asked for again yet, with its actuator
            and what that is to do instead, as ``do(R,A,T)``.
    """

    paused: bool = False
    on_hold: Tuple[str, ...] = ()
    held: Tuple[HeldRow, ...] = ()
    tokens: Tuple[int, ...] = ()
    rejected: Tuple[HeldRow, ...] = ()

    @classmethod
    def read(
        cls,
        paused: bool,
        on_hold: Sequence[str],
        held: Sequence[str],
        reasons: Sequence[str],
        *,
        tokens: Sequence[int] = (),
        rejected: Sequence[str] = (),
        instead: Sequence[str] = (),
    ) -> OperatorDecisions:
        """Reads the fields of a ``ROSoClingoHeld``; an atom that is none is skipped."""
        numbers = [int(token) for token in tokens] or [0] * len(held)
        rows = [(row, number) for row, number in zip(_rows(held, reasons), numbers) if row]
        return cls(
            bool(paused),
            tuple(on_hold),
            tuple(row for row, _ in rows),
            tuple(number for _, number in rows),
            tuple(row for row in _rows(rejected, instead) if row),
        )

    @classmethod
    def of_message(cls, message: Any) -> OperatorDecisions:
        """Reads a ``ROSoClingoHeld``, which in an older bag has less fields."""
        newer = {name: getattr(message, name, ()) for name in ("tokens", "rejected", "instead")}
        return cls.read(message.paused, message.on_hold, message.held, message.reasons, **newer)


def _rows(atoms: Sequence[str], words: Sequence[str]) -> List[Optional[HeldRow]]:
    """Returns actuator, action and word for each atom; None for one that is no action."""
    terms = [(*split_term(atom), word) for atom, word in zip(atoms, words)]
    return [
        (arguments[0], arguments[1], word) if name == "do" and len(arguments) == 2 else None
        for name, arguments, word in terms
    ]


@dataclass(frozen=True)
class HoldSpan:
    """A time in which the same was held.

    Attributes:
        began: When it began, in seconds.
        ended: When it ended; None if it has not.
        kind: ``hold`` if the run was paused or an actuator on hold, ``approval`` if actions only
            waited for one, or were rejected.
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

    def add(self, seconds: float, decisions: OperatorDecisions) -> None:
        """Adds a message of ``~held``, which came at a time in seconds."""
        stops = ["paused"] * decisions.paused + [f"{name} on hold" for name in decisions.on_hold]
        waits = [
            f"{who}: {what} for approval" for who, what, why in decisions.held if why == APPROVAL
        ]
        waits += [f"{who}: {what} rejected" for who, what, _ in decisions.rejected]
        kind, name = HOLD if stops else APPROVAL, ", ".join((*stops, *waits))
        last = self.spans[-1] if self.spans else None
        if last is not None and last.ended is None:
            if (last.kind, last.name) == (kind, name):
                return
            self.spans[-1] = replace(last, ended=max(seconds, last.began))
        if name:
            self.spans.append(HoldSpan(seconds, None, kind, name))
