#!/usr/bin/env python3
"""Stability of plans in a stream: waiters drop no errand, and requests wait hardly longer.

In process: 60 requests come to three waiters, at random times. Some are cancelled, and some actions
fail, and are tried again. Each shift is simulated twice, with the same inputs: as it is, and with a
plan from nothing at each news. An errand is dropped if a waiter is on its way to a stop, or stands
there, and goes to another one first. A waiter that goes back at once to where it has come from has
turned back. Neither counts if there is a reason: the request, or one that the waiter carries, was
cancelled, the waiter has failed, or a way is blocked, or free again.

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
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, stdev
from typing import Any, Callable, Dict, Iterator, List, Sequence, Set, Tuple
from unittest import mock

from harness import HarnessError, Report, Row, Samples
from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import Input, read_input
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem
from rosoclingo.loop.journal import (
    ActionPublished,
    CancelArrived,
    Entry,
    GoalArrived,
    MessageArrived,
    PlanFound,
    Status,
    StatusSet,
)
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.planner import task_search
from rosoclingo.loop.words import FAILURE, SUCCESS

MODE = "dynamic.incremental.dyn_reset"
SEEDS = int(os.environ.get("SEEDS", "5"))
REQUESTS, GAP = 60, 4.0  # the gap is in seconds, on average
CANCELED, FAILING, AGAIN = 0.05, 0.05, 0.5  # of requests, of actions, and of these when tried again
LUCK = 30  # seconds for which an action of a kind fails, or not
LONGER = 1.08  # times the mean wait of plans from nothing
TABLES = {"t1": "hall", "t2": "hall", "t3": "bar", "t4": "bar", "t5": "aisle", "t6": "aisle",
          "t7": "terrace", "t8": "terrace"}  # fmt: skip
STARTS = {"w1": "dock", "w2": "kitchen", "w3": "hall"}
ENCODING = """
#include "{actions}".
#program base.
way(dock,hall). way(kitchen,hall). way(sink,kitchen). way(hall,bar). way(hall,aisle).
way(aisle,terrace). way(V,W) :- table(V), by(V,W). way(V,W) :- way(W,V).
table(V) :- by(V,W). moves(R) :- waiter(R).
{tables}
{starts}
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
restores(ID,thing(ID),V,k) :- job(ID,V,W,k).
action(R,back(ID),k) :- job(ID,V,W,k), waiter(R).
needs(R,back(ID),at(R),V,k) :- job(ID,V,W,k), waiter(R).
needs(R,back(ID),thing(ID),R,k) :- job(ID,V,W,k), waiter(R).
sets(R,back(ID),thing(ID),V,k) :- job(ID,V,W,k), waiter(R).
gives(R,back(ID),tray(R),1,k) :- job(ID,V,W,k), waiter(R).
"""
_GO = re.compile(r"go\((\w+)\)")
_DO = re.compile(r"do\((\w+),(.+),(\d+)\)")
_STOP = re.compile(r"\w+\((\w+)\)")  # an action at a stop, with the slot of its request


class Restaurant(SimulatedSystem):
    """A simulation in which the numbers of inputs are seconds, and some actions fail."""

    def __init__(self, make: Callable[..., Loop], inputs: Sequence[Input], seed: int) -> None:
        """Makes the loop; the seed determines which actions fail, and when."""
        self._seed = seed
        # The action with which a waiter has failed last, when it first did, and how often.
        self._failed: Dict[str, Tuple[str, float, int]] = {}
        super().__init__(
            make, inputs, self._outcome, improves=False, most_steps=5000, patience=-1.0
        )

    def _outcome(self, waiter: str, action: str) -> str:
        """Draws whether an action fails, by what it is and when: both plans have the same luck.

        Else, what differs most is on which way a move fails so often that it is blocked.
        """
        before, since, failures = self._failed.pop(waiter, ("", 0.0, 0))
        if before != action:
            since, failures = self.clock, 0
        what = action if _GO.fullmatch(action) else f"{waiter} {action.partition('(')[0]}"
        chance = random.Random(f"{self._seed} {what} {since // LUCK}")
        draws = [chance.random() for _ in range(failures + 1)]
        if draws[0] >= FAILING or max(draws[1:], default=0.0) >= AGAIN:
            return SUCCESS
        self._failed[waiter] = action, since, failures + 1
        return FAILURE

    def own_moments(self) -> List[float]:
        """Returns when the loop does something next, or an input comes."""
        moments = [float(one.moment.number) for one in self.left]
        return [*super().own_moments(), *sorted(moments)[:1]]

    def turn(self) -> bool:
        """Advances to the next event, if there is one."""
        due = [one for one in self.left if one.moment.number <= self.clock]
        self._come(due)
        return bool(due) or self._pass()


@dataclass
class Way:
    """Where a waiter goes.

    Attributes:
        at: Where it is.
        stops: What it is to do by the plan that it has not begun, at stops, in order.
        is_begun: Whether it has gone a part of the way, or stands there.
        came: From where it has just come; empty if it has done something since then.
        acts: The action that it does, or tries again.
        carried: The slots of the requests of which it carries things.
        is_free: Whether it has failed, or lost its stop, since it has gone its last part of a way.
    """

    at: str
    stops: Sequence[str] = ()
    is_begun: bool = False
    came: str = ""
    acts: str = ""
    carried: Set[str] = field(default_factory=set)
    is_free: bool = False


class Shift:
    """A shift, with what was wrong with it.

    Attributes:
        dropped: Errands that were dropped.
        turned: How often a waiter has turned back.
        excused: How often there was a reason for one of the two.
        wait: How long a request waits that is met, in seconds, on average.
        seconds: How many seconds the shift took.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        """Simulates a shift."""
        file = folder / "restaurant.lp"
        library = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms/lib/actions.lp"
        tables = " ".join(f"by({table},{place})." for table, place in TABLES.items())
        starts = " ".join(f"waiter({one}). initially(at({one}),{v})." for one, v in STARTS.items())
        text = ENCODING.replace("{actions}", str(library)).replace("{tables}", tables)
        file.write_text(text.replace("{starts}", starts), encoding="utf-8")
        options = Options((str(file),), ("-c", "slots=12"))
        parts = make_parts(MODE, options, ("-c", "steps=300"))
        world = Restaurant(parts.loop, _inputs(seed), seed)
        failure = world.run()
        ends = [goal.words[-1:] for goal in world.goals]
        if failure or any(end not in (["succeeded"], ["canceled"], ["recalled"]) for end in ends):
            raise HarnessError(f"not all goals have ended well: {failure}, {ends}")
        self.seconds = world.clock
        self.dropped = self.turned = self.excused = 0
        self._ways = {waiter: Way(place) for waiter, place in STARTS.items()}
        self._slots: Dict[str, str] = {}  # of goals
        self._read(world.journal)

    def _read(self, journal: Sequence[Entry]) -> None:
        begins: Dict[str, float] = {}
        waits: List[float] = []
        for entry in journal:
            event: Any = entry.event
            if isinstance(event, PlanFound):
                found = [m.groups() for m in map(_DO.fullmatch, map(str, event.actions)) if m]
                ahead = [(int(step), who, what) for who, what, step in found]
                ahead = sorted(one for one in ahead if one[0] > entry.step)
                self._plan([one[1:] for one in ahead])
            elif isinstance(event, ActionPublished):
                self._act(event.actuator, event.action)
            elif isinstance(event, MessageArrived):
                self._hear(event.source, event.value)
            elif isinstance(event, CancelArrived):
                slot = self._slots.get(event.goal, "")
                for way in self._ways.values():
                    way.is_free |= slot in {*map(_slot_of, way.stops[:1]), *way.carried}
            elif isinstance(event, GoalArrived):
                begins[event.goal] = entry.seconds
            elif isinstance(event, StatusSet):
                self._slots[event.goal] = event.slot or self._slots.get(event.goal, "")
                if event.status is Status.SUCCEEDED:
                    waits.append(entry.seconds - begins[event.goal])
        self.wait = mean(waits)

    def _plan(self, ahead: Sequence[Tuple[str, str]]) -> None:
        for waiter, way in self._ways.items():
            actions = [what for who, what in ahead if who == waiter]
            while way.acts and actions[:1] == [way.acts]:  # it goes on
                del actions[0]
            stops = [what for what in actions if not _GO.fullmatch(what)]
            if way.is_begun and stops[:1] != way.stops[:1]:
                self.dropped += not way.is_free
                self.excused += way.is_free
                way.is_begun = False
            way.stops = stops
            way.is_begun &= bool(stops)

    def _act(self, waiter: str, action: str) -> None:
        way, go = self._ways[waiter], _GO.fullmatch(action)
        if action == way.acts:  # it is tried again
            return
        way.acts = action
        if go is None:
            way.is_begun, way.came, way.is_free = False, "", False
            way.stops = way.stops[1:] if way.stops[:1] == [action] else way.stops
            return
        is_turn = go[1] == way.came
        self.turned += is_turn and not way.is_free
        self.excused += is_turn and way.is_free
        way.is_begun, way.is_free = bool(way.stops), False

    def _hear(self, source: str, value: str) -> None:
        if source not in self._ways:
            for way in self._ways.values():
                way.is_free |= value.startswith(("blocked", "unblocked"))
            return
        way = self._ways[source]
        go = _GO.fullmatch(way.acts)
        if value != SUCCESS:  # a way on which a move has failed in the end is blocked for all
            for each in self._ways.values() if go else [way]:
                each.is_free = True
        elif go:
            way.came, way.at = way.at, go[1]
        elif way.acts.startswith("pick("):
            way.carried.add(_slot_of(way.acts))
        else:
            way.carried.discard(_slot_of(way.acts))
        way.acts = ""


