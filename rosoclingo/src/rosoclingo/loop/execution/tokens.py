"""Tokens: idempotency keys of actions, by which answers are matched to them. Needs no ROS.

A token is the run's id and the action's number in the run. It stays the same when the action is
published again, so that an interface can do it once. See docs/protocol.md, section "Tokens".

>>> from rosoclingo.loop.values.atoms import Action
>>> from rosoclingo.loop.values.environment import Environment
>>> executions = Executions(Environment())
>>> executions.begin(Action("robot", "go(3)", 1))
>>> answer = AnswerArrived(executions.run, 1, "success", "/node")
>>> resolve(executions, [answer])
([MessageArrived(source='robot', value='success', seconds=0.0, sender='')], [])
>>> _ = executions.end("robot", "success")
>>> resolve(executions, [answer])
([], [])
>>> resolve(executions, [AnswerArrived(executions.run, 1, "failure")])[1]
['answer failure to action 1: robot has answered success already']
"""

from __future__ import annotations

from typing import List, Optional, Sequence, Set, Tuple, Union

from rosclingo.errors import shorten
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.inputs.inbox import Item, Taken
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.values.atoms import canonical_or_text
from rosoclingo.loop.words import FAILURE, GIVEN_UP

TOKENS_HEADER = "answers_with_tokens"
"""A field of a connection's header on ``~in``: the node sends its answers with tokens, too."""

UntakenAnswer = Union[str, int]
"""An actuator, or the number of an action, whose answer the loop has not taken yet."""


def resolve(executions: Executions, items: Sequence[Item]) -> Tuple[List[Taken], List[str]]:
    """Resolves answers with tokens to messages, and drops those that fit no open action.

    Most copies do not come here, see :class:`rosoclingo.ros.copies.AnswerCopies`.

    Args:
        executions: What each actuator was told last; which answers have come is recorded there.
        items: What has come, in order.

    Returns:
        What the loop is to take, and why the rest is dropped. An answer that was taken before
        and comes again is in neither.
    """
    taken: List[Taken] = []
    dropped: List[str] = []
    for item in items:
        if isinstance(item, AnswerArrived):
            _resolve_answer(executions, item, taken, dropped)
        else:
            taken.append(item)
    return taken, dropped


def _resolve_answer(
    executions: Executions, answer: AnswerArrived, taken: List[Taken], dropped: List[str]
) -> None:
    run, number, value = executions.run, answer.number, canonical_or_text(answer.value)
    name = f"answer {shorten(answer.value)} to action {number}: "
    if answer.run != run:
        dropped.append(f"{name}it is of the run {shorten(answer.run)}, and this is {run}")
        return
    before = executions.answers.get(number)
    one = next((one for one in executions.last.values() if one.number == number), None)
    if is_known(before, value):
        return
    if one is None:
        is_old = 0 < number <= executions.number
        why = "its actuator was told something else since then" if is_old else "there is none"
        dropped.append(f"{name}{why}")
    elif before is not None:
        dropped.append(f"{name}{why_late(one.actuator, before)}")
    else:
        message = MessageArrived(one.actuator, answer.value)
        if message not in taken:  # its node may have said it without the token, too
            taken.append(message)


def untaken_answers(items: Sequence[Item], run: str) -> Set[UntakenAnswer]:
    """Returns whose answers are among inputs that the loop has not taken yet.

    Args:
        items: The inputs.
        run: The id of the run.

    Returns:
        The ids of actuators, and the numbers of their tokens.
    """
    plain = (item.source for item in items if isinstance(item, MessageArrived))
    tokens = (item for item in items if isinstance(item, AnswerArrived))
    return {*plain, *(item.number for item in tokens if item.run == run)}


def is_known(before: Optional[str], value: str) -> bool:
    """Returns whether an answer says nothing new.

    Args:
        before: The answer to the same action that was taken before; None if none was.
        value: The answer.

    Returns:
        Whether it is a copy, or says that an action has failed that was given up before: its
        interface was told to abort it, and answers that.
    """
    return value == before or (value == FAILURE and before in GIVEN_UP)


def why_late(actuator: str, before: str) -> str:
    """Returns why an answer comes too late.

    Args:
        actuator: Who gives it.
        before: The answer that was taken.
    """
    if before in GIVEN_UP:
        return f"{actuator} has not answered in time: the action has timed out ({before})"
    return f"{actuator} has answered {shorten(before)} already"
