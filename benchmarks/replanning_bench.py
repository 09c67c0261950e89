#!/usr/bin/env python3
"""Times how long the mailbot needs to go on: after answers, failures, blocked ways and requests.

Over ROS, on a grid of 10 x 10 offices with three requests, by three nodes and by one: from the
message, goal or cancel request that is sent until the next action is heard, or the changed plan.
In process, the paper's three scenarios in the office: the planner's own time after each answer. And
three robots in the office with six open requests, planned in seconds: in each step, a robot is done
unexpectedly.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import contextlib
import random
import re
import sys
import time
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Sequence, Tuple

from actionlib import ClientGoalHandle

from harness import HarnessError, Report, RosSystem, Row, Samples, measure
from mailbot import ENCODING, FOLDER, MODES, Grid, Nodes, Run, deliveries
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Assumed, Command, Improvement, Outcome, Reply
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import ShutdownError
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.mode.controller import Controller
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.single.algorithm1 import Algorithm1
from rosoclingo.loop.values.atoms import Plan, event
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.solver import Forwarding

GRID = Grid(10, 4)  # a slot for the new request, too
REQUESTS = 3
STEPS = 150  # more than twice the longest plan
DRAWS = 5
ANSWER, FAILURE, BLOCKED, NEW, CANCEL = (
    "answer as planned", "failed move", "blocked way", "new request", "cancel",
)  # fmt: skip
LIMITS = {ANSWER: 20.0, FAILURE: 100.0, BLOCKED: 100.0, NEW: 150.0, CANCEL: 150.0}  # ms
OFFICE_MEDIAN, OFFICE_WORST = 5.0, 60.0  # ms
FLEET_MEDIAN, FLEET_WORST = 200.0, 1000.0  # ms
FLEET_REQUESTS, FLEET_STEPS = 6, 30

_GO = re.compile(r"do\(\w+,go\((c\(\d+\))\),\d+\)")
_NODE = re.compile(r"c\(\d+\)")
_PAUSE = 0.02  # seconds that an action takes at least, in which the loop comes to rest
_LONG_PAUSE = 0.3  # when it has to plan, and does not say whether it has
_ENOUGH = 25  # actions that are to be left for another round


class Delivery:
    """Three requests on their way, and what happens in between.

    Attributes:
        times: The milliseconds that each reaction took, by what was reacted to.
    """

    def __init__(self, run: Run, seed: int) -> None:
        """Sends the requests, and waits for the first action."""
        self.times: Dict[str, List[float]] = {what: [] for what in LIMITS}
        self._run = run
        self._extra = [pair for part in range(9) for pair in GRID.draw(f"{seed} new {part}")]
        for request in GRID.draw(seed)[:REQUESTS]:
            run.send(request)
        self._served = REQUESTS
        _, self._plan = run.plan(lambda plan: deliveries(plan) == REQUESTS)
        _, action = run.action()
        self._action = action.action
        self._at = "c(1)"

    def go_on(self) -> None:
        """Lets everything happen again and again, until the plan is short."""
        while len(self._plan) > _ENOUGH and self._extra:
            goal = self._request()
            self._answer()
            self._cancel(goal)
            self._answer()
            self._answer()
            self._block()
            self._answer()
            self._fail()
            self._answer()

    def _answer(self) -> None:
        begin = self._begin()
        self._at = _target(self._action) or self._at
        self._run.say("mailbot", "success")
        self._take_action(ANSWER, begin)

    def _fail(self) -> None:
        # Not on the only way out of an office, from where there is no plan.
        while not (_NODE.fullmatch(self._at) and _NODE.fullmatch(_target(self._action))):
            self._answer()
        begin = self._begin()
        way = self._at, _target(self._action)
        self._run.say("mailbot", "failure")
        self._take_action(FAILURE, begin)
        self._open(way)

    def _take_action(self, what: str, begin: float) -> None:
        when, action = self._run.action()
        self._action = action.action
        self.times[what].append((when - begin) * 1e3)

    def _request(self) -> ClientGoalHandle:
        self._served = deliveries(self._latest_plan())
        begin = self._begin()
        goal = self._run.send(self._extra.pop())
        self._take_plan(NEW, begin, lambda plan: deliveries(plan) > self._served)
        return goal

    def _cancel(self, goal: ClientGoalHandle) -> None:
        served = deliveries(self._latest_plan())
        begin = self._begin()
        goal.cancel()
        self._take_plan(CANCEL, begin, lambda plan: deliveries(plan) < served)

    def _block(self) -> None:
        """Blocks a way of the plan, a few steps ahead."""
        old = list(self._latest_plan())
        way = next(_ways(old[3:]), None)
        if way is None:
            return
        begin = self._begin()
        self._run.say("info", f"blocked({way[0]},{way[1]})")
        self._take_plan(BLOCKED, begin, lambda plan: way not in _ways(plan))
        self._open(way)

    def _open(self, way: Tuple[str, str]) -> None:
        """Opens a way again, so that in the end nothing is cut off."""
        self._run.say("info", f"unblocked({way[0]},{way[1]})")
        time.sleep(_LONG_PAUSE)

    def _take_plan(self, what: str, begin: float, fits: Callable[[Sequence[str]], bool]) -> None:
        when, self._plan = self._run.plan(fits)
        self.times[what].append((when - begin) * 1e3)

    def _latest_plan(self) -> Sequence[str]:
        time.sleep(_LONG_PAUSE)
        self._plan = self._run.latest_plan() or self._plan
        return self._plan

    def _begin(self) -> float:
        time.sleep(_PAUSE)
        return time.perf_counter()


def _target(action: str) -> str:
    """Returns where an action leads; "" if nowhere."""
    return action[3:-1] if action.startswith("go(") else ""


def _ways(actions: Sequence[str]) -> Iterator[Tuple[str, str]]:
    """Returns the ways between nodes of the grid that a plan leads along."""
    places = [found[1] if found else "" for found in map(_GO.fullmatch, actions)]
    return ((v, w) for v, w in zip(places, places[1:]) if v and w)


def measure_grid(system: RosSystem, report: Report, *, together: bool) -> None:
    """Adds the rows of the deliveries on the grid."""
    nodes = Nodes(system, GRID, together=together, steps=STEPS)
    times: Dict[str, List[float]] = {what: [] for what in LIMITS}
    for seed in range(DRAWS):
        run = nodes.start()
        delivery = Delivery(run, seed)
        delivery.go_on()
        nodes.end(run)
        for what, values in delivery.times.items():
            times[what] += values
    nodes.close()
    for what, limit in LIMITS.items():
        samples = Samples("ms", tuple(times[what]))
        name = f"{what}, {'one node' if together else 'three nodes'}"
        report.add(Row(name, None, samples, "median", samples.median, "ms", limit))


class Watched(Forwarding):
    """A solver that adds up its own time.

    Attributes:
        seconds: Its time since this was set to 0.
    """

    seconds = 0.0

    def run(self, commands: Sequence[Command]) -> Reply:
        """Runs commands in order until one fails."""
        with self._watch():
            return super().run(commands)

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches for answer sets."""
        with self._watch():
            return super().solve(assumptions, stopped, improved)

    @contextlib.contextmanager
    def _watch(self) -> Iterator[None]:
        begin = time.perf_counter()
        yield
        self.seconds += time.perf_counter() - begin


