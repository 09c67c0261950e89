#!/usr/bin/env python3
"""Measures the planning loop's overhead over the solver's own time, with general encodings.

The encodings are in ``encodings/`` and in the style of the manual's; the horizon grows one by one.
Over ROS there are three nodes in a static mode, from the first command until the plan is heard.
clingo itself grounds and solves the same in this process, with the same options. Both in turn.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import queue
import statistics
import sys
import time
from pathlib import Path
from typing import Any, List, Mapping, NamedTuple, Tuple

import clingo
import rospy

from harness import HarnessError, Report, RosSystem, Row, Samples, measure, milliseconds
from rosclingo.ros.client import Client
from rosclingo.wire.commands import GetStats, Stats
from rosoclingo.loop.journal import CommandDone, decode
from rosoclingo.loop.values.added import EMPTY_PARTS
from rosoclingo.msg import ROSoClingoEvent, ROSoClingoOut

ROOT = Path(__file__).resolve().parents[1]
ENCODINGS = Path(__file__).with_name("encodings")
MODE = ROOT / "rosoclingo" / "modes" / "static.incremental.recording.lp"
STEPS = 150  # the longest plan to look for
FIRST_DOUBT = 8  # searches without a plan, see rosoclingo.loop.search
LIMIT = 10.0  # percent of clingo's time that the loop may add
_TIMEOUT_SECONDS = 120.0


class Instance(NamedTuple):
    """An encoding, with options for clingo."""

    name: str
    files: Tuple[Path, ...]
    options: Tuple[str, ...] = ()


class Effort(NamedTuple):
    """The effort of a search, to compare two: the plan's length, and clingo's conflicts."""

    steps: int
    conflicts: int


INSTANCES = (
    Instance("towers of Hanoi", (ENCODINGS / "hanoi.lp",), ("-c", "disks=7")),
    Instance(
        "blocks world, 10 blocks",
        (ENCODINGS / "ten_blocks.lp", ROOT / "rosclingo" / "example" / "itoh.lp"),
    ),
    Instance("ricochet robots", (ENCODINGS / "ricochet.lp",)),
)
DRAWS = 10


def plan_with_clingo(instance: Instance) -> Tuple[float, Effort]:
    """Plans as a script of clingo does.

    Two things are not needed for a plan, and done here only because clingo's way depends on them:
    what rosoclingo adds to the program, and the searches by which it looks now and then whether
    there is any answer set. The time of the latter does not count.

    Returns:
        The milliseconds, and the effort.
    """
    begin = time.perf_counter()
    control = clingo.Control(list(instance.options), logger=lambda *_: None)
    for file in instance.files:
        control.load(str(file))
    for part in EMPTY_PARTS:
        control.add(part.name, list(part.parameters), part.program)
    step = 0
    doubts = 0.0
    now: List[clingo.Symbol] = [clingo.Number(step)]
    control.ground([("base", []), ("state", now), ("query", now)])
    while True:
        query = clingo.Function("query", now)
        control.assign_external(query, True)
        if control.solve().satisfiable:
            seconds = time.perf_counter() - begin - doubts
            return seconds * 1e3, Effort(step, _conflicts(control.statistics))
        control.assign_external(query, False)
        step += 1
        if step >= FIRST_DOUBT and not step & (step - 1):
            doubts += milliseconds(control.solve)[0] / 1e3
        now = [clingo.Number(step)]
        control.ground([("state", now), ("transition", now), ("query", now)])


class Nodes:
    """Controller and planner of an instance, and a rosoclingo that is started for each plan."""

    def __init__(self, system: RosSystem, instance: Instance, number: int) -> None:
        """Starts the solvers.

        Args:
            system: The ROS system.
            instance: What is planned.
            number: Of the instance, for names.
        """
        self._system = system
        self._name = f"general{number}"
        files = [part for file in instance.files for part in ("-f", str(file))]
        mode = ["-f", str(MODE), "-c", f"steps={STEPS}"]
        for role, arguments in (("controller", mode), ("planner", [*files, *instance.options])):
            system.rosrun("rosclingo", "run.py", *arguments, name=f"{self._name}_{role}")
        self._planner = Client(f"{self._name}_planner")
        self._planner.wait(_TIMEOUT_SECONDS)

    def plan(self) -> Tuple[float, Effort]:
        """Plans in a fresh node.

        Returns:
            The milliseconds from the first command until the plan is heard, and the effort.

        Raises:
            HarnessError: There is no plan.
        """
        plans: queue.Queue[float] = queue.Queue()
        commands: List[Tuple[ROSoClingoEvent, CommandDone]] = []

        def note(message: ROSoClingoEvent) -> None:
            event = decode(message)
            if isinstance(event, CommandDone):
                commands.append((message, event))

        listeners = [
            rospy.Subscriber(
                f"{self._name}/out",
                ROSoClingoOut,
                lambda _: plans.put(time.time()),  # the clock of the journal
                tcp_nodelay=True,
            ),
            rospy.Subscriber(f"{self._name}/journal", ROSoClingoEvent, note),
        ]
        solvers = [f"_{role}:={self._name}_{role}" for role in ("controller", "planner")]
        options = [*solvers, "_one_by_one_seconds:=0"]  # as clingo's script does it
        self._system.rosrun("rosoclingo", "run.py", *options, name=self._name)
        try:
            end = plans.get(timeout=_TIMEOUT_SECONDS)
        except queue.Empty:
            raise HarnessError("no plan came") from None
        while not (commands and commands[-1][1].publishes):  # another connection
            time.sleep(0.01)
        for listener in listeners:
            listener.unregister()
        self._system.end(self._name)
        first, done = commands[0]
        begin = first.stamp.to_sec() - done.seconds
        (stats,) = self._planner.control(GetStats())
        assert isinstance(stats, Stats)
        return (end - begin) * 1e3, Effort(commands[-1][0].horizon, _conflicts(stats.values))

    def close(self) -> None:
        """Ends the solvers."""
        for role in ("controller", "planner"):
            self._system.end(f"{self._name}_{role}")


def _conflicts(statistics: Mapping[str, Any]) -> int:
    return int(statistics["solving"]["solvers"]["conflicts"])


def run(system: RosSystem, _: Path, report: Report) -> None:
    """Measures all instances."""
    for number, instance in enumerate(INSTANCES):
        nodes = Nodes(system, instance, number)
        own: List[float] = []
        ros: List[float] = []
        for _draw in range(DRAWS):
            clingos, effort = plan_with_clingo(instance)
            ours, seen = nodes.plan()
            if seen != effort:
                raise HarnessError(f"{instance.name}: {seen} instead of {effort}")
            own.append(clingos)
            ros.append(ours)
        nodes.close()
        base, through = Samples("ms", tuple(own)), Samples("ms", tuple(ros))
        # Pair by pair, because the machine's speed drifts.
        pairs = list(zip(own, ros))
        percent = statistics.median(100 * (ours / clingos - 1) for clingos, ours in pairs)
        added = statistics.median(ours - clingos for clingos, ours in pairs)
        length = effort.steps
        name = f"{instance.name}, {length} steps"
        report.add(Row(name, base, through, "added to clingo's time", percent, "%", LIMIT))
        each = Samples("ms", tuple(value / (length + 1) for value in ros))
        row = Row(f"{name}, per horizon", base / (length + 1), each, "added", added / (length + 1))
        report.add(row)


if __name__ == "__main__":
    sys.exit(measure("general", run))
