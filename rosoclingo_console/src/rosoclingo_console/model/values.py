"""Values of the console: a planning node's messages, as far as rows are made of them.

>>> PlanAhead.read(1, 2, ["do(robot,go(2),1)", "expected(1,60)"]).actions
(PlannedAction(step=1, actuator='robot', action='go(2)'),)
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import NamedTuple, Sequence, Tuple

from rosclingo.wire.term_text import number, split_term
from rosoclingo.loop.values.plan_times import PlanTimes

_DO = "do"


class PlannedAction(NamedTuple):
    """An action of the plan ahead."""

    step: int
    actuator: str
    action: str


@dataclass
class PlanAhead:
    """The plan ahead, as ``~plan`` says it.

    Attributes:
        step: The current step.
        horizon: The last step.
        actions: From the current step on, ordered by step.
        times: When goals will be served and are due, and when actions begin and end.
    """

    step: int = 0
    horizon: int = 0
    actions: Tuple[PlannedAction, ...] = ()
    times: PlanTimes = field(default_factory=PlanTimes)

    @classmethod
    def read(cls, step: int, horizon: int, atoms: Sequence[str]) -> PlanAhead:
        """Reads ``do(Actuator,Action,Step)`` and the terms about times; skips all else."""
        actions = []
        for atom in atoms:
            name, arguments = split_term(atom)
            last = number(arguments[-1]) if arguments else None
            if last is None:
                continue
            if name == _DO and len(arguments) == 3:
                actions.append(PlannedAction(last, arguments[0], arguments[1]))
        ordered = tuple(sorted(actions, key=lambda one: one.step))
        return cls(step, horizon, ordered, PlanTimes.read(atoms))


class TokenRow(NamedTuple):
    """The last action of an actuator, as ``~dispatch`` says it."""

    number: int
    step: int
    actuator: str
    action: str
    is_open: bool
    is_aborted: bool


def quality_words(cost: Sequence[int], is_best: bool) -> str:
    """Returns what a plan costs, in words; nothing if that is not known."""
    text = " ".join(map(str, cost))
    return f"{text}, the best" if text and is_best else text


def read_quality(text: str) -> str:
    """Returns what a message of ``~plan_quality`` says, in words.

    Raises:
        ValueError: It says something else.
    """
    try:
        said = json.loads(text)
        return quality_words(list(map(int, said.get("cost", []))), said.get("optimal") is True)
    except (AttributeError, TypeError, ValueError, OverflowError, RecursionError) as err:
        raise ValueError(f"expected what a plan costs: {err}") from err