class Scenario(Inbox, Environment):
    """The office, with a robot that acts whenever the loop waits.

    Attributes:
        own: The planner's own time in milliseconds from each answer to the next action.
        whole: The time of the whole loop in milliseconds, for the same.
    """

    def __init__(
        self,
        before: Sequence[str],
        request: str,
        happens: Callable[[Scenario, str, int], str],
        mode: str,
    ) -> None:
        """Prepares a scenario.

        Args:
            before: What is announced before the request.
            request: The first request.
            happens: Called with an action and its number; returns the robot's answer.
            mode: The mode; "" for planning as run-1.0.py does.
        """
        super().__init__()
        self.own: List[float] = []
        self.whole: List[float] = []
        self._happens = happens
        self._pending = ""
        self._actions = 0
        self._answered: Optional[float] = None
        files = (str(FOLDER / "instances" / "graph_wg.lp"), str(ENCODING))
        self._planner = Watched(Engine(Options(files)))
        options = Options((str(MODES / f"{mode}.lp"),), ("-c", "steps=60"))
        controller = Controller(Engine(options)) if mode else Algorithm1(0)
        self._loop = Loop(controller, self._planner, ROSCommands, self, self)
        for value in before:
            self.put(MessageArrived("info", value))
        self.put(Goal(request))

    def run(self) -> None:
        """Runs until the robot has nothing to do."""
        self._loop.prepare()
        with contextlib.suppress(ShutdownError):
            while True:
                self._loop.step()

    def publish(self, actuator: str, action: str) -> None:
        """Takes an action."""
        if self._answered is not None:
            self.whole.append((time.perf_counter() - self._answered) * 1e3)
            self.own.append(self._planner.seconds * 1e3)
            self._answered = None
        self._pending = action
        self._actions += 1

    def wait(self, timeout: float) -> bool:
        """Lets the robot act, or ends if it has nothing to do."""
        if not self._pending:
            self.close()
            return True
        action, self._pending = self._pending, ""
        answer = self._happens(self, action, self._actions)
        self.put(MessageArrived("mailbot", answer))
        self._planner.seconds = 0.0
        self._answered = time.perf_counter()
        return True


