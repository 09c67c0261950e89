"""A mode through ROS: goals, cancel requests, answers, and what may be sent by mistake."""

from __future__ import annotations

import random
import sys
import threading
import unittest
from typing import Any, Callable, List, Optional, Tuple

import rospy
import rostest
from actionlib import ClientGoalHandle, CommState
from actionlib_msgs.msg import GoalStatus
from waiting import TIMEOUT, wait_for

from rosclingo.limits import MOST_TEXT
from rosclingo.ros.action_client import LowLatencyActionClient
from rosoclingo.msg import (
    ROSoClingoAction,
    ROSoClingoAnswer,
    ROSoClingoDispatch,
    ROSoClingoEvent,
    ROSoClingoFeedback,
    ROSoClingoGoal,
    ROSoClingoIn,
    ROSoClingoOut,
    ROSoClingoToken,
)
from rosoclingo.srv import ControlActuator, GetGoalInformation

# How much comes at once: a lot for one mode, since inbox and action server are the same in all, and
# else what is more than there is room for.
GOALS, MESSAGES = (200, 10_000) if "--flood" in sys.argv else (40, 1_000)
_NEXT = {  # the statuses that may follow one, by actionlib's table
    GoalStatus.PENDING: {GoalStatus.ACTIVE, GoalStatus.REJECTED, GoalStatus.RECALLING,
                         GoalStatus.RECALLED},
    GoalStatus.RECALLING: {GoalStatus.RECALLED, GoalStatus.REJECTED, GoalStatus.PREEMPTING},
    GoalStatus.ACTIVE: {GoalStatus.PREEMPTING, GoalStatus.SUCCEEDED, GoalStatus.ABORTED,
                        GoalStatus.PREEMPTED},
    GoalStatus.PREEMPTING: {GoalStatus.PREEMPTED, GoalStatus.SUCCEEDED, GoalStatus.ABORTED},
}  # fmt: skip


class Goal:
    """A goal on its way, with everything that came back."""

    def __init__(
        self, client: LowLatencyActionClient, request: str, information: Optional[List[str]] = None
    ) -> None:
        self.lines: List[str] = []
        self._said = threading.Condition()  # guards the lines
        self._known = threading.Event()
        self._active = threading.Event()
        self._canceling = threading.Event()
        self._done = threading.Event()
        goal = ROSoClingoGoal(request, information or [f"about {request}", "more"])
        self.handle = client.send_goal(goal, self._on_transition, self._on_feedback)

    def _on_transition(self, handle: ClientGoalHandle) -> None:
        self._known.set()
        state = handle.get_comm_state()
        if state == CommState.ACTIVE:
            self._active.set()
        elif state in (CommState.PREEMPTING, CommState.RECALLING):
            self._canceling.set()
        elif state == CommState.DONE:
            self._done.set()

    def _on_feedback(self, _: ClientGoalHandle, message: ROSoClingoFeedback) -> None:
        with self._said:
            self.lines.append(message.status)
            self._said.notify_all()

    def wait_for(self, kind: str) -> None:
        """Waits for feedback of a kind, which actionlib drops when the goal has ended."""
        with self._said:
            assert self._said.wait_for(
                lambda: any(line.startswith(kind) for line in self.lines), TIMEOUT
            ), (kind, self.lines)

    def wait_until_active(self) -> None:
        assert self._active.wait(TIMEOUT), "the goal was not accepted"

    def cancel(self) -> None:
        # actionlib's client takes a goal for lost that it cancels before the server has it.
        assert self._known.wait(TIMEOUT), "the goal did not arrive"
        self.handle.cancel()

    def wait_until_canceling(self) -> None:
        assert self._canceling.wait(TIMEOUT), "the cancel request did not arrive"

    def end(self) -> str:
        """Waits for the end and returns the terminal status; the result says the same."""
        assert self._done.wait(TIMEOUT), f"the goal did not end: {self.lines}"
        status: str = GoalStatus.to_string(self.handle.get_terminal_state())
        words = {"PREEMPTED": "canceled", "RECALLED": "canceled"}
        assert self.handle.get_result() is not None, (status, self.text, self.lines)
        result = self.handle.get_result().result
        assert result == words.get(status, status.lower()), (status, result)
        return status

    @property
    def text(self) -> str:
        return str(self.handle.get_goal_status_text())


def succeed(actuator: str, action: str) -> Optional[str]:
    """The answer of an actuator that can do everything; the gate is the test's own."""
    return None if actuator in ("solver", "gate") else "success"


