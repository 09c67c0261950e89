"""Simulated answers of actuators, for ``fulfill.py`` and simulations."""

from __future__ import annotations

import random
import re
from dataclasses import dataclass, field
from typing import Dict, List, Optional, Pattern, Sequence

from rosoclingo.loop.words import FAILURE, SUCCESS

NO_ANSWER = "none"
ANSWERS = (SUCCESS, FAILURE, NO_ANSWER)

_NOTHING = re.compile(r"(?!)")


@dataclass
class Answers:
    """Chooses the answer to each action, for each actuator apart and reproducibly.

    The first of these that applies decides: ``sequence``, ``no_answer``, ``fail``,
    ``fail_probability``.

    Attributes:
        sequence: Answers to an actuator's first actions.
        no_answer: Actions that are never answered, where the expression is found in them.
        fail: Actions that fail, where the expression is found in them.
        fail_probability: How probable it is that one of the other actions fails, 0 to 1.
        seed: Start of the random numbers.
    """

    sequence: Sequence[str] = ()
    no_answer: Pattern[str] = _NOTHING
    fail: Pattern[str] = _NOTHING
    fail_probability: float = 0.0
    seed: int = 0
    _rest: Dict[str, List[str]] = field(default_factory=dict, init=False)
    _random: Dict[str, random.Random] = field(default_factory=dict, init=False)

    def next(self, actuator: str, action: str) -> Optional[str]:
        """Returns the answer to an actuator's next action, or None for none at all."""
        rest = self._rest.setdefault(actuator, list(self.sequence))
        if rest:
            word = rest.pop(0)
            return None if word == NO_ANSWER else word
        if self.no_answer.search(action):
            return None
        if self.fail.search(action):
            return FAILURE
        dice = self._random.setdefault(actuator, random.Random(f"{self.seed} {actuator}"))  # noqa: S311
        return FAILURE if dice.random() < self.fail_probability else SUCCESS
