#!/usr/bin/env python3
"""Measures a solver's overhead behind ROS: the same calls in process and through a node, in turn.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Callable, Sequence, Tuple, Union, cast

import rospy

from harness import (
    HarnessError,
    Measurements,
    Row,
    Samples,
    measure,
    resident_mebibytes,
    side_by_side,
)
from rosclingo.errors import RosclingoError
from rosclingo.ros.client import Client
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.srv import ROSClingoControl
from rosclingo.wire.commands import (
    AssignExternal,
    Assumed,
    Command,
    Ground,
    Outcome,
    Part,
    Result,
    Truth,
)
from rosclingo.wire.xml_codec import encode_commands

EXAMPLE = Path(__file__).resolve().parent.parent / "rosclingo" / "example"
ATOMS = 100_000
Plan = Callable[["Union[Client, InProcess]"], Outcome]

TRIVIAL = "a. #external e."
# A search of minutes: 12 pigeons in 11 holes.
PIGEONS = "1 { at(P,H) : H=1..11 } 1 :- P=1..12. :- at(P,H), at(Q,H), P<Q."
# Facts, because they take the solver the least time: the rest weighs the most.
LARGE = f"holds(at(1..{ATOMS}),7)."


class InProcess:
    """An engine in this process, with the calls of a client."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine

    def control(self, *commands: Command) -> None:
        """Runs commands in order."""
        for command in commands:
            self._engine.apply(command)

    def solve(self, assumptions: Sequence[Assumed] = ()) -> Outcome:
        """Searches for answer sets."""
        return self._engine.solve(assumptions)


class _StopSoon:
    """Tells a search to stop when it has run for a while, and remembers when that was."""

    def __init__(self) -> None:
        self._due = time.monotonic() + 0.3
        self.time = 0.0

    def __call__(self) -> bool:
        self.time = time.monotonic()
        return self.time > self._due


