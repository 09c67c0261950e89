#!/usr/bin/env python3
"""Times first plans of planning tasks in PDDL, beside those of LAMA.

A task is imported by ``pddl.py``, and a planner in a process of its own loads what that has
written. Then the problem's goal comes, and the time until the first action goes out is measured.
LAMA is Fast Downward's ``lama-first``, the whole process with its translator. Times are processor

times, the least of some runs each, in turn, and each planner has 30 s. PDDL's own semantics
validates each plan, and so does unified-planning, if it can read the task.

The folder of the tasks has folders with ``domain.pddl`` (or ``NAME-domain.pddl``) and problems. It
is an argument, or in the environment as PDDL_TASKS; without it, nothing is measured. One half of
the tasks for which the limits were set, drawn by lot, was not looked at while the planner was
built, and has a row of its own. Exit status 1 says that a limit is missed, or that a plan is not
valid. With ``--execute``, nothing is measured: plans are executed, actions fail at random, and each
one that succeeds is validated. With ``--lengths``, it is measured what a plan costs after ten
seconds, with ``~patience``, beside LAMA's plan after ten seconds, and beside the optimal plan, if
A* finds that within a minute. With ``--whole``, the command ``pddl.py --plan`` is measured as a
process, from its start to the printed plan.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
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
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

from harness import Report, Row, Samples
from plan_validator import PlanValidator, read_validator
from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.planner.planner import DEFAULT_PATIENCE
from rosoclingo.loop.words import FAILURE, SOLVER
from rosoclingo.tools.pddl.expressions import PddlError
from rosoclingo.tools.pddl.files import ImportOptions, import_task, write_files
from rosoclingo.tools.pddl.translator import fast_downward

RATIO = 0.4  # of LAMA's time, in the median
MOST_RATIO = 3.0  # of LAMA's time, for any task
WHOLE_RATIO = 3.0  # of LAMA's time for both commands, in the median
SECONDS = 30.0  # in which a task is to be solved
DRAWS = 3
LENGTH_SECONDS = 10
CHEAP = {1.0: 0.75, 1.1: 0.92}  # of LAMA's costs by then, in that share of the tasks at least
OPTIMAL_SECONDS = 60  # for an optimal plan
_READY_SECONDS = 0.1  # in which a process that is not ready does something
_SLOWEST = 5  # times as long as the improvement may take, on a slow or busy machine
_OPTIMAL = "astar(lmcut())"
_OUT_OF_TIME = (21, 23)  # exit statuses of Fast Downward: its translator, its search
_FAILURES = 0.05
_ACTUATORS = ("aircraft", "driver", "elevator", "hoist", "robot", "rover", "satellite", "truck",
              "vehicle")  # fmt: skip
_NODES = Path(__file__).resolve().parents[1] / "rosoclingo" / "nodes"
_MODE = "dynamic.incremental.dyn_reset"
_STEPS = ["-c", "steps=10000"]
_NAME = "imported"  # of the encodings; the library has files of some other names
_NO_PLAN = Samples("s", (SECONDS,))

UNSEEN = """\
barman-opt11-strips pfile01-001
barman-opt14-strips p638-1
blocks probBLOCKS-6-0
depot p03
depot p07
elevators-opt08-strips p10
elevators-sat11-strips p01
freecell p04
gripper prob03
gripper prob05
logistics00 probLOGISTICS-4-0
miconic s8-0
nomystery-opt11-strips p05
openstacks-opt11-strips p05
openstacks-sat11-strips p01
parcprinter-08-strips p10
pegsol-08-strips p10
rovers p05
rovers p10
schedule probschedule-10-0
snake-opt18-strips p01
tpp p06
woodworking-opt08-strips p05
woodworking-sat11-strips p01
""".splitlines()
"""The half, drawn by lot on 2026-11-28, that was not looked at while the planner was built."""


@dataclass(frozen=True)
class Planned:
    """A first plan.

    Attributes:
        seconds: Processor time until it was there.
        actions: Its actions, in an order in which they can be done; or how many there are.
        cost: What it costs.
        last: Its last step.
    """

    seconds: float
    actions: List[str]
    cost: int = 0
    last: int = 0


class _FirstPlan(System):
    """Ends when the first action goes out."""

    def __init__(self, encoding: List[str], patience: float, slots: int) -> None:
        constants = ("-c", f"slots={slots}")
        parts = make_parts(_MODE, Options(tuple(encoding), constants), _STEPS)
        super().__init__(parts.loop, patience=patience)
        self.actions: Optional[List[str]] = None
        self.last = 0
        self.ended = 0.0

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        if actuator != SOLVER and self.actions is None:
            self.ended = _processor_time()
            plan = self.loop.state.plan.actions_from(0)
            self.actions = [each.name for each in sorted(plan, key=lambda one: one.step)]
            self.last = max(each.step for each in plan)
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
    texts = import_task(domain, problem, options or ImportOptions(name=_NAME))
    return [str(f) for f in write_files(texts, Path(folder)) if f.suffix == ".lp"]


def execute_task(domain: Path, problem: Path, kinds: Sequence[str], seed: int) -> str:
    """Executes plans for a task, and returns what is wrong; nothing if all is right."""
    validator = read_validator(domain, problem)
    known = {*validator.kinds.values(), *(fact[0] for fact in validator.facts)}
    options = ImportOptions(name=_NAME, actuators=[kind for kind in kinds if kind in known])
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
    """Returns the processor time of this process and of all that it has started, in seconds."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + ended.ru_utime + ended.ru_stime + _children_time()


