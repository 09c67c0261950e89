"""Clients are told when their goals will be served, and told again when that has moved."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import pytest

from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.values.arrivals import SaidTime
from rosoclingo.loop.words import EXPECTED

TIMES = """
#program state(t).
#show due(ID,25) : rslot(ID).
#program transition(t).
#show lasts(do(robot,go(X),t),go,10) : do(robot,go(X),t).
#show expected(ID,do(robot,go(X),t)) : do(robot,go(X),t), asked(ID,X,t).
"""
"""A step of the robot takes 10 s, and each goal is due within 25 s."""


class Run(SimulatedSystem):
    """A robot on a line, with what was shown of it.

    Attributes:
        shown: When goals will be served, each time that it was shown.
    """

    def __init__(self, folder: Path, seconds: Sequence[float], *inputs: str, **more: Any) -> None:
        self.shown: List[Tuple[str, ...]] = []
        self._message: Tuple[Any, ...] = ()
        file = folder / "times.lp"
        file.write_text(TIMES)
        options = Options((f"{EXAMPLES}/line.lp", str(file)))
        parts = make_parts(more.pop("mode", "dynamic.incremental.recording"), options)
        rest = list(seconds)
        super().__init__(
            parts.loop,
            [read_input(*one.split("@")) for one in inputs],
            seconds=lambda actuator, action: rest.pop(0) if rest else 10.0,
            **more,
        )

    def show_plan(self, *shown: Any) -> None:
        assert shown != self._message  # what is said again is not published
        self._message = shown
        said = tuple(
            str(one) for one in shown[-1] if isinstance(one, SaidTime) and one.word == EXPECTED
        )
        if not self.shown or self.shown[-1] != said:
            self.shown.append(said)

    def lines(self, number: int = 0) -> List[str]:
        """Returns what a client was told of times."""
        return [line for line in self.goals[number].lines if line.startswith(("expected", "late"))]


def test_what_goes_as_planned_is_said_once(tmp_path: Path) -> None:
    run = Run(tmp_path, [], "goal:visit(3)")
    assert run.run() is None
    assert run.goals[0].words == ["accepted", "succeeded"]
    assert run.lines() == ["expected in 20 s", "late by 0 s"]
    assert run.shown == [(), ("expected(1,20)",), ()]


@pytest.mark.parametrize(("seconds", "late"), [(17, ["late by 2 s"]), (4, [])])
def test_an_action_that_took_longer_or_less_moves_the_time(
    seconds: int, late: List[str], tmp_path: Path
) -> None:
    run = Run(tmp_path, [seconds], "goal:visit(3)")
    run.run()
    assert run.lines() == ["expected in 20 s", "late by 0 s", "expected in 10 s", *late]
    assert run.shown == [(), ("expected(1,20)",), (f"expected(1,{10 + seconds})",), ()]


def test_an_action_that_should_have_ended_moves_the_time_now_and_then(tmp_path: Path) -> None:
    """The loop looks every second, as it does with a robot."""
    run = Run(tmp_path, [22], "goal:visit(3)", action_timeout=1000)
    run.run()
    assert run.lines() == [
        "expected in 20 s", "late by 0 s", "expected in 10 s", "expected in 10 s", "late by 5 s",
        "expected in 10 s", "late by 7 s",
    ]  # fmt: skip
    assert [one[0] for one in run.shown if one] == [
        f"expected(1,{second})" for second in (20, 25, 30, 32)
    ]


def test_a_failure_and_another_goal_move_the_time(tmp_path: Path) -> None:
    """The second goal comes in step 1, and is on the way to the first one."""
    run = Run(tmp_path, [], "goal:visit(3)", "robot:failure@1", "goal:visit(2)@1")
    run.run()
    assert run.lines() == ["expected in 20 s", "late by 0 s", "expected in 20 s", "late by 5 s"]
    assert run.goals[1].words == ["accepted", "succeeded"]
    assert run.lines(1) == ["expected in 10 s", "late by 0 s", "expected in 10 s"]


def test_a_reset_changes_no_time(tmp_path: Path) -> None:
    mode = "dynamic.incremental.dyn_reset"
    run = Run(tmp_path, [10, 13], "goal:visit(2)", "goal:visit(4)", mode=mode)
    run.run()
    assert [goal.words[-1] for goal in run.goals] == ["succeeded"] * 2
    assert run.lines(1) == [
        "expected in 30 s", "late by 5 s", "expected in 10 s", "late by 8 s"
    ]  # fmt: skip
    seconds: Dict[str, None] = {one[-1]: None for one in run.shown if one}
    assert list(seconds) == ["expected(2,30)", "expected(2,33)"]
