"""Deduplicates answers by token where they come in, before they are stored or wake the loop.

Interfaces repeat an answer until they know that it was taken. Only the first one is news:

>>> from rosoclingo.loop.values.atoms import Action
>>> from rosoclingo.loop.values.environment import Environment
>>> executions = Executions(Environment())
>>> executions.begin(Action("robot", "go(3)", 1))
>>> copies, answer = AnswerCopies(), AnswerArrived(executions.run, 1, "success", "/robot")
>>> [copies.is_copy(answer, executions) for _ in range(3)]
[False, True, True]
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Collection, Iterable, Tuple, TypeVar

from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.inputs.inbox import Item
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.values.atoms import canonical_or_text

_MOST = 1000  # answers, and nodes, that are remembered

_Entry = TypeVar("_Entry", str, Tuple[str, int, str])
_Key = Tuple[str, int, str]  # run, number and value


class AnswerCopies:
    """Knows which answers have come, and which nodes answer with tokens. Thread-safe."""

    def __init__(self) -> None:
        """Begins without answers."""
        self._lock = threading.Lock()  # guards the two below; held for moments only
        self._answers: OrderedDict[_Key, None] = OrderedDict()  # the last to come on the right
        self._nodes: OrderedDict[str, None] = OrderedDict()  # likewise

    def restore(self, executions: Executions, waiting: Iterable[Item]) -> None:
        """Takes over what an earlier process of the run knew; before anything comes in.

        Args:
            executions: What each actuator was told last, and which answers were taken.
            waiting: The inputs that had come, and were not taken.
        """
        for number, value in executions.answers.items():
            _is_known(self._answers, (executions.run, number, value))
        for node in executions.answering:
            _is_known(self._nodes, node)
        for item in waiting:
            if isinstance(item, AnswerArrived):
                self.is_copy(item, executions)

    def is_copy(self, answer: AnswerArrived, executions: Executions) -> bool:
        """Tells if an answer has come before; remembers it.

        One to an action that does not exist yet is not remembered: it may become right.

        Args:
            answer: The answer.
            executions: What each actuator was told last; only read.
        """
        if answer.run == executions.run and answer.number > executions.number:
            return False
        with self._lock:
            if answer.sender:
                _is_known(self._nodes, answer.sender)
            key = answer.run, answer.number, canonical_or_text(answer.value)
            return _is_known(self._answers, key)

    def repeats_token(self, message: MessageArrived, told: Collection[str]) -> bool:
        """Tells if a message without a token is an answer that its node gives with one, too.

        Args:
            message: The message, with the node that sends it.
            told: The actuators that were told something.
        """
        with self._lock:
            return message.source in told and message.sender in self._nodes


def _is_known(known: OrderedDict[_Entry, None], key: _Entry) -> bool:
    """Tells if a key is known, and makes it the one that came last; the oldest is forgotten."""
    was_known = key in known
    known[key] = None
    known.move_to_end(key)
    if len(known) > _MOST:
        known.popitem(last=False)
    return was_known
