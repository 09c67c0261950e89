"""Finds the goals that an action serves in what the planning loop has published. Needs no ROS.

>>> board = ServedGoalsBoard()
>>> board.hear("a", 7, [ServedGoal(7, "1", "dish(t3)", "client-3")])
>>> board.find(Token("a", 7)), board.find(Token("a", 8), seconds=0.01)
((ServedGoal(number=7, slot='1', request='dish(t3)', goal_id='client-3', information=()),), None)
"""

from __future__ import annotations

import threading
from typing import Optional, Sequence, Tuple

from rosoclingo.loop.values.served import ServedGoal
from rosoclingo_interfaces.ledger import Token

_SECONDS_TO_HEAR = 2.0  # an action and its goals come on two topics, between which is no order


class ServedGoalsBoard:
    """The goals that the last actions serve, as the planning loop has published them. Thread-safe.

    Attributes:
        is_empty: Whether nothing has been published yet.
    """

    def __init__(self) -> None:
        self.is_empty = True
        self._changed = threading.Condition()  # guards the three below
        self._run = ""
        self._number = 0
        self._goals: Tuple[ServedGoal, ...] = ()

    def hear(self, run: str, number: int, goals: Sequence[ServedGoal]) -> None:
        """Takes a message.

        Args:
            run: The id of the run.
            number: That of the last action that is considered.
            goals: What the last actions serve.
        """
        with self._changed:
            self.is_empty = False
            self._run, self._number, self._goals = run, number, tuple(goals)
            self._changed.notify_all()

    def find(
        self, token: Token, seconds: float = _SECONDS_TO_HEAR
    ) -> Optional[Tuple[ServedGoal, ...]]:
        """Returns the goals that an action serves; waits until that has been published.

        Args:
            token: That of the action.
            seconds: Longest time to wait, of wall time.

        Returns:
            None if nothing is published in time.
        """
        with self._changed:
            if not self._changed.wait_for(
                lambda: self._run == token.run and self._number >= token.number, seconds
            ):
                return None
            return tuple(one for one in self._goals if one.number == token.number)
