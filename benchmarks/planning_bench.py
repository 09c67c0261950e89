"""Times how long the mailbot takes to plan and to plan again, against one-shot clingo.

All of it runs in this process, one after the other, so that the ratios hold on any machine:

- planning as the incremental modes do it, with a horizon that grows until there is a plan, against
  an encoding that searches for every move, grounded at once to the horizon of the shortest plan;
- planning again after each step of the office's three scenarios, against planning the same state in
  a fresh solver.

Times include grounding. The plot shows the former over the size of the map.
"""

from __future__ import annotations

import contextlib
import random
import statistics
import sys
import time
from functools import partial
from pathlib import Path
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import matplotlib as mpl

from harness import RESULTS, Report, Row, Samples, milliseconds
from rosclingo.commands import AssignExternal, Ground, Part, Truth
from rosclingo.engine import Engine, Result
from rosclingo.options import Options
from rosoclingo.atoms import Plan, event
from rosoclingo.controller import Controller
from rosoclingo.errors import ShutdownError
from rosoclingo.goals import Goal
from rosoclingo.inbox import Inbox, Message
from rosoclingo.loop import Loop
from rosoclingo.single import ClingoControl
from rosoclingo.solver import Planner
from rosoclingo.state import Outside

ROOT = Path(__file__).resolve().parents[1]
MAILBOT = ROOT / "rosoclingo_aspprograms" / "mailbot"
BY_STEPS = ROOT / "rosoclingo_aspprograms" / "test" / "planning" / "mailbot_by_steps.lp"
MODE = ROOT / "rosoclingo" / "modes" / "dynamic.incremental.recording.lp"
sys.path.insert(0, str(ROOT / "rosoclingo" / "nodes"))

from commands import ROSCommands  # noqa: E402 (the path has to be set first)

SIZES = (2, 3, 4, 6)  # waypoints along each side of the grid
REQUESTS = (1, 2, 3)
LIMITED = {(4, 3), (6, 3)}  # sizes and requests for which there is a limit
DRAWS = {True: 5, False: 2}  # random requests of each kind, with and without a limit
LIMIT = 10.0
LARGE = 10


class Planning:
    """A planner, told at once what is to be done, with a horizon that grows."""

    def __init__(self, instance: str, *options: str) -> None:
        file = str(MAILBOT / "instances" / instance)
        self._planner = Planner(Engine(Options((file, str(MAILBOT / "mailbot.lp")), options)))
        self._engine = Engine(Options((file, str(BY_STEPS)), options))
        self.horizon = 0

    def incremental(self, events: Sequence[str]) -> Plan:
        """Plans for events of step 0, as the incremental modes do."""
        planner = self._planner
        planner.begin([atom for atom in events if atom.startswith("event(save,")])
        assert not planner.tell([atom for atom in events if not atom.startswith("event(save,")])
        while True:
            query = [f"query({self.horizon})"]
            planner.assign(query, Truth.TRUE)
            outcome = planner.search(0, self.horizon, lambda: False)
            if outcome.result is Result.SAT:
                return Plan(outcome.symbols)
            planner.assign(query, Truth.FALSE)
            first, self.horizon = self.horizon + 1, planner.needed or self.horizon + 1
            planner.ground_steps(range(first, self.horizon + 1))

    def one_shot(self, events: Sequence[str], horizon: int) -> Plan:
        """Plans for events of step 0, with a horizon that is known to suffice."""
        parts = [part for step in range(horizon + 1) for part in _step(step)]
        self._ground([Part("base"), *parts])
        self._assign([*events, f"query({horizon})"], Truth.TRUE)
        outcome = self._engine.solve()
        assert outcome.result is Result.SAT
        return Plan(outcome.symbols)

    def _ground(self, parts: Sequence[Part]) -> None:
        self._engine.apply(Ground(tuple(parts)))

    def _assign(self, atoms: Sequence[str], value: Truth) -> None:
        reply = self._engine.run([AssignExternal(atom, value) for atom in atoms])
        assert reply.failure is None, reply.failure


def _step(step: int) -> List[Part]:
    parts = ("state", "query") if step == 0 else ("state", "transition", "query")
    return [Part(part, (str(step),)) for part in parts]


