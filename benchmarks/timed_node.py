#!/usr/bin/env python3
"""A node whose planner writes down when it grounded and solved, in seconds of the monotonic clock.

usage: timed_node.py LOG [PLANNER OPTION]...
       timed_node.py LOG [PLANNER OPTION]... + [CONTROLLER OPTION]...

Without a controller it is the node of ``rosrun rosclingo run.py``; with one it is controller,
planner and rosoclingo in one process. The monotonic clock is the same in all processes, so who
reads the log can tell when the planner was at work. The log is written when the node ends.
"""

from __future__ import annotations

import atexit
import json
import sys
import time
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple
from unittest import mock

import rospy

from rosclingo.ros import node as solver_node
from rosclingo.ros.init import init_node
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosclingo.wire.commands import Answer, Assumed, Command, Ground, Improvement, Outcome
from rosoclingo.commands import ROSCommands
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.mode.controller import Controller
from rosoclingo.ros.loop_node import LoopNode

_busy: List[Tuple[float, float]] = []


class TimedEngine(Engine):
    """An engine that writes down when it grounds and solves."""

    def apply(self, command: Command) -> Optional[Answer]:
        """Runs a command."""
        begin = time.monotonic()
        try:
            return super().apply(command)
        finally:
            if isinstance(command, Ground):
                _busy.append((begin, time.monotonic()))

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches for answer sets."""
        begin = time.monotonic()
        try:
            return super().solve(assumptions, stopped, improved)
        finally:
            _busy.append((begin, time.monotonic()))


def main() -> None:
    """Runs the node until it is shut down."""
    program, log, *options = rospy.myargv(sys.argv)
    atexit.register(lambda: Path(log).write_text(json.dumps(_busy)))
    if "+" not in options:
        with mock.patch.object(solver_node, "Engine", TimedEngine):
            solver_node.main([program, *options])
    plus = options.index("+")
    planner = TimedEngine(parse_options(options[:plus]))
    controller = Engine(parse_options(options[plus + 1 :]))
    init_node("rosoclingo")
    node = LoopNode(Controller(controller), planner, ROSCommands, Inbox())
    node.start()
    node.spin()
    if node.failure is not None:
        sys.exit(node.failure)


if __name__ == "__main__":
    main()
