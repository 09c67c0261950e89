"""The dispatch interlock: holds actions back until an operator lets them begin.

An action that is held is committed already, and its actuator owes an answer, as to every action of
the step; only nobody has told it yet. So the planner needs to know nothing of it, and the others
act on.

>>> interlock = Interlock(("deliver(*)",))
>>> interlock.reason("robot", "go(3)"), interlock.reason("robot", "deliver(1)")
(None, <HoldReason.APPROVAL: 'approval'>)
>>> interlock.apply(Control.APPROVE, "robot")
>>> interlock.apply(Control.PAUSE)
>>> interlock.reason("robot", "deliver(1)")
<HoldReason.PAUSE: 'pause'>
>>> interlock.apply(Control.RESUME)
>>> interlock.reason("robot", "deliver(1)") is None
True
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Optional, Pattern, Sequence, Set

from rosoclingo.loop.journal import Control
from rosoclingo.loop.values.execution import HoldReason

_BLANKS = re.compile(r'("(?:\\.|[^"\\])*")|\s+')  # and strings, in which they count


def read_pattern(text: str) -> Pattern[str]:
    """Compiles a pattern of actions; blanks outside of strings do not count.

    Raises:
        ValueError: Its brackets are not in pairs, as if it was cut at a blank.

    >>> bool(read_pattern("take(*, 2)").fullmatch("take(box,2)"))
    True
    """
    compact = _BLANKS.sub(lambda found: found[1] or "", text)
    outside = _BLANKS.sub("", compact)
    if not compact or outside.count("(") != outside.count(")"):
        raise ValueError(
            f"{text!r} is no pattern of actions such as deliver(*): its brackets are not in pairs; "
            "a pattern with blanks is one of a list"
        )
    return re.compile(".*".join(re.escape(part) for part in compact.split("*")), re.DOTALL)


@dataclass
class InterlockState:
    """Saved state of a :class:`Interlock`.

    Attributes:
        is_paused: Whether no action is dispatched.
        steps: Whether the next actions are nevertheless.
        on_hold: The actuators that are on hold.
        approved: The actuators whose next action is approved.
    """

    is_paused: bool = False
    steps: bool = False
    on_hold: Set[str] = field(default_factory=set)
    approved: Set[str] = field(default_factory=set)


class Interlock(InterlockState):
    """Decides which actions may be dispatched. Used by the loop's thread."""

    def __init__(self, ask_before: Sequence[str] = ()) -> None:
        """Begins with a run that is not paused.

        Args:
            ask_before: Which actions need an approval: patterns, with ``*`` for any text, of
                actions such as ``deliver(*)``, or with their actuators, as ``do(robot,*)``.

        Raises:
            ValueError: One of them is none.
        """
        super().__init__()
        self._ask_before = [read_pattern(one) for one in ask_before]

    @property
    def asks(self) -> bool:
        """Tells if any action needs an approval."""
        return bool(self._ask_before)

    def needs_approval(self, actuator: str, action: str) -> bool:
        """Returns whether an operator is to approve an action, be it approved or not."""
        texts = (action, f"do({actuator},{action})")
        return any(one.fullmatch(text) for one in self._ask_before for text in texts)

    def reason(self, actuator: str, action: str) -> Optional[HoldReason]:
        """Returns why an action is held; None if it may be dispatched."""
        if actuator not in self.approved and self.needs_approval(actuator, action):
            return HoldReason.APPROVAL
        if actuator in self.on_hold:
            return HoldReason.HOLD
        return HoldReason.PAUSE if self.is_paused and not self.steps else None

    def note_dispatched(self, actuators: Sequence[str]) -> None:
        """Says that actions were dispatched: each approval was for one, and so was a step."""
        self.approved.difference_update(actuators)
        if actuators:
            self.steps = False

    def apply(self, control: Control, actuator: str = "") -> None:
        """Changes what may be dispatched from now on, by an operator's request.

        Args:
            control: What is wanted.
            actuator: Of which actuator.
        """
        if control in (Control.PAUSE, Control.HALT, Control.STEP):
            self.is_paused, self.steps = True, control is Control.STEP
        elif control is Control.RESUME:
            self.is_paused = self.steps = False
        elif control is Control.HOLD:
            self.on_hold.add(actuator)
        elif control is Control.RELEASE:
            self.on_hold.discard(actuator)
        elif control is Control.APPROVE:
            self.approved.add(actuator)