class Scenario(Inbox, Outside):
    """The office, with a robot that acts whenever the loop waits.

    Attributes:
        again: Milliseconds to plan again after each answer.
        scratch: Milliseconds to plan the same states in a fresh solver.
    """

    def __init__(
        self,
        before: Sequence[str],
        request: str,
        happens: Callable[[Scenario, str, int], str],
        single: bool,
    ) -> None:
        """Prepares a scenario.

        Args:
            before: What is announced before the request.
            request: The first request.
            happens: Called with an action and its number; returns the robot's answer.
            single: Whether it is planned as run-1.0.py does, instead of by a mode.
        """
        super().__init__()
        self.again: List[float] = []
        self.scratch: List[float] = []
        self._happens = happens
        self._pending: List[str] = []
        self._actions = 0
        self._answered: Optional[float] = None
        files = tuple(str(MAILBOT / name) for name in ("instances/graph_wg.lp", "mailbot.lp"))
        mode = Options((str(MODE),), ("-c", "steps=60"))
        controller = ClingoControl(0) if single else Controller(Engine(mode))
        self._loop = Loop(controller, Engine(Options(files)), ROSCommands, self, self)
        for value in before:
            self.put(Message("info", value))
        self.put(Goal(request))

    def run(self) -> None:
        """Runs until the robot has nothing to do."""
        self._loop.prepare()
        with contextlib.suppress(ShutdownError):
            while True:
                self._loop.step()
                if self._pending and self._answered is not None:
                    self.again.append((time.perf_counter() - self._answered) * 1e3)
                    self._answered = None
                    self._plan_from_scratch()

    def publish(self, actuator: str, action: str) -> None:
        """Takes an action."""
        self._pending.append(action)
        self._actions += 1

    def wait(self, timeout: float) -> bool:
        """Lets the robot act, or ends if it has nothing to do."""
        if not self._pending:
            self.close()
            return True
        action = self._pending.pop()
        answer = self._happens(self, action, self._actions)
        self._answered = time.perf_counter()
        self.put(Message("mailbot", answer))
        return True

    def _plan_from_scratch(self) -> None:
        state = self._loop.state
        fluents = state.plan.fluents(state.step - 1)
        saved = [event("save", fluent, 0) for fluent in fluents]
        planning = Planning("graph_wg.lp")
        duration, _ = milliseconds(partial(planning.incremental, saved))
        self.scratch.append(duration)


def scenarios() -> Dict[str, Scenario]:
    """Returns the three scenarios of the paper, with the planning of three nodes and of one."""

    def second(scenario: Scenario, action: str, number: int) -> str:
        if action == "go(c6)" and number > 1:
            scenario.put(Message("info", "unblocked(c3,c4)"))
        return "success"

    def third(scenario: Scenario, action: str, number: int) -> str:
        if action == "go(c6)" and number == 1:
            scenario.put(Goal("bring(o2,o3)"))
        return "failure" if action == "go(c4)" and number == 3 else "success"

    blocked = ["blocked(c3,c4)"]
    made = {}
    for single in (False, True):
        nodes = "one node" if single else "three nodes"
        made[f"1, {nodes}"] = Scenario(blocked, "bring(o9,o14)", lambda *_: "success", single)
        made[f"2, {nodes}"] = Scenario(blocked, "bring(o9,o14)", second, single)
        made[f"3, {nodes}"] = Scenario([], "bring(o7,o11)", third, single)
    return made


