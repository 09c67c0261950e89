"""Actions: who does them, what is answered, how they end. Without ROS."""

from __future__ import annotations

import logging
import queue
import sys
import threading
from typing import Any, Callable, Iterator, List, Tuple

import pytest

from rosclingo.errors import TermError
from rosoclingo.loop.values.served import ServedGoal
from rosoclingo_interfaces.execution import ActionExecution
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.ledger import Token
from rosoclingo_interfaces.served_goals import ServedGoalsBoard

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes


class Robot(ActionInterface):
    """Remembers what it was told, and goes on only when it may."""

    actuators = ("robot", "arm(1)")

    def __init__(self) -> None:
        self.calls: queue.Queue[Tuple[Any, ...]] = queue.Queue()
        self.may_go_on = threading.Event()
        self.stopped = threading.Event()
        self._private = 1

    def go(self, waypoint: Any, *more: Any) -> bool:
        self.calls.put((self.actuator, waypoint, *more))
        return waypoint != "nowhere"

    def wait(self) -> bool:
        self.calls.put(("wait",))
        try:
            self.sleep()
        finally:
            self.stopped.set()
        return True

    def stubborn(self) -> bool:
        self.calls.put(("stubborn",))
        assert self.may_go_on.wait(TIMEOUT)
        return True

    def polite(self) -> bool:
        self.calls.put(("polite",))
        while not self.canceled:
            self.may_go_on.wait(0.001)
        return True

    def nap(self, tenths: int) -> bool:
        self.sleep(tenths / 10)
        return True

    def say(self, answer: str) -> str:
        return answer

    def fail(self) -> bool:
        raise OSError("the battery is empty")

    def leave(self) -> bool:
        sys.exit("I have had enough")

    def nothing(self) -> Any:
        return None

    def elsewhere(self) -> bool:
        """Looks at the action from a thread of its own."""
        failures: List[Exception] = []

        def look(execution: ActionExecution) -> None:
            assert execution.actuator == self_actuator
            try:
                self.canceled  # noqa: B018
            except RuntimeError as err:
                failures.append(err)

        self_actuator = self.actuator
        thread = threading.Thread(target=look, args=(self.execution,))
        thread.start()
        thread.join()
        return "self.execution" in str(failures[0])

    def sleep_(self) -> str:
        return "slept"

    def pass_(self, what: str) -> str:
        return f"passed({what})"


