"""A search that somebody else ends begins again."""

from __future__ import annotations

from typing import Callable, List, Optional, Sequence

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, Assumed, Ground, Improvement, Outcome, Part, Result
from rosoclingo.errors import LoopError
from rosoclingo.loop.mode.retrying import RetryingSolver
from rosoclingo.loop.values.solver import Forwarding


class Disturbed(Forwarding):
    """A solver whose first searches somebody else ends."""

    def __init__(self, times: int) -> None:
        engine = Engine(Options())
        engine.run([Add("a", (), "a."), Ground((Part("a"),))])
        super().__init__(engine)
        self.times = times

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        self.times -= 1
        if self.times >= 0:
            return super().solve(assumptions, lambda: True)
        return super().solve(assumptions, stopped, improved)


def test_it_is_tried_again_with_one_warning() -> None:
    warnings: List[str] = []
    solver = RetryingSolver(Disturbed(3), "/planner", warnings.append)
    assert solver.solve((), lambda: False) == Outcome(Result.SAT, symbols=("a",))
    (warning,) = warnings
    assert "leave /planner/goal and /planner/cancel out of what rosbag plays" in warning


def test_a_search_that_was_told_to_stop_ends() -> None:
    warnings: List[str] = []
    outcome = RetryingSolver(Disturbed(0), "/planner", warnings.append).solve((), lambda: True)
    assert outcome.interrupted
    assert warnings == []


def test_a_rival_that_never_ends_is_named() -> None:
    with pytest.raises(LoopError, match="does another rosoclingo use that solver"):
        RetryingSolver(Disturbed(10_000), "/controller", lambda _: None).solve()