def measure_planning(report: Report) -> Dict[Tuple[int, int], Tuple[float, float]]:
    """Adds a row for each size and number of requests, and returns the medians in ms."""
    medians = {}
    for size in SIZES:
        for requests in REQUESTS:
            name = f"{requests} of {size * size} offices"
            ours, theirs, ratios, lengths = [], [], [], []
            limited = (size, requests) in LIMITED
            for draw in range(DRAWS[limited]):
                events = _draw(size, requests, draw)
                arguments = ("graph_bench.lp", "-c", f"x={size}", "-c", f"y={size}")
                planning = Planning(*arguments)
                time_ours, plan = milliseconds(partial(planning.incremental, events))
                shot = Planning(*arguments)
                time_theirs, best = milliseconds(partial(shot.one_shot, events, planning.horizon))
                assert len(plan.actions_from(0)) == len(best.actions_from(0))
                ours.append(time_ours)
                theirs.append(time_theirs)
                ratios.append(time_ours / time_theirs)
                lengths.append(len(plan.actions_from(0)))
            limit = LIMIT if limited else None
            samples = Samples("ms", tuple(ours))
            name += f", {min(lengths)} to {max(lengths)} actions"
            report.add(
                Row(f"plan {name}", samples, None, "worst to one-shot", max(ratios), "x", limit)
            )
            medians[size, requests] = (statistics.median(ours), statistics.median(theirs))
    return medians


def _draw(size: int, requests: int, seed: int) -> List[str]:
    dice = random.Random(f"{size} {requests} {seed}")
    offices = range(1, size * size + 1)
    pairs = (dice.sample(offices, 2) for _ in range(requests))
    return [event(str(slot), f"bring({o},{p})", 0) for slot, (o, p) in enumerate(pairs, 1)]


def measure_replanning(report: Report) -> None:
    """Adds the rows for the three scenarios."""
    again: List[float] = []
    scratch: List[float] = []
    for name, scenario in scenarios().items():
        scenario.run()
        again += scenario.again
        scratch += scenario.scratch
        ratios = [a / s for a, s in zip(scenario.again, scenario.scratch)]
        samples = Samples("ms", tuple(scenario.again))
        report.add(
            Row(f"plan again, scenario {name}", samples, None, "median to fresh solver",
                statistics.median(ratios), "x")
        )  # fmt: skip
    ratio = statistics.median([a / s for a, s in zip(again, scratch)])
    samples = Samples("ms", tuple(again))
    report.add(
        Row("plan again, all scenarios", samples, None, "median to fresh solver", ratio, "x", 0.5)
    )
    median = statistics.median(again)
    report.add(Row("plan again, all scenarios", samples, None, "median", median, "ms", 200))
    report.add(Row("plan again, worst", samples, None, "max", max(again), "ms", 1000))


def measure_large(report: Report) -> None:
    """Adds the row for a request among 100 offices."""
    arguments = ("graph_bench.lp", "-c", f"x={LARGE}", "-c", f"y={LARGE}")
    planning, shot = Planning(*arguments), Planning(*arguments)
    events = [event("1", f"bring(1,{LARGE * LARGE})", 0)]
    ours, plan = milliseconds(partial(planning.incremental, events))
    theirs, _ = milliseconds(partial(shot.one_shot, events, planning.horizon))
    name = f"plan 1 of {LARGE * LARGE} offices, {len(plan.actions_from(0))} actions"
    samples = Samples("ms", (ours,))
    report.add(Row(name, samples, None, "to one-shot", ours / theirs, "x", LIMIT))


def plot(medians: Dict[Tuple[int, int], Tuple[float, float]]) -> Path:
    """Draws the planning times over the size of the map, and returns the picture's file."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 (the backend has to be set first)

    figure, axes = plt.subplots(figsize=(7, 4.5))
    for requests in REQUESTS:
        offices = [size * size for size in SIZES]
        ours = [medians[size, requests][0] for size in SIZES]
        theirs = [medians[size, requests][1] for size in SIZES]
        (line,) = axes.plot(offices, ours, "o-", label=f"requests: {requests}, growing horizon")
        axes.plot(offices, theirs, "s--", color=line.get_color(), label="the same, one-shot")
    axes.set(xlabel="offices", ylabel="time to the shortest plan (ms)", yscale="log")
    axes.set_title("Planning of the mailbot, median of random requests")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize="small")
    figure.tight_layout()
    RESULTS.mkdir(exist_ok=True)
    file = RESULTS / "planning.png"
    figure.savefig(file, dpi=120)
    return file


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    report = Report("planning")
    medians = measure_planning(report)
    measure_replanning(report)
    measure_large(report)
    print(f"\nplot: {plot(medians)}")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
