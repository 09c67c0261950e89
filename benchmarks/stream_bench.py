#!/usr/bin/env python3
"""Stability of plans in a stream: waiters drop no errand, and requests wait hardly longer.

In process: 60 requests come to three waiters, at random times. Each shift is simulated twice, with
the same requests: as it is, and with a plan from nothing at each news. An errand is dropped if a
waiter is on its way to a stop, or stands there, and goes to another one first. A waiter that goes
back at once to where it has come from has turned back.

SEEDS in the environment says how many shifts there are. Run by scripts/bench. Exit status 1 says
that a limit is missed.
"""

from __future__ import annotations

import contextlib
import os
import random
import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, stdev
from typing import Any, Dict, Iterator, List, Sequence, Set, Tuple
from unittest import mock

from harness import HarnessError, Report, Row, Samples
from rosclingo.solver.options import Options
from rosoclingo.desk.inputs import read_input
from rosoclingo.desk.parts import make_parts
from rosoclingo.desk.simulation import DeskSimulation
from rosoclingo.loop.journal import ActionPublished, PlanFound
from rosoclingo.loop.planner import task_search

MODE = "dynamic.incremental.dyn_reset"
SEEDS = int(os.environ.get("SEEDS", "5"))
REQUESTS, GAP = 60, 2.5  # the gap is in steps, on average
LONGER = 1.08  # times the mean wait of plans from nothing
TABLES = {"t1": "hall", "t2": "hall", "t3": "bar", "t4": "bar", "t5": "aisle", "t6": "aisle",
          "t7": "terrace", "t8": "terrace"}  # fmt: skip
ENCODING = """
#include "{actions}".
#program base.
way(dock,hall). way(kitchen,hall). way(sink,kitchen). way(hall,bar). way(hall,aisle).
way(aisle,terrace). way(V,W) :- table(V), by(V,W). way(V,W) :- way(W,V).
table(V) :- by(V,W). waiter(w1;w2;w3). moves(R) :- waiter(R).
{tables}
initially(at(w1),dock). initially(at(w2),kitchen). initially(at(w3),hall).
number(tray(R),2) :- waiter(R).
request((dish(T);clear(T))) :- table(T).
#program present(k,t).
job(ID,kitchen,T,k) :- asked(ID,dish(T),k).
job(ID,T,sink,k) :- asked(ID,clear(T),k).
own(ID,thing(ID),V,k) :- job(ID,V,W,k).
wants(ID,thing(ID),W,k) :- job(ID,V,W,k).
action(R,(pick(ID);put(ID)),k) :- job(ID,V,W,k), waiter(R).
needs(R,pick(ID),at(R),V,k) :- job(ID,V,W,k), waiter(R).
needs(R,pick(ID),thing(ID),V,k) :- job(ID,V,W,k), waiter(R).
sets(R,pick(ID),thing(ID),R,k) :- job(ID,V,W,k), waiter(R).
uses(R,pick(ID),tray(R),1,k) :- job(ID,V,W,k), waiter(R).
needs(R,put(ID),at(R),W,k) :- job(ID,V,W,k), waiter(R).
needs(R,put(ID),thing(ID),R,k) :- job(ID,V,W,k), waiter(R).
sets(R,put(ID),thing(ID),W,k) :- job(ID,V,W,k), waiter(R).
gives(R,put(ID),tray(R),1,k) :- job(ID,V,W,k), waiter(R).
"""
_GO = re.compile(r"go\((\w+)\)")
_DO = re.compile(r"do\((\w+),(.+),(\d+)\)")


@dataclass
class Way:
    """Where a waiter goes.

    Attributes:
        stops: What it is to do by the plan that it has not begun, at stops, in order.
        is_begun: Whether it has gone a part of the way, or stands there.
        at: Where it is.
        came: From where it has just come; empty if it has done something since then.
    """

    at: str
    stops: Sequence[str] = ()
    is_begun: bool = False
    came: str = ""


