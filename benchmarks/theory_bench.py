#!/usr/bin/env python3
"""Times agendas with the sums of lib/agenda.lp beside difference constraints, by clingo-dl.

Several robots of the office with ways as long as there, and requests of which all are told at once.
The mailbot's encoding makes the tables: what it costs to do one request after another. From these,
each of three programs finds the agenda whose last delivery is as early as possible, and proves it
the best; that all say the same second is checked. Measured is processor time, from the tables to
the proof, with grounding.

clingo-dl minimises nothing that a program says. So after each answer set it is asked for less, by a
further part, as clingo-dl's own program does it; once with difference constraints alone, and once
with the redundant sum of agenda.lp, by which all robots together have no more time than that.

Run by scripts/bench; needs the package clingo-dl. No figure has a limit.
"""

from __future__ import annotations

import random
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Tuple

from harness import HarnessError, Report, Row, Samples
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Add, Ground, Outcome, Part, Result
from rosclingo.wire.term_text import split_term
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.values.atoms import event

ROOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms"
ENCODINGS = Path(__file__).with_name("encodings")
SIZES = ((2, 4), (2, 6), (2, 8), (3, 6), (3, 8))  # robots, requests
DRAWS = 5
OFFICES = [f"o{number}" for number in range(1, 15)]
_SEARCH = "1"  # the number of the only one

Agenda = Dict[str, str]
"""What is done right after a task, or after ``first(R)``, which is robot R as it is."""


class Found(NamedTuple):
    """The best agenda, and the milliseconds of processor time that it took."""

    agenda: Agenda
    duration: float


def make_tables(robots: int, requests: int, seed: int) -> List[str]:
    """Returns the facts of which an agenda is made, for random requests in the office.

    Raises:
        HarnessError: The encoding does not know the requests.
    """
    dice = random.Random(f"{robots} {requests} {seed}")
    files = (
        *(ROOT / "mailbot" / "instances" / name for name in (f"fleet_{robots}.lp", "lengths.lp")),
        *(ROOT / "mailbot" / "mailbot.lp", ENCODINGS / "agenda_tables.lp"),
    )
    planner = Planner(Engine(Options(tuple(map(str, files)), ("-c", f"slots={requests}"))))
    planner.begin()
    pairs = (dice.sample(OFFICES, 2) for _ in range(requests))
    brings = [f"bring({origin},{destination})" for origin, destination in pairs]
    if planner.tell([event(str(slot), request, 0) for slot, request in enumerate(brings, 1)]):
        raise HarnessError("the encoding does not know the requests")
    shown = planner.search(0, sys.maxsize, lambda: False).symbols
    return [split_term(text)[1][0] for text in shown if text.startswith("table(")]


def by_sums(tables: Sequence[str]) -> Found:
    """Finds the best agenda with ``lib/agenda.lp``."""
    engine = _engine(ROOT / "lib" / "agenda.lp", tables)
    begin = time.process_time()
    _ground(engine, "agenda")
    outcome = engine.solve()
    duration = time.process_time() - begin
    asked = (split_term(text)[1][0] for text in outcome.symbols if text.startswith("ground(chosen"))
    agenda = (split_term(part)[1] for part in asked)
    return Found({before: task for _, before, task in agenda}, duration * 1e3)


def by_differences(tables: Sequence[str], *parts: str) -> Found:
    """Finds the best agenda with clingo-dl.

    Args:
        tables: The facts.
        parts: What is grounded for a number, by which all has to be done.

    Raises:
        HarnessError: There is none.
    """
    engine = _engine(ENCODINGS / "agenda_dl.lp", tables, "dl")
    begin = time.process_time()
    _ground(engine, "plan")
    best = outcome = engine.solve()
    while outcome.result is Result.SAT:
        best = outcome
        engine.apply(Ground(tuple(Part(name, (_SEARCH, f"{_end(best) - 1}")) for name in parts)))
        outcome = engine.solve()
    duration = time.process_time() - begin
    if best.result is not Result.SAT:
        raise HarnessError("there is no agenda")
    pairs = (split_term(text)[1] for text in best.symbols if text.startswith("chosen("))
    return Found(dict(pairs), duration * 1e3)


def _engine(encoding: Path, tables: Sequence[str], theory: str = "") -> Engine:
    engine = Engine(Options((str(encoding),), theory=theory))
    engine.apply(Add("tables", (), " ".join(f"{fact}." for fact in tables)))
    return engine


def _ground(engine: Engine, part: str) -> None:
    engine.apply(Ground((Part("base"), Part("tables"), Part(part, (_SEARCH,)))))


def _end(outcome: Outcome) -> int:
    """Returns when all is done, as clingo-dl has it."""
    (value,) = (split_term(one)[1][1] for one in outcome.symbols if one.startswith("dl(end,"))
    return int(value)


def last_delivery(agenda: Agenda, tables: Sequence[str]) -> int:
    """Returns after how many seconds the last request is served."""
    costs: Dict[Tuple[str, str], int] = {}
    for name, arguments in map(split_term, tables):
        if name == "cost":
            costs[arguments[0], arguments[1]] = int(arguments[2])
    ends = []
    for before in (one for one in agenda if one.startswith("first(")):
        seconds, place = 0, before
        while place in agenda:
            seconds += costs[place, agenda[place]]
            place = agenda[place]
        ends.append(seconds)
    return max(ends)


def compare(report: Report, robots: int, requests: int) -> None:
    """Adds rows for a number of robots and requests.

    Raises:
        HarnessError: One of the programs has found another optimum.
    """
    times: List[Tuple[float, ...]] = []
    for seed in range(DRAWS):
        tables = make_tables(robots, requests, seed)
        found = (
            by_sums(tables),
            by_differences(tables, "within"),
            by_differences(tables, "within", "spare"),
        )
        ends = {last_delivery(one.agenda, tables) for one in found}
        if len(ends) != 1:
            raise HarnessError(f"the optimum of {robots}, {requests}, {seed} is one of {ends}")
        times.append(tuple(one.duration for one in found))
    sums, *others = (Samples("ms", values) for values in zip(*times))
    name = f"{robots} robots, {requests} requests"
    report.add(Row(f"{name}: sums", sums, None))
    for what, samples in zip(("clingo-dl", "clingo-dl, and the sum of all"), others):
        ratio = samples.median / sums.median
        report.add(Row(f"{name}: {what}", samples, None, "clingo-dl / sums", ratio, "x"))


if __name__ == "__main__":
    RESULT = Report("theory")
    for size in SIZES:
        compare(RESULT, *size)
    sys.exit(RESULT.finish())
