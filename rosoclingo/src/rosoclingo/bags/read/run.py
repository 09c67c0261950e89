"""A run as its journal tells it: its inputs, its outputs and its end. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Dict, List, Optional, Sequence, Set, Tuple, Union

from rosclingo.wire.term_text import last_number
from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.run_end import RunEnd
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Reason


@dataclass(frozen=True)
class Output:
    """An output of a run: an action, a status, a published plan or the end.

    Attributes:
        event: An action, a status, the end, or a plan that was published as a whole, with its
            actions in order.
        step: In which step; None for a plan, if steps are not known, and if another thread than
            the loop's had a part in it, so that the step is a matter of chance.
    """

    event: Union[journal.ActionPublished, journal.StatusSet, journal.PlanFound, journal.LoopEnded]
    step: Optional[int] = None

    @property
    def key(self) -> journal.Event:
        """The output without step, slot and reason, by which outputs of two runs are compared."""
        if isinstance(self.event, journal.StatusSet):
            return replace(self.event, slot="", reason="")
        return journal.LoopEnded("") if isinstance(self.event, journal.LoopEnded) else self.event


class Outputs:
    """Filters the outputs out of a journal's events, one by one from its beginning."""

    def __init__(self, has_journal: bool = True) -> None:
        self._knows_steps = has_journal
        self._plan: Sequence[str] = ()

    def find(self, record: journal.Record) -> Optional[Output]:
        """Returns the output that an event stands for, if any."""
        event, step = record.event, record.step if self._knows_steps else None
        if isinstance(event, journal.StatusSet):
            # Without a slot, the goal was recalled or rejected by the thread that took it.
            return Output(event, step if event.slot else None)
        if isinstance(event, (journal.ActionPublished, journal.LoopEnded)):
            return Output(event, step)
        if isinstance(event, journal.PlanFound):
            self._plan = event.actions
        elif isinstance(event, journal.CommandDone) and event.publishes:
            return Output(journal.PlanFound(tuple(sorted(self._plan, key=_place))))
        return None


class Run:
    """A run, whose journal is read once.

    Attributes:
        has_journal: Whether there was a journal; else steps and waits are not known.
        recorded: The entries but those from the end on, if that was forced from outside, and but
            answers to questions, which change nothing; as recorded.
        recalls: The cancel requests that have ended goals without a slot before the loop took
            them, by the numbers of the statuses.
        entries: What is recorded, in causal order. A cancel request that has recalled a goal, and
            the goal itself, are noted when the loop takes them, which may be after the status of
            the goal: here they come before it. Goals that came after the end are refused and have
            no entry, so their statuses are left out, and so is that of a goal which was recalled
            just before the journal ends.
        outputs: For each of these entries, what it has put out.
        requests: What was asked for, by the ids of the goals, in the order in which they came.
        is_open: Whether the run ends while the loop was at work, or had goals to end, so that more
            was to come.
    """

    def __init__(self, entries: Sequence[Entry], has_journal: bool = True) -> None:
        """Reads a journal.

        Args:
            entries: The journal, in the order of its numbers.
            has_journal: Whether it was recorded, and not made from other topics.
        """
        self.has_journal = has_journal
        before_the_end = takewhile(lambda entry: not _is_forced_end(entry.event), entries)
        self.recorded = [e for e in before_the_end if not isinstance(e.event, journal.Explained)]
        self.recalls: Dict[int, Entry] = {}
        self._goals: Dict[str, Entry] = {}
        self._cancels: Set[str] = set()
        self._read_goals()
        self.entries = self._in_causal_order()
        reader = Outputs(has_journal)
        self.outputs = [reader.find(entry) for entry in self.entries]
        self.requests: Dict[str, str] = {}
        for entry in self.entries:
            if isinstance(entry.event, journal.GoalArrived):
                self.requests.setdefault(entry.event.goal, entry.event.request)
        self.is_open = _is_open(self.entries)

    @property
    def is_cut(self) -> bool:
        """Whether the recording is truncated, as far as it tells: the loop was still at work."""
        return self.has_journal and self.is_open

    @property
    def is_empty(self) -> bool:
        """Whether the run has neither inputs nor outputs that a replay could compare."""
        return not any(self.outputs) and (self.is_open or not self.requests)

    @classmethod
    def of(cls, recording: Recording) -> Run:
        """Reads a recording."""
        return cls(recording.entries, recording.has_journal)

    def _read_goals(self) -> None:
        recalled: Dict[str, int] = {}  # the number of the status
        for entry in self.recorded:
            event = entry.event
            if isinstance(event, journal.GoalArrived):
                self._goals.setdefault(event.goal, entry)
            elif isinstance(event, journal.CancelArrived):
                self._cancels.add(event.goal)
                if event.goal in recalled:
                    self.recalls.setdefault(recalled[event.goal], entry)
            elif isinstance(event, journal.StatusSet) and event.reason is Reason.RECALLED:
                recalled[event.goal] = entry.number

    def _in_causal_order(self) -> List[Entry]:
        ordered: Dict[int, Entry] = {}
        for entry in self.recorded:
            event = entry.event
            if isinstance(event, journal.StatusSet):
                is_recall = event.reason is Reason.RECALLED
                is_without_cause = is_recall and event.goal not in self._cancels
                if event.goal not in self._goals or is_without_cause:
                    continue
                if entry.number in self.recalls:
                    for cause in (self._goals[event.goal], self.recalls[entry.number]):
                        ordered.setdefault(cause.number, cause)
            ordered.setdefault(entry.number, entry)
        return list(ordered.values())


def _is_forced_end(event: journal.Event) -> bool:
    """Tells if an event begins an end of the run that was forced from outside."""
    if isinstance(event, journal.StatusSet):
        return event.reason is Reason.SHUTDOWN
    return isinstance(event, journal.LoopEnded) and event.is_forced


def _is_open(entries: Sequence[Entry]) -> bool:
    end = RunEnd()
    for entry in entries:
        end.see(entry.event)
    if end.loop_has_ended:
        return not end.is_over
    for entry in reversed(entries):
        event = entry.event
        if isinstance(event, journal.LoopWaits):
            return False
        if isinstance(event, journal.CommandDone):
            return not event.publishes
        if isinstance(event, journal.ARRIVALS):  # whether the loop took it as news is not known
            return True
    return True


def _place(atom: str) -> Tuple[int, str]:
    step = last_number(atom)
    return (0 if step is None else step), atom