def _children_time() -> float:
    """Returns the processor time of the processes that run for this one, in seconds."""
    seconds = 0.0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            if int(stat.read_text().rpartition(")")[2].split()[1]) == os.getpid():
                clock = ~int(stat.parent.name) << 3 | 2  # as clock_getcpuclockid(3) has it
                seconds += time.clock_gettime(clock)
    return seconds


def _wait_until_ready() -> float:
    """Waits until the processes that were started in advance do nothing any more.

    Returns:
        The processor time until then, as :func:`_processor_time` has it.
    """
    before, now = -1.0, _children_time()
    while now != before:
        time.sleep(_READY_SECONDS)
        before, now = now, _children_time()
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return now + ended.ru_utime + ended.ru_stime + time.process_time()


def plan_here(encoding: List[str], seconds: float, goals: Sequence[str]) -> None:
    """Plans in this process, and prints the time, the plan, its cost and last step as JSON.

    Args:
        encoding: The files.
        seconds: How long the plan is improved before the first action goes out.
        goals: The requests.
    """
    system = _FirstPlan(encoding, seconds or DEFAULT_PATIENCE, len(goals))
    system.run()
    began = _wait_until_ready()
    for goal in goals:
        system.request(goal)
    system.run()
    print(json.dumps([system.ended - began, system.actions, system.cost, system.last]))


def plan_with_library(
    encoding: List[str], limit: float, seconds: float = 0, goals: Sequence[str] = ("goal",)
) -> Optional[Planned]:
    """Plans in a process of its own; returns None if there is no plan in time."""
    command = [sys.executable, __file__, "--seconds", str(seconds), "--one", *encoding]
    command += ["--goals", *goals]
    try:
        ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None
    duration, actions, cost, last = json.loads(ended.stdout.splitlines()[-1])
    return None if actions is None else Planned(duration, actions, cost, last)


