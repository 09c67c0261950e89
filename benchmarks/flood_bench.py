#!/usr/bin/env python3
"""Load test: how soon a goal's first action comes under a flood of inputs, and if each goal ends.

usage: flood_bench.py [--each] [--seconds N] [--only-goals] [--goals N...]

Five kinds of inputs come in turn: the same message, different known ones, unknown ones, goals that
are cancelled at once, and answers that were given before. After a minute of 1,000 a second, more
and more come until something breaks. With --each, each kind comes alone, too.

Then 10,000 goals come at once to a planning node with a store: how many are acknowledged in a
second, and how much longer a cancel request, an operator and a robot's answer take than before.
--goals says how many, one burst after the other; with --only-goals the rest is left out.

Run by scripts/bench. Exit status 1 says that a limit is missed.
"""

from __future__ import annotations

import argparse
import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, List, Optional, Sequence

from actionlib_msgs.msg import GoalStatus

import probe
from harness import HarnessError, Measurements, Row, Samples, measure
from rosoclingo.msg import ROSoClingoGoal, ROSoClingoOut
from rosoclingo_bench import Actuator

FOLDER = Path(__file__).resolve().parent
ENCODING = FOLDER / "encodings" / "flood.lp"  # takes a second to plan
MODE = FOLDER.parent / "rosoclingo" / "modes" / "dynamic.incremental.dyn_reset.lp"
KINDS = ("equal", "different", "unknown", "goals", "answers")
SYSTEMS = ("three nodes", "one node")

RATE = 1000  # inputs in a second
LIMIT = 3.0  # times the time without a flood
QUIET_GOALS = 8
BEFORE_SECONDS = 2.0  # how long the flood goes on before the first goal
SECONDS = 60.0  # how long it lasts
SHORT_SECONDS = 15.0  # how long one of another rate or kind lasts
FASTEST = 16_000
WORK_SECONDS = 0.02  # how long an action takes
LINE = FOLDER.parent / "rosoclingo" / "example" / "line.lp"
GOALS = 10_000  # at once
MOST_MILLISECONDS = 1.0  # for each to be acknowledged
SILENT_SECONDS = 20.0
LONGEST_SECONDS = 60.0  # a goal that takes longer does not end


class FloodClient(Actuator):
    """A robot whose actions take a moment, and the client that gives it goals."""

    def first_action(self) -> float:
        """Executes a goal, and returns the seconds until its first action.

        Raises:
            HarnessError: The goal did not succeed.
        """
        first: Optional[float] = None
        begin = time.monotonic()
        goal = ROSoClingoGoal("work", [])
        handle = self._client.send_goal(goal, self._on_transition, None)
        while True:
            try:
                is_action, now = self._events.get(timeout=LONGEST_SECONDS)
            except queue.Empty:
                raise HarnessError("a goal did not end") from None
            if not is_action:
                break
            first = first or now - begin
        if handle.get_terminal_state() != GoalStatus.SUCCEEDED or first is None:
            raise HarnessError(f"a goal did not succeed: {handle.get_goal_status_text()}")
        return first

    def _on_action(self, action: ROSoClingoOut) -> None:
        super()._on_action(action)
        threading.Timer(WORK_SECONDS, self._in.publish, ("robot", "success")).start()


