"""The ROS node that plans and executes with two solvers, which are nodes of their own."""

from __future__ import annotations

from functools import partial
from typing import Any, Callable, Dict, NoReturn, Optional

import rospy

from rosclingo.ros import parameters
from rosclingo.ros.client import Client
from rosclingo.ros.init import init_node
from rosclingo.solver.about import about
from rosoclingo.encodings.about import LOOP_NODE, Launched
from rosoclingo.loop.mode.controller import Controller
from rosoclingo.loop.mode.retrying import RetryingSolver
from rosoclingo.ros.encodings import Encodings
from rosoclingo.ros.loop_node import LoopNode
from rosoclingo.ros.running import open_inbox, run
from rosoclingo.ros.storing import open_durability

_USAGE = """\
usage: run.py [_controller:=NAME] [_planner:=NAME] [_action_timeout:=SECONDS]
              [_abort_unreachable:=true] [_patience:=SECONDS]
              [_one_by_one_seconds:=SECONDS] [_why_seconds:=SECONDS]
              [_why_nice:=NUMBER] [_explain:=false] [_store:=FOLDER] [_resume:=fresh]
              [_solver_timeout:=SECONDS] [_ask_before:=PATTERNS]
              [_ask_again:=SECONDS]
              [_diagnostics_period:=SECONDS] [_slow_seconds:=SECONDS] [ROS remappings]

Plans and executes with two solver nodes of package rosclingo, by default controller and planner."""
_SOLVERS = ("controller", "planner")


def main(commands: Callable[..., Any]) -> NoReturn:
    """Runs the node until it is shut down, and ends the process.

    Args:
        commands: Class with a method for each command, such as ``ROSCommands``.

    The exit status is that of :func:`rosoclingo.ros.running.run`. Arguments of the command line are
    ignored, because the manual passes one.
    """
    init_node("rosoclingo", usage=_USAGE)
    run(lambda: _make(commands))


def _make(commands: Callable[..., Any]) -> LoopNode:
    def launched() -> Dict[str, Launched]:
        nodes = encodings.launched()
        return {role: nodes[name] for role, name in solvers.items()}

    def wait(seconds: Optional[float] = None) -> None:
        for client in (controller, planner):
            client.wait(seconds)

    durability = open_durability(launched, wait)
    inbox = open_inbox()  # closed before the clients are, so that the loop knows why
    controller, planner = (
        Client(parameters.text(name, name), only_own_restarts=True) for name in _SOLVERS
    )

    solvers = {"controller": controller.name, "planner": planner.name}
    describe = partial(about, LOOP_NODE, [], solvers=solvers)
    decides, plans = (
        RetryingSolver(each, each.name, rospy.logwarn) for each in (controller, planner)
    )
    decider = Controller(decides, is_remote=True)
    encodings = Encodings(planner.name, controller.name)
    encodings.listen()
    return LoopNode(
        decider,
        plans,
        commands,
        inbox,
        ready=wait,
        describe=describe,
        encodings=encodings,
        durability=durability,
    )