class Sent:
    """The answers, each with its actuator."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self._answers: queue.Queue[Tuple[str, str]] = queue.Queue()

    def begin(self, actuator: str, action: str) -> None:
        self._executor.begin(actuator, action, lambda value: self._answers.put((actuator, value)))

    def next(self) -> Tuple[str, str]:
        return self._answers.get(timeout=TIMEOUT)

    def ask(self, action: str, actuator: str = "robot") -> str:
        """Begins an action and returns its answer; there must not be another."""
        self.begin(actuator, action)
        source, value = self.next()
        assert source == actuator
        assert self._answers.empty()
        return value

    @property
    def empty(self) -> bool:
        return self._answers.empty()


Make = Callable[..., Sent]


@pytest.fixture
def make() -> Iterator[Make]:
    executors: List[Executor] = []

    def made(interface: ActionInterface, *arguments: Any) -> Sent:
        executors.append(Executor(interface, *arguments))
        return Sent(executors[-1])

    yield made
    for executor in executors:
        executor.close(TIMEOUT)


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def sent(make: Make, robot: Robot) -> Sent:
    return make(robot)


@pytest.mark.parametrize(
    ("action", "arguments"),
    [
        ("go(c3)", ("c3",)),
        ("go(c(1))", ("c(1)",)),
        ("go(3,-4)", (3, -4)),
        ('go("c 3",(1,2))', ("c 3", "(1,2)")),
        ("go(1+2)", (3,)),
        ("go(#inf)", ("#inf",)),
    ],
)
def test_arguments(robot: Robot, sent: Sent, action: str, arguments: Tuple[Any, ...]) -> None:
    assert sent.ask(action) == "success"
    assert robot.calls.get() == ("robot", *arguments)


@pytest.mark.parametrize(
    ("action", "answer"),
    [
        ("go(nowhere)", "failure"),
        ("say(delayed(5))", "delayed(5)"),
        ('say("1+2")', "3"),
        ("say(sleep)", "sleep"),
        ("sleep", "slept"),
        ("pass(me)", "passed(me)"),
        ("elsewhere", "success"),
        ("nap(0)", "success"),
        ("nap(1)", "success"),
    ],
)
def test_answers(sent: Sent, action: str, answer: str) -> None:
    assert sent.ask(action) == answer


@pytest.mark.parametrize(
    ("action", "text"),
    [
        (
            "fly(3)",
            "there is no method for the action fly(3): Robot has elsewhere, fail, go",
        ),
        ("-go(3)", "there is no method for the action -go(3)"),
        ("7", "there is no method for the action 7"),
        ('"go"', "there is no method"),
        ("(go,c3)", "there is no method"),
        ("_private", "there is no method"),
        ("__init__", "there is no method"),
        ("actuators", "there is no method"),
        ("perform(go)", "there is no method"),
        ("calls", "there is no method"),
        ("wait(3)", "the action wait(3) does not fit the method wait()"),
        ("go", "the action go does not fit the method go(waypoint"),
        ("go(X)", "'go(X)' is not a ground term"),
        ("go(", "'go(' is not a ground term"),
        ("", "it is empty"),
        ("fail", "the battery is empty"),
        ("leave", "I have had enough"),
        ("nothing", "the method returned None, where True"),
        ('say("a b")', "the method's answer 'a b' cannot be sent"),
        ("[do(robot,go(c3),1)]", "is not a ground term"),
    ],
)
def test_what_cannot_be_done_fails(
    sent: Sent, caplog: pytest.LogCaptureFixture, action: str, text: str
) -> None:
    assert sent.ask(action) == "failure"
    assert text in caplog.text
    assert sent.ask("go(c3)") == "success"


def test_actuators(robot: Robot, sent: Sent) -> None:
    for other in ("solver", "arm(2)", "Robot", "", "arm"):
        sent.begin(other, "go(c3)")
    assert sent.ask("go(c3)", "arm( 1 )") == "success"
    assert robot.calls.get_nowait() == ("arm(1)", "c3")
    assert robot.calls.empty()


def test_all_actuators(make: Make) -> None:
    class Everybody(Robot):
        actuators = ()

    sent = make(Everybody())
    sent.begin("solver", "[do(robot,go(c3),1)]")
    assert sent.ask("go(c3)", "somebody") == "success"


def test_an_actuator_that_is_no_term(make: Make, robot: Robot) -> None:
    robot.actuators = ("Robot",)
    with pytest.raises(TermError):
        make(robot)


def test_a_new_action_replaces_the_old(robot: Robot, sent: Sent) -> None:
    sent.begin("robot", "wait")
    assert robot.calls.get(timeout=TIMEOUT) == ("wait",)
    assert sent.ask("go(c3)") == "success"
    assert robot.stopped.is_set()  # before the next began
    assert sent.empty


def test_many_replacements(robot: Robot, sent: Sent) -> None:
    for _ in range(50):
        sent.begin("robot", "wait")
    assert sent.ask("go(c3)") == "success"


def test_actuators_act_side_by_side(robot: Robot, sent: Sent) -> None:
    sent.begin("robot", "stubborn")
    assert sent.ask("go(c3)", "arm(1)") == "success"
    robot.may_go_on.set()
    assert sent.next() == ("robot", "success")


def test_an_action_that_does_not_stop(
    robot: Robot, sent: Sent, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("rosoclingo_interfaces.executor._SECONDS_TO_STOP", 0.05)
    sent.begin("robot", "stubborn")
    assert robot.calls.get(timeout=TIMEOUT) == ("stubborn",)
    assert sent.ask("go(c3)") == "success"
    assert "stubborn goes on although it was cancelled" in caplog.text
    robot.may_go_on.set()
    assert sent.ask("go(c3)") == "success"  # its late answer is nobody's


def test_abort(robot: Robot, sent: Sent) -> None:
    sent.begin("robot", "abort")  # nothing runs
    sent.begin("robot", "wait")
    robot.calls.get(timeout=TIMEOUT)
    assert sent.ask("abort") == "failure"
    sent.begin("robot", "polite")
    assert sent.ask("abort") == "success"  # it was through before it looked
    sent.begin("robot", "abort")
    assert sent.ask("go(c3)") == "success"


def test_time_limit(make: Make, robot: Robot, caplog: pytest.LogCaptureFixture) -> None:
    sent = make(robot, 0.05)
    assert sent.ask("wait") == "failure"
    assert "robot: wait: no answer within 0.05 s (~timeout)" in caplog.text
    assert robot.stopped.wait(TIMEOUT)
    assert sent.ask("stubborn") == "failure"
    robot.may_go_on.set()
    for _ in range(20):
        assert sent.ask("go(c3)") == "success"


def test_a_clock_of_its_own(make: Make, robot: Robot) -> None:
    """Time limits keep to a simulator's time."""
    now = [100.0]
    sent = make(robot, 60.0, lambda: now[0])
    sent.begin("robot", "wait")
    robot.calls.get(timeout=TIMEOUT)
    now[0] += 59.9
    assert not robot.stopped.wait(0.2)
    now[0] += 0.2
    assert sent.next() == ("robot", "failure")


