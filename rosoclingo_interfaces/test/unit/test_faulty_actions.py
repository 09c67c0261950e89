"""Interfaces that lie, die and fail as rules say."""

from __future__ import annotations

import contextvars
import threading
from typing import Any, Dict, List, Tuple

import clingo
import pytest

from rosoclingo_interfaces.execution import CURRENT, ActionExecution
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.faulty_actions import FaultyActions, read_rules
from rosoclingo_interfaces.interface import ActionInterface

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes


class Killed(BaseException):
    """In the place of the end of a process."""


class Node:
    """Interfaces with faults lie, die and fail as they were told to."""

    def __init__(self, rules: Dict[str, Any], deaths: int = 0) -> None:
        self.done: List[str] = []
        self.now = 0.0
        faulty = FaultyActions(self._perform, read_rules(rules), self._die, self._clock, deaths)
        self._faulty = faulty

    def _clock(self) -> float:
        return self.now

    def _perform(self, action: clingo.Symbol) -> bool:
        self.done.append(str(action))
        return True

    def _die(self) -> None:
        raise Killed

    def do(self, action: str, actuator: str = "robot") -> object:
        return contextvars.copy_context().run(self._do, clingo.parse_term(action), actuator)

    def _do(self, action: clingo.Symbol, actuator: str) -> object:
        CURRENT.set(ActionExecution(actuator, action))
        return self._faulty.perform(action)


def test_an_interface_that_lies_does_nothing() -> None:
    node = Node({"lies": {"actions": "^go", "times": 2}})
    assert [node.do("go(1)"), node.do("pickup(1)"), node.do("go(2)")] == [
        "success",
        True,
        "success",
    ]
    assert node.done == ["pickup(1)"]
    assert node.do("go(3)") is True
    assert node.done == ["pickup(1)", "go(3)"]


@pytest.mark.parametrize(("at", "done"), [("begin", []), ("end", ["go(1)"])])
def test_an_interface_dies_once_before_or_after_an_action(at: str, done: List[str]) -> None:
    rules: Dict[str, Any] = {"dies": {"actions": "go", "at": at}}
    liar = Node({**rules, "lies": {}})
    with pytest.raises(Killed):
        liar.do("go(1)")
    assert not liar.done
    node = Node(rules)
    with pytest.raises(Killed):
        node.do("go(1)")
    assert node.done == done
    again = Node(rules, deaths=1)
    assert again.do("go(1)") is True
    assert again.done == ["go(1)"]


def test_a_package_that_was_taken_away_comes_back() -> None:
    node = Node({"fails": {"actions": "pickup", "times": 1, "lasts": 30}})
    assert node.do("pickup(1)") == "failure"
    assert node.do("pickup(2)") is True
    node.now = 29.0
    assert node.do("pickup(1)") == "failure"
    assert node.do("pickup(1)", "other") is True
    node.now = 30.0
    assert node.do("pickup(1)") is True
    assert node.done == ["pickup(2)", "pickup(1)", "pickup(1)"]


def outcomes(seed: int, actuator: str = "robot", *, more: bool = False) -> Tuple[object, ...]:
    node = Node({"seed": seed, "lies": {"probability": 0.3}, "fails": {"probability": 0.2}})
    said = []
    for number in range(200):
        said.append(node.do(f"go({number})", actuator))
        if more:
            node.do("go(x)", "other")
    return tuple(said)


def test_a_seed_repeats_the_faults_of_each_actuator() -> None:
    first = outcomes(3)
    assert first == outcomes(3) == outcomes(3, more=True)
    assert first != outcomes(4)
    assert first != outcomes(3, "other")
    assert first.count("success") / 200 == pytest.approx(0.3, abs=0.1)
    assert first.count("failure") / 200 == pytest.approx(0.7 * 0.2, abs=0.08)


def test_the_executor_does_actions_with_faults() -> None:
    class Robot(ActionInterface):
        actuators = ("robot",)

        def go(self, _: int) -> bool:
            return False

    robot, answers, came = Robot(), [], threading.Event()

    def reply(value: str) -> None:
        answers.append(value)
        came.set()

    rules = read_rules({"lies": {"times": 1}})
    faulty = FaultyActions(robot.perform, rules, lambda: None, lambda: 0.0)
    executor = Executor(robot, perform=faulty.perform)
    for answer in ("success", "failure"):
        came.clear()
        executor.begin("robot", "go(1)", reply)
        assert came.wait(TIMEOUT)
        assert answers[-1] == answer


@pytest.mark.parametrize(
    ("rules", "message"),
    [
        ({"lie": {}}, "there is no entry 'lie'; there are lies, dies, fails and seed"),
        ({"lies": "go"}, "lies: expected a mapping, such as .*, not 'go'"),
        ({"lies": {"at": "end"}}, "lies: there is no entry 'at'; there are actions, probability"),
        ({"lies": {"lasts": 1}}, "lies: there is no entry 'lasts'"),
        ({"lies": {"actions": "("}}, "lies: actions: expected a regular expression: "),
        ({"fails": {"probability": 1.5}}, "fails: probability: expected a number from 0 to 1, not"),
        ({"fails": {"probability": True}}, "fails: probability: expected a number"),
        ({"fails": {"times": "many"}}, "fails: times: expected a number from 0, not 'many'"),
        ({"fails": {"lasts": -1}}, "fails: lasts: expected a number from 0, not -1"),
        ({"dies": {"at": "noon"}}, "dies: at: expected begin or end, not 'noon'"),
        ({"seed": 1.5}, "seed: expected an integer, not 1.5"),
        ({"seed": "x"}, "seed: expected a number from 0, not 'x'"),
    ],
)
def test_wrong_rules_are_named(rules: Dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_rules(rules)
