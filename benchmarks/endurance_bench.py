#!/usr/bin/env python3
"""Measures the costs of long runs, in process: with resets, without, and with unknown requests.

One goal comes after the other, each action succeeds at once, and each run has a process of its own.
So has each measurement of what a mode takes for a decision, by the number of steps.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import contextlib
import json
import os
import statistics
import subprocess
import sys
import time
from typing import Callable, List, NamedTuple, Sequence, Tuple

from harness import Report, Row, Samples, resident_mebibytes
from mailbot import MODES, ROOT, Grid, bring
from rehearsal import Rehearsal
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosoclingo.commands import ROSCommands
from rosoclingo.errors import ShutdownError
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.mode.controller import Controller
from rosoclingo.loop.single.algorithm1 import Algorithm1
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal

DYN_RESET, RECORDING, SINGLE = "dynamic.incremental.dyn_reset", "dynamic.incremental.recording", ""
STEPS = 10_000  # with resets
UNKNOWN = 100_000  # requests
BLOCKS = 20  # parts of a run
SLOWER, LARGER = 1.2, 4.0  # times as long a step, and MiB more, since the first fifth of a run
FORGET = "--forget-on-step=15"
HORIZONS = (50, 1_000, 10_000, 100_000, 1_000_000)  # the steps of a mode
DECISIONS = 1_500  # for each of them, in several turns
TURNS = 3
DEARER, BIGGER = 1.2, 1.0  # times as long a decision, and MiB more, with the most steps
_RUN, _DECIDE = "run", "decide"  # told to the processes of runs, and to those of decisions
_FLOOD = "flood"  # in the place of a mode: unknown requests, a hundred at a time


class Task(NamedTuple):
    """The planning task of a run.

    Attributes:
        name: The encoding's name.
        files: It, and its map.
        options: Options for clingo.
        robot: The actuator.
        request: Returns the request with a number, from 1 on.
        growing: The steps of a run that remembers everything.
    """

    name: str
    files: Tuple[str, ...]
    options: Tuple[str, ...]
    robot: str
    request: Callable[[int], str]
    growing: int


def _visit(number: int) -> str:
    return f"visit({(6, 1)[number % 2]})"  # from one end of the line to the other


GRID = Grid(4, 1)


def _bring(number: int) -> str:
    return bring(GRID.draw(number)[0])


LINE = str(ROOT / "rosoclingo" / "example" / "line.lp")
TASKS = {
    task.name: task
    for task in (
        Task("line.lp", (LINE,), (), "robot", _visit, 300),
        Task("mailbot.lp", GRID.files, GRID.options, "mailbot", _bring, 1_000),
    )
}


class LongRun(Inbox, Environment):
    """A planner, and a world that acts whenever the loop waits.

    Attributes:
        times: The CPU time of a step in each part of the run, in ms, whatever else runs.
        memory: Of this process after each part, in MiB.
    """

    def __init__(self, task: Task, mode: str, steps: int, options: Tuple[str, ...]) -> None:
        """Prepares a run.

        Args:
            task: What is planned.
            mode: The mode; "" for planning as run-1.0.py does.
            steps: When the run ends.
            options: Further options of clingo's.
        """
        super().__init__()
        self.times: List[float] = []
        self.memory: List[float] = []
        self._task = task
        self._steps = steps
        self._done = 0
        self._goals = 0
        self._acts = False
        self._begin = 0.0
        last = 60 if mode == DYN_RESET else 3 * steps // 2 + 60
        file = Options((str(MODES / f"{mode}.lp"),), ("-c", f"steps={last}"))
        controller = Controller(Engine(file)) if mode else Algorithm1(0)
        planner = Engine(Options(task.files, (*task.options, *options)))
        self._loop = Loop(controller, planner, ROSCommands, self, self)

    def run(self) -> None:
        """Runs until enough steps are done."""
        self._begin = time.process_time()
        self._loop.prepare()
        with contextlib.suppress(ShutdownError):
            while True:
                self._loop.step()

    def publish(self, actuator: str, action: str) -> None:
        """Takes an action."""
        self._acts = True

    def wait(self, timeout: float) -> bool:
        """Lets the robot act, or sends a new request."""
        if self._acts:
            self._acts = False
            self._count()
            self.put(MessageArrived(self._task.robot, "success"))
        else:
            self._goals += 1
            self.put(Goal(self._task.request(self._goals)))
        return True

    def _count(self) -> None:
        self._done += 1
        size = self._steps // BLOCKS
        if self._done % size == 0:
            now = time.process_time()
            self.times.append((now - self._begin) * 1e3 / size)
            self.memory.append(resident_mebibytes(os.getpid()))
            self._begin = time.process_time()
        if self._done == self._steps:
            self.close()


class Flood(LongRun):
    """Requests that the planner does not know, each another one, in the place of steps."""

    def wait(self, timeout: float) -> bool:
        """Sends a hundred requests."""
        for _ in range(100):
            self._count()
            self.put(Goal(f"bring(9,x{self._done})"))
        return True


def run_apart(
    name: str, mode: str, steps: int, options: Sequence[str] = ()
) -> Tuple[List[float], List[float]]:
    """Runs in a process of its own, and returns times per step and memory for each part."""
    command = [sys.executable, __file__, _RUN, name, mode, str(steps), *options]
    ended = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    times, memory = json.loads(ended.stdout)
    return times, memory


def _run_here(name: str, mode: str, steps: str, *options: str) -> None:
    kind, mode = (Flood, DYN_RESET) if mode == _FLOOD else (LongRun, mode)
    run = kind(TASKS[name], mode, int(steps), options)
    run.run()
    json.dump((run.times, run.memory), sys.stdout)


def decide_apart(mode: str, steps: int) -> Tuple[float, float]:
    """Returns the processor time of a decision, in ms, and the memory, of a process of its own."""
    command = [sys.executable, __file__, _DECIDE, mode, str(steps)]
    ended = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    milliseconds, memory = json.loads(ended.stdout)
    return milliseconds, memory


def _decide_here(mode: str, steps: str) -> None:
    before = resident_mebibytes(os.getpid())
    options = Options((str(MODES / f"{mode}.lp"),), ("-c", f"steps={steps}"))
    times: List[float] = []
    while len(times) < DECISIONS // TURNS:
        controller, run = Controller(Engine(options)), Rehearsal()
        controller.prepare()
        goes_on = True
        while goes_on and len(times) < DECISIONS // TURNS:
            begin = time.process_time()
            command = controller.decide(run.info)
            times.append((time.process_time() - begin) * 1e3)
            goes_on = run.carry_out(command)
    json.dump((statistics.median(times), resident_mebibytes(os.getpid()) - before), sys.stdout)


def measure_decisions(report: Report, mode: str) -> None:
    """Adds the rows about decisions, whose cost should not depend on the number of steps."""
    turns = [[decide_apart(mode, steps) for steps in HORIZONS] for _ in range(TURNS)]
    kinds = (("time", "ms", "x", DEARER), ("memory", "MiB", "MiB", BIGGER))
    for kind, (quantity, unit, compared, limit) in enumerate(kinds):
        medians = [statistics.median(turn[n][kind] for turn in turns) for n in range(len(HORIZONS))]
        first, last = medians[0], medians[-1]
        value = last / first if compared == "x" else last - first
        name = f"decision, {mode}, {quantity}"
        words = f"steps={HORIZONS[-1]:,} to {HORIZONS[0]}"
        report.add(Row(name, Samples(unit, tuple(medians)), None, words, value, compared, limit))


def measure_resets(report: Report, name: str) -> None:
    """Adds the rows of a run with resets, which is to stay as it is."""
    times, memory = run_apart(name, DYN_RESET, STEPS)
    fifth = BLOCKS // 5
    steps = Samples("ms", tuple(times))
    early, late = Samples("ms", tuple(times[:fifth])), Samples("ms", tuple(times[-fifth:]))
    what = f"{STEPS:,} steps, {name}, dyn_reset"
    ratio = late.median / early.median
    report.add(Row(f"{what}, time per step", steps, None, "last / first 20 %", ratio, "x", SLOWER))
    sizes = Samples("MiB", tuple(memory))
    grown = memory[-1] - memory[fifth - 1]
    report.add(Row(f"{what}, memory", sizes, None, "last - at 20 %", grown, "MiB", LARGER))


def measure_growth(report: Report, name: str, mode: str, *options: str) -> None:
    """Adds the rows of a run that remembers everything: what 1,000 steps add."""
    count = TASKS[name].growing
    times, memory = run_apart(name, mode, count, options)
    thousands = count * (BLOCKS - 1) / BLOCKS / 1000  # of steps between two parts' ends
    what = " ".join((f"{count:,} steps, {name}, {'recording' if mode else 'run-1.0.py'}", *options))
    for quantity, unit, values in (("time per step", "ms", times), ("memory", "MiB", memory)):
        grown = (values[-1] - values[0]) / thousands
        samples = Samples(unit, tuple(values))
        report.add(Row(f"{what}, {quantity}", samples, None, "each 1,000 steps", grown, unit))


def measure_unknown(report: Report) -> None:
    """Adds the row of requests that the planner does not know, which are to leave nothing."""
    _, memory = run_apart("mailbot.lp", _FLOOD, UNKNOWN)
    sizes = Samples("MiB", tuple(memory))
    grown = memory[-1] - memory[BLOCKS // 5 - 1]
    name = f"{UNKNOWN:,} unknown requests, memory"
    report.add(Row(name, sizes, None, "last - at 20 %", grown, "MiB", LARGER))


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    if sys.argv[1:2] == [_RUN]:
        _run_here(*sys.argv[2:])
        return 0
    if sys.argv[1:2] == [_DECIDE]:
        _decide_here(*sys.argv[2:])
        return 0
    report = Report("endurance")
    for file in sorted(MODES.glob("*.lp")):
        measure_decisions(report, file.stem)
    measure_unknown(report)
    for name in TASKS:
        measure_resets(report, name)
    for name in TASKS:
        for mode in (RECORDING, SINGLE):
            measure_growth(report, name, mode)
            measure_growth(report, name, mode, FORGET)
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
