"""The task of the process that answers questions: an encoding, a situation and a question."""

from __future__ import annotations

import os
import pickle
from dataclasses import dataclass
from typing import Optional

from rosclingo.errors import OutOfMemoryError, RosclingoError, report
from rosclingo.solver.memory import RESERVE
from rosclingo.solver.options import Options
from rosoclingo.errors import InterruptedQuestionError
from rosoclingo.loop.single.dialects import Dialect1, Dialect2, PaperDialect
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.snapshot import encode
from rosoclingo.why.answers import WhyGoal, WhyNoPlan
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.question import MORE_TIME, Question, ReplyStatus, WhyReply

_DIALECTS = {dialect.name: dialect for dialect in (Dialect2, Dialect1, PaperDialect)}


@dataclass(frozen=True)
class Encoding:
    """The encoding of a planner: its command line, directory and dialect.

    Attributes:
        options: Its command line; files have absolute paths, or begin in the directory.
        directory: Its working directory, where includes are looked for.
        dialect: The name of the encoding's dialect.
        limit: The last step that the mode plans for; None if there is none, or it is not known.
    """

    options: Options
    directory: str = "."
    dialect: str = Dialect2.name
    limit: Optional[int] = None


@dataclass(frozen=True)
class QuestionTask:
    """The input of the answering process: everything needed for an answer.

    Attributes:
        encoding: What the planner was started with.
        situation: What it was told.
        question: The question.
        seconds: How long the answer may take.
    """

    encoding: Encoding
    situation: Situation
    question: Question
    seconds: float


def answer(message: bytes) -> bytes:
    """Does a pickled task, and returns the reply as JSON; raises nothing."""
    try:
        task = pickle.loads(message)  # noqa: S301 (of the process that has started this one)
        os.chdir(task.encoding.directory)
        explainer = Explainer(
            task.encoding.options,
            task.situation.up_to(task.encoding.limit),
            _DIALECTS[task.encoding.dialect],
            seconds=task.seconds,
        )
        found = task.question.answer(explainer)
        is_late = isinstance(found, (WhyNoPlan, WhyGoal)) and not found.is_finished
        reply = WhyReply(ReplyStatus.ANSWERED, found.text, encode(found), is_late)
    except InterruptedQuestionError as err:
        text = f"{err} within {task.seconds:g} s; {MORE_TIME}"
        reply = WhyReply(ReplyStatus.UNANSWERED, text, is_late=True)
    except (OutOfMemoryError, MemoryError) as err:
        RESERVE.free()
        reason = f"the copy of the planner: {str(err) or 'out of memory'}"
        reply = WhyReply(ReplyStatus.UNANSWERED, reason)
    except RosclingoError as err:
        reply = WhyReply(ReplyStatus.WRONG, str(err))
    except Exception as err:  # a bug, or clingo's; the next question may have an answer
        reply = WhyReply(
            ReplyStatus.UNANSWERED, f"internal error: {report(err, 'in a question')!r}"
        )
    return reply.encode()
