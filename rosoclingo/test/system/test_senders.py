"""Inputs of a node know the node that has sent them, by which duplicate answers are told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, List

from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.msg import ROSoClingoAnswer, ROSoClingoIn
from rosoclingo.ros.loop_node import LoopNode


def test_inputs_have_their_sender() -> None:
    """Also after a restart, when it is not known yet who was told something."""
    put: List[Any] = []
    node: Any = SimpleNamespace(_environment=SimpleNamespace(told=frozenset()), _put=put.append)
    message, answer = ROSoClingoIn("robot", "success"), ROSoClingoAnswer("run", 3, "success")
    for one in (message, answer):
        one._connection_header = {"callerid": "/robot", "answers_with_tokens": "1"}
    LoopNode._on_message(node, message)
    LoopNode._on_answer(node, answer)
    assert put == [
        MessageArrived("robot", "success", sender="/robot"),
        AnswerArrived("run", 3, "success", sender="/robot"),
    ]