class Shift:
    """A shift, with what was wrong with it.

    Attributes:
        dropped: Errands that were dropped.
        turned: How often a waiter has turned back.
        wait: How long a request waits, in steps, on average.
        steps: How many steps the shift took.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        """Simulates a shift."""
        file = folder / "restaurant.lp"
        library = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms/lib/actions.lp"
        tables = " ".join(f"by({table},{place})." for table, place in TABLES.items())
        text = ENCODING.replace("{actions}", str(library)).replace("{tables}", tables)
        file.write_text(text, encoding="utf-8")
        chance, step, inputs = random.Random(seed), 0.0, []
        come: List[int] = []
        for _ in range(REQUESTS):
            come.append(int(step))
            request = f"{chance.choice(['dish', 'dish', 'clear'])}({chance.choice(list(TABLES))})"
            inputs.append(read_input(f"goal:{request}", str(int(step))))
            step += chance.expovariate(1 / GAP)
        options = Options((str(file),), ("-c", "slots=12"))
        parts = make_parts(MODE, options, ("-c", "steps=300"))
        world = DeskSimulation(parts.loop, inputs, improves=False, most_steps=2000, patience=-1.0)
        failure = world.run()
        if failure or any(goal.words[-1:] != ["succeeded"] for goal in world.goals):
            raise HarnessError(f"not all goals have succeeded: {failure}")
        self.steps = world.elapsed
        self.dropped = self.turned = 0
        self._ways = {"w1": Way("dock"), "w2": Way("kitchen"), "w3": Way("hall")}
        ends: Dict[str, float] = {}
        begins: Dict[str, float] = {}
        step = 0
        done: Set[Tuple[str, ...]] = set()  # since the last reset
        for entry in world.journal:
            event: Any = entry.event
            if entry.step < step:
                done.clear()
            step = entry.step
            if isinstance(event, PlanFound):
                found = [m.groups() for m in map(_DO.fullmatch, map(str, event.actions)) if m]
                self._plan([one[:2] for one in found if one not in done])
            elif isinstance(event, ActionPublished):
                done.add((event.actuator, event.action, str(step)))
                self._act(event.actuator, event.action)
            elif type(event).__name__ == "GoalArrived":
                begins[event.goal] = entry.seconds
            elif type(event).__name__ == "StatusSet" and event.status.is_terminal:
                ends[event.goal] = entry.seconds
        self.wait = mean(ends[goal] - begins[goal] for goal in ends)

    def _plan(self, actions: Sequence[Tuple[str, ...]]) -> None:
        for waiter, way in self._ways.items():
            stops = [what for who, what in actions if who == waiter and not _GO.fullmatch(what)]
            self.dropped += way.is_begun and stops[:1] != way.stops[:1]
            way.stops = stops
            way.is_begun &= bool(stops)

    def _act(self, waiter: str, action: str) -> None:
        way, go = self._ways[waiter], _GO.fullmatch(action)
        if go is None:
            way.is_begun, way.came, way.stops = False, "", way.stops[1:]
            return
        self.turned += go[1] == way.came
        way.came, way.at, way.is_begun = way.at, go[1], bool(way.stops)


@contextlib.contextmanager
def from_nothing() -> Iterator[None]:
    """A context in which each plan is made from nothing."""
    with mock.patch.multiple(
        task_search,
        rest_of_plan=lambda task: None,
        begun_plan=lambda task: [],
        begun_of=lambda task, plan: [],
    ):
        yield


def main() -> int:
    """Simulates all shifts; returns the exit status."""
    report = Report("stream")
    with tempfile.TemporaryDirectory() as name:
        kept = [Shift(Path(name), seed) for seed in range(SEEDS)]
        with from_nothing():
            plain = [Shift(Path(name), seed) for seed in range(SEEDS)]
    for title, shifts, limit in (("plans stay", kept, 0.0), ("from nothing", plain, None)):
        waits = Samples("steps", tuple(shift.wait for shift in shifts))
        dropped = sum(shift.dropped for shift in shifts)
        report.add(Row(f"{title}: wait", waits, None, "dropped", dropped, "", limit))
        steps = Samples("steps", tuple(float(shift.steps) for shift in shifts))
        turned = sum(shift.turned for shift in shifts)
        report.add(Row(f"{title}: shift", steps, None, "turned back", turned, "", limit))
    ratios = [one.wait / other.wait for one, other in zip(kept, plain)]
    spread = 2 * stdev(ratios) / len(ratios) ** 0.5 if len(ratios) > 1 else 0.0
    print(f"ratio of mean waits {mean(ratios):.3f} +- {spread:.3f} (two standard errors)")
    ratio = Samples("", tuple(ratios))
    report.add(Row("wait, as a ratio", ratio, None, "on average", mean(ratios), "x", LONGER))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
