#!/usr/bin/env python3
"""Measures the speed and memory of replaying a long recording.

Run by scripts/bench; ``--steps 10000`` replays a run as long as a robot's day. Exit status 1 says
that a limit is missed.
"""

from __future__ import annotations

import argparse
import queue
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Iterator, List, Tuple

import rospy
from actionlib_msgs.msg import GoalStatus

from harness import HarnessError, Report, RosSystem, Row, Samples, resident_mebibytes
from rosoclingo.msg import ROSoClingoGoal, ROSoClingoOut
from rosoclingo_bench import PACKAGE, PLANNER, TARGETS, Actuator

MODE = PACKAGE / "modes" / "dynamic.incremental.dyn_reset.lp"
STEPS_OF_A_GOAL = 5

RECORDED_STEP = 1000.0  # ms that a step takes a real robot, at the least
FASTER = 20  # times, at the least
# The replay keeps what it compares: some 2 KiB for each step; else nothing is to grow.
GROWTH_MEBIBYTES = 8

_TIMEOUT_SECONDS = 60.0
_PROGRESS = re.compile(r"replay: (\d+) of (\d+) inputs")


class Robot(Actuator):
    """Answers each action at once, and sends goals one after the other."""

    QUEUE = 10_000

    def execute_goals(self, goals: int) -> None:
        """Executes so many goals.

        Raises:
            HarnessError: One does not succeed.
        """
        for number in range(goals):
            request = f"visit({TARGETS[number % len(TARGETS)]})"
            handle = self._client.send_goal(ROSoClingoGoal(request, []), self._on_transition, None)
            try:
                self._events.get(timeout=_TIMEOUT_SECONDS)
            except queue.Empty:
                raise HarnessError(f"{request} did not end") from None
            if handle.get_terminal_state() != GoalStatus.SUCCEEDED:
                raise HarnessError(f"{request} did not succeed: {handle.get_goal_status_text()}")

    def _on_action(self, action: ROSoClingoOut) -> None:
        self._in.publish(action.id, "success")


def record(bag: Path, steps: int) -> None:
    """Records a run of so many steps."""
    with RosSystem() as system:
        rospy.init_node("robot", disable_signals=True)
        try:
            system.rosrun(
                "rosclingo", "run.py", "-f", str(MODE), "-c", "steps=20", name="controller"
            )
            system.rosrun("rosclingo", "run.py", "-f", str(PLANNER), name="planner")
            system.rosrun("rosoclingo", "record.py", "-o", str(bag), name="record")
            system.rosrun("rosoclingo", "run.py", name="rosoclingo")
            robot = Robot("/rosoclingo")
            robot.wait()
            robot.execute_goals(steps // STEPS_OF_A_GOAL)
            system.end("record")
        finally:
            rospy.signal_shutdown("recorded")


def replay(bag: Path) -> Tuple[float, List[float], List[float]]:
    """Replays a bag.

    Returns:
        How long it took in seconds, and from time to time the memory in MiB: that of the replay's
        own process, and that of the nodes.

    Raises:
        HarnessError: There is a difference.
    """
    command = ["rosrun", "rosoclingo", "replay.py", str(bag)]
    own: List[float] = []
    nodes: List[float] = []
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        for line in process.stderr:
            print(line, end="", flush=True)
            if _PROGRESS.match(line):
                own.append(resident_mebibytes(process.pid))
                nodes.append(sum(map(resident_mebibytes, _children(process.pid))))
        said = process.stdout.read()
    print(said, end="")
    took = re.search(r"([\d.]+) s, [\d.]+ times as fast", said)
    if process.returncode or took is None:
        raise HarnessError(f"the replay differs, or failed: {process.returncode}")
    return float(took[1]), own, nodes


def _children(pid: int) -> Iterator[int]:
    for file in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in map(int, file.read_text().split()):
            yield child
            yield from _children(child)


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=3000, help="how long the run is")
    steps = parser.parse_args().steps
    report = Report("replay")
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "run.bag"
        record(bag, steps)
        seconds, own, nodes = replay(bag)
    took = Samples("ms", (seconds * 1e3 / steps,))
    limit = RECORDED_STEP / FASTER
    report.add(Row(f"{steps} steps, each", None, took, "mean", took.median, "ms", limit))
    # By then, the journal that is kept for late subscribers is as long as it gets.
    for name, values in (("replay.py", own), ("nodes", nodes)):
        memory = Samples("MiB", tuple(values[len(values) * 6 // 10 :]))
        growth = memory.values[-1] - memory.values[0]
        report.add(
            Row(
                f"memory of {name}", None, memory, "last - at 60 %", growth, "MiB", GROWTH_MEBIBYTES
            )
        )
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
