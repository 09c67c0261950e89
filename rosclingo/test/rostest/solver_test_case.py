"""What the rostests of a solver node share."""

from __future__ import annotations

import threading
import unittest
from typing import Any, Tuple

import rospy
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from waiting import TIMEOUT

from rosclingo.msg import ROSClingoAction, ROSClingoGoal, ROSClingoResult
from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.srv import ROSClingoControl
from rosclingo.wire.commands import Reply
from rosclingo.wire.xml_codec import decode_reply

# 12 pigeons in 11 holes: clingo searches for minutes.
PIGEONS = "1 { at(P,H) : H=1..11 } 1 :- P=1..12. :- at(P,H), at(Q,H), P&lt;Q."


class Goal:
    """A goal on its way, with everything that came back."""

    def __init__(self, client: LowLatencyActionClient, assumptions: str) -> None:
        self._known = threading.Event()
        self._active = threading.Event()
        self._done = threading.Event()
        self._handle = client.send_goal(ROSClingoGoal(assumptions), self._on_transition)

    def _on_transition(self, handle: ClientGoalHandle) -> None:
        self._known.set()
        state = handle.get_comm_state()
        if state not in (CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING):
            self._active.set()
        if state == CommState.DONE:
            self._done.set()

    @property
    def id(self) -> str:
        return str(self._handle.comm_state_machine.action_goal.goal_id.id)

    @property
    def has_ended(self) -> bool:
        return self._done.is_set()

    def wait_until_active(self) -> None:
        if not self._active.wait(TIMEOUT):
            raise AssertionError("the goal was not accepted")

    def cancel(self) -> None:
        # actionlib's client takes a goal for lost that it cancels before the server has it.
        if not self._known.wait(TIMEOUT):
            raise AssertionError("the goal did not arrive")
        self._handle.cancel()

    def result(self) -> Tuple[str, ROSClingoResult, str]:
        """Waits for the end; returns the terminal status, the result and the status text."""
        if not self._done.wait(TIMEOUT):
            raise AssertionError("the goal did not end")
        status = GoalStatus.to_string(self._handle.get_terminal_state())
        return status, self._handle.get_result(), self._handle.get_goal_status_text()


class SolverTestCase(unittest.TestCase):
    """Talks to a solver node in plain XML, as any client might."""

    solver = "solver"
    control_service: Any
    client: LowLatencyActionClient

    @classmethod
    def setUpClass(cls) -> None:
        cls.control_service, cls.client = cls.connect(cls.solver)

    @staticmethod
    def connect(name: str) -> Tuple[Any, LowLatencyActionClient]:
        rospy.wait_for_service(f"{name}/control", TIMEOUT)
        client = LowLatencyActionClient(name, ROSClingoAction)
        if not client.wait_for_server(rospy.Duration.from_sec(TIMEOUT)):
            raise AssertionError(f"there is no action {name}")
        return rospy.ServiceProxy(f"{name}/control", ROSClingoControl, persistent=True), client

    def control(self, commands: str) -> Reply:
        return decode_reply(self.control_service(f"<commands>{commands}</commands>").result)

    def succeed(self, commands: str) -> Reply:
        reply = self.control(commands)
        self.assertIsNone(reply.failure)
        return reply

    def goal(self, assumptions: str = "") -> Goal:
        return Goal(self.client, assumptions)

    def search_for_minutes(self) -> Goal:
        self.succeed(
            f'<restart/><add name="pigeons"><program>{PIGEONS}</program></add>'
            '<ground><program name="pigeons"/></ground>'
        )
        goal = self.goal()
        goal.wait_until_active()
        return goal

    def assert_solves(self) -> None:
        """The node takes a program of its own and answers correctly, whatever came before."""
        self.succeed(
            '<restart/><add name="check"><program>{a; b} = 1. #external e. :- e, a. #show a/0. '
            '#show b/0.</program></add><ground><program name="check"/></ground>'
            '<assign_external name="e" value="true"/>'
        )
        status, result, _ = self.goal().result()
        self.assertEqual((status, result.result, result.interrupted), ("SUCCEEDED", "sat", False))
        self.assertEqual(result.answerset, ["b"])
        status, result, _ = self.goal(
            '<assumptions><assumption name="a" value="true"/></assumptions>'
        ).result()
        self.assertEqual((status, result.result), ("SUCCEEDED", "unsat"))
