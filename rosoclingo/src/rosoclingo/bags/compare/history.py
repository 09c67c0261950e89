"""What became of the goals of a run, and what its loop has put out, in order. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence, Tuple

from rosclingo.wire.term_text import last_number, split_list
from rosoclingo.bags.compare.outputs import INPUTS, Output, Reader
from rosoclingo.bags.model import Entry
from rosoclingo.loop.journal import Event

OPEN = "open"
"""The outcome of a goal that has not ended."""


@dataclass(frozen=True)
class Goal:
    """What became of a goal in one run.

    Attributes:
        statuses: Its statuses, with the step where that is known.
        outcome: The last of them; ``open`` if it has not ended.
        steps: In how many steps there were actions from when it came until it ended.
    """

    statuses: Tuple[str, ...] = ()
    outcome: str = OPEN
    steps: int = 0


@dataclass(frozen=True)
class Cell:
    """Something that a run has put out, in words; the step only where it is known."""

    step: Optional[int]
    text: str


class History:
    """What a journal says of its goals, and what its loop has put out."""

    def __init__(self, entries: Sequence[Entry], has_journal: bool, reader: Reader) -> None:
        self.requests: Dict[str, str] = {}
        self.numbers: Dict[str, int] = {}  # of the goals, in the order in which they came
        self.goals: Dict[str, Goal] = {}
        self.steps = 0
        self.timeline: List[Output] = []
        self.places: List[int] = []  # for each output, how many of the timeline come before it
        self.inputs: Dict[int, List[Event]] = {}  # by the place in the timeline that they precede
        self._published: List[Output] = []
        self._has_journal = has_journal
        self._begins: Dict[str, int] = {}
        self._acted: Optional[int] = None  # the step of the last action
        for entry in entries:  # before the rest: a status that comes before its goal is no harm
            if entry.event.kind == "goal" and entry.event.id not in self.requests:
                self.requests[entry.event.id] = entry.event.text
                self.numbers[entry.event.id] = len(self.numbers) + 1
                self.goals[entry.event.id] = Goal()
        for entry in entries:
            output = reader.output(entry.event)
            if output is not None:
                self.places.append(len(self.timeline))
                self._take_output(output)
            if entry.event.kind in INPUTS:
                self.inputs.setdefault(len(self.timeline), []).append(entry.event)
                if entry.event.kind == "goal":
                    self._begins.setdefault(entry.event.id, self.steps)
            elif entry.event.kind == "action" and entry.event.step != self._acted:
                self._acted = entry.event.step
                self.steps += 1
            elif entry.event.kind == "command" and entry.event.text.startswith("reset("):
                self._acted = None  # steps count from 0 again
        for identifier, goal in self.goals.items():
            if goal.outcome == OPEN:
                steps = self.steps - self._begins.get(identifier, 0)
                self.goals[identifier] = replace(goal, steps=steps)

    def ends(self, with_lengths: bool) -> List[Tuple[str, int]]:
        """Returns which plans were published, maybe with lengths, and whether the loop ended."""
        return [(output.kind, _length(output) if with_lengths else 0) for output in self._published]

    def cell(self, output: Output) -> Cell:
        """Describes an output."""
        step = output.step if self._has_journal else None
        if output.kind == "action":
            return Cell(step, f"{output.id}: {output.text}")
        if output.kind == "status":
            return Cell(step, f"{self.label(output.id)}: {output.text}")
        if output.kind == "plan":
            return Cell(None, f"published: [{output.text}]")
        return Cell(step, f"the end: {output.text}")

    def input(self, event: Event) -> Cell:
        """Describes an input."""
        step = event.step if self._has_journal else None
        if event.kind == "message":
            return Cell(step, f"message {event.id}: {event.text}")
        name = self.label(event.id) if event.id in self.requests else event.id
        return Cell(step, f"{name} {'came' if event.kind == 'goal' else 'is to be cancelled'}")

    def label(self, identifier: str) -> str:
        """Names a goal, by its number in the order of arrival and its request."""
        return f"goal {self.numbers[identifier]} {self.requests[identifier]}"

    def _take_output(self, output: Output) -> None:
        if output.kind in ("plan", "end"):
            self._published.append(output)
            self.steps += _length(output)
        if output.kind == "status":
            self._take_status(output)
            if output.step is None or not self._has_journal:
                return  # another thread may have set it: there is no order to the rest
        if self._has_journal or output.kind != "end":
            self.timeline.append(output)

    def _take_status(self, output: Output) -> None:
        goal = self.goals[output.id]
        at_step = output.step is not None and self._has_journal
        word = f"{output.text} in step {output.step}" if at_step else output.text
        self.goals[output.id] = Goal(
            (*goal.statuses, word),
            OPEN if output.text == "accepted" else output.text,
            self.steps - self._begins.get(output.id, 0),
        )


def _length(output: Output) -> int:
    """Returns in how many steps a published plan has actions; 0 for anything else."""
    steps = set(map(last_number, split_list(output.text))) if output.kind == "plan" else set()
    return len(steps - {None})
