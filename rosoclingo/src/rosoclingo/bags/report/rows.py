"""Rows of bars and charts over a run, for the report's page and its picture. Needs no ROS."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple, Union

from rosoclingo.bags.believed import BeliefSpan
from rosoclingo.bags.holds import HoldSpan
from rosoclingo.bags.report.run import PLANNED, Statistics
from rosoclingo.bags.run_model import TrackedAction

MOST_LABELS = 40  # goals whose names have room; more of them would hide each other
COLOURS = {
    "succeeded": "#2a9d63", "open": "#2f6feb", "canceled": "#8b95a5", "recalled": "#b3bac6",
    "rejected": "#c77d0a", "aborted": "#d23f3f", "success": "#4c8fd6", "failure": "#d23f3f",
    "answer": "#d39a1e", "none": "#a4adba", "message": "#7a4fc4", "dropped": "#d23f3f",
    "start": "#667085", "goal": "#2f6feb", "queued": "#2f6feb", "cancel": "#8b95a5",
    "late": "#d23f3f", "planned": "#a9c3e4",
    "restart": "#b5177b", "hold": "#7d5a1e", "approval": "#c77d0a", "belief": "#0e8a8a",
    "sat": "#2a9d63", "unsat": "#93a1b5", "unknown": "#e08a1e",
}  # fmt: skip
"""The colours by what they mean: outcomes, answers, causes of changes, results of searches."""
LEGEND: Dict[str, Dict[str, str]] = {
    "goals": {
        "open": "open", "succeeded": "succeeded", "aborted": "aborted", "rejected": "rejected",
        "canceled": "canceled", "recalled": "recalled", "late": "after the deadline",
    },
    "actions": {
        "success": "success", "failure": "failure", "answer": "other answer", "none": "no answer",
        "planned": "planned",
    },
    "messages": {"message": "no answer to an action", "dropped": "dropped"},
    "plan changes by": {
        "start": "first plan", "goal": "goal", "cancel": "cancel", "failure": "failure",
        "message": "message",
    },
    "searches": {"sat": "sat", "unsat": "unsat", "unknown": "interrupted"},
    "a node": {"restart": "goes on after it had died"},
    "an operator": {"hold": "pauses or holds", "approval": "is to approve"},
    "the encoding": {"belief": "believes in a cause"},
}  # fmt: skip
"""For each kind of bars, the words for the colours."""

_Span = Union[TrackedAction, HoldSpan, BeliefSpan]


class Bar(NamedTuple):
    """A bar on a row.

    Attributes:
        number: That of the goal, action, ... in the statistics.
        began: Where it begins.
        ended: Where it ends; the same for a mark.
        colour: Its name in :data:`COLOURS`.
    """

    number: int
    began: float
    ended: float
    colour: str


class Lane(NamedTuple):
    """A row of the time line, whose bars are in order and do not overlap.

    Attributes:
        name: What stands before it.
        kind: The attribute of :class:`.Statistics` that its bars show.
        bars: The bars.
    """

    name: str
    kind: str
    bars: List[Bar]


class Chart(NamedTuple):
    """A chart over the steps.

    Attributes:
        title: What stands above.
        is_stacked: Whether the first series is the sum of both, which the second one covers in
            part; else they are lines.
        series: For each its name, its colour, and a value for each step, in the order to draw.
    """

    title: str
    is_stacked: bool
    series: Sequence[Tuple[str, str, Sequence[float]]]


def rows(run: Statistics) -> List[Lane]:
    """Returns the rows of the time line."""
    made = _goal_rows(run)
    actions = (*run.actions, *run.planned)
    for actuator in dict.fromkeys(action.actuator for action in actions):
        bars = [
            _bar(run, i, one, _answer_colour(one.answer))
            for i, one in enumerate(actions)
            if one.actuator == actuator
        ]
        made.append(Lane(actuator, "actions", bars))
    made += [
        _marks("messages", "messages",
               [(one.seconds, "dropped" if one.dropped else "message") for one in run.messages]),
        _marks("plan changes", "changes",
               [(one.seconds, one.causes[0].kind) for one in run.changes]),
        Lane("searches", "searches",
            [Bar(i, one.ended - one.duration, one.ended, one.result)
             for i, one in enumerate(run.searches)]),
    ]  # fmt: skip
    if run.holds:
        bars = [_bar(run, i, one, one.kind) for i, one in enumerate(run.holds)]
        made.append(Lane("operator", "holds", bars))
    if run.beliefs:
        bars = [_bar(run, i, one, "belief") for i, one in enumerate(run.beliefs)]
        made.append(Lane("believed", "beliefs", bars))
    if run.restarts:
        made.append(
            _marks("restarts", "restarts", [(one.seconds, "restart") for one in run.restarts])
        )
    return made


def _marks(name: str, kind: str, marks: Sequence[Tuple[float, str]]) -> Lane:
    return Lane(name, kind, [Bar(i, at, at, colour) for i, (at, colour) in enumerate(marks)])


def _bar(run: Statistics, number: int, span: _Span, colour: str) -> Bar:
    """Returns the bar of a time span; one that has not ended goes on until the end of the run."""
    end = max(span.began, run.ended) if span.ended is None else span.ended
    return Bar(number, span.began, end, colour)


def _answer_colour(answer: str) -> str:
    return answer if answer in ("success", "failure", PLANNED) else "answer" if answer else "none"


def _goal_rows(run: Statistics) -> List[Lane]:
    """Places each goal on the first row on which it, and its name, overlap no other one."""
    room = (run.until - run.began) / (12 if len(run.goals) <= MOST_LABELS else 250)
    made: List[Lane] = []
    reached: List[float] = []
    for i, goal in enumerate(run.goals):
        number = next((n for n, end in enumerate(reached) if end < goal.came), len(reached))
        if number == len(reached):
            made.append(Lane("" if made else "goals", "goals", []))
            reached.append(0.0)
        end = (goal.expected or run.ended) if goal.ended is None else goal.ended
        reached[number] = max(end, goal.came + room)
        made[number].bars.append(Bar(i, goal.came, end, goal.outcome))
    return made


def charts(run: Statistics) -> List[Chart]:
    """Returns the charts over the steps."""
    steps = run.steps
    return [
        Chart("horizon and current step", False, [
            ("horizon", "open", [step.horizon for step in steps]),
            ("current step", "canceled", [step.number for step in steps]),
        ]),
        Chart("time for a step, in ms", True, [
            ("other commands", "recalled", [1000 * (one.solving + one.other) for one in steps]),
            ("searching", "open", [1000 * step.solving for step in steps]),
        ]),
        Chart("searches in a step", True, [
            ("interrupted", "unknown", [step.searches for step in steps]),
            ("ended", "open", [step.searches - step.interrupted for step in steps]),
        ]),
    ]  # fmt: skip
