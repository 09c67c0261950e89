#!/usr/bin/env python3
"""Times plans by an encoding that is written step by step, and is hard one horizon after the other.

In process: a hospital of 40 places with two requests, whose shortest plan has 20 to 40 steps. The
planner has two seconds for one horizon after the other, as by default, and then lets several take
turns; its first plan is improved until it is proven the best of its horizon, as while robots act.
clingo itself is told that the plan has at most 60 steps, which is unknown beforehand; these two
seconds are granted to the first plan, for a shortest plan that is found by then. Both in turn.

And eight blocks with one arm, one action a step: random towers, which are to become others, in
processor time, with clingo's default options.

Run by scripts/bench. Exit status 1 says that a limit is missed. ``--draws N`` says how often each
is measured.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from itertools import count
from pathlib import Path
from typing import Iterator, List, NamedTuple, Tuple

import clingo

from harness import HarnessError, Report, Row, Samples
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Result
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import event, query

ENCODINGS = Path(__file__).with_name("encodings")
ENCODING = ENCODINGS / "linen.lp"
BLOCKS = ENCODINGS / "eight_blocks.lp"
DRAWS = 10
STEPS = 60  # the horizon that clingo is told
ONE_BY_ONE = 2.0  # s, by default
MOST = 120.0  # s, after which neither goes on
FIRST, BEST = 1.0, 1.4  # of clingo's time
BLOCKS_WORST = 30_000.0  # ms
# Those wards to which the battery lasts for the way there and back.
WARDS = [f"ward(1,{i})" for i in range(1, 8)] + [f"ward(2,{i})" for i in range(1, 6)]


class Times(NamedTuple):
    """Times of one run: milliseconds to the first and to the best plan, and what that costs."""

    first: float
    best: float
    cost: int


def draw(seed: int) -> List[str]:
    """Returns two random requests, as events of step 0."""
    dice = random.Random(seed)
    wards = dice.sample(WARDS, 2)
    return [event(str(i), f"bring({w},{dice.randint(1, 3)})", 0) for i, w in enumerate(wards, 1)]


def towers(dice: random.Random) -> List[str]:
    """Returns how eight blocks stand in random towers, as terms of ``eight_blocks.lp``."""
    blocks = dice.sample("abcdefgh", 8)
    return [
        f"table({block})" if below is None or dice.random() < 0.25 else f"on({block},{below})"
        for below, block in zip([None, *blocks], blocks)
    ]


def blocks(seed: int) -> Iterator[str]:
    """Yields the facts of a random task with eight blocks."""
    dice = random.Random(seed)
    start = towers(dice)
    yield f"#program base. block({';'.join('abcdefgh')}). init(free)."
    for block in "abcdefgh":
        if not any(fluent.endswith(f",{block})") for fluent in start):
            yield f"init(clear({block}))."
    yield from (f"init({fluent})." for fluent in start)
    yield from (f"goal({fluent})." for fluent in towers(dice))


def search(planner: Planner, events: List[str]) -> Tuple[float, int]:
    """Has a planner search as a mode does.

    Returns:
        When it has a plan, and with which horizon.

    Raises:
        HarnessError: It has none in time.
    """
    end = time.monotonic() + MOST
    planner.begin()
    planner.note_last_horizon(10_000)
    planner.tell(events)
    planner.query(0, None, [])
    for horizon in count():
        result = planner.search(0, horizon, lambda: time.monotonic() > end).result
        if result is Result.SAT:
            break
        if result is Result.UNKNOWN:
            raise HarnessError(f"{events}: no plan in {MOST:.0f} s")
        planner.query(horizon + 1, horizon, [horizon + 1])
    return time.monotonic(), horizon


def plan_blocks(seed: int) -> float:
    """Returns the processor time, in ms, of a first plan for a random task with eight blocks."""
    with tempfile.NamedTemporaryFile("w", suffix=".lp") as facts:
        facts.write("\n".join(blocks(seed)))
        facts.flush()
        begin = time.process_time()
        engine = Engine(Options((str(BLOCKS), facts.name)))
        search(Planner(engine, one_by_one_seconds=ONE_BY_ONE), [])
    return (time.process_time() - begin) * 1e3


def plan(events: List[str]) -> Times:
    """Plans, and improves the plan before anything is published."""
    begin = time.monotonic()
    planner = Planner(Engine(Options((str(ENCODING),))), one_by_one_seconds=ONE_BY_ONE)
    first, horizon = search(planner, events)

    def is_over() -> bool:
        return time.monotonic() > begin + MOST

    while planner.may_improve and not is_over():
        planner.improve(0, is_over, horizon=horizon)
    if planner.quality is None or not planner.quality.is_best:
        raise HarnessError(f"{events}: no plan is proven the best in {MOST:.0f} s")
    best = time.monotonic()
    return Times((first - begin) * 1e3, (best - begin) * 1e3, *planner.quality.cost)


def solve(events: List[str]) -> Times:
    """Has clingo find the best plan of ``STEPS`` steps."""
    begin = time.monotonic()
    control = clingo.Control(logger=lambda code, text: None)
    control.load(str(ENCODING))
    start = [("base", []), ("state", [clingo.Number(0)]), ("query", [clingo.Number(0)])]
    control.ground(start)
    for told in events:
        control.assign_external(clingo.parse_term(told), True)
    for step in range(1, STEPS + 1):
        control.ground([(name, [clingo.Number(step)]) for name in ("state", "transition", "query")])
    control.assign_external(clingo.parse_term(query(STEPS)), True)
    first, cost = 0.0, 0
    with control.solve(yield_=True, async_=True) as handle:
        while True:
            handle.resume()
            if not handle.wait(begin + MOST - time.monotonic()):
                raise HarnessError(f"{events}: clingo has no best plan in {MOST:.0f} s")
            model = handle.model()
            if model is None:
                break
            first = first or time.monotonic()
            (cost,) = model.cost
    return Times((first - begin) * 1e3, (time.monotonic() - begin) * 1e3, cost)


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of requests")
    draws = range(parser.parse_args().draws)
    pairs = [(solve(draw(seed)), plan(draw(seed))) for seed in draws]
    report = Report("plain")
    rows = [("first plan", 0, ONE_BY_ONE * 1e3, FIRST), ("best plan", 1, 0.0, BEST)]
    for name, number, granted, limit in rows:
        base, ours = (Samples("ms", tuple(run[number] for run in runs)) for runs in zip(*pairs))
        ratios = tuple(run[number] / (ref[number] + granted) for ref, run in pairs)
        of = "ours / (clingo + 2 s)" if granted else "ours / clingo"
        report.add(Row(name, base, ours, of, Samples("", ratios).median, "x", limit))
    dearer = sum(run.cost > ref.cost for ref, run in pairs)
    report.add(Row("plans that cost more than clingo's", None, None, "plans", dearer, "", 0))
    samples = Samples("ms", tuple(map(plan_blocks, draws)))
    for what, value in (("median", samples.median), ("worst", max(samples.values))):
        most = {"worst": BLOCKS_WORST}.get(what)
        report.add(Row("eight blocks, first plan", None, samples, what, value, "ms", most))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
