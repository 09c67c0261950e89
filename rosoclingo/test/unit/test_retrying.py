"""A search that somebody else ends begins again."""

from __future__ import annotations

from dataclasses import replace
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

    def __init__(self, times: int, rival: str = "/rival") -> None:
        engine = Engine(Options())
        engine.run([Add("a", (), "a."), Ground((Part("a"),))])
        super().__init__(engine)
        self.times = times
        self.rival = rival

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        self.times -= 1
        if self.times >= 0:
            return replace(super().solve(assumptions, lambda: True), ended_by=self.rival)
        return super().solve(assumptions, stopped, improved)


def test_it_is_tried_again_with_one_warning() -> None:
    warnings: List[str] = []
    solver = RetryingSolver(Disturbed(3), "/planner", warnings.append)
    assert solver.solve((), lambda: False) == Outcome(Result.SAT, symbols=("a",))
    (warning,) = warnings
    assert "ended by a goal, cancel or control request of /rival, and is tried again" in warning
    assert "leave /planner/goal and /planner/cancel out of what rosbag plays" in warning


def test_a_search_that_was_told_to_stop_ends() -> None:
    warnings: List[str] = []
    outcome = RetryingSolver(Disturbed(0), "/planner", warnings.append).solve((), lambda: True)
    assert outcome.interrupted
    assert warnings == []


def test_a_rival_that_never_ends_is_named() -> None:
    with pytest.raises(LoopError, match="does another rosoclingo use that solver"):
        RetryingSolver(Disturbed(10_000), "/controller", lambda _: None).solve()


def test_what_no_other_node_has_ended_is_not_warned_of() -> None:
    """As when an earlier process of the same name has sent a request that comes late."""
    warnings: List[str] = []
    solver = RetryingSolver(Disturbed(3, rival=""), "/planner", warnings.append)
    assert solver.solve((), lambda: False) == Outcome(Result.SAT, symbols=("a",))
    assert warnings == []
    with pytest.raises(LoopError, match="no other node is known to have done that"):
        RetryingSolver(Disturbed(10_000, rival=""), "/planner", warnings.append).solve()


def test_who_was_told_to_stop_once_does_not_begin_again() -> None:
    """Why it was to end may be over when it has: a plan was found just then, for instance."""

    class Stopping(Disturbed):
        def solve(
            self,
            assumptions: Sequence[Assumed] = (),
            stopped: Optional[Callable[[], bool]] = None,
            improved: Callable[[Improvement], None] = lambda _: None,
        ) -> Outcome:
            assert stopped is not None
            return super().solve(assumptions, lambda: stopped() or True, improved)

    warnings: List[str] = []
    told = iter([True])
    solver = RetryingSolver(Stopping(0), "/planner", warnings.append)
    assert solver.solve((), lambda: next(told, False)).interrupted
    assert warnings == []