class Bench(Measurements):
    """The measurements, each on a node of its own."""

    def run(self) -> None:
        """Measures everything."""
        self._memory()
        self._control()
        self._goal()
        self._blocks_world()
        self._large_answer_set()
        self._ends_of_a_search()

    def _memory(self) -> None:
        sizes = []
        for number in range(3):
            pid = self._node(f"idle{number}", EXAMPLE / "instance.lp", EXAMPLE / "toh.lp")
            Client(f"idle{number}").wait(10)
            time.sleep(1)
            sizes.append(resident_mebibytes(pid))
            self.system.end(f"idle{number}")
        samples = Samples("MiB", tuple(sizes))
        largest = samples.percentile99
        self.report.add(Row("memory of an idle node", None, samples, "p99", largest, "MiB", 80))

    def _control(self) -> None:
        engine, client = self._pair("control", self._file("trivial.lp", TRIVIAL))
        self.system.start("echo", [sys.executable, str(Path(__file__).with_name("echo_node.py"))])
        self.system.node_pid("echo")
        rospy.wait_for_service("echo/control", 10)
        bare_service = rospy.ServiceProxy("echo/control", ROSClingoControl, persistent=True)
        command = AssignExternal("e", Truth.TRUE)
        text = encode_commands([command])
        base, ros, bare = side_by_side(
            2000,
            200,
            lambda: engine.control(command),
            lambda: client.control(command),
            lambda: bare_service(text),
        )
        self.report.add(Row("bare rospy service", None, bare))
        self.report.add(_median_row("control request", base, ros, 0.5))
        bare_service.close()
        self.system.end("echo")
        self.system.end("control")

    def _goal(self) -> None:
        engine, client = self._pair("goal", self._file("trivial.lp", TRIVIAL))
        base, ros = side_by_side(
            1000, 100, lambda: _found(engine.solve(), 1), lambda: _found(client.solve(), 1)
        )
        self.report.add(_median_row("trivial goal", base, ros, 3))
        # Not p99 - p99: noise in process must not excuse anything.
        tail = ros.percentile99 - base.median
        self.report.add(Row("trivial goal, tail", base, ros, "p99 - median", tail, "ms", 15))
        self.system.end("goal")

    def _blocks_world(self) -> None:
        engine, client = self._pair(
            "blocks", EXAMPLE / "instance.lp", EXAMPLE / "itoh.lp", ground=False
        )
        plan = _load_plan()
        steps = len(_quietly(plan, engine).symbols)
        base, ros = side_by_side(
            40,
            3,
            lambda: _found(_quietly(plan, engine), steps),
            lambda: _found(_quietly(plan, client), steps),
        )
        horizons = steps + 1  # a plan of n steps is found at horizon n, the first being 0
        row = _median_row("blocks world, per horizon", base / horizons, ros / horizons, 3)
        self.report.add(row)
        self.system.end("blocks")

    def _large_answer_set(self) -> None:
        engine, client = self._pair("large", self._file("large.lp", LARGE))
        base, ros = side_by_side(
            30, 3, lambda: _found(engine.solve(), ATOMS), lambda: _found(client.solve(), ATOMS)
        )
        ratio = ros.median / base.median
        name = f"answer set of {ATOMS:,} atoms"
        self.report.add(Row(name, base, ros, "median / median", ratio, "x", 2))
        self.system.end("large")

    def _ends_of_a_search(self) -> None:
        """Ends a search of minutes: 20 times by a cancel request, 5 times by Ctrl-C."""
        pigeons = self._file("pigeons.lp", PIGEONS)
        _, client = self._pair("cancel", pigeons)
        cancels = []
        for _ in range(20):
            stop = _StopSoon()
            outcome = client.solve(stopped=stop)
            cancels.append((time.monotonic() - stop.time) * 1000)
            if not outcome.interrupted:
                raise HarnessError(f"the search ended by itself: {outcome}")
        self.system.end("cancel")
        samples = Samples("ms", tuple(cancels))
        name = "cancel of a search"
        self.report.add(Row(name, None, samples, "median", samples.median, "ms", 100))
        self.report.add(Row(f"{name}, worst", None, samples, "max", max(cancels), "ms", 300))

        ends = []
        for number in range(5):
            name = f"interrupt{number}"
            _, client = self._pair(name, pigeons)
            with ThreadPoolExecutor() as pool:
                gone = pool.submit(client.solve)
                time.sleep(1)
                begin = time.monotonic()
                self.system.end(name)
                ends.append((time.monotonic() - begin) * 1000)
                if not isinstance(gone.exception(10), RosclingoError):
                    raise HarnessError("the client did not learn that the node is gone")
        samples = Samples("ms", tuple(ends))
        name = "Ctrl-C during a search, worst"
        self.report.add(Row(name, None, samples, "max", max(ends), "ms", 2000))

    def _file(self, name: str, program: str) -> Path:
        file = self.folder / name
        file.write_text(program)
        return file

    def _node(self, name: str, *files: Path) -> int:
        arguments = [argument for file in files for argument in ("-f", str(file))]
        return self.system.rosrun("rosclingo", "run.py", *arguments, name=name)

    def _pair(self, name: str, *files: Path, ground: bool = True) -> Tuple[InProcess, Client]:
        """Makes the same solver twice: here, and in a node."""
        self._node(name, *files)
        engine = InProcess(Engine(Options(files=tuple(map(str, files)))))
        client = Client(name)
        client.wait(10)
        if ground:
            command = Ground((Part("base"),))
            engine.control(command)
            client.control(command)
        return engine, client


def _median_row(name: str, base: Samples, ros: Samples, limit: float) -> Row:
    difference = ros.median - base.median
    return Row(name, base, ros, "median - median", difference, "ms", limit)


def _found(outcome: Outcome, atoms: int) -> None:
    """Makes sure that what was measured is what was meant."""
    if outcome.result is not Result.SAT or len(outcome.symbols) != atoms:
        raise HarnessError(f"{outcome.result.value} with {len(outcome.symbols)} atoms, not {atoms}")


def _load_plan() -> Plan:
    """Takes the loop from the example itself, which is no module of a package."""
    spec = importlib.util.spec_from_file_location("istart", EXAMPLE / "istart.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return cast(Plan, module.plan)


def _quietly(plan: Plan, solver: Union[Client, InProcess]) -> Outcome:
    with contextlib.redirect_stdout(io.StringIO()):
        return plan(solver)


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    return measure("rosclingo", lambda *parts: Bench(*parts).run())


if __name__ == "__main__":
    sys.exit(main())
