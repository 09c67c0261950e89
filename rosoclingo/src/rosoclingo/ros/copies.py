"""Deduplicates answers by token where they come in, before they are stored or wake the loop.

Interfaces repeat an answer until they know that it was taken. Only the first one is news:

>>> from rosoclingo.loop.values.atoms import Action
>>> from rosoclingo.loop.values.environment import Environment
>>> executions = Executions(Environment())
>>> executions.begin(Action("robot", "go(3)", 1))
>>> copies, answer = AnswerCopies(), AnswerArrived(executions.run, 1, "success", "/robot")
>>> [copies.is_copy(answer, executions, {"robot": 1}) for _ in range(3)]
[False, True, True]
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from typing import Iterable, Mapping, Tuple, TypeVar

from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.inputs.inbox import Item
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.values.atoms import canonical_or_text

_MOST = 1000  # answers, and nodes with their actuators, that are remembered

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")
_Source = Tuple[str, str]
"""A node, and the actuator that it answers for."""
_Answer = Tuple[int, str]
"""The number of an action, and the answer to it."""


class AnswerCopies:
    """Knows which answers have come, with tokens and without. Thread-safe."""

    def __init__(self) -> None:
        """Begins without answers."""
        self._lock = threading.Lock()  # guards the four below; held for moments only
        self._answers: OrderedDict[Tuple[str, int, str], None] = OrderedDict()
        # The last answer with a token of each node that was not said without it, and the other way.
        self._tokened: OrderedDict[_Source, _Answer] = OrderedDict()
        self._plain: OrderedDict[_Source, _Answer] = OrderedDict()
        self._twofold: OrderedDict[_Source, None] = OrderedDict()  # who has answered in both ways

    def restore(self, executions: Executions, waiting: Iterable[Item]) -> None:
        """Takes over what an earlier process of the run knew; before anything comes in.

        Args:
            executions: What each actuator was told last, and which answers were taken.
            waiting: The inputs that had come, and were not taken.
        """
        for number, value in executions.answers.items():
            _remember(self._answers, (executions.run, number, value), None)
        for item in waiting:
            if isinstance(item, AnswerArrived):
                self.is_copy(item, executions, {})

    def is_copy(
        self, answer: AnswerArrived, executions: Executions, told: Mapping[str, int]
    ) -> bool:
        """Tells if an answer has come before; remembers it.

        One to an action that does not exist yet is not remembered: it may become right.

        Args:
            answer: The answer.
            executions: What each actuator was told last; only read.
            told: The number of the last action of each actuator that was told something.
        """
        number, value = answer.number, canonical_or_text(answer.value)
        if answer.run == executions.run and number > executions.number:
            return False
        with self._lock:
            key = answer.run, number, value
            was_known = key in self._answers
            _remember(self._answers, key, None)
            actuator = next((one for one, last in told.items() if last == number), None)
            if actuator is not None and answer.run == executions.run and not was_known:
                source = answer.sender, actuator
                if self._plain.pop(source, None) == (number, value):
                    _remember(self._twofold, source, None)
                else:
                    _remember(self._tokened, source, (number, value))
            return was_known

    def repeats_token(self, message: MessageArrived, told: Mapping[str, int]) -> bool:
        """Tells if a message is an answer that its node has given with a token, too.

        That is so if the token is that of its actuator's last action; if it is an older one, only
        if the node has answered that actuator's actions in both ways before.

        Args:
            message: The message, with the node that sends it.
            told: As for :meth:`is_copy`.
        """
        source, number = (message.sender, message.source), told.get(message.source)
        if number is None:
            return False
        answer = number, canonical_or_text(message.value)
        with self._lock:
            before = self._tokened.pop(source, None)
            is_late = before is not None and before[0] != number and source in self._twofold
            if before == answer:
                _remember(self._twofold, source, None)
            elif not is_late:
                self._twofold.pop(source, None)  # until its token comes, too
                _remember(self._plain, source, answer)
                return False
            return True


def _remember(known: OrderedDict[_Key, _Value], key: _Key, value: _Value) -> None:
    """Makes a key the one that came last; the oldest one is forgotten."""
    known[key] = value
    known.move_to_end(key)
    if len(known) > _MOST:
        known.popitem(last=False)