def test_a_clock_that_jumps_as_an_action_begins(make: Make, robot: Robot) -> None:
    """The time limit counts from the message, whenever the thread that looks at it begins."""
    times = iter([100.0])
    sent = make(robot, 60.0, lambda: next(times, 161.0))
    assert sent.ask("wait") == "failure"


def test_close(robot: Robot) -> None:
    executor = Executor(robot)
    sent = Sent(executor)
    sent.begin("robot", "wait")
    robot.calls.get(timeout=TIMEOUT)
    executor.close(TIMEOUT)
    assert robot.stopped.is_set()
    sent.begin("robot", "go(c3)")
    assert sent.empty
    assert robot.calls.empty()


def test_an_interface_that_leaves_actions_to_others(
    make: Make, robot: Robot, caplog: pytest.LogCaptureFixture
) -> None:
    robot.leaves_unknown = True
    sent = make(robot)
    caplog.set_level(logging.WARNING)
    sent.begin("robot", "fly(3)")
    assert sent.ask("go(c3)") == "success"
    assert caplog.text == ""
    sent.begin("robot", "wait")
    while robot.calls.get(timeout=TIMEOUT) != ("wait",):
        pass
    sent.begin("robot", "fly(3)")  # the actuator does something else now
    sent.begin("robot", "fly(3)")
    assert sent.ask("go(c3)") == "success"
    assert robot.stopped.is_set()  # before the next began
    assert sent.ask("go") == "failure"  # it is known, but wrong


def test_no_action_in_this_thread(robot: Robot) -> None:
    with pytest.raises(RuntimeError, match="no action runs in this thread"):
        robot.sleep(1.0)


def test_served_goals() -> None:
    """They are found when a method wants to know them, and once for each action."""

    class Waiter(ActionInterface):
        actuators = ("waiter",)

        def pick(self, slot: int) -> str:
            assert self.served_goals == self.execution.served_goals
            return "none" if self.served_goal is None else self.served_goal.request

    asked: List[str] = []

    def find() -> Tuple[ServedGoal, ...]:
        asked.append("asked")
        return (ServedGoal(1, "1", "dish(t3)", "a"), ServedGoal(1, "2", "dish(t4)", "b"))

    answers: queue.Queue[str] = queue.Queue()
    executor = Executor(Waiter())
    executor.begin("waiter", "pick(1)", answers.put, Token("run", 1), find_served=find)
    assert answers.get(timeout=TIMEOUT) == "dish(t3)"
    assert asked == ["asked"]
    executor.begin("waiter", "pick(1)", answers.put)
    assert answers.get(timeout=TIMEOUT) == "none"


def test_served_goals_that_come_later() -> None:
    board, found = ServedGoalsBoard(), queue.Queue()  # type: ignore[var-annotated]
    board.hear("before", 9, [ServedGoal(9, "1", "old", "a")])
    token = Token("run", 2)
    assert board.find(token, seconds=0.0) is None
    threading.Thread(target=lambda: found.put(board.find(token, TIMEOUT)), daemon=True).start()
    board.hear("run", 1, [])
    served = [ServedGoal(1, "1", "dish(t3)", "a"), ServedGoal(2, "2", "dish(t4)", "b")]
    board.hear("run", 2, served)
    assert found.get(timeout=TIMEOUT) == (served[1],)
    board.hear("run", 3, served[:1])
    assert board.find(token) == ()
