"""A recorded run as values: its journal, and how its nodes were started."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping, Tuple

from rosoclingo.drawing.holds import HoldHistory, HoldSpan, read_held
from rosoclingo.launched.about import Launched
from rosoclingo.loop.journal import Record


@dataclass(frozen=True)
class Entry(Record):
    """An event of a recorded journal.

    Attributes:
        number: Its number in the journal, from 1.
        seconds: When it happened, in seconds of wall time since the recording began; negative for
            what was published before.
    """

    number: int = 1
    seconds: float = 0.0


@dataclass(frozen=True)
class OperatorHold:
    """A message of ``~held``: pause, actuators and actions that an operator held from then on.

    Attributes:
        seconds: When it was recorded, by the recorder's clock, since the recording began.
        is_paused: Whether the run was paused.
        on_hold: The actuators that were on hold.
        held: The actions that were held, as ``do(Actuator,Action)``.
        reasons: Why each of them was.
    """

    seconds: float
    is_paused: bool = False
    on_hold: Tuple[str, ...] = ()
    held: Tuple[str, ...] = ()
    reasons: Tuple[str, ...] = ()


@dataclass(frozen=True)
class FeedbackLine:
    """A line of feedback for a goal.

    Attributes:
        seconds: When it was recorded, by the recorder's clock, since the recording began.
        goal: The goal's id.
        text: The line.
    """

    seconds: float
    goal: str
    text: str


@dataclass(frozen=True)
class Recording:
    """The recorded run of one system, read from a bag.

    Attributes:
        name: Resolved name of the node with the planning loop, such as ``/rosoclingo``.
        entries: The journal, in the order of its numbers.
        programs: How the nodes were started, by node; empty if the bag does not say.
        remarks: What was wrong with the bag and could be mended, in words for the user.
        size: Size of the bag in bytes.
        has_journal: Whether the bag has the journal itself; otherwise the entries were made from
            what the bag has of the node's other topics.
        held: The messages of ``~held``, in order; empty in a bag from before that was recorded.
        feedback: Goals' feedback, in order; empty if it was not to be read.
    """

    name: str
    entries: Tuple[Entry, ...]
    programs: Mapping[str, Launched] = field(default_factory=dict)
    remarks: Tuple[str, ...] = ()
    size: int = 0
    has_journal: bool = True
    held: Tuple[OperatorHold, ...] = ()
    feedback: Tuple[FeedbackLine, ...] = ()

    @property
    def hold_spans(self) -> Tuple[HoldSpan, ...]:
        """The time spans in which an operator held something."""
        history = HoldHistory()
        for one in self.held:
            held = read_held(one.held, one.reasons)
            history.add(one.seconds, one.is_paused, one.on_hold, held)
        return tuple(history.spans)