class Robot:
    """The actuators: they answer each action, unless told otherwise."""

    def __init__(self) -> None:
        self.actions: List[Tuple[str, str]] = []
        self.answer = succeed
        self._in = rospy.Publisher(
            "rosoclingo/in", ROSoClingoIn, tcp_nodelay=True, queue_size=20000
        )
        self._out = rospy.Subscriber(
            "rosoclingo/out", ROSoClingoOut, self._on_out, tcp_nodelay=True
        )
        self.wait_for(lambda: self._in.get_num_connections() and self._out.get_num_connections())

    def _on_out(self, message: ROSoClingoOut) -> None:
        self.actions.append((message.id, message.action))
        answer = self.answer(message.id, message.action)
        if answer is not None:
            self.send(message.id, answer)

    def send(self, identifier: str, value: str) -> None:
        self._in.publish(identifier, value)

    def wait_for(self, condition: Callable[[], Any]) -> None:
        """Waits for a condition that an action or a connection makes true."""
        wait_for(condition, lambda: self.actions)


class ModeTestCase(unittest.TestCase):
    client: LowLatencyActionClient
    robot: Robot

    @classmethod
    def setUpClass(cls) -> None:
        cls.client = LowLatencyActionClient("rosoclingo", ROSoClingoAction)
        assert cls.client.wait_for_server(rospy.Duration.from_sec(TIMEOUT))
        cls.robot = Robot()

    def goal(self, request: str, information: Optional[List[str]] = None) -> Goal:
        return Goal(self.client, request, information)


class TestStatic(ModeTestCase):
    def test_the_plan_is_published_once_and_latched(self) -> None:
        self.robot.wait_for(lambda: self.robot.actions)
        late = Robot()
        late.wait_for(lambda: late.actions)
        ((actuator, plan),) = late.actions
        self.assertEqual(actuator, "solver")
        self.assertEqual(plan.count("do(arm,"), 14)
        self.assertEqual(self.robot.actions, late.actions)

    def test_goals_are_rejected_and_messages_ignored(self) -> None:
        self.robot.send("arm", "success")
        goal = self.goal("visit(3)")
        self.assertEqual(goal.end(), "REJECTED")
        self.assertIn("static", goal.text)
        self.assertEqual(self.goal("f(X)").end(), "REJECTED")


class TestFixed(ModeTestCase):
    """The gate holds time until the goals are there; afterwards there is no stopping."""

    def test_goals_in_time(self) -> None:
        self.robot.wait_for(lambda: ("gate", "open") in self.robot.actions)
        goals = [self.goal(f"visit({x})") for x in (3, 1, 2)]
        for request in ("visit(", "f(X)"):
            self.assertEqual(self.goal(request).end(), "REJECTED")
        goals[2].cancel()
        self.assertEqual(goals[2].end(), "RECALLED")
        answers = iter(["failure"])
        self.robot.answer = lambda actuator, action: next(answers, "success")
        self.robot.send("gate", "success")
        self.assertEqual([goal.end() for goal in goals[:2]], ["SUCCEEDED", "SUCCEEDED"])
        moves = [action for actuator, action in self.robot.actions if actuator == "robot"]
        self.assertEqual(moves, ["go(2)", "go(2)", "go(3)"])
        # The steps are used up sooner or later.
        for target in (6, 1) * 6:
            late = self.goal(f"visit({target})")
            if late.end() == "ABORTED":
                break
        # The steps pass without waiting: the last one may have, or too few are left.
        when = r"(ended after its last step, 12; it is too late|horizon of 12 steps)"
        self.assertRegex(late.text, rf"{when} for visit\({target}\)")


