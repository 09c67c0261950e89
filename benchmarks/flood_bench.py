#!/usr/bin/env python3
"""Load test: how soon a goal's first action comes under a flood of inputs, and if each goal ends.

usage: flood_bench.py [--each] [--seconds N]

Five kinds of inputs come in turn: the same message, different known ones, unknown ones, goals that
are cancelled at once, and answers that were given before. After a minute of 1,000 a second, more
and more come until something breaks. With --each, each kind comes alone, too.

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
from typing import List, Optional, Sequence

from actionlib_msgs.msg import GoalStatus

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
    arguments = parser.parse_args()
    each, seconds = arguments.each, arguments.seconds
    return measure("flood", lambda *parts: Bench(*parts).run(each, seconds))


if __name__ == "__main__":
    sys.exit(main())
