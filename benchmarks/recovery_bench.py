#!/usr/bin/env python3
"""Measures the overhead of a store, and the recovery time of a killed node.

A reaction with a store, side by side with one without and with bare writes to the same disk; and
the time from when rosoclingo is back until the next action, beside the planner's own time for the
same commands.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import os
import queue
import signal
import sys
import time
from pathlib import Path
from typing import List, Sequence, Tuple

from actionlib_msgs.msg import GoalStatusArray

from harness import HarnessError, Report, RosSystem, Row, Samples, measure, milliseconds
from rosclingo.ros.low_latency import publisher, subscriber
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.wire.xml_codec import decode_commands
from rosoclingo.msg import ROSoClingoAnswer, ROSoClingoDispatch
from rosoclingo.store.store import Store
from rosoclingo_bench import DYN_RESET, PACKAGE, PLANNER, RECORDING, TARGETS, Actuator

MAILBOT = Path(__file__).resolve().parents[1] / "rosoclingo_aspprograms" / "mailbot"
OFFICE = (MAILBOT / "instances" / "graph_wg.lp", MAILBOT / "mailbot.lp")
PAGE = bytes(4096)

GOALS = 40  # executed with a store and without, in turn
WRITES = 2  # durable ones, which a step may take
STORE_LIMIT = 1.0  # ms that the rest may take
KILLS = 9
STEP = 50  # in which the first of them is
BACK_LIMIT = 1000.0  # ms
RATIO_LIMIT = 1.5  # to the planner's own time

# Eleven deliveries, one to where the next one begins.
OFFICES = (1, 14, 6, 12, 3, 9, 4, 10, 7, 2, 13, 8)

_TIMEOUT_SECONDS = 30.0
_ANSWER_SECONDS = 0.005  # after which an answer is repeated that was not taken
_PAUSE_SECONDS = 0.1  # in which the loop comes to rest


def run(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures everything."""
    _reactions(system, folder, report)
    _kills(system, folder, report)


def _start(
    system: RosSystem, name: str, mode: str, steps: int, planner: Tuple[str, ...], *, store: str
) -> None:
    """Starts three nodes; without a store if its name is empty."""
    file = str(PACKAGE / "modes" / f"{mode}.lp")
    controller = ("-f", file, "-c", f"steps={steps}")
    system.rosrun("rosclingo", "run.py", *controller, name=f"{name}_controller")
    system.rosrun("rosclingo", "run.py", *planner, name=f"{name}_planner")
    _start_loop(system, name, store)


def _start_loop(system: RosSystem, name: str, store: str) -> None:
    words = [f"_controller:={name}_controller", f"_planner:={name}_planner"]
    words += [f"_store:={store}"] if store else []
    system.start(name, ["rosrun", "rosoclingo", "run.py", *words, f"__name:={name}"])


def _reactions(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures reactions with a store and without, and what the disk takes, in turn."""
    actuators = []
    for name, store in (("plain", ""), ("stored", str(folder / "reactions.store"))):
        _start(system, name, DYN_RESET, 20, ("-f", str(PLANNER)), store=store)
        actuators.append(Actuator(name))
        actuators[-1].wait()
    times: Tuple[List[float], List[float]] = ([], [])
    writes: List[float] = []
    with (folder / "bare").open("wb", buffering=0) as disk:

        def write() -> None:
            disk.write(PAGE)
            os.fsync(disk.fileno())

        for number in range(GOALS):
            request = f"visit({TARGETS[number % len(TARGETS)]})"
            for actuator, reactions in zip(actuators, times):
                intervals, _ = actuator.execute(request)
                reactions += [(end - begin) * 1e3 for begin, end in intervals]
                writes.append(milliseconds(write)[0])
    plain, stored, bare = (Samples("ms", tuple(values)) for values in (*times, writes))
    report.add(Row("a write to the disk", bare, None))
    rest = stored.median - plain.median - WRITES * bare.median
    compared = f"with - without a store - {WRITES} writes"
    report.add(
        Row("reaction, without a store and with", plain, stored, compared, rest, "ms", STORE_LIMIT)
    )
    for name in ("plain", "stored"):
        for part in ("", "_controller", "_planner"):
            system.end(f"{name}{part}")


class Robot:
    """Answers each action with its token, and tells when what came."""

    def __init__(self, name: str) -> None:
        """Opens the connections to a rosoclingo node.

        Args:
            name: The node's name.
        """
        self.back: queue.Queue[float] = queue.Queue()  # when lists of statuses came
        self._told: queue.Queue[Tuple[float, ROSoClingoDispatch]] = queue.Queue()
        self._number = 0
        self._run = ""
        self._answer = publisher(f"{name}/answer", ROSoClingoAnswer)
        self._listeners = [
            subscriber(
                f"{name}/status", GoalStatusArray, lambda _: self.back.put(time.monotonic())
            ),
            subscriber(
                f"{name}/dispatch",
                ROSoClingoDispatch,
                lambda told: self._told.put((time.monotonic(), told)),
            ),
        ]

    def next(self) -> Tuple[float, int]:
        """Answers the last action until there is another one.

        Returns:
            When that came, and its step.

        Raises:
            HarnessError: It does not come.
        """
        end = time.monotonic() + _TIMEOUT_SECONDS
        while time.monotonic() < end:
            if self._number:
                self._answer.publish(self._run, self._number, "success")
            try:
                when, told = self._told.get(timeout=_ANSWER_SECONDS)
            except queue.Empty:
                continue
            for action in told.actions:
                if action.number > self._number:
                    self._run, self._number = told.run, action.number
                    return when, action.step
        raise HarnessError("there is no further action")


def _kills(system: RosSystem, folder: Path, report: Report) -> None:
    """Measures from when a loop that was killed is back until its next action, again and again."""
    name, store = "office", folder / "office.store"
    client, robot = Actuator(name), Robot(name)
    planner = (*(word for file in OFFICE for word in ("-f", str(file))), "-c", "slots=3")
    _start(system, name, RECORDING, 400, planner, store=str(store))
    client.wait()
    for source, target in zip(OFFICES, OFFICES[1:]):
        client.send(f"bring(o{source},o{target})")
    step = 0
    while step < STEP:
        _, step = robot.next()
    times, own = [], []
    for _ in range(KILLS):
        time.sleep(_PAUSE_SECONDS)
        os.kill(system.node_pid(name), signal.SIGKILL)
        system.end(name)
        own.append(_planner_time(store, planner))
        while not robot.back.empty():
            robot.back.get()
        _start_loop(system, name, str(store))
        back = robot.back.get(timeout=_TIMEOUT_SECONDS)
        when, _ = robot.next()
        times.append((when - back) * 1e3)
    base, back_again = Samples("ms", tuple(own)), Samples("ms", tuple(times))
    what = f"the office in step {STEP}, back until the next action"
    report.add(Row(what, base, back_again, "median", back_again.median, "ms", BACK_LIMIT))
    ratio = back_again.median / base.median
    report.add(Row(f"{what}, beside grounding", base, back_again, "ratio", ratio, "x", RATIO_LIMIT))


def _planner_time(file: Path, options: Sequence[str]) -> float:
    """Returns how many milliseconds a fresh solver takes for what a store has of the planner."""
    store = Store(file)
    commands = [command for text in store.commands for command in decode_commands(text)]
    store.close()
    engine = Engine(parse_options(options))
    duration, reply = milliseconds(lambda: engine.run(commands))
    if reply.failure is not None:
        raise HarnessError(f"the planner refuses what is stored: {reply.failure.message}")
    return duration


if __name__ == "__main__":
    sys.exit(measure("recovery", run))
