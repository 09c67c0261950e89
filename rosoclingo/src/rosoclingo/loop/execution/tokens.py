"""Tokens: idempotency keys of actions, by which answers are matched to them. Needs no ROS.

A token is the run's id and the action's number in the run. It stays the same when the action is
published again, so that an interface can do it once. See docs/protocol.md, section "Tokens".

>>> from rosoclingo.loop.values.atoms import Action
>>> from rosoclingo.loop.values.environment import Environment
>>> executions = Executions(Environment())
>>> executions.begin(Action("robot", "go(3)", 1))
>>> answer = AnswerArrived(executions.run, 1, "success")
>>> resolve(executions, [answer])
([MessageArrived(source='robot', value='success', seconds=0.0, sender='')], [])
>>> _ = executions.end("robot", "success")
>>> resolve(executions, [answer])
([], [])
>>> resolve(executions, [AnswerArrived(executions.run, 1, "failure")])[1]
['answer failure to action 1: robot has answered success already']
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Sequence, Tuple

from rosclingo.errors import TermError, shorten
from rosoclingo.loop.execution.executions import Executions
from rosoclingo.loop.inputs.inbox import Item, Taken
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.words import LOST, TIMEOUT

TOKENS_HEADER = "answers_with_tokens"
"""A field of a connection's header on ``~in``: the node sends its answers with tokens, too."""


def resolve(executions: Executions, items: Sequence[Item]) -> Tuple[List[Taken], List[str]]:
    """Resolves answers with tokens to messages, and drops duplicates and misfits.

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
        elif not isinstance(item, MessageArrived):
            taken.append(item)
        elif _is_news(executions, item, dropped):
            taken.append(replace(item, sender=""))
    return taken, dropped


def _resolve_answer(
    executions: Executions, answer: AnswerArrived, taken: List[Taken], dropped: List[str]
) -> None:
    run, number = executions.run, answer.number
    one = next((one for one in executions.last.values() if one.number == number), None)
    name = f"answer {shorten(answer.value)} to action {number}: "
    if answer.run != run:
        dropped.append(f"{name}it is of the run {shorten(answer.run)}, and this is {run}")
        return
    if one is None:
        is_old = 0 < number <= executions.number
        why = "its actuator was told something else since then" if is_old else "there is none"
        dropped.append(f"{name}{why}")
        return
    said = (answer.sender, _canonical(answer.value))
    heard = [before[1] for before in (one.tokened, one.plain) if before is not None]
    if one.answer not in (None, said[1]):
        dropped.append(f"{name}{one.actuator} has answered {shorten(str(one.answer))} already")
        return
    if one.is_open and said[1] not in heard:
        taken.append(MessageArrived(one.actuator, answer.value))
    executions.hear(one, tokened=said)


def _is_news(executions: Executions, message: MessageArrived, dropped: List[str]) -> bool:
    """Returns whether a message is new, and no duplicate of an answer with a token."""
    said = (message.sender, _canonical(message.value))
    one = executions.last.get(_canonical(message.source))
    if one is None:
        return True
    if message.sender and one.owed == message.sender:
        executions.hear(one, owed="")
        dropped.append(
            f"answer {shorten(message.value)} of {one.actuator} without a token: "
            f"{message.sender} has given it to the action before, with its token"
        )
        return False
    if one.is_held:
        return True
    if said[1] in (TIMEOUT, LOST) and not message.sender:
        return True  # the loop's own words
    executions.hear(one, plain=said)
    return one.tokened != said


def _canonical(text: str) -> str:
    """Returns a term as clingo prints it, and other texts unchanged: they are dropped later."""
    try:
        return canonical(text)
    except TermError:
        return text
