"""A recorded run as values: its journal, and how its nodes were started."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Mapping, Optional, Tuple

from rosoclingo.bags.holds import HoldHistory, HoldSpan, OperatorDecisions
from rosoclingo.encodings.about import SOLVER_NODE, Launched
from rosoclingo.loop.journal import Entry
from rosoclingo.loop.values.plan_times import PlanTimes


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
        held: The messages of ``~held``, in order, each with when it was recorded, in seconds since
            the recording began; empty in a bag from before that was recorded.
        feedback: Goals' feedback, in order; empty if it was not to be read.
        plan_times: The times that ``~plan`` has said, in order, each with when it was recorded, in
            seconds since the recording began.
    """

    name: str
    entries: Tuple[Entry, ...]
    programs: Mapping[str, Launched] = field(default_factory=dict)
    remarks: Tuple[str, ...] = ()
    size: int = 0
    has_journal: bool = True
    held: Tuple[Tuple[float, OperatorDecisions], ...] = ()
    feedback: Tuple[FeedbackLine, ...] = ()
    plan_times: Tuple[Tuple[float, PlanTimes], ...] = ()

    @property
    def planner(self) -> Optional[Launched]:
        """How the node with the planner's encoding was started; None if the bag does not say."""
        loop = self.programs.get(self.name)
        if loop is None or not loop.solvers:
            return loop
        planner = self.programs.get(loop.solvers.get("planner", ""))
        return planner if planner is not None and planner.program == SOLVER_NODE else None

    @property
    def hold_spans(self) -> Tuple[HoldSpan, ...]:
        """The time spans in which an operator held something."""
        history = HoldHistory()
        for seconds, decisions in self.held:
            history.add(seconds, decisions)
        return tuple(history.spans)
