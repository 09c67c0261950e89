#!/usr/bin/env python3
"""How long it takes to say why a delivery waits, in the office, in process.

The robot is on its way, or was never sent. Ways are blocked, one after the other, until the office
that it has to go to is cut off, and two more. Each question has an explainer of its own, as if
nobody had asked before.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import random
import sys
from functools import partial
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

from harness import Report, Row, Samples, milliseconds
from rosclingo.solver.options import Options
from rosoclingo.loop.atoms import Plan
from rosoclingo.why.copy import Deadline
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.retelling import RetellingCopy
from rosoclingo.why.situation import Situation

MAILBOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms" / "mailbot"
OFFICE = Options((str(MAILBOT / "instances" / "graph_wg.lp"), str(MAILBOT / "mailbot.lp")))
DRAWS = 50
MEDIAN, WORST = 500.0, 1000.0  # ms
_LAST = 60  # steps
_OFFICES = [f"o{number}" for number in range(1, 15)]
_DOORS = {  # the corridor that an office is at
    office: f"c{corridor}"
    for corridor, numbers in enumerate(
        ((1, 3), (2, 13), (4, 5, 14), (6, 7, 11), (8, 9, 12), (10,)), 1
    )
    for office in (f"o{number}" for number in numbers)
}
_RING = ["open1", "c1", "c2", "c3", "c4", "c5", "c6"]


class Case(NamedTuple):
    """What is asked about.

    Attributes:
        open: The situation before ways are blocked.
        situation: The situation.
        other: An action that could be done next in the first one.
    """

    open: Situation
    situation: Situation
    other: str

    def ask(self, name: str) -> str:
        """Asks a question, and returns the answer."""
        explainer = Explainer(OFFICE, self.situation)
        if name == "why there is no plan":
            return explainer.no_plan().text
        if name == "why a goal waits":
            return explainer.goal("1").text
        if name == "why not another action":
            return Explainer(OFFICE, self.open).why_not(self.other).text
        way = self.situation.told[-1].split(",", 1)[1].rpartition(",")[0]
        return explainer.what_if([f"info:un{way}"]).text


def draw(seed: int, *, acts: bool) -> Case:
    """Returns a random situation in which a goal waits.

    Args:
        seed: Says which.
        acts: Whether the robot has done some of its plan.
    """
    pick = random.Random(seed)
    origin, destination = pick.sample(_OFFICES, 2)
    request = f"bring({origin},{destination})"
    told = [f"event(1,{request},0)"]
    step = 0
    if acts:
        copy = RetellingCopy(OFFICE, Situation(last=_LAST), Deadline(60.0))
        plan = copy.ask(frozenset(told)).plan
        assert plan is not None
        actions = Plan(plan.actions).actions_from(1)
        for action in actions[: pick.randrange(1, len(actions) - 2)]:
            told.append(f"event(info,passed,{step})")
            step = action.step
            told.append(f"event(commit,do(mailbot,{action.name}),{step})")
            told.append(f"event(mailbot,success,{step})")
    goals = (("1", request),)
    before = Situation(tuple(told), step, step, _LAST, goals=goals)
    corridor = _DOORS[destination]
    at = _RING.index(corridor)
    cut = [(corridor, destination)]
    if pick.random() < 0.5:  # the office, or its part of the corridor
        cut = [(corridor, _RING[at - 1]), (corridor, _RING[(at + 1) % len(_RING)])]
    doors = [
        (door, office) for office, door in _DOORS.items() if office not in (origin, destination)
    ]
    ways = [*cut, *pick.sample(doors, 2)]
    pick.shuffle(ways)
    for way in ways:
        told.append(f"event(info,passed,{step})")
        step += 1
        told.append("event(info,blocked({},{}),{})".format(*way, step))
    situation = Situation(tuple(told), step, step, _LAST, goals=goals)
    return Case(before, situation, f"do(mailbot,go({pick.choice(_RING)}),{before.step + 1})")


QUESTIONS = (
    "why there is no plan",
    "why a goal waits",
    "why not another action",
    "what if a way were free",
)


def main() -> int:
    """Measures everything."""
    report = Report("why")
    for acts, kind in ((False, "at the start"), (True, "on the way")):
        times: Dict[str, List[float]] = {name: [] for name in QUESTIONS}
        for seed in range(DRAWS):
            case = draw(seed, acts=acts)
            for name in QUESTIONS:
                duration, text = milliseconds(partial(case.ask, name))
                times[name].append(duration)
                if seed == 0:
                    print(f"{name}, {kind}: {text}")
        for name, seconds in times.items():
            _add(report, f"{name}, {kind}", tuple(seconds))
    return report.finish()


def _add(report: Report, name: str, times: Tuple[float, ...]) -> None:
    samples = Samples("ms", times)
    report.add(Row(name, samples, None, "median", samples.median, "ms", MEDIAN))
    report.add(Row(f"{name}, worst", samples, None, "maximum", max(times), "ms", WORST))


if __name__ == "__main__":
    sys.exit(main())
