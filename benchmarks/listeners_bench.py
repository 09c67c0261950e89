#!/usr/bin/env python3
"""Times the loop's reactions beside who listens: a recorder, and a console with twenty pages.

The planning node is told 1,000 unknown things in a second, each of which is in the journal.
Meanwhile a robot answers, and the time until its next action is measured: without a listener, with
record.py, with the console, and with twenty open pages of it. The pages give way to all other
processes, since those of a user are on other machines.

Nodes differ from each other by as much as listeners do, and a node with more steps takes longer. So
each node has all listeners in turn for some goals, and each listener is the first as often as
another.

Run by scripts/bench. Exit status 1 says that a limit is missed. ``--rounds N`` says how often each
is measured.
"""

from __future__ import annotations

import argparse
import contextlib
import queue
import re
import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Sequence, Tuple

from harness import HarnessError, Report, RosSystem, Row, Samples, measure
from rosoclingo.msg import ROSoClingoGoal
from rosoclingo_bench import PLANNER, TARGETS, WORK_SECONDS, Actuator

PAGES_SCRIPT = Path(__file__).with_name("pages.py")
NODE, LISTENER = "listened", "listener"
RATE = 1000  # inputs in a second
TICK_SECONDS = 0.01
GOALS = 4
ROUNDS = 16
LIMIT = 1.1  # times the reaction without a listener
PAGES = 20
_TIMEOUT_SECONDS = 60.0
_LINK = re.compile(r"open (\S+/#\S+)(?:\s|$)")  # as the console prints it


class Robot(Actuator):
    """The robot, its client, and whoever tells the planning node what it does not know."""

    QUEUE = 100 * RATE

    def reactions(self) -> List[float]:
        """Returns how many milliseconds it takes from each answer to the next action."""
        is_over = threading.Event()
        flood = threading.Thread(target=self._flood, args=(is_over,), daemon=True)
        flood.start()
        try:
            return [ms for number in range(GOALS) for ms in self._visit(TARGETS[number % 2])]
        finally:
            is_over.set()
            flood.join()

    def _flood(self, is_over: threading.Event) -> None:
        begin, told = time.monotonic(), 0
        while not is_over.wait(TICK_SECONDS):
            due = int((time.monotonic() - begin) * RATE)
            for number in range(told, due):
                self._in.publish("info", f"nonsense({number})")
            told = due

    def _visit(self, target: int) -> List[float]:
        found: List[float] = []
        self._client.send_goal(ROSoClingoGoal(f"visit({target})", []))
        self._next()
        for _ in range(abs(TARGETS[0] - TARGETS[1]) - 1):
            time.sleep(WORK_SECONDS)
            begin = time.monotonic()
            self._in.publish("robot", "success")
            found.append((self._next() - begin) * 1e3)
        self._in.publish("robot", "success")
        return found

    def _next(self) -> float:
        try:
            return self._events.get(timeout=_TIMEOUT_SECONDS)[1]
        except queue.Empty:
            raise HarnessError("no action came") from None


def record(system: RosSystem, folder: Path) -> None:
    """Starts a recorder."""
    bag = folder / f"{time.monotonic()}.bag"
    system.rosrun("rosoclingo", "record.py", "-o", str(bag), f"rosoclingo:={NODE}", name=LISTENER)
    system.wait_until_hears(f"/{LISTENER}", NODE)


def watch(system: RosSystem, _: Path, pages: int = 0) -> None:
    """Starts a console, and opens pages of it."""
    arguments = ("_port:=0", f"_systems:={NODE}")
    system.rosrun("rosoclingo_console", "console.py", *arguments, name=LISTENER)
    system.wait_until_hears(f"/{LISTENER}", NODE)
    if pages:
        end = time.monotonic() + _TIMEOUT_SECONDS
        while not (link := _LINK.search(system.output(LISTENER))):
            if time.monotonic() > end:
                raise HarnessError("the console has printed no link")
            time.sleep(TICK_SECONDS)
        opened = system.start(
            "pages", ["nice", "-n", "19", sys.executable, str(PAGES_SCRIPT), link[1], str(pages)]
        )
        while f"{pages} pages are open" not in system.output("pages"):
            if opened.poll() is not None or time.monotonic() > end:
                raise HarnessError("the pages did not open")
            time.sleep(TICK_SECONDS)


LISTENERS: Dict[str, Callable[[RosSystem, Path], None]] = {
    "nobody": lambda *_: None,
    "record.py": record,
    "the console": watch,
    f"the console with {PAGES} pages": partial(watch, pages=PAGES),
}


def react(
    system: RosSystem, folder: Path, robot: Robot, listen: Callable[[RosSystem, Path], None]
) -> List[float]:
    """Returns the robot's reactions beside a listener, which comes and goes."""
    listen(system, folder)
    try:
        return robot.reactions()
    finally:
        for name in ("pages", LISTENER):
            with contextlib.suppress(KeyError):  # it was not started
                system.end(name)


def measure_round(
    system: RosSystem, folder: Path, names: Sequence[str]
) -> Iterator[Tuple[str, List[float]]]:
    """Yields the reactions of one planning node beside each listener."""
    system.rosrun("rosoclingo", "run-1.0.py", "-f", str(PLANNER), name=NODE)
    robot = Robot(NODE)
    robot.wait()
    try:
        for name in names:
            yield name, react(system, folder, robot, LISTENERS[name])
    finally:
        robot.close()
        system.end(NODE)


def main() -> int:
    """Measures, and returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS, metavar="N", help="of each listener")
    rounds = parser.parse_args().rounds

    def run(system: RosSystem, folder: Path, report: Report) -> None:
        times: Dict[str, List[float]] = {name: [] for name in LISTENERS}
        names = list(LISTENERS)
        for number in range(rounds):
            first = number % len(names)  # each is first, and last, as often as the others
            for name, found in measure_round(system, folder, names[first:] + names[:first]):
                times[name] += found
        alone = Samples("ms", tuple(times["nobody"]))
        for name, values in times.items():
            samples = Samples("ms", tuple(values))
            ratio = samples.median / alone.median
            limit = LIMIT if str(PAGES) in name else None
            what = f"an answer to the next action: {name}"
            report.add(Row(what, None, samples, "to nobody", ratio, "x", limit))

    return measure("listeners", run)


if __name__ == "__main__":
    sys.exit(main())