def plan_with_lama(
    domain: Path, problem: Path, folder: Path, seconds: Optional[int] = None
) -> Optional[Planned]:
    """Plans with LAMA; the actions have no names.

    Args:
        domain: The domain.
        problem: The problem.
        folder: Gets its files.
        seconds: How long it improves plans; None for its first plan.

    Returns:
        None if it has no plan in time.
    """
    driver = str(fast_downward() / "fast-downward.py")
    alias, limit = ("lama-first", SECONDS) if seconds is None else ("lama", seconds)
    options = ["--overall-time-limit", f"{limit:g}s", "--alias", alias]
    command = [sys.executable, driver, *options, str(domain), str(problem)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ended = subprocess.run(command, check=False, capture_output=True, text=True, cwd=folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    duration = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    lengths = re.findall(r"Plan length: (\d+) step", ended.stdout)
    costs = re.findall(r"Plan cost: (\d+)", ended.stdout)
    if not lengths and ended.returncode in _OUT_OF_TIME:
        return None
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
    written: List[str] = []
    try:
        for plan in plans:
            validator = read_validator(domain, problem)
            for action in plan.actions:
                validator.execute_term(action)
            validator.require_goal()
            written.append("\n".join(f"({validator.words(one)})" for one in plan.actions))
    except PddlError as err:
        print(f"{name}: the plan is not valid: {err}")
        return False
    return _judge(name, domain, problem, written)


def _judge(name: str, domain: Path, problem: Path, plans: Sequence[str]) -> bool:
    """Executes plans in PDDL by unified-planning; says what is wrong, or that it cannot."""
    # They take a second, which would be part of each planner's start.
    from unified_planning.engines.plan_validator import SequentialPlanValidator  # noqa: PLC0415
    from unified_planning.exceptions import UPUsageError  # noqa: PLC0415
    from unified_planning.io import PDDLReader  # noqa: PLC0415

    reader = PDDLReader()
    try:
        task = reader.parse_problem(str(domain), str(problem))
    except Exception as err:  # its parser has many classes of errors
        print(f"{name}: unified-planning cannot read the task: {str(err).splitlines()[0]}")
        return True
    for plan in plans:
        try:
            judged = SequentialPlanValidator().validate(task, reader.parse_plan_string(task, plan))
        except UPUsageError as err:
            print(f"{name}: unified-planning does not judge such tasks: {err}")
            return True
        if not judged:
            print(f"{name}: unified-planning says that the plan is not valid: {judged.reason}")
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


def measure_tasks(folder: Path, pattern: str, draws: int, report: Report) -> bool:
    """Adds a row for each task, and those of all; returns whether all plans are valid."""
    halves: Dict[bool, List[float]] = {True: [], False: []}  # by whether it was not looked at
    count = solved = missed = shorter = 0
    all_valid = True
    for name, domain, problem in tasks(folder, pattern):
        count += 1
        lama, ours = _plan_in_turn(domain, problem, draws)
        others = Samples("s", tuple(each.seconds for each in lama)) if lama else None
        if not ours:
            missed += bool(lama)
            report.add(Row(f"{name}: no plan in {SECONDS:g} s", others or _NO_PLAN, None))
            if others:
                halves[name in UNSEEN].append(SECONDS / min(others.values))
            continue
        solved += 1
        all_valid &= is_valid(name, domain, problem, *ours)
        own = Samples("s", tuple(each.seconds for each in ours))
        length = len(ours[0].actions)
        if others is None:
            shorter += 1
            report.add(Row(f"{name}: {length} actions, LAMA none", own, None))
            continue
        shorter += length <= len(lama[0].actions)
        ratio = min(own.values) / min(others.values)
        halves[name in UNSEEN].append(ratio)
        report.add(Row(f"{name}: {length} actions, LAMA {len(lama[0].actions)}", own, None,
                       "to LAMA", ratio, "x"))  # fmt: skip
    for title, samples in _halves(halves):
        report.add(Row(title, samples, None, "median to LAMA", samples.median, "x", RATIO))
        report.add(Row(title, samples, None, "most to LAMA", max(samples.values), "x", MOST_RATIO))
    if count:
        report.add(Row(f"{solved} of {count} solved", Samples("", (float(solved),)), None,
                       "solved by LAMA only", missed, "", 0))  # fmt: skip
        print(f"{shorter} of {solved} plans have at most as many actions as LAMA's")
    return all_valid


def _halves(halves: Dict[bool, List[float]]) -> Iterator[Tuple[str, Samples]]:
    """Yields titles and ratios of both halves and of all tasks, as far as there are any."""
    for title, ratios in (
        ("half that was not looked at", halves[True]),
        ("other half", halves[False]),
        ("all", halves[True] + halves[False]),
    ):
        if ratios:
            yield title, Samples("x", tuple(ratios))


def measure_whole(folder: Path, pattern: str, draws: int, report: Report) -> bool:
    """Measures ``pddl.py --plan`` as a user runs it, beside LAMA's whole process.

    Adds a row for each task, and those of all; returns whether all plans are valid.
    """
    halves: Dict[bool, List[float]] = {True: [], False: []}  # by whether it was not looked at
    all_valid = True
    for name, domain, problem in tasks(folder, pattern):
        lama: List[Optional[Planned]] = []
        ours: List[Optional[Planned]] = []
        for _ in range(draws):
            with tempfile.TemporaryDirectory() as place:
                lama.append(plan_with_lama(domain, problem, Path(place)))
                ours.append(plan_with_command(domain, problem, Path(place)))
        others, own = _unless_missing(lama), _unless_missing(ours)
        samples = Samples("s", tuple(each.seconds for each in own)) if own else _NO_PLAN
        all_valid &= is_valid(name, domain, problem, *own)
        if not others:
            report.add(Row(f"{name}: LAMA none", samples, None))
            continue
        ratio = min(samples.values) / min(each.seconds for each in others)
        halves[name in UNSEEN].append(ratio)
        report.add(Row(name if own else f"{name}: no plan", samples, None, "to LAMA", ratio, "x"))
    for title, samples in _halves(halves):
        report.add(Row(title, samples, None, "median to LAMA", samples.median, "x", WHOLE_RATIO))
    return all_valid


def plan_with_command(domain: Path, problem: Path, folder: Path) -> Optional[Planned]:
    """Imports a task and plans it by ``pddl.py --plan``.

    Returns:
        None if there is no plan in time.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, str(_NODES / "pddl.py"), str(domain), str(problem)]
    command += ["--name", "one", "--plan"]
    try:
        ended = subprocess.run(
            command, check=False, capture_output=True, text=True, cwd=folder, timeout=4 * SECONDS
        )
    except subprocess.TimeoutExpired:
        return None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    duration = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    lines = re.findall(r"^ *\d+  (.+)$", ended.stdout, re.MULTILINE)
    actions = [one.partition(": ")[2] for line in lines for one in line.split(", ")]
    return None if ended.returncode else Planned(duration, actions)


def _plan_in_turn(domain: Path, problem: Path, draws: int) -> Tuple[List[Planned], List[Planned]]:
    """Returns the plans of LAMA and ours; empty if one of the runs has none in time."""
    lama: List[Optional[Planned]] = []
    ours: List[Optional[Planned]] = []
    with tempfile.TemporaryDirectory() as place:
        files = write_encoding(domain, problem, place)
        for _ in range(draws):
            if None not in lama:
                lama.append(plan_with_lama(domain, problem, Path(place)))
            if None not in ours:
                found = plan_with_library(files, SECONDS + 5)
                in_time = found is not None and found.seconds <= SECONDS
                ours.append(found if in_time else None)
    return _unless_missing(lama), _unless_missing(ours)


def _unless_missing(plans: Sequence[Optional[Planned]]) -> List[Planned]:
    found = [plan for plan in plans if plan is not None]
    return found if len(found) == len(plans) else []


def measure_lengths(folder: Path, pattern: str, report: Report) -> bool:
    """Adds a row for each task, and those of all; returns whether all plans are valid."""
    halves: Dict[bool, List[float]] = {True: [], False: []}  # by whether it was not looked at
    above: List[float] = []  # the optimum, where that is known
    all_valid = True
    for name, domain, problem in tasks(folder, pattern):
        with tempfile.TemporaryDirectory() as place:
            files = write_encoding(domain, problem, place)
            lama = plan_with_lama(domain, problem, Path(place), LENGTH_SECONDS)
            optimum = plan_optimally(domain, problem, Path(place))
            limit = SECONDS + LENGTH_SECONDS * _SLOWEST
            ours = plan_with_library(files, limit, LENGTH_SECONDS)
        if ours is None:
            report.add(Row(f"{name}: no plan", _NO_PLAN, None))
            if lama:
                halves[name in UNSEEN].append(math.inf)
            continue
        all_valid &= is_valid(name, domain, problem, ours)
        best = "not within a minute" if optimum is None else str(optimum)
        if optimum is not None:
            above.append(_ratio(ours.cost, optimum))
        own = Samples("", (float(ours.cost),))
        title = f"{name}: cost, LAMA {lama.cost if lama else 'none'}, optimum {best}"
        ratio = _ratio(ours.cost, lama.cost) if lama else None
        report.add(Row(title, own, None, "to LAMA" if lama else "", ratio, "x"))
        if ratio is not None:
            halves[name in UNSEEN].append(ratio)
    for title, samples in _halves(halves):
        for most, share in CHEAP.items():
            dear = sum(ratio > most for ratio in samples.values) / len(samples.values)
            report.add(Row(f"{title}: costs to LAMA's", samples, None,
                           f"share above {most:g}x", dear, "", 1 - share))  # fmt: skip
    if above:
        samples = Samples("x", tuple(above))
        report.add(Row(f"{above.count(1.0)} of {len(above)} known optima", samples, None,
                       "most to optimum", max(above), "x"))  # fmt: skip
    return all_valid


def _ratio(cost: int, other: int) -> float:
    return 1.0 if cost == other else cost / other if other else math.inf


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", default=os.environ.get("PDDL_TASKS"))
    parser.add_argument("--one", nargs="+", metavar="FILE", help="plans with an encoding only")
    parser.add_argument("--goals", nargs="+", default=["goal"], help="requests; with --one")
    parser.add_argument("--draws", type=int, default=DRAWS, metavar="N", help="of each task")
    parser.add_argument("--tasks", default="", metavar="REGEX", help="only those, by their names")
    parser.add_argument("--execute", action="store_true", help="executes plans only")
    parser.add_argument("--whole", action="store_true", help="pddl.py as a process only")
    parser.add_argument("--lengths", action="store_true", help="of plans after ten seconds only")
    parser.add_argument("--seconds", type=float, default=0.0, help="to improve a plan; with --one")
    chosen = parser.parse_args()
    if chosen.one:
        plan_here(chosen.one, chosen.seconds, chosen.goals)
        return 0
    if chosen.folder is None:
        print("no tasks: name their folder, or set PDDL_TASKS")
        return 0
    folder, pattern = Path(chosen.folder), chosen.tasks
    if chosen.execute:
        return execute_tasks(folder, pattern, chosen.draws)
    report = Report("lengths" if chosen.lengths else "whole" if chosen.whole else "tasks")
    if chosen.whole:
        all_valid = measure_whole(folder, pattern, chosen.draws, report)
    elif chosen.lengths:
        all_valid = measure_lengths(folder, pattern, report)
    else:
        all_valid = measure_tasks(folder, pattern, chosen.draws, report)
    return report.finish() or (0 if all_valid else 1)


if __name__ == "__main__":
    sys.exit(main())
