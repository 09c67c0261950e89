"""The dispatch interlock: holds actions back until an operator lets them begin.

A held action is committed already, and its actuator owes an answer, as to every action of the step;
but it is not dispatched yet. So the planner need not know of it, and the other actuators go on.

>>> interlock = Interlock(("deliver(*)",))
>>> interlock.reason("robot", "go(3)"), interlock.reason("robot", "deliver(1)")
(None, <HoldReason.APPROVAL: 'approval'>)
>>> interlock.apply(Control.PAUSE)
>>> interlock.reason("robot", "deliver(1)", is_approved=True)
<HoldReason.PAUSE: 'pause'>
>>> interlock.apply(Control.RESUME)
>>> interlock.reason("robot", "deliver(1)", is_approved=True) is None
True
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Optional, Sequence, Set

from rosoclingo.loop.execution.patterns import ActionPattern
from rosoclingo.loop.journal import Control
from rosoclingo.loop.values.execution import HoldReason


@dataclass
class InterlockState:
    """Saved state of a :class:`Interlock`.

    Attributes:
        is_paused: Whether no action is dispatched.
        steps: Whether the next actions are nevertheless.
        on_hold: The actuators that are on hold.
    """

    is_paused: bool = False
    steps: bool = False
    on_hold: Set[str] = field(default_factory=set)


class Interlock(InterlockState):
    """Decides which actions may be dispatched. Used by the loop's thread."""

    def __init__(self, ask_before: Sequence[str] = ()) -> None:
        """Begins with a run that is not paused.

        Args:
            ask_before: Which actions need an approval: patterns, see :class:`.ActionPattern`.

        Raises:
            ValueError: One of them is none.
        """
        super().__init__()
        self._ask_before = [ActionPattern(one) for one in ask_before]

    @property
    def asks(self) -> bool:
        """Tells if any action needs an approval."""
        return bool(self._ask_before)

    def reason(
        self, actuator: str, action: str, *, is_approved: bool = False
    ) -> Optional[HoldReason]:
        """Returns why an action is held; None if it may be dispatched.

        Args:
            actuator: Whose action it is.
            action: The action.
            is_approved: Whether an operator has approved it.
        """
        if not is_approved and any(one.fits(actuator, action) for one in self._ask_before):
            return HoldReason.APPROVAL
        if actuator in self.on_hold:
            return HoldReason.HOLD
        return HoldReason.PAUSE if self.is_paused and not self.steps else None

    def note_dispatched(self) -> None:
        """Says that actions were dispatched: a step is for those that begin together."""
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