class Bench(Measurements):
    """The measurements."""

    def run(self, each: bool, seconds: float) -> None:
        """Measures everything.

        Args:
            each: Whether each kind comes alone, too.
            seconds: How long the flood lasts.
        """
        for name in SYSTEMS:
            quiet = self._measure(name, 0, (), 0.0)
            self._add(f"{name}, no flood", quiet, quiet, None)
            flooded = self._measure(name, RATE, KINDS, seconds)
            self._add(f"{name}, {RATE} a second", quiet, flooded, LIMIT)
            for kind in KINDS if each else ():
                flooded = self._measure(name, RATE, (kind,), SHORT_SECONDS)
                self._add(f"{name}, {RATE} a second, {kind}", quiet, flooded, None)
            self._go_on(name, quiet)

    def goals(self, counts: Sequence[int]) -> None:
        """Measures bursts of goals, with a store."""
        for count in counts:
            self._burst(count)

    def _burst(self, count: int) -> None:
        """Measures how soon many goals are acknowledged, and what they hold up."""
        store = self.folder / f"{count}.store"
        mode = ("-f", str(MODE), "-c", "steps=50")
        self.system.rosrun("rosclingo", "run.py", "-f", str(LINE), name="planner")
        self.system.rosrun("rosclingo", "run.py", *mode, name="controller")
        self.system.rosrun("rosoclingo", "run.py", f"_store:={store}", name="stored")
        name = f"{count} goals, with a store"
        robot = probe.Probe("stored")
        over = threading.Event()
        over.set()
        silent = robot.run(SILENT_SECONDS, over)
        over.clear()
        burst = subprocess.Popen(
            [sys.executable, str(FOLDER / "burst.py"), "stored", str(count)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        said: List[str] = []
        assert burst.stdout is not None
        burst.stdout.readline()

        def watch() -> None:
            said.append(burst.communicate("go\n")[0])
            over.set()

        threading.Thread(target=watch, daemon=True).start()
        phases = {"come": robot.run(0.0, over), "wait": robot.run(SILENT_SECONDS, over)}
        if burst.returncode or not said[0].strip():
            raise HarnessError(f"{name}: not all are acknowledged")
        each = Samples("ms", (float(said[0]) * 1e3 / count,))
        self.report.add(
            Row(f"{name}, acknowledged", None, each, "each", each.median, "ms", MOST_MILLISECONDS)
        )
        for kind in probe.KINDS:
            self.report.add(Row(f"{kind}, no flood", None, silent[kind]))
            for phase, times in phases.items():
                ratio = times[kind].median / silent[kind].median
                what = f"{kind}, {name}, that {phase}"
                self.report.add(Row(what, None, times[kind], "with / without", ratio, "x", LIMIT))
        robot.close()
        for node in ("stored", "controller", "planner"):
            self.system.end(node)

    def _go_on(self, name: str, quiet: Samples) -> None:
        """Doubles the rate until a goal does not end, or the ratio is missed."""
        rate = 2 * RATE
        while rate <= FASTEST:
            try:
                flooded = self._measure(name, rate, KINDS, SHORT_SECONDS)
            except HarnessError as err:
                print(f"{name}, {rate} a second: {err}", flush=True)
                return
            self._add(f"{name}, {rate} a second", quiet, flooded, None)
            if flooded.median / quiet.median > LIMIT:
                return
            rate *= 2

    def _add(self, name: str, quiet: Samples, flooded: Samples, limit: Optional[float]) -> None:
        ratio = flooded.median / quiet.median
        row = Row(f"first action, {name}", None, flooded, "with / without", ratio, "x", limit)
        self.report.add(row)

    def _measure(self, name: str, rate: float, kinds: Sequence[str], seconds: float) -> Samples:
        """Executes goals in a fresh system, and returns the milliseconds to each first action."""
        nodes = self._start(name)
        client = FloodClient(nodes[-1])
        client.wait()
        flood = self._flood(nodes[-1], rate, kinds) if rate else None
        times: List[float] = []
        begin = time.monotonic()
        try:
            while time.monotonic() < begin + seconds or len(times) < QUIET_GOALS * (not rate):
                times.append(client.first_action() * 1e3)
            if flood is not None:
                self._check(flood, rate, seconds + BEFORE_SECONDS)
        finally:
            if flood is not None:
                flood.kill()
            client.close()
            for node in reversed(nodes):
                self.system.end(node)
        return Samples("ms", tuple(times))

    def _start(self, name: str) -> List[str]:
        """Starts the nodes of a system, and returns their names, the planning node's last."""
        if name == "one node":
            self.system.rosrun("rosoclingo", "run-1.0.py", "-f", str(ENCODING), name="one")
            return ["one"]
        self.system.rosrun("rosclingo", "run.py", "-f", str(ENCODING), name="planner")
        mode = ("-f", str(MODE), "-c", "steps=50")
        self.system.rosrun("rosclingo", "run.py", *mode, name="controller")
        self.system.rosrun("rosoclingo", "run.py", name="three")
        return ["planner", "controller", "three"]

    def _flood(self, node: str, rate: float, kinds: Sequence[str]) -> subprocess.Popen[str]:
        flood = subprocess.Popen(
            [sys.executable, str(FOLDER / "flooder.py"), node, str(rate), *kinds],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert flood.stdout is not None
        flood.stdout.readline()
        time.sleep(BEFORE_SECONDS)
        return flood

    def _check(self, flood: subprocess.Popen[str], rate: float, seconds: float) -> None:
        """Ends a flood, and sees that it was one, and that each of its goals ends.

        Raises:
            HarnessError: One does not end, or less was sent than it should.
        """
        text, _ = flood.communicate(timeout=2 * LONGEST_SECONDS + seconds)
        sent, goals, ended = map(int, text.split())
        print(f"{sent} inputs were sent, with {goals} goals, of which {ended} have ended")
        if ended < goals:
            raise HarnessError(f"{goals - ended} of {goals} goals of the flood do not end")
        if sent < 0.95 * rate * seconds:
            raise HarnessError(f"only {sent / seconds:.0f} inputs were sent in a second")


def main() -> int:
    """Measures, prints the table, and returns the exit status: 1 says that a limit is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", action="store_true", help="have each kind come alone, too")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="how long the flood lasts")
    parser.add_argument("--only-goals", action="store_true", help="measure bursts of goals only")
    parser.add_argument("--goals", type=int, nargs="+", default=[GOALS], help="sizes of bursts")
    arguments = parser.parse_args()

    def run(*parts: Any) -> None:
        bench = Bench(*parts)
        if not arguments.only_goals:
            bench.run(arguments.each, arguments.seconds)
        bench.goals(arguments.goals)

    return measure("flood", run)


if __name__ == "__main__":
    sys.exit(main())
