"""The manual's two examples, in process: the same encodings and commands as the clients'."""

from __future__ import annotations

from pathlib import Path
from typing import Tuple

import pytest

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.wire.commands import Add, AssignExternal, Ground, Outcome, Part, Result, Truth

EXAMPLES = Path(__file__).parents[2] / "example"

# The examples of the manual's part ROSClingo: docs/protocol.md, section "Sources".
PLAN = {
    *("do(arm,pickup(4),1)", "do(arm,putdown(b),2)", "do(arm,pickup(3),3)", "do(arm,putdown(4),4)"),
    *("do(arm,pickup(2),5)", "do(arm,putdown(3),6)", "do(arm,pickup(1),7)", "do(arm,putdown(c),8)"),
    *("do(arm,pickup(2),9)", "do(arm,putdown(1),10)", "do(arm,pickup(3),11)"),
    *("do(arm,putdown(2),12)", "do(arm,pickup(4),13)", "do(arm,putdown(3),14)"),
}


def engine_with(encoding: str, *options: str) -> Engine:
    files = ["-f", str(EXAMPLES / "instance.lp"), "-f", str(EXAMPLES / encoding)]
    return Engine(parse_options([*files, *options]))


def assert_is_the_plan(outcome: Outcome) -> None:
    assert (outcome.result, outcome.interrupted) == (Result.SAT, False)
    assert len(outcome.symbols) == 14
    assert set(outcome.symbols) == PLAN


@pytest.mark.parametrize("options", [(), ("-c", "max=14")])
def test_one_shot(options: Tuple[str, ...]) -> None:
    engine = engine_with("toh.lp", *options)
    engine.apply(Ground((Part("base"),)))
    assert_is_the_plan(engine.solve())


def test_one_shot_with_a_step_too_few() -> None:
    engine = engine_with("toh.lp", "-c", "max=13")
    engine.apply(Ground((Part("base"),)))
    assert engine.solve() == Outcome(Result.UNSAT)


def test_the_plan_is_the_only_one() -> None:
    # Else clingo could print another than the manual does.
    engine = engine_with("toh.lp")
    engine.apply(Add("other", (), f":- {','.join(sorted(PLAN))}."))
    engine.apply(Ground((Part("base"), Part("other"))))
    assert engine.solve() == Outcome(Result.UNSAT)


def test_incremental() -> None:
    engine = engine_with("itoh.lp")
    engine.apply(Ground((Part("base"), Part("state", ("0",)), Part("query", ("0",)))))
    engine.apply(AssignExternal("query(0)", Truth.TRUE))
    for horizon in range(14):
        assert engine.solve() == Outcome(Result.UNSAT), f"horizon {horizon}"
        step = (str(horizon + 1),)
        engine.apply(AssignExternal(f"query({horizon})", Truth.FALSE))
        engine.apply(Ground(tuple(Part(name, step) for name in ("state", "transition", "query"))))
        engine.apply(AssignExternal(f"query({horizon + 1})", Truth.TRUE))
    assert_is_the_plan(engine.solve())
