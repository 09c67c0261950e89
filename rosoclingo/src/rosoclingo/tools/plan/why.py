"""Explains why ``plan.py`` has no plan."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import List, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.in_process.system import Request
from rosoclingo.loop.single.algorithm1 import last_step
from rosoclingo.loop.single.dialects import Dialect2, detect
from rosoclingo.loop.situation import Situation
from rosoclingo.why.answers import WhyNoPlan
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.question import Question, QuestionKind, WhyAnswer


def explain(
    situation: Situation, chosen: argparse.Namespace, lost: Sequence[Request]
) -> Tuple[List[WhyAnswer], List[str]]:
    """Says why goals are not reached, or why there is no plan at all.

    Args:
        situation: The situation in which that was so.
        chosen: The command line.
        lost: The goals that are not reached.

    Returns:
        The answers, and why there are no others.
    """
    asked = {slot for slot, _ in situation.goals}
    waiting = [g.slot for g in lost if g.slot in asked and not g.ended]
    questions = [Question(QuestionKind.GOAL, (slot,)) for slot in waiting if slot is not None]
    dialect = detect(chosen.options) if chosen.mode == SINGLE else Dialect2
    # Without --simulate, no actuator has had the time to answer.
    silent = tuple((actuator, seconds) for actuator, seconds in situation.silent if seconds > 0)
    situation = replace(situation, silent=silent)
    limit = last_step((*chosen.mode_options, *chosen.options.clingo))
    explainer = Explainer(
        chosen.options, situation.up_to(limit), dialect, seconds=chosen.why_seconds
    )
    answers: List[WhyAnswer] = []
    try:
        for question in questions or [Question()]:
            answer = question.answer(explainer)
            if questions or not _has_plan(answer):
                answers.append(answer)
    except RosclingoError as err:
        return answers, [f"why: {err}; --why-seconds {chosen.why_seconds:g}"]
    return answers, []


def _has_plan(answer: WhyAnswer) -> bool:
    """Returns whether there is a plan after all, so that goals have ended for another reason."""
    if not isinstance(answer, WhyNoPlan):
        return False
    return answer.plan is not None and answer.horizon is None
