#!/usr/bin/env python3
"""Times first plans of planning tasks in PDDL, beside those of LAMA.

A task is imported by ``pddl.py``, and a planner in a process of its own loads what that has
written. Then the problem's goal comes, and the time until the first action goes out is measured.
LAMA is Fast Downward's ``lama-first``, the whole process with its translator. Times are processor
times, the least of some runs each, in turn. PDDL's own semantics validates each plan.

The folder of the tasks has folders with ``domain.pddl`` (or ``NAME-domain.pddl``) and problems. It
is an argument, or in the environment as PDDL_TASKS; without it, nothing is measured. Exit status 1
says that a limit is missed, or that a plan is not valid. With ``--seed-planner lama`` the planner
has a seed, whose process counts, too, and the limits are those for that. With ``--execute``,
nothing is measured: plans are executed, actions fail by chance, and each one that succeeds is
validated. With ``--lengths``, it is measured how many actions a plan has ten seconds after the goal
has come, with ``~patience``, beside LAMA's plan after ten seconds, and what the optimal plan costs,
if A* finds it within a minute.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, List, Optional, Sequence, Tuple

from harness import Report, Row, Samples
from plan_validator import PlanValidator
from rosclingo.solver.options import Options
from rosoclingo.desk.parts import make_parts
from rosoclingo.desk.system import System
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.loop.words import FAILURE, SOLVER
from rosoclingo.pddl.domain import read_domain, read_problem
from rosoclingo.pddl.expressions import PddlError, read_file
from rosoclingo.pddl.files import ImportOptions, import_task, write_files
from rosoclingo.pddl.translator import fast_downward
from rosoclingo.seed.downward import NONE

RATIO = 0.5  # of LAMA's time, in the median
SOLVED = 29 / 32  # of the tasks
RATIO_WITH_SEED = 1.2  # likewise
SOLVED_WITH_SEED = 1.0
SECONDS = 30.0  # in which a task is to be solved
DRAWS = 3
LENGTH_SECONDS = 10
SHORT = 24 / 32  # of the tasks have plans that are at most as long as LAMA's by then
OPTIMAL_SECONDS = 60  # for an optimal plan
_OPTIMAL = "astar(lmcut())"
_FAILURES = 0.05
_ACTUATORS = ("aircraft", "driver", "elevator", "hoist", "robot", "rover", "satellite", "truck",
              "vehicle")  # fmt: skip
_MODE = "dynamic.incremental.dyn_reset"
_STEPS = ["-c", "steps=10000"]


@dataclass(frozen=True)
class Planned:
    """A first plan.

    Attributes:
        seconds: Processor time until it was there.
        actions: Its actions, in an order in which they can be done; or how many there are.
        cost: What it costs.
    """

    seconds: float
    actions: List[str]
    cost: int = 0


class _FirstPlan(System):
    """Ends when the first action goes out."""

    def __init__(self, encoding: List[str], seed_planner: str, patience: float) -> None:
        parts = make_parts(_MODE, Options(tuple(encoding), ()), _STEPS)
        super().__init__(parts.loop, patience=patience, seed_planner=seed_planner)
        self.actions: Optional[List[str]] = None
        self.ended = 0.0

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        if actuator != SOLVER and self.actions is None:
            self.ended = _processor_time()
            plan = self.loop.state.plan.actions_from(0)
            self.actions = [each.name for each in sorted(plan, key=lambda one: one.step)]
            self.close()

    def turn(self) -> bool:
        return False

    @property
    def cost(self) -> int:
        """The cost of the plan."""
        quality = self.loop.state.planner.quality
        return 0 if quality is None else quality.cost[-1]


class _World(System):
    """Executes plans as PDDL says, where one of twenty actions fails."""

    def __init__(self, encoding: List[str], validator: PlanValidator, seed: int) -> None:
        parts = make_parts(_MODE, Options(tuple(encoding), ()), _STEPS)
        super().__init__(parts.loop, patience=DEFAULT_PATIENCE)
        self.improves = False
        self._validator = validator
        self._dice = random.Random(seed)

    def turn(self) -> bool:
        for actuator in self._dice.sample(sorted(self.acting), len(self.acting)):
            if self._dice.random() < _FAILURES:
                self.answer(actuator, FAILURE)
            else:
                self._validator.execute_term(self.answer(actuator))
        return bool(self._items)


def write_encoding(
    domain: Path, problem: Path, folder: str, options: Optional[ImportOptions] = None
) -> List[str]:
    """Imports a task into a folder, and returns the planner's files."""
    texts = import_task(domain, problem, options or ImportOptions(name="task"))
    return [str(f) for f in write_files(texts, Path(folder)) if f.suffix == ".lp"]


