"""The ROS node of the one-node system: solver and planning loop in one process."""

from __future__ import annotations

import faulthandler
import sys
import time
from functools import partial
from typing import Any, NoReturn, Type

import rospy

from rosclingo.errors import RosclingoError
from rosclingo.ros import parameters
from rosclingo.ros.init import end_wrong, init_node, log_clingo
from rosclingo.ros.master_watch import is_respawned
from rosclingo.ros.memory_watch import watch_memory
from rosclingo.solver.about import about
from rosclingo.solver.activity import solver_health
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import parse_options
from rosoclingo.encodings.about import SINGLE_NODE
from rosoclingo.loop.single.algorithm1 import Algorithm1, commands_for, last_step
from rosoclingo.loop.single.dialects import detect, says_status
from rosoclingo.ros.encodings import Encodings
from rosoclingo.ros.loop_node import LoopNode
from rosoclingo.ros.running import open_inbox, run
from rosoclingo.ros.storing import open_durability

_USAGE = """\
usage: run-1.0.py --file FILE... [--theory dl] [clingo options]
                  [_action_timeout:=SECONDS] [_abort_unreachable:=true] [_patience:=SECONDS]
                  [_one_by_one_seconds:=SECONDS] [_threads:=NUMBER]
                  [_why_seconds:=SECONDS] [_why_nice:=NUMBER] [_explain:=false]
                  [_store:=FOLDER] [_resume:=fresh] [_ask_before:=PATTERNS]
                  [_ask_again:=SECONDS]
                  [_diagnostics_period:=SECONDS] [_slow_seconds:=SECONDS] [ROS remappings]

Plans and executes in one process, as the paper has it; a controller and a planner are not needed.

  -f FILE, --file FILE  load the encoding FILE, or FILE.lp if FILE is not a file; repeatable
  --theory dl           take difference constraints, as of clingo-dl, if that package is installed
  -c steps=N            end when there is no plan within N steps; without it, there is no such limit
  -h, --help            print this text

All else is handed to clingo, for instance:
  -c NAME=TERM          replace the value of a #const
  -t N                  search with N threads
"""


def main(commands: Type[Any]) -> NoReturn:
    """Runs the node until it is shut down, and ends the process.

    Args:
        commands: Class with a method for each command, such as ``ROSCommands``.

    The exit status is 0, 1 when the loop had to end, or 2 when the command line, a file or a
    parameter is wrong.
    """
    faulthandler.enable()  # says where a division of clingo's has ended the process
    arguments = rospy.myargv(sys.argv)[1:]
    try:
        options = parse_options(arguments)
        if options.help:
            print(_USAGE, end="")
            sys.exit(0)
        dialect = detect(options)
        has_status = says_status(options)
        last = last_step(options.clingo)
        engine = Engine(options, log=log_clingo)
    except RosclingoError as err:
        print(f"rosoclingo: {err}", file=sys.stderr)
        end_wrong()
    init_node("rosoclingo")
    rospy.loginfo(
        "%s plans with %s, in the dialect %s; clingo options: %s",
        rospy.get_name(),
        ", ".join(options.files),
        dialect.name,
        " ".join(options.clingo) or "none",
    )
    describe = partial(about, SINGLE_NODE, arguments, engine.program)
    name = rospy.get_name()
    encodings = Encodings(name, dialect=dialect.name)
    encodings.tell(name, describe())

    def make() -> LoopNode:
        engine.use_threads(parameters.threads())
        watch_memory(engine.activity)
        durability = open_durability(lambda: {"rosoclingo": encodings.launched()[name]})
        return LoopNode(
            Algorithm1(dialect.first_step, last),
            dialect(engine),
            commands_for(dialect, commands, has_status),
            open_inbox(),
            describe=describe,
            encodings=encodings,
            durability=durability,
            is_replaced=is_respawned(),
            solver_report=lambda slow: solver_health(
                engine.activity, time.monotonic(), slow_seconds=slow
            ),
        )

    run(make)
