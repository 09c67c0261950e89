#!/usr/bin/env python3
"""Times explanations of a waiting delivery in the office, and the loop meanwhile.

In process, the robot is on its way, or was never sent. Ways are blocked, one after the other, until
the office that it has to go to is cut off, and two more. Each question has an explainer of its own,
as if it were the first question.

Over ROS, deliveries are made by three nodes and by one. During every second one, a process asks
why, without a pause; the reactions are the times from an answer to the next action.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Tuple

import rospy
from actionlib import CommState

from harness import HarnessError, Report, RosSystem, Row, Samples, measure, milliseconds
from mailbot import MODE, Run
from rosclingo.solver.options import Options
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.atoms import Plan
from rosoclingo.why.copy_by_replay import RetellingCopy
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.planner_copy import Deadline, PlanQuery

MAILBOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms" / "mailbot"
OFFICE = Options((str(MAILBOT / "instances" / "graph_wg.lp"), str(MAILBOT / "mailbot.lp")))
DRAWS = 50
MEDIAN, WORST = 500.0, 1000.0  # ms
DELIVERIES, WARM_UP = 40, 4  # with questions, and as many without
RATIO = 1.1
WORK_SECONDS = 0.02  # how long an action takes
ASKER = Path(__file__).with_name("asker.py")
ASKED = ("plan", "if info:blocked(c3,c4)", "if cancel:1")
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
    """The situations that questions are about.

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
        plan = copy.ask(PlanQuery(frozenset(told))).plan
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


class Asker:
    """A process that asks while it is told to; ends with the context."""

    def __init__(self, node: str) -> None:
        """Starts it.

        Args:
            node: The resolved name of the node that is asked.
        """
        command = [sys.executable, str(ASKER), node, *ASKED]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        self.times: List[float] = []
        self.unanswered: List[str] = []

    def __enter__(self) -> Asker:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()

    def begin(self) -> None:
        """Starts asking."""
        self._tell()

    def end(self) -> None:
        """Waits for the last answer."""
        self._tell()
        assert self._process.stdout is not None
        for line in self._process.stdout:
            said = json.loads(line)
            if isinstance(said, list):
                self.times += said
                return
            self.unanswered.append(said)
        raise HarnessError("the process that asks has ended")

    def _tell(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write("\n")
        self._process.stdin.flush()


def deliver(run: Run, request: str) -> List[float]:
    """Makes a delivery, and returns the milliseconds from each answer to the next action."""
    goal = run.ask_for(request)
    reactions = []
    answered: Optional[float] = None
    while True:
        when, action = run.action()
        if answered is not None:
            reactions.append((when - answered) * 1e3)
        time.sleep(WORK_SECONDS)
        answered = time.perf_counter()
        run.say("mailbot", "success")
        if action.action.startswith("deliver("):
            break
    while goal.get_comm_state() != CommState.DONE:
        time.sleep(WORK_SECONDS)
    return reactions


def react(system: RosSystem, report: Report, *, together: bool) -> None:
    """Measures the reactions of one node or of three, with questions and without."""
    name, kind = ("one", "one node") if together else ("three", "three nodes")
    files = [word for file in OFFICE.files for word in ("-f", file)]
    if together:
        system.rosrun("rosoclingo", "run-1.0.py", *files, name=name)
    else:
        mode = ["-f", str(MODE), "-c", "steps=100"]
        for role, arguments in (("controller", mode), ("planner", files)):
            system.rosrun("rosclingo", "run.py", *arguments, name=role)
        system.rosrun("rosoclingo", "run.py", name=name)
    run = Run(rospy.resolve_name(name))
    pick = random.Random(0)
    plain: List[float] = []
    asked: List[float] = []
    with Asker(rospy.resolve_name(name)) as asker:
        for number in range(WARM_UP + 2 * DELIVERIES):
            is_asked = bool(number % 2)
            if is_asked:
                asker.begin()
            reactions = deliver(run, "bring({},{})".format(*pick.sample(_OFFICES, 2)))
            if is_asked:
                asker.end()
            if number >= WARM_UP:
                (asked if is_asked else plain).extend(reactions)
            else:
                asker.times.clear()
    if asker.unanswered:
        print(f"{kind}: {len(asker.unanswered)} without an answer: {asker.unanswered[0]}")
    run.close()
    system.end(name)
    if not together:
        system.end("planner")
        system.end("controller")
    samples, base = Samples("ms", tuple(asked)), Samples("ms", tuple(plain))
    ratio = samples.median / base.median
    report.add(Row(f"reaction of {kind}", None, base))
    report.add(
        Row(f"reaction of {kind}, asked", base, samples, "median / median", ratio, "x", RATIO)
    )
    times = Samples("ms", tuple(asker.times))
    report.add(Row(f"answer of {kind}", None, times, "median", times.median, "ms", MEDIAN))
    longest = max(times.values)
    report.add(Row(f"answer of {kind}, worst", None, times, "maximum", longest, "ms", WORST))


def main() -> int:
    """Measures everything."""
    return measure("why", _measure)


def _measure(system: RosSystem, _: Path, report: Report) -> None:
    for together in (False, True):
        react(system, report, together=together)
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


def _add(report: Report, name: str, times: Tuple[float, ...]) -> None:
    samples = Samples("ms", times)
    report.add(Row(name, samples, None, "median", samples.median, "ms", MEDIAN))
    report.add(Row(f"{name}, worst", samples, None, "maximum", max(times), "ms", WORST))


if __name__ == "__main__":
    sys.exit(main())
