"""Answers with tokens come in once, also if the same node gives them without."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, List

from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.environment import Environment
from rosoclingo.msg import ROSoClingoAnswer, ROSoClingoIn
from rosoclingo.ros.copies import AnswerCopies
from rosoclingo.ros.loop_node import LoopNode


def test_what_comes_in() -> None:
    """Also after a restart, when it is not known yet who was told something."""
    put: List[Any] = []
    executions = Executions(Environment())
    executions.begin(Action("robot", "go(3)", 1))
    node: Any = SimpleNamespace(
        _environment=SimpleNamespace(told={}),
        _loop=SimpleNamespace(state=SimpleNamespace(executions=executions)),
        _copies=AnswerCopies(),
        _put=put.append,
    )

    def message(sender: str, *header: str) -> None:
        one = ROSoClingoIn("robot", "success")
        one._connection_header = {"callerid": sender, **dict.fromkeys(header, "1")}
        LoopNode._on_message(node, one)

    answer = ROSoClingoAnswer(executions.run, 1, "success")
    answer._connection_header = {"callerid": "/old"}
    arrived = MessageArrived("robot", "success")
    message("/robot", "answers_with_tokens")
    message("/old")
    assert put == [arrived] * 2
    node._environment.told = {"robot": 1}
    message("/robot", "answers_with_tokens")
    for _ in range(3):
        LoopNode._on_answer(node, answer)
    message("/old")
    assert put[2:] == [AnswerArrived(executions.run, 1, "success", sender="/old")]
    message("/older")
    assert put[3:] == [arrived]