def execute_task(domain: Path, problem: Path, kinds: Sequence[str], seed: int) -> str:
    """Executes plans for a task, and returns what is wrong; nothing if all is right."""
    task = read_domain(read_file(domain)), read_problem(read_file(problem))
    known = {*task[1].objects.values(), *(atom.head for atom in task[1].init)}
    options = ImportOptions(name="task", actuators=[kind for kind in kinds if kind in known])
    validator = PlanValidator(*task)
    with tempfile.TemporaryDirectory() as place:
        world = _World(write_encoding(domain, problem, place, options), validator, seed)
        world.request("goal")
        try:
            failure = world.run()
            validator.require_goal()
        except PddlError as err:
            return str(err)
    return "" if failure is None else str(failure)


def execute_tasks(folder: Path, pattern: str, draws: int) -> int:
    """Executes plans for all tasks, and returns the exit status."""
    wrong = 0
    for name, domain, problem in tasks(folder, pattern):
        for seed in range(draws):
            failure = execute_task(domain, problem, _ACTUATORS, seed)
            print(f"{name}, {seed}: {failure or 'as PDDL says'}", flush=True)
            wrong += bool(failure)
    return 1 if wrong else 0


def _processor_time() -> float:
    """Returns the processor time of this process and of those that it has ended, in seconds."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def plan_here(encoding: List[str], seed_planner: str, seconds: float) -> None:
    """Plans in this process, and prints the time, the plan and its cost as JSON.

    Args:
        encoding: The files.
        seed_planner: The name of another planner.
        seconds: How long the plan is improved before the first action goes out.
    """
    system = _FirstPlan(encoding, seed_planner, seconds or DEFAULT_PATIENCE)
    system.run()
    began = _processor_time()
    system.request("goal")
    system.run()
    print(json.dumps([system.ended - began, system.actions, system.cost]))


def plan_with_library(
    encoding: List[str], limit: float, seed_planner: str, seconds: float = 0
) -> Optional[Planned]:
    """Plans in a process of its own; returns None if there is no plan in time."""
    command = [sys.executable, __file__, "--seed-planner", seed_planner]
    command += ["--seconds", str(seconds), "--one", *encoding]
    try:
        ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None
    duration, actions, cost = json.loads(ended.stdout.splitlines()[-1])
    return None if actions is None else Planned(duration, actions, cost)


def plan_with_lama(
    domain: Path, problem: Path, folder: Path, seconds: Optional[int] = None
) -> Planned:
    """Plans with LAMA; the actions have no names.

    Args:
        domain: The domain.
        problem: The problem.
        folder: Gets its files.
        seconds: How long it improves plans; None for its first plan.
    """
    driver = str(fast_downward() / "fast-downward.py")
    options = ["--alias", "lama-first"]
    if seconds is not None:
        options = ["--overall-time-limit", f"{seconds}s", "--alias", "lama"]
    command = [sys.executable, driver, *options, str(domain), str(problem)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(
        command, check=seconds is None, capture_output=True, text=True, cwd=folder
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    duration = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    lengths = re.findall(r"Plan length: (\d+) step", ended.stdout)
    costs = re.findall(r"Plan cost: (\d+)", ended.stdout)
    assert lengths, ended.stdout[-2000:]
    return Planned(duration, [""] * int(lengths[-1]), int(costs[-1]))


def plan_optimally(domain: Path, problem: Path, folder: Path) -> Optional[int]:
    """Returns what an optimal plan costs, by A* with LM-cut; None if it takes over a minute."""
    driver = str(fast_downward() / "fast-downward.py")
    limits = ["--overall-time-limit", f"{OPTIMAL_SECONDS}s", "--overall-memory-limit", "3G"]
    command = [sys.executable, driver, *limits, str(domain), str(problem), "--search", _OPTIMAL]
    ended = subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder)
    costs = re.findall(r"Plan cost: (\d+)", ended.stdout)
    return int(costs[-1]) if costs else None


def is_valid(name: str, domain: Path, problem: Path, *plans: Planned) -> bool:
    """Executes plans by PDDL's semantics; says why one of them is not valid, if one is not."""
    try:
        for plan in plans:
            validator = PlanValidator(
                read_domain(read_file(domain)), read_problem(read_file(problem))
            )
            for action in plan.actions:
                validator.execute_term(action)
            validator.require_goal()
    except PddlError as err:
        print(f"{name}: the plan is not valid: {err}")
        return False
    return True


def tasks(folder: Path, pattern: str) -> Iterator[Tuple[str, Path, Path]]:
    """Yields the name, the domain and the problem of each task whose name fits."""
    for problem in sorted(folder.glob("*/*.pddl")):
        if problem.name.endswith("domain.pddl"):
            continue
        domain = problem.with_name("domain.pddl")
        if not domain.exists():
            domain = problem.with_name(f"{problem.stem}-domain.pddl")
        name = f"{problem.parent.name} {problem.stem}"
        if re.search(pattern, name):
            yield name, domain.resolve(), problem.resolve()


