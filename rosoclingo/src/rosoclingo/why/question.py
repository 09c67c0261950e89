"""A question as it is sent, to the node or to the answering process, and the reply.

>>> str(read("if", ["goal:visit(2)", "info:close(4)"]))
'if goal:visit(2), info:close(4)'
>>> read("goal", [])
Traceback (most recent call last):
  ...
rosoclingo.errors.QuestionError: goal needs one argument: the slot or the request of a goal
"""

from __future__ import annotations

import enum
import json
from dataclasses import dataclass
from typing import Mapping, Sequence, Tuple, Union

from rosclingo.errors import shorten
from rosoclingo.errors import QuestionError
from rosoclingo.why.answers import Contrast, Happened, WhatIf, WhyGoal, WhyNoPlan
from rosoclingo.why.explainer import Explainer

WhyAnswer = Union[WhyNoPlan, WhyGoal, Contrast, WhatIf, Happened]


class QuestionKind(enum.Enum):
    """The kinds of questions; the values are words on the wire and of command lines."""

    PLAN = "plan"  # why is there none?
    GOAL = "goal"  # why does it wait, or fail?
    ACTION = "action"  # why is it in the plan?
    INSTEAD = "instead"  # why is it not in the plan?
    IF = "if"  # what would be?
    HAPPENED = "happened"  # how did an action go, and why?


_ARGUMENTS = {
    QuestionKind.GOAL: "the slot or the request of a goal",
    QuestionKind.ACTION: "an action, such as do(mailbot,go(c3),4)",
    QuestionKind.INSTEAD: "an action, such as do(mailbot,go(c3),4)",
    QuestionKind.HAPPENED: "an action, such as go(c3) or do(mailbot,go(c3))",
}


@dataclass(frozen=True)
class Question:
    """A question.

    Attributes:
        kind: The kind of the question.
        arguments: What it is asked about; for ``if``, one event or more.
    """

    kind: QuestionKind = QuestionKind.PLAN
    arguments: Tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.kind.value} {', '.join(self.arguments)}".strip()

    def by_request(self, goals: Mapping[str, str]) -> Question:
        """Returns the same question, with the request of a goal that is given by its slot.

        Args:
            goals: The requests of the open goals, by their slots.
        """
        if self.kind is not QuestionKind.GOAL:
            return self
        return Question(self.kind, tuple(goals.get(name, name) for name in self.arguments))

    def answer(self, explainer: Explainer) -> WhyAnswer:
        """Dispatches the question to an explainer's method, whose errors pass.

        What has happened needs no explainer: see :func:`.happened.happened`.
        """
        if self.kind is QuestionKind.PLAN:
            return explainer.no_plan()
        if self.kind is QuestionKind.IF:
            return explainer.what_if(self.arguments)
        (name,) = self.arguments
        if self.kind is QuestionKind.GOAL:
            return explainer.goal(name)
        return explainer.why(name) if self.kind is QuestionKind.ACTION else explainer.why_not(name)


def read(kind: str, arguments: Sequence[str]) -> Question:
    """Reads a question.

    Args:
        kind: The value of a :class:`QuestionKind`.
        arguments: What it is asked about.

    Raises:
        QuestionError: There is no such kind, or its arguments are too few or too many.
    """
    words = [kind.value for kind in QuestionKind]
    if kind not in words:
        raise QuestionError(f"{shorten(kind)!r} is no question; there are {', '.join(words)}")
    question = Question(QuestionKind(kind), tuple(arguments))
    if question.kind is QuestionKind.PLAN and arguments:
        raise QuestionError(f"{kind} takes no argument: {shorten(', '.join(arguments))}")
    if question.kind is QuestionKind.IF and not arguments:
        raise QuestionError(f"{kind} needs events, such as goal:visit(2), cancel:1, info:close(5)")
    if question.kind in _ARGUMENTS and len(arguments) != 1:
        raise QuestionError(f"{kind} needs one argument: {_ARGUMENTS[question.kind]}")
    return question


MORE_TIME = (
    "~why_seconds gives it more time, and a smaller ~why_nice than 19 more of that on a machine "
    "that is busy"
)
"""The remedy for an answer that took too long."""


class ReplyStatus(enum.Enum):
    """The statuses of replies; the values are exit statuses of ``why.py``, too."""

    ANSWERED = 0
    UNANSWERED = 1  # there was no time or memory, or the node is shutting down
    WRONG = 2  # it names what there is not, or nothing can be said of this encoding


@dataclass(frozen=True)
class WhyReply:
    """The reply to a question.

    Attributes:
        status: What has become of it.
        text: The answer in sentences; or why there is none.
        structure: The answer as JSON, with its atoms and plans; empty if there is none.
        is_late: Whether there was no time for an answer, or only for a part of the reason.
    """

    status: ReplyStatus
    text: str
    structure: str = ""
    is_late: bool = False

    def encode(self) -> bytes:
        """Encodes the reply, for :func:`read_reply`."""
        values = [self.status.value, self.text, self.structure, self.is_late]
        return json.dumps(values).encode()


def read_reply(message: bytes) -> WhyReply:
    """Reads a reply.

    Raises:
        ValueError: It is none.
    """
    status, text, structure, is_late = json.loads(message)
    return WhyReply(ReplyStatus(status), str(text), str(structure), bool(is_late))
