"""Summarises a run for comparison: its goals' outcomes, and its outputs in order. Needs no ROS."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple, Union

from rosclingo.wire.term_text import last_number
from rosoclingo.bags.read.run import Output, Run
from rosoclingo.bags.run_model import RunModel
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry

OPEN_GOAL = "open"
"""The outcome of a goal that has not ended."""


@dataclass
class GoalHistory:
    """The statuses and outcome of a goal in one run.

    Attributes:
        statuses: Its statuses, with the step where that is known.
        outcome: How it has ended; ``open`` if it has not.
        steps: In how many steps there were actions from when it came until it ended.
    """

    statuses: Tuple[str, ...] = ()
    outcome: str = OPEN_GOAL
    steps: int = 0


@dataclass(frozen=True)
class Cell:
    """An output in words; the step only where it is known."""

    step: Optional[int]
    text: str


class History:
    """The outcomes of a run's goals, and the timeline of its outputs.

    Attributes:
        requests: The requests, by the ids of the goals, in order of arrival.
        numbers: The numbers of the goals, by their ids.
        goals: The outcomes of the goals.
        steps: In how many steps there were actions.
        timeline: The outputs that have an order.
        places: For each output, how many of the timeline come before it.
        inputs: What has come, by the place in the timeline that it precedes.
    """

    def __init__(self, run: Run, knows_steps: bool) -> None:
        """Goes through a run.

        Args:
            run: The run.
            knows_steps: Whether steps are told.
        """
        self.requests = run.requests
        self.numbers = {goal: number for number, goal in enumerate(run.requests, 1)}
        self.goals = {goal: GoalHistory() for goal in run.requests}
        self.steps = 0
        self.timeline: List[Output] = []
        self.places: List[int] = []
        self.inputs: Dict[int, List[Entry]] = {}
        self._published: List[Union[journal.PlanFound, journal.LoopEnded]] = []
        self._knows_steps = knows_steps
        self._begins: Dict[str, int] = {}
        acted: Optional[int] = None  # the step of the last action
        model = RunModel()
        for entry, output in zip(run.entries, run.outputs):
            event = entry.event
            model.apply(entry)
            if output is not None:
                self.places.append(len(self.timeline))
                self._take_output(output)
            if isinstance(event, journal.ARRIVALS):
                self.inputs.setdefault(len(self.timeline), []).append(entry)
                if isinstance(event, journal.GoalArrived):
                    self._begins.setdefault(event.goal, self.steps)
            elif isinstance(event, journal.ActionPublished) and entry.step != acted:
                acted = entry.step
                self.steps += 1
            elif isinstance(event, journal.CommandDone) and event.resets_to is not None:
                acted = None  # steps count from 0 again
        for identifier, goal in self.goals.items():
            if model.goals[identifier].ended is None:
                goal.steps = self.steps - self._begins.get(identifier, 0)
            else:
                goal.outcome = model.goals[identifier].status.value

    def ends(self, with_lengths: bool) -> List[Tuple[type, int]]:
        """Returns which plans were published, maybe with lengths, and whether the loop ended."""
        return [(type(event), _length(event) if with_lengths else 0) for event in self._published]

    def cell(self, output: Output) -> Cell:
        """Describes an output."""
        event, step = output.event, self._known(output.step)
        if isinstance(event, journal.ActionPublished):
            return Cell(step, f"{event.actuator}: {event.action}")
        if isinstance(event, journal.StatusSet):
            return Cell(step, f"{self.label(event.goal)}: {event.status.value}")
        if isinstance(event, journal.PlanFound):
            return Cell(step, f"published: [{', '.join(event.actions)}]")
        return Cell(step, f"the end: {event.reason}")

    def input(self, entry: Entry) -> Cell:
        """Describes an input."""
        event, step = entry.event, self._known(entry.step)
        assert isinstance(event, journal.ARRIVALS)
        if isinstance(event, journal.MessageArrived):
            return Cell(step, f"message {event.source}: {event.value}")
        if isinstance(event, journal.ControlArrived):
            # An older journal does not say of which action.
            return Cell(step, f"operator: {event.control} {event.actuator}".rstrip())
        name = self.label(event.goal) if event.goal in self.requests else event.goal
        what = "came" if isinstance(event, journal.GoalArrived) else "is to be cancelled"
        return Cell(step, f"{name} {what}")

    def label(self, identifier: str) -> str:
        """Names a goal, by its number in the order of arrival and its request."""
        return f"goal {self.numbers[identifier]} {self.requests[identifier]}"

    def _known(self, step: Optional[int]) -> Optional[int]:
        return step if self._knows_steps else None

    def _take_output(self, output: Output) -> None:
        event, step = output.event, self._known(output.step)
        if isinstance(event, (journal.PlanFound, journal.LoopEnded)):
            self._published.append(event)
            self.steps += _length(event)
        if isinstance(event, journal.StatusSet):
            self._take_status(event, step)
        if isinstance(event, (journal.StatusSet, journal.LoopEnded)) and step is None:
            return  # another thread may have set it: there is no order to the rest
        self.timeline.append(output)

    def _take_status(self, event: journal.StatusSet, step: Optional[int]) -> None:
        goal, word = self.goals[event.goal], event.status.value
        goal.statuses += (word if step is None else f"{word} in step {step}",)
        goal.steps = self.steps - self._begins.get(event.goal, 0)


def _length(event: Union[journal.PlanFound, journal.LoopEnded]) -> int:
    """Returns in how many steps a published plan has actions; 0 for the end."""
    if isinstance(event, journal.LoopEnded):
        return 0
    return len({last_number(action) for action in event.actions} - {None})
