"""All that tell a run tell the same: how actions and goals end, and why."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Iterator, List, Sequence, Tuple

import pytest

from rosoclingo.bags.compare.history import History
from rosoclingo.bags.model import Recording
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.report.run import MessageRun
from rosoclingo.bags.report.statistics import compute
from rosoclingo.bags.run_model import RunModel, TrackedAction
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Event, Status
from rosoclingo.tools.plan.story import RunStory
from rosoclingo_console.model.system import SystemModel
from rosoclingo_examples.orders import Bring
from rosoclingo_gazebo.demo.fleet import FleetStory
from rosoclingo_gazebo.demo.story import DemoStory

BAGS = sorted((Path(__file__).resolve().parent / "bags").rglob("*.bag"))
MOST = 200  # actions and ended goals that the console keeps, at least

Story = List[Tuple[str, str, bool, str]]


def stories(entries: Sequence[Entry]) -> Tuple[Story, Story]:
    """Returns how actions and goals end, by the report and by the console."""
    run = compute(Recording("", tuple(entries)))
    model = SystemModel()
    for entry in entries:
        model.hear(entry)
    told = [
        (action.actuator, action.name, action.ended is None, action.answer)
        for action in run.actions
        if action.actuator != "solver"
    ]
    shown = [
        (bar["actuator"], bar["action"], bar["ended"] is None, bar["answer"])
        for bar in model.actuators.bars().values()
    ]
    goals = model.goals.rows(model.actuators.plan.times)
    told_goals = [
        ("", goal.request, goal.ended is None, goal.reason)
        for goal in run.goals
        if goal.id in goals
    ]
    shown_goals = [
        ("", goal["request"], goal["ended"] is None, goal["reason"]) for goal in goals.values()
    ]
    told_goals += [("", f"{m.id}: {m.value}", False, m.dropped) for m in last_of(run.messages)]
    for one in last_of(run.messages):
        fate = model.messages.fate(one.id, one.value)
        assert fate is not None
        reason = f"{journal.naming(one.id, one.value)}{fate.dropped}" if fate.dropped else ""
        shown_goals.append(("", f"{one.id}: {one.value}", False, reason))
    return [*told[-MOST:], *sorted(told_goals)], [*shown, *sorted(shown_goals)]


def last_of(messages: Sequence[MessageRun]) -> Sequence[MessageRun]:
    """Returns the last message of each source and value, which are those that the console keeps."""
    return [*{(one.id, one.value): one for one in messages}.values()]


def narrated(entries: Sequence[Entry]) -> Tuple[List[str], List[str]]:
    """Returns what was taken for answers, and how goals end, by the report and by ``plan.py``."""
    run = compute(Recording("", tuple(entries)))
    lines: List[str] = []
    story = RunStory(lambda line: lines.append(line.strip()))
    for entry in entries:
        story.hear(entry)
    told = [f"{action.actuator} answers {action.answer}" for action in run.actions if action.answer]
    told += [f"{one.id} answers {one.value}" for one in run.messages if one.dropped]
    told += [f"goal {goal.id}, {goal.request}, {ENDS[goal.outcome]}" for goal in run.goals
             if goal.ended]  # fmt: skip
    said = [re.split(", at |: ", line)[0] for line in lines]
    answers = [line for line in said if re.match(r"\S+ answers ", line)]
    return sorted(told), sorted(
        [*answers, *(line for line in said if line.endswith(tuple(ENDS.values())))]
    )


def compared(entries: Sequence[Entry]) -> Tuple[List[str], List[str]]:
    """Returns how goals end, by the report and by ``compare.py``."""
    run, history = compute(Recording("", tuple(entries))), History(Run(entries), True)
    told = [f"{goal.request} {goal.outcome}" for goal in run.goals]
    said = [f"{history.requests[key]} {goal.outcome}" for key, goal in history.goals.items()]
    return [line.replace("recalled", "canceled") for line in told], said


def answers(entries: Sequence[Entry]) -> Iterator[Tuple[TrackedAction, str]]:
    """Yields what was taken for an answer, also if it was dropped then: demos tell it at once."""
    run = RunModel()
    for entry in entries:
        action = run.apply(entry)
        if action is not None and isinstance(entry.event, journal.MessageArrived):
            yield action, entry.event.value


def fleet_lines(entries: Sequence[Entry]) -> Tuple[List[str], List[str]]:
    """Returns failures and open goals, by the report and by the demo of a fleet."""
    run = compute(Recording("", tuple(entries)))
    robots = {action.actuator for action in run.actions}
    story = FleetStory(robots, {"here": (0.0, 0.0)})
    for robot in robots:
        story.moves(robot, 0.0, (0.0, 0.0), 0.0)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        for entry in entries:
            story.learns(entry.event)
    failed = [f"{answer.actuator} {answer.name} fails" for answer, value in answers(entries)
              if value != "success"]  # fmt: skip
    is_open = sum(goal.ended is None for goal in run.goals)
    said = [" ".join(line.split()[2:]) for line in out.getvalue().splitlines() if "fails" in line]
    return [*sorted(failed), f"{is_open} open"], [*sorted(said), f"{story.open} open"]


def demo_lines(entries: Sequence[Entry]) -> Tuple[List[str], List[str]]:
    """Returns actions with answers, and whether all goals ended, by the report and by the demo."""
    run = compute(Recording("", tuple(entries)))
    story = DemoStory([Bring("bring(a,b)", ("box",))] * 9, lambda _: None)
    story.moves(0.0, (0.0, 0.0))
    with contextlib.redirect_stdout(io.StringIO()) as out:
        for entry in entries:
            story.notes(entry)
    told = [f"{action.name} {value}" for action, value in answers(entries)]
    said = [" ".join(line.split()[4:6]) for line in out.getvalue().splitlines()]
    is_over = all(goal.ended is not None for goal in run.goals)
    return [*sorted(told), str(is_over)], [*sorted(said), str(story.has_ended)]


ENDS = {
    Status.SUCCEEDED.value: "has succeeded", Status.CANCELED.value: "is canceled",
    Status.ABORTED.value: "is aborted", Status.REJECTED.value: "is rejected",
    "recalled": "is canceled",
}  # fmt: skip
A, M = journal.ActionPublished, journal.MessageArrived


@pytest.mark.parametrize(
    ("events", "story"),
    [
        (
            [A("r", "go(2)"), M("r", "failure"), journal.ActionRetried("r", "go(2)", 1, "failure"),
             A("r", "go(2)"), M("r", "success")],
            [("r", "go(2)", False, "failure"), ("r", "go(2)", False, "success")],
        ),
        (
            [A("r", "go(2)"), M("r", "strange"),
             journal.MessageDropped(f"{journal.naming('r', 'strange')}it is unknown")],
            [("r", "go(2)", True, "")],
        ),
        (
            [A("r", "go(2)"), M("r", "strange"),
             journal.MessageDropped(f"{journal.naming('r', 'strange')}it is unknown"),
             M("r", "success")],
            [("r", "go(2)", False, "success")],
        ),
        ([A("r", "go(2)"), A("r", "abort"), M("r", "failure")], [("r", "go(2)", False, "failure")]),
        ([A("r", "go(2)"), A("r", "go(3)")], [("r", "go(2)", False, ""), ("r", "go(3)", True, "")]),
    ],
)  # fmt: skip
def test_actions_end_alike(events: Sequence[Event], story: Story) -> None:
    all_events = [journal.GoalArrived("g", "visit(3)"), *events]
    entries = [Entry(event, 1, 3, n, float(n)) for n, event in enumerate(all_events, 1)]
    told, shown = stories(entries)
    assert told == shown
    assert [one for one in told if ": " not in one[1]] == [*story, ("", "visit(3)", True, "")]
    for tell in (narrated, compared, fleet_lines, demo_lines):
        told, said = tell(entries)
        assert told == said


@pytest.mark.parametrize("bag", BAGS, ids=lambda bag: str(bag.relative_to(bag.parents[1])))
def test_bags_are_told_alike(bag: Path) -> None:
    entries = read_recording(bag).entries
    told, shown = stories(entries)
    assert told == shown
    assert told or "static" in bag.name
    for tell in (narrated, compared, fleet_lines, demo_lines):
        told, said = tell(entries)
        assert told == said