def measure_tasks(
    folder: Path, pattern: str, draws: int, report: Report, seed_planner: str
) -> bool:
    """Adds a row for each task, and those of all; returns whether all plans are valid."""
    has_seed = seed_planner != NONE
    most, least = (RATIO_WITH_SEED, SOLVED_WITH_SEED) if has_seed else (RATIO, SOLVED)
    ratios: List[float] = []
    solved = count = shorter = 0
    all_valid = True
    for name, domain, problem in tasks(folder, pattern):
        count += 1
        with tempfile.TemporaryDirectory() as place:
            files = write_encoding(domain, problem, place)
            both = []
            for _ in range(draws):
                lama = plan_with_lama(domain, problem, Path(place))
                ours = plan_with_library(files, SECONDS + 5, seed_planner)
                both.append((lama, ours))
                if ours is None:
                    break
        found = [ours for _, ours in both if ours is not None and ours.seconds <= SECONDS]
        others = Samples("s", tuple(lama.seconds for lama, _ in both))
        if len(found) < len(both):
            report.add(Row(f"{name}: no plan in {SECONDS:g} s", others, None))
            ratios.append(SECONDS / min(others.values))
            continue
        all_valid &= is_valid(name, domain, problem, *found)
        solved += 1
        own = Samples("s", tuple(ours.seconds for ours in found))
        ratios.append(min(own.values) / min(others.values))
        lengths = len(found[0].actions), len(both[0][0].actions)
        shorter += lengths[0] <= lengths[1]
        report.add(Row(f"{name}: {lengths[0]} actions, LAMA {lengths[1]}", own, None,
                       "to LAMA", ratios[-1], "x"))  # fmt: skip
    if ratios:
        all_ratios = Samples("x", tuple(ratios))
        report.add(Row("to LAMA", all_ratios, None, "median", all_ratios.median, "x", most))
        missing = Samples("", (float(count - solved),))
        report.add(Row(f"{solved} of {count} solved", missing, None, "not solved",
                       (count - solved) / count, "", 1 - least))  # fmt: skip
        print(f"{shorter} of {solved} plans have at most as many actions as LAMA's")
    return all_valid


def measure_lengths(folder: Path, pattern: str, report: Report, seed_planner: str) -> bool:
    """Adds a row for each task, and one for all; returns whether all plans are valid."""
    count = short = cheap = known = best = 0
    all_valid = True
    for name, domain, problem in tasks(folder, pattern):
        count += 1
        with tempfile.TemporaryDirectory() as place:
            files = write_encoding(domain, problem, place)
            lama = plan_with_lama(domain, problem, Path(place), LENGTH_SECONDS)
            optimum = plan_optimally(domain, problem, Path(place))
            limit = SECONDS + LENGTH_SECONDS
            ours = plan_with_library(files, limit, seed_planner, LENGTH_SECONDS)
        length = Samples("actions", (float(len(lama.actions)),))
        if ours is None:
            report.add(Row(f"{name}: no plan", length, None))
            continue
        all_valid &= is_valid(name, domain, problem, ours)
        short += len(ours.actions) <= len(lama.actions)
        cheap += ours.cost <= lama.cost
        own = Samples("actions", (float(len(ours.actions)),))
        least = "over a minute" if optimum is None else str(optimum)
        known += optimum is not None
        best += optimum == ours.cost
        title = f"{name}: cost {ours.cost}, LAMA {lama.cost}, optimal {least}"
        report.add(Row(title, own, None,
                       "LAMA", length.median, "actions"))  # fmt: skip
    if count:
        longer = Samples("", (float(count - short),))
        report.add(Row(f"{short} of {count} at most as long", longer, None, "longer",
                       (count - short) / count, "", 1 - SHORT))  # fmt: skip
        print(f"{cheap} of {count} plans cost at most as much as LAMA's")
        print(f"{best} of the {known} whose optimum is known are optimal")
    return all_valid


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", default=os.environ.get("PDDL_TASKS"))
    parser.add_argument("--one", nargs="+", metavar="FILE", help="plans with an encoding only")
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of each task")
    parser.add_argument("--tasks", default="", metavar="REGEX", help="only those, by their names")
    parser.add_argument("--execute", action="store_true", help="executes plans only")
    parser.add_argument("--lengths", action="store_true", help="of plans after ten seconds only")
    parser.add_argument("--seconds", type=float, default=0.0, help="to improve a plan; with --one")
    parser.add_argument("--seed-planner", default=NONE, metavar="NAME", help="lama, for a seed")
    chosen = parser.parse_args()
    if chosen.one:
        plan_here(chosen.one, chosen.seed_planner, chosen.seconds)
        return 0
    if chosen.folder is None:
        print("no tasks: name their folder, or set PDDL_TASKS")
        return 0
    folder, pattern = Path(chosen.folder), chosen.tasks
    if chosen.execute:
        return execute_tasks(folder, pattern, chosen.draws)
    report = Report("lengths" if chosen.lengths else "tasks")
    if chosen.lengths:
        all_valid = measure_lengths(folder, pattern, report, chosen.seed_planner)
    else:
        all_valid = measure_tasks(folder, pattern, chosen.draws, report, chosen.seed_planner)
    return report.finish() or (0 if all_valid else 1)


if __name__ == "__main__":
    sys.exit(main())