def _slot_of(stop: str) -> str:
    match = _STOP.fullmatch(stop)
    return match[1] if match else ""


def _inputs(seed: int) -> List[Input]:
    chance, seconds, inputs = random.Random(seed), 0.0, []
    for number in range(1, REQUESTS + 1):
        request = f"{chance.choice(['dish', 'dish', 'clear'])}({chance.choice(list(TABLES))})"
        inputs.append(read_input(f"goal:{request}", str(int(seconds))))
        after = chance.randint(1, 20)
        if chance.random() < CANCELED:
            inputs.append(read_input(f"cancel:{number}", str(int(seconds) + after)))
        seconds += chance.expovariate(1 / GAP)
    return sorted(inputs, key=lambda one: one.moment.number)


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
        waits = Samples("s", tuple(shift.wait for shift in shifts))
        dropped = sum(shift.dropped for shift in shifts)
        report.add(Row(f"{title}: wait", waits, None, "dropped", dropped, "", limit))
        lasted = Samples("s", tuple(shift.seconds for shift in shifts))
        turned = sum(shift.turned for shift in shifts)
        report.add(Row(f"{title}: shift", lasted, None, "turned back", turned, "", limit))
        excused = sum(shift.excused for shift in shifts)
        print(f"{title}: {excused} times, there was a reason to drop an errand or to turn back")
    # Of the means, since the mean of ratios is larger than 1 if both waits vary alike.
    whole = mean(shift.wait for shift in plain)
    value = mean(shift.wait for shift in kept) / whole
    rests = [(one.wait - value * other.wait) / whole for one, other in zip(kept, plain)]
    spread = 2 * stdev(rests) / len(rests) ** 0.5 if len(rests) > 1 else 0.0
    print(f"ratio of mean waits {value:.3f} +- {spread:.3f} (two standard errors)")
    ratio = Samples("", tuple(one.wait / other.wait for one, other in zip(kept, plain)))
    report.add(Row("wait, as a ratio", ratio, None, "of the means", value, "x", LONGER))
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
