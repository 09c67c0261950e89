"""Goals: answers, cancel, preemption, abortion, optimisation, and several nodes side by side."""

from __future__ import annotations

import queue
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import List

import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from waiting import TIMEOUT, wait_for

from rosclingo.msg import (
    ROSClingoActionFeedback,
    ROSClingoActionGoal,
    ROSClingoActionResult,
    ROSClingoFeedback,
)
from rosclingo.ros.client import Client
from rosclingo.wire.commands import Outcome, Reply, Result
from rosclingo.wire.xml_codec import decode_reply
from solver_test_case import Goal, SolverTestCase

_OPTIMISE = (
    '<commands><restart/><add name="p"><program>1 { a(1..12) } 5. #minimize { X,X : a(X) }. '
    '#maximize { 1@2,X : a(X) }. #show a/1.</program></add><ground><program name="p"/></ground>'
    "</commands>"
)


class TestSolve(SolverTestCase):
    def test_answers(self) -> None:
        self.assert_solves()

    def test_unknown_atoms_are_false(self) -> None:
        self.succeed('<restart/><ground><program name="base"/></ground>')
        for value, answer in (("true", "unsat"), ("false", "sat")):
            _, result, _ = self.goal(
                f'<assumptions><assumption name="unknown" value="{value}"/></assumptions>'
            ).result()
            self.assertEqual(result.result, answer)

    def test_only_shown_symbols(self) -> None:
        self.succeed(
            '<restart/><add name="p"><program>a(1). b("x y"). #show a/1. #show (s,X) : b(X).'
            '</program></add><ground><program name="p"/></ground>'
        )
        _, result, _ = self.goal().result()
        self.assertEqual(sorted(result.answerset), ['(s,"x y")', "a(1)"])

    def test_cancel(self) -> None:
        for _ in range(20):
            goal = self.search_for_minutes()
            goal.cancel()
            status, result, text = goal.result()
            self.assertEqual(status, "PREEMPTED")
            self.assertEqual((result.result, result.interrupted), ("unknown", True))
            self.assertIn("canceled", text)
        for _ in range(200):
            self.assert_solves()

    def test_a_burst_of_goals(self) -> None:
        """None is lost."""
        # What is large makes the connection slower than this loop.
        goals = [self.goal("no XML" + 1_000_000 * ".") for _ in range(60)]
        for goal in goals:
            self.assertEqual(goal.result()[0], "REJECTED")

    def test_a_control_request_aborts(self) -> None:
        goal = self.search_for_minutes()
        self.assert_solves()
        status, result, text = goal.result()
        self.assertEqual(status, "ABORTED")
        self.assertEqual((result.result, result.interrupted), ("unknown", True))
        self.assertIn("control", text)

    def test_a_search_of_the_client_that_somebody_else_ends(self) -> None:
        client = Client("solver")
        client.wait(TIMEOUT)
        self.search_for_minutes().cancel()
        outcomes: queue.Queue[Outcome] = queue.Queue()
        threading.Thread(target=lambda: outcomes.put(client.solve())).start()

        def has_ended() -> bool:  # nobody says when the search begins
            self.succeed("<get_externals/>")
            return not outcomes.empty()

        wait_for(has_ended)
        self.assertEqual(outcomes.get(), Outcome(Result.UNKNOWN, True))

    def test_a_new_goal_preempts(self) -> None:
        old = self.search_for_minutes()
        new = self.goal()
        status, result, text = old.result()
        self.assertEqual(
            (status, result.result, result.interrupted), ("PREEMPTED", "unknown", True)
        )
        self.assertEqual(text, f"ended by a newer goal of {rospy.get_name()}")
        new.wait_until_active()
        new.cancel()
        self.assertEqual(new.result()[0], "PREEMPTED")
        self.assert_solves()

    def test_a_cancel_request_that_comes_before_its_goal(self) -> None:
        goals = rospy.Publisher("solver/goal", ROSClingoActionGoal, queue_size=1)
        cancels = rospy.Publisher("solver/cancel", GoalID, queue_size=1)
        results: queue.Queue[ROSClingoActionResult] = queue.Queue()
        listener = rospy.Subscriber("solver/result", ROSClingoActionResult, results.put)
        wait_for(lambda: goals.get_num_connections() and cancels.get_num_connections())
        cancels.publish(GoalID(id="early"))
        # The server keeps the request for later, and shows that it has it.
        self._wait_for_status("early")
        goals.publish(ROSClingoActionGoal(goal_id=GoalID(id="early")))
        result = results.get(timeout=TIMEOUT)
        self.assertEqual(result.status.goal_id.id, "early")
        self.assertEqual(result.status.status, GoalStatus.RECALLED)
        self.assertEqual((result.result.result, result.result.interrupted), ("unknown", True))
        listener.unregister()

    def test_a_goal_that_ends_before_its_client_listens(self) -> None:
        control, _ = self.connect("optimiser")
        self.assertIsNone(decode_reply(control(_OPTIMISE).result).failure)
        script = Path(__file__).resolve().with_name("late_client.py")
        for server, topic in (("solver", "result"), ("optimiser", "feedback")):
            client = subprocess.run(
                [sys.executable, str(script), server, topic],
                check=True,
                stdout=subprocess.PIPE,
                text=True,
                timeout=3 * TIMEOUT,
            )
            heard = client.stdout.split()
            if topic == "feedback":  # for each better model
                heard = list(dict.fromkeys(heard))
            self.assertEqual(heard, [f"before_{topic}", f"after_{topic}"])

    def _statuses(self) -> List[str]:
        """Returns the ids of the goals in the status list."""
        message = rospy.wait_for_message("solver/status", GoalStatusArray, TIMEOUT)
        return [status.goal_id.id for status in message.status_list]

    def _wait_for_status(self, identifier: str) -> List[str]:
        """Waits until a goal is in the status list, and returns the ids in it."""
        end = time.monotonic() + TIMEOUT
        while True:
            identifiers = self._statuses()
            if identifier in identifiers:
                return identifiers
            self.assertLess(time.monotonic(), end, identifiers)

    def test_many_rejected_goals_during_a_search(self) -> None:
        """The status list is short, but the goal that is open stays in it."""
        goal = self.search_for_minutes()
        rejected = [self.goal("<assumptions").result()[0] for _ in range(60)]
        self.assertEqual(set(rejected), {"REJECTED"})
        goal.cancel()
        status, result, _ = goal.result()
        self.assertEqual(
            (status, result.result, result.interrupted), ("PREEMPTED", "unknown", True)
        )

    def test_a_goal_that_waits_for_the_grounding(self) -> None:
        """It is recalled although clingo cannot be interrupted."""
        first = self.search_for_minutes()
        replies: queue.Queue[Reply] = queue.Queue()
        slow = "n(1..300). p :- n(X), n(Y), n(Z), X*Y*Z &lt; 0."  # takes seconds to ground
        request = (
            f'<commands><add name="slow"><program>{slow}</program></add>'
            '<ground><program name="slow"/></ground></commands>'
        )
        service, _ = self.connect(self.solver)
        grounding = threading.Thread(
            target=lambda: replies.put(decode_reply(service(request).result))
        )
        grounding.start()
        self.assertEqual(first.result()[0], "ABORTED")  # so the request is being carried out
        replaced, canceled = self.goal(), self.goal()
        canceled.cancel()
        for goal in (replaced, canceled):
            status, result, _ = goal.result()
            self.assertEqual((status, result.result), ("RECALLED", "unknown"))
        self.assertTrue(replies.empty(), "the grounding was over too soon to show anything")
        self.assertIsNone(replies.get(timeout=TIMEOUT).failure)
        self.assert_solves()

    def test_many_goals_and_control_requests_at_once(self) -> None:
        """Every goal ends, whatever the others do."""
        self.search_for_minutes().cancel()
        goals: List[Goal] = []

        def send() -> None:
            for _ in range(20):
                goals.append(self.goal())

        def change() -> None:
            for _ in range(20):
                self.succeed("<get_externals/>")

        threads = [threading.Thread(target=work) for work in (send, send, change)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        # A goal may come after a control request that was sent later: they take two connections.
        wait_for(lambda: self.control("<get_externals/>") and all(goal.has_ended for goal in goals))
        ends = {goal.result()[0] for goal in goals}
        self.assertEqual(len(goals), 40)
        self.assertLessEqual(ends, {"PREEMPTED", "RECALLED", "ABORTED"})
        self.assert_solves()

    def test_optimum_and_feedback(self) -> None:
        control, client = self.connect("optimiser")
        control(_OPTIMISE)
        # Not by the goal: actionlib drops what comes after the result, by another connection.
        feedback: List[ROSClingoFeedback] = []
        listener = rospy.Subscriber(
            "optimiser/feedback",
            ROSClingoActionFeedback,
            lambda message: feedback.append(message.feedback),
        )
        wait_for(listener.get_num_connections)
        status, result, _ = Goal(client, "").result()
        self.assertEqual((status, result.result), ("SUCCEEDED", "sat"))
        self.assertEqual(sorted(result.answerset), [f"a({i})" for i in range(1, 6)])
        wait_for(lambda: feedback and list(feedback[-1].cost) == [-5, 15])
        costs = [list(message.cost) for message in feedback]
        self.assertEqual(costs, sorted(costs, reverse=True))
        self.assertEqual(len({tuple(cost) for cost in costs}), len(costs))
        self.assertEqual(sorted(feedback[-1].answerset), sorted(result.answerset))
        numbers = [message.number for message in feedback]
        self.assertEqual(numbers, sorted(set(numbers)))
        listener.unregister()

    def test_nodes_side_by_side(self) -> None:
        for name in ("/robot1/controller", "/robot2/controller"):
            control, client = self.connect(name)
            control(
                f'<commands><restart/><add name="p"><program>name("{name}").</program></add>'
                '<ground><program name="p"/></ground></commands>'
            )
        for name in ("/robot1/controller", "/robot2/controller"):
            _, client = self.connect(name)
            _, result, _ = Goal(client, "").result()
            self.assertEqual(result.answerset, [f'name("{name}")'])


if __name__ == "__main__":
    rospy.init_node("test_solve")
    rostest.rosrun("rosclingo", "test_solve", TestSolve, sys.argv)