class TestDynamic(ModeTestCase):
    def setUp(self) -> None:
        self.robot.answer = succeed
        self.robot.actions.clear()

    def tearDown(self) -> None:
        """Whatever came before, the next goals succeed."""
        self.robot.answer = succeed
        self.assertEqual(self.goal("visit(2)").end(), "SUCCEEDED")
        self.assertEqual(self.goal("visit(1)").end(), "SUCCEEDED")

    def test_a_goal(self) -> None:
        self.robot.answer = lambda actuator, action: None if action == "go(4)" else "success"
        goal = self.goal("visit(4)")
        for line in ("accepted", "plan ", "step "):
            goal.wait_for(line)
        self.robot.wait_for(lambda: len(self.robot.actions) == 3)
        self.robot.send("robot", "success")
        self.assertEqual(goal.end(), "SUCCEEDED")
        self.assertEqual(self.robot.actions, [("robot", f"go({x})") for x in (2, 3, 4)])

    def test_tokens(self) -> None:
        """One that comes late sees what is to be done; an answer to an old token is dropped."""
        self.robot.answer = lambda actuator, action: None
        goal = self.goal("visit(3)")
        self.robot.wait_for(lambda: self.robot.actions)
        answers = rospy.Publisher("rosoclingo/answer", ROSoClingoAnswer, queue_size=10)
        heard: List[ROSoClingoDispatch] = []

        def act(message: ROSoClingoDispatch) -> None:
            (told,) = message.actions
            heard.append(message)
            if told.state == ROSoClingoToken.PENDING:
                self.robot.wait_for(answers.get_num_connections)
                answers.publish("another", told.number, "failure")
                answers.publish(message.run, told.number - 1, "failure")
                answers.publish(message.run, told.number, "success")

        dispatch = rospy.Subscriber("rosoclingo/dispatch", ROSoClingoDispatch, act)
        self.assertEqual(goal.end(), "SUCCEEDED")
        self.robot.wait_for(
            lambda: heard and heard[-1].actions[0].state == ROSoClingoToken.ANSWERED
        )
        dispatch.unregister()
        told = [message.actions[0] for message in heard]
        self.assertEqual(self.robot.actions, [("robot", "go(2)"), ("robot", "go(3)")])
        self.assertEqual(
            [(one.id, one.action, one.number - told[0].number, one.state) for one in told],
            [("robot", "go(2)", 0, 0), ("robot", "go(3)", 1, 0), ("robot", "go(3)", 1, 2)],
        )
        self.assertEqual(len({message.run for message in heard}), 1)
        self.assertEqual(heard[0]._connection_header["latching"], "1")

    def test_more_goals_than_slots(self) -> None:
        self.robot.answer = lambda actuator, action: None
        goals = [self.goal(f"visit({x})") for x in (3, 6, 2, 5, 1)]
        goals[4].wait_for("queued")
        self.robot.wait_for(lambda: self.robot.actions)
        self.robot.answer = succeed
        self.robot.send("robot", "success")
        self.assertEqual([goal.end() for goal in goals], ["SUCCEEDED"] * 5)

    def test_information(self) -> None:
        rospy.wait_for_service("rosoclingo/get_goal_information", TIMEOUT)
        ask = rospy.ServiceProxy("rosoclingo/get_goal_information", GetGoalInformation)
        self.robot.answer = lambda actuator, action: None
        goal = self.goal("visit(2)")
        self.robot.wait_for(lambda: self.robot.actions)
        found = []
        for slot in ("1", "2"):
            try:
                found += ask(slot).information
            except rospy.ServiceException as err:
                self.assertIn(f"'{slot}'", str(err))
        self.assertEqual(found, ["about visit(2)", "more"])
        self.robot.send("robot", "success")
        self.assertEqual(goal.end(), "SUCCEEDED")

    def test_cancel_while_queued_and_while_running(self) -> None:
        self.robot.answer = lambda actuator, action: None
        goals = [self.goal(f"visit({x})") for x in (5, 6, 4)]
        self.robot.wait_for(lambda: self.robot.actions)
        goals[2].cancel()
        self.assertEqual(goals[2].end(), "RECALLED")
        self.robot.send("robot", "success")
        goals[0].wait_until_active()
        self.robot.wait_for(lambda: len(self.robot.actions) == 2)
        for goal in goals[:2]:
            goal.cancel()
            goal.wait_until_canceling()  # an answer takes another connection
        # The server says so just before the loop can know.
        self.robot.answer = lambda actuator, action: "success" if action == "go(4)" else None
        self.robot.send("robot", "success")
        self.assertEqual([goal.end() for goal in goals[:2]], ["PREEMPTED", "PREEMPTED"])
        goals[0].cancel()  # after its end

    def test_failures(self) -> None:
        answers = iter(["failure", "failure", "success", "failure"])
        self.robot.answer = lambda actuator, action: next(answers, "success")
        goal = self.goal("visit(3)")
        self.assertEqual(goal.end(), "SUCCEEDED")
        moves = [action for _, action in self.robot.actions]
        self.assertEqual(moves, ["go(2)", "go(2)", "go(2)", "go(3)", "go(3)"])

    def test_bad_requests(self) -> None:
        bad = ["", "visit(", "visit(X)", "visit(3). a", 'visit("\x02")', "fly(3)",
               'fly("é \\" \\\\")', "visit(" * 100_000 + "3" + ")" * 100_000,
               "f(" + "a," * 500_000 + "a)"]  # fmt: skip
        for request in bad:
            with self.subTest(request=request[:30]):
                goal = self.goal(request)
                self.assertEqual(goal.end(), "REJECTED")
                self.assertTrue(goal.text)

    def test_bad_messages(self) -> None:
        bad = [("", "success"), ("robot", "f(X)"), ("commit", "x"), ("save", "at(3)"),
               ("1", "cancel"), ("info", "passed"), ("é", "x"), ('"a\\"b é"', '"c\\\\"'),
               ("robot", "dance"), ("robot", '"\x01"'),
               ("robot", "f(" + "a," * 500_000 + "a)")]  # fmt: skip
        for identifier, value in bad:
            self.robot.send(identifier, value)
        self.assertEqual(self.goal("visit(3)").end(), "SUCCEEDED")

    def test_what_is_too_long(self) -> None:
        """It is dropped or refused where it comes in, and neither kept nor journaled."""
        noted: List[int] = []
        journal = rospy.Subscriber(
            "rosoclingo/journal",
            ROSoClingoEvent,
            lambda event: noted.append(len(str(event))),
        )
        wait_for(lambda: journal.get_num_connections() > 0)
        long = '"' + "x" * 2**20 + '"'
        for _ in range(40):
            self.robot.send("info", long)
        for goal in (self.goal(f"visit({long})"), self.goal("visit(3)", [long])):
            self.assertEqual(goal.end(), "REJECTED")
            self.assertIn("an input has at most 16384", goal.text)
        for word in ("approve", "hold"):
            reply = rospy.ServiceProxy(f"rosoclingo/{word}", ControlActuator)("robot", long, 0)
            self.assertFalse(reply.success)
            self.assertIn("an input has at most 16384", reply.message)
        with self.assertRaisesRegex(rospy.ServiceException, "an input has at most 16384"):
            rospy.ServiceProxy("rosoclingo/get_goal_information", GetGoalInformation)(long)
        self.assertEqual(self.goal("visit(3)").end(), "SUCCEEDED")
        self.assertLess(max(noted), MOST_TEXT)
        journal.unregister()

    def test_many_messages(self) -> None:
        for number in range(MESSAGES):
            self.robot.send("sensor", f"reading({number})")
        self.assertEqual(self.goal("visit(3)").end(), "SUCCEEDED")

    def test_many_goals(self) -> None:
        """Many goals, a random half of them cancelled: all end, legally, in the queue's order."""
        seen: dict[str, List[int]] = {}
        order: List[str] = []

        def on_status(statuses: Any) -> None:
            for status in statuses.status_list:
                history = seen.setdefault(status.goal_id.id, [])
                if not history or history[-1] != status.status:
                    history.append(status.status)

        def on_result(result: Any) -> None:
            if result.status.status == GoalStatus.SUCCEEDED:
                order.append(result.status.goal_id.id)

        listeners = [
            rospy.Subscriber("rosoclingo/status", self.client.status_sub.data_class, on_status),
            rospy.Subscriber("rosoclingo/result", self.client.result_sub.data_class, on_result),
        ]
        goals = [self.goal("visit(2)" if number % 2 else "visit(1)") for number in range(GOALS)]
        canceled = random.Random(7).sample(goals, GOALS // 2)
        for goal in canceled:
            goal.cancel()
        for goal in goals:
            end = goal.end()
            legal = (
                {"SUCCEEDED"} if goal not in canceled else {"SUCCEEDED", "PREEMPTED", "RECALLED"}
            )
            self.assertIn(end, legal, goal.text)
        for history in seen.values():
            for before, after in zip(history, history[1:]):
                self.assertTrue(self._may_follow(before, after), history)
        # Two goals have a slot at a time, so that none is overtaken by more than one.
        ids = [goal.handle.comm_state_machine.action_goal.goal_id.id for goal in goals]
        places = [ids.index(identifier) for identifier in order if identifier in ids]
        for position, place in enumerate(places):
            self.assertLessEqual(sum(later < place for later in places[position + 1 :]), 1)
        for listener in listeners:
            listener.unregister()

    def _may_follow(self, before: int, after: int) -> bool:
        """Whether a status may follow another, maybe over one that was not seen."""
        direct = _NEXT.get(before, set())
        return after in direct or any(after in _NEXT.get(middle, set()) for middle in direct)


TESTS = {"static": TestStatic, "fixed": TestFixed, "dynamic": TestDynamic}

if __name__ == "__main__":
    rospy.init_node("test_mode")
    kind = rospy.get_param("~kind")
    rostest.rosrun("rosoclingo", f"test_mode_{rospy.get_param('~mode')}", TESTS[kind], sys.argv)
