"""The client, against a server that the test plays."""

from __future__ import annotations

import os
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, Callable, Dict, List

import rospy
import rostest
from actionlib import CommState, ServerGoalHandle
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from waiting import wait_for

from rosclingo.ros.action_client import LowLatencyActionClient
from rosclingo.ros.action_server import LowLatencyActionServer
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoActionResult,
    ROSoClingoFeedback,
    ROSoClingoGoal,
    ROSoClingoResult,
)
from rosoclingo_examples.orders import Bring, Orders
from rosoclingo_examples.ros.client import RequestClient
from rosoclingo_interfaces.errors import LineError


class TestClient(unittest.TestCase):
    server: LowLatencyActionServer
    takes_back = False  # whether the next cancel request is not acknowledged

    @classmethod
    def setUpClass(cls) -> None:
        cls.goals: Dict[str, ServerGoalHandle] = {}
        cls.arrived: List[str] = []
        cls.canceled: List[str] = []
        cls.server = LowLatencyActionServer(
            "rosoclingo",
            ROSoClingoAction,
            cls._on_goal,
            cls._on_cancel,
            ROSoClingoResult(),
            results_kept=10,
        )
        cls.server.start()
        cls.said: List[str] = []
        cls.orders = Orders()
        cls.client = RequestClient(cls.orders, cls._say)
        cls.wait_for(cls.client.there)

    @classmethod
    def _on_goal(cls, handle: ServerGoalHandle) -> None:
        cls.goals[handle.get_goal().request] = handle
        cls.arrived.append(handle.get_goal().request)

    @classmethod
    def _on_cancel(cls, handle: ServerGoalHandle) -> None:
        cls.canceled.append(handle.get_goal().request)
        if cls.takes_back:
            cls.takes_back = False
            cls.server.take_back_cancel(handle)

    @classmethod
    def _say(cls, line: str) -> None:
        cls.said.append(line)

    @classmethod
    def wait_for(cls, condition: Callable[[], Any]) -> None:
        wait_for(condition, lambda: cls.said)

    def send(self, request: str, *information: str) -> ServerGoalHandle:
        self.client.send(Bring(request, information))
        self.wait_for(lambda: request in self.goals)
        return self.goals[request]

    def last(self, request: str) -> str:
        """Returns the last line about a request."""
        return [line for line in self.said if request in line][-1]

    def test_each_change_is_one_line(self) -> None:
        handle = self.send("bring(1,2)", "box")
        self.assertEqual(list(handle.get_goal().information), ["box"])
        handle.set_accepted()
        for line in ("accepted", "accepted", "plan 3 steps", "step 1 of 3"):
            handle.publish_feedback(ROSoClingoFeedback(line))
        self.wait_for(lambda: "step 1 of 3" in self.last("bring(1,2)"))
        handle.set_succeeded(ROSoClingoResult("succeeded"), "the planner's status in step 3")
        self.wait_for(lambda: self.last("bring(1,2)").endswith(": succeeded"))
        lines = [line.split(": ")[1] for line in self.said if "bring(1,2) box" in line]
        self.assertEqual(lines, ["sent", "accepted", "plan 3 steps", "step 1 of 3", "succeeded"])

    def test_ends(self) -> None:
        ends = {
            "bring(1,4)": (ServerGoalHandle.set_rejected, "rejected: no such office"),
            "bring(2,4)": (ServerGoalHandle.set_aborted, "aborted: no such office"),
            "bring(3,4)": (ServerGoalHandle.set_canceled, "canceled: no such office"),
        }
        for request, (end, text) in ends.items():
            handle = self.send(request)
            if "aborted" in text:
                handle.set_accepted()
            end(handle, ROSoClingoResult(), "no such office")
            self.wait_for(
                lambda r=request, t=text: any(r in s and s.endswith(t) for s in self.said)
            )
        self.assertFalse(self.orders.all_as_asked)

    def test_a_result_that_comes_again(self) -> None:
        """As of a server that was killed: nothing is said, and no error is logged."""
        handle = self.send("bring(7,1)")
        handle.set_accepted()
        handle.set_succeeded(ROSoClingoResult("succeeded"), "")
        self.wait_for(lambda: self.last("bring(7,1)").endswith(": succeeded"))
        heard: List[Any] = []
        # It hears of each result after the client, which has opened the topic before.
        results = rospy.Subscriber("rosoclingo/result", ROSoClingoActionResult, heard.append)
        said = len(self.said)
        with self.assertLogs("rosout") as logged:
            rospy.loginfo("begins")
            self.server.publish_result_again(handle, ROSoClingoResult("succeeded"))
            self.wait_for(lambda: heard)
        self.assertEqual([record.levelname for record in logged.records], ["INFO"])
        self.assertEqual(len(self.said), said)
        results.unregister()

    def test_cancel_as_soon_as_sent(self) -> None:
        """actionlib alone would take the goal for lost."""
        for turn in range(5):
            request = f"bring(5,{turn})"
            self.client.send(Bring(request))
            number = int(self.last(request)[1:].split("]")[0])
            self.client.cancel(number)
            self.wait_for(lambda r=request: r in self.canceled)
            self.goals[request].set_canceled(ROSoClingoResult("canceled"), "why not")
            self.wait_for(
                lambda n=number: f"[{n}] " in self.said[-1] and "canceled" in self.said[-1]
            )
            self.assertEqual(self.said[-1], f"[{number}] {request}: canceled")
            with self.assertRaises(LineError):
                self.client.cancel(number)

    def test_a_cancel_request_that_is_not_acknowledged_is_sent_again(self) -> None:
        """As when it cannot be written, because the disk is full or the node about to end."""
        cls, request = type(self), "bring(5,6)"
        heard: List[int] = []
        statuses = rospy.Subscriber(
            "rosoclingo/status",
            GoalStatusArray,
            lambda message: heard.extend(goal.status for goal in message.status_list),
        )
        handle = self.send(request)
        handle.set_accepted()
        cls.takes_back = True
        self.client.cancel(int(self.last(request)[1:].split("]")[0]))
        self.wait_for(lambda: not cls.takes_back)
        heard.clear()
        self.wait_for(lambda: GoalStatus.ACTIVE in heard)
        self.wait_for(lambda: GoalStatus.PREEMPTING in heard)
        self.assertEqual(self.canceled.count(request), 2)
        statuses.unregister()
        handle.set_canceled(ROSoClingoResult("canceled"), "why not")
        self.wait_for(lambda: self.last(request).endswith(": canceled"))

    def test_another_process_goes_on(self) -> None:
        """The server does what is sent again only once, however long ago it was through with it."""
        with tempfile.TemporaryDirectory() as folder:
            orders = Orders(Path(folder) / "a.json")
            requests = ["bring(6,1)", "bring(6,2)", "bring(6,3)"]
            ids = [orders.add(Bring(request)).id for request in requests[:2]]
            action = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
            self.wait_for(lambda: action.wait_for_server(rospy.Duration.from_sec(0.01)))
            sent = [
                action.send_goal(ROSoClingoGoal(request, []), identifier=identifier)
                for request, identifier in zip(requests, ids)
            ]
            self.wait_for(lambda: set(requests[:2]) <= set(self.goals))
            self.goals[requests[0]].set_accepted()
            self.goals[requests[0]].set_succeeded(ROSoClingoResult("succeeded"), "")
            self.goals[requests[1]].set_accepted()
            self.wait_for(lambda: sent[0].get_comm_state() == CommState.DONE)
            self.wait_for(lambda: ids[0] not in map(_id, action.last_status_msg.status_list))
            orders.add(Bring(requests[2]))  # the process has died before it has sent this
            os.close(orders._guard)

            orders = Orders(Path(folder) / "a.json")
            said: List[str] = []
            client = RequestClient(orders, said.append)
            self.wait_for(client.there)
            client.go_on()
            self.wait_for(lambda: "[1] bring(6,1): succeeded" in said)
            self.wait_for(lambda: requests[2] in self.goals)
            client.cancel(2)
            self.wait_for(lambda: requests[1] in self.canceled)
            self.goals[requests[1]].set_canceled(ROSoClingoResult("canceled"), "")
            self.goals[requests[2]].set_rejected(ROSoClingoResult("rejected"), "why not")
            self.wait_for(lambda: not orders.open)
            for number, request in enumerate(requests, 1):
                self.assertIn(f"[{number}] {request}: sent again", said)
            self.assertIn("[2] bring(6,2): canceled", said)
            self.assertIn("[3] bring(6,3): rejected: why not", said)
            self.assertEqual([r for r in self.arrived if r in requests], requests)


def _id(status: GoalStatus) -> str:
    return str(status.goal_id.id)


if __name__ == "__main__":
    rospy.init_node("test_client")
    rostest.rosrun("rosoclingo_examples", "test_client", TestClient, sys.argv)