def scenarios(mode: str) -> List[Scenario]:
    """Returns the paper's three scenarios."""

    def second(scenario: Scenario, action: str, number: int) -> str:
        if action == "go(c6)" and number > 1:
            scenario.put(MessageArrived("info", "unblocked(c3,c4)"))
        return "success"

    def third(scenario: Scenario, action: str, number: int) -> str:
        if action == "go(c6)" and number == 1:
            scenario.put(Goal("bring(o2,o3)"))
        return "failure" if action == "go(c4)" and number == 3 else "success"

    blocked = ["blocked(c3,c4)"]
    return [
        Scenario(blocked, "bring(o9,o14)", lambda *_: "success", mode),
        Scenario(blocked, "bring(o9,o14)", second, mode),
        Scenario([], "bring(o7,o11)", third, mode),
    ]


def measure_office(report: Report) -> None:
    """Adds the rows of the office."""
    own: List[float] = []
    whole: List[float] = []
    for mode in ("dynamic.incremental.recording", "dynamic.incremental.dyn_reset", ""):
        for _ in range(DRAWS):
            for scenario in scenarios(mode):
                scenario.run()
                own += scenario.own
                whole += scenario.whole
    samples = Samples("ms", tuple(own))
    name = "office, the planner's own time"
    report.add(Row(name, samples, None, "median", samples.median, "ms", OFFICE_MEDIAN))
    report.add(Row(name, samples, None, "max", max(own), "ms", OFFICE_WORST))
    report.add(Row("office, with the loop", Samples("ms", tuple(whole)), None))


def plan_again(seed: int, folder: Path) -> List[float]:
    """Returns the milliseconds of each new plan for three robots with six open requests."""
    dice = random.Random(f"fleet {seed}")
    robots = folder / "robots.lp"
    robots.write_text("start(second,open2). start(third,open3).")
    office = (FOLDER / "instances" / f"{name}.lp" for name in ("graph_wg", "lengths"))
    files = (*map(str, office), str(robots), str(ENCODING))
    planner = Planner(Engine(Options(files, ("-c", f"slots={FLEET_REQUESTS}"))))
    planner.begin()
    slots = [str(slot) for slot in range(1, FLEET_REQUESTS + 1)]
    events = [event(slot, _draw(dice), 0) for slot in slots]
    times: List[float] = []
    plan = Plan(_search(planner, events, 0, []))
    for step in range(1, FLEET_STEPS + 1):
        actions = _actions(plan, step)
        planner.tell([event("commit", f"do({r},{name})", step) for r, name in actions.items()])
        # Who goes on with its action in the next step is not expected to be through in this one.
        goes_on = [r for r, name in _actions(plan, step + 1).items() if actions.get(r) == name]
        through = dice.choice(sorted(goes_on or actions))
        timed = times if goes_on else []
        events = [event(robot, "busy", step) for robot in actions if robot != through]
        events.append(event(through, "success", step))
        plan = Plan(_search(planner, events, step, timed))
        if actions[through].startswith("deliver("):  # its slot is free; so there are six again
            slot = actions[through][len("deliver(") : -1]
            plan = Plan(_search(planner, [event(slot, _draw(dice), step)], step, times))
    return times


def _search(
    planner: Planner, events: Sequence[str], step: int, times: List[float]
) -> Tuple[str, ...]:
    """Searches for a plan after events, adds how long that took in ms, and returns its atoms."""
    begin = time.perf_counter()
    unknown = planner.tell(events)
    symbols = planner.search(step, sys.maxsize, lambda: False).symbols
    times.append((time.perf_counter() - begin) * 1e3)
    if unknown:
        raise HarnessError(f"the encoding does not know {unknown}")
    return symbols


def _actions(plan: Plan, step: int) -> Dict[str, str]:
    """Returns what each robot does in a step of a plan."""
    return {action.actuator: action.name for action in plan.actions(step)}


def _draw(dice: random.Random) -> str:
    """Returns a request in the office."""
    return "bring(o{},o{})".format(*dice.sample(range(1, 15), 2))


def measure_fleet(folder: Path, report: Report) -> None:
    """Adds the rows of three robots in the office."""
    times = [one for seed in range(DRAWS) for one in plan_again(seed, folder)]
    samples = Samples("ms", tuple(times))
    name = "three robots, six requests in the office"
    report.add(Row(name, samples, None, "median", samples.median, "ms", FLEET_MEDIAN))
    report.add(Row(name, samples, None, "max", max(times), "ms", FLEET_WORST))


def run(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures everything."""
    measure_office(report)
    measure_fleet(folder, report)
    for together in (False, True):
        measure_grid(system, report, together=together)


if __name__ == "__main__":
    sys.exit(measure("replanning", run))
