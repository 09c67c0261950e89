"""In which order goals get slots that wait for one."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, List, Sequence

import pytest

from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.journal import Event, Status, StatusSet
from rosoclingo.loop.values.goals import Goal, Goals

FIRST = {
    "line": "#program state(t). #external event(queue,first(visit((4;5))),t).",
    "line_demand": "#program event(s,c). #external event(s,c) : c = first(visit(4..5)), s = queue.",
}
"""Visits of 4 and 5 get a slot before others: by an external, and where events are told."""


def goals(*names: str) -> Callable[[Goals], List[str]]:
    """Returns what puts goals into a queue; those that begin with ! are first."""

    def add(queue: Goals) -> List[str]:
        for name in names:
            goal = Goal(name)
            queue.add(goal)
            queue.decide(goal, is_first=name.startswith("!"))
        return [goal.request for goal in queue.queued]

    return add


def test_who_is_first_overtakes_the_others_but_none_that_is_first() -> None:
    queue = Goals()
    queue.set_slots("12")
    assert goals("a", "b", "!c", "d", "!e")(queue) == ["!c", "!e", "a", "b", "d"]


def test_nobody_is_overtaken_by_more_goals_than_there_are_slots() -> None:
    queue = Goals()
    queue.set_slots("12")
    assert goals("a", "!b", "!c", "!d", "e", "!f")(queue) == ["!b", "!c", "a", "!d", "!f", "e"]


def test_who_is_recalled_counts_no_more() -> None:
    queue = Goals()
    queue.set_slots("1")
    goals("a", "!b")(queue)
    queue.queued[0].recall()
    assert [goal.request for goal in queue.queued] == ["a"]
    assert queue.undecided() == []


@pytest.mark.parametrize("mode", ["dynamic.incremental.dyn_reset", SINGLE])
@pytest.mark.parametrize("encoding", sorted(FIRST))
def test_the_encoding_says_who_is_first(tmp_path: Path, encoding: str, mode: str) -> None:
    """The robot begins at 1; there is a slot for one goal at a time."""
    file = tmp_path / "first.lp"
    file.write_text(FIRST[encoding])
    options = Options((f"{EXAMPLES}/{encoding}.lp", str(file)), ("-c", "slots=1"))
    inputs = ["goal:visit(2)", "goal:visit(3)", "goal:visit(4)", "goal:visit(6)", "goal:visit(5)"]
    run = SimulatedSystem(make_parts(mode, options).loop, [read_input(one) for one in inputs])
    assert run.run() is None
    assert [goal.words for goal in run.goals] == [["accepted", "succeeded"]] * 5
    assert places(run.goals[4].lines)[-3:] == [3, 2, 1]  # visit(3) was overtaken already
    accepted = [e.event.goal for e in run.journal if is_acceptance(e.event)]
    assert [run.goals[int(goal) - 1].request for goal in accepted] == [
        f"visit({cell})" for cell in (4, 2, 3, 5, 6)
    ]


def places(lines: Sequence[str]) -> List[int]:
    """Returns which place in the queue a client was told."""
    return [int(line.split()[1]) for line in lines if line.startswith("queued")]


def is_acceptance(event: Event) -> bool:
    return isinstance(event, StatusSet) and event.status is Status.ACCEPTED


def test_how_late_a_goal_is_counts_from_when_it_came(tmp_path: Path) -> None:
    """Not from when it got its slot."""
    file = tmp_path / "times.lp"
    file.write_text(
        "#program state(t). #show due(ID,1) : rslot(ID). #program transition(t)."
        "#show lasts(do(robot,go(X),t),go,10) : do(robot,go(X),t)."
        "#show expected(ID,do(robot,go(X),t)) : do(robot,go(X),t), asked(ID,X,t)."
    )
    options = Options((f"{EXAMPLES}/line.lp", str(file)), ("-c", "slots=1"))
    inputs = [read_input("goal:visit(3)"), read_input("goal:visit(4)")]
    parts = make_parts("dynamic.incremental.recording", options)
    run = SimulatedSystem(parts.loop, inputs, seconds=lambda *_: 10.0)
    assert run.run() is None
    assert "late by 29 s" in run.goals[1].lines
