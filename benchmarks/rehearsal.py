"""A run as the controller sees it, without a planner and a robot: for benchmarks of decisions."""

from __future__ import annotations

from typing import Optional

import clingo

from rosclingo.wire.commands import Result
from rosoclingo.loop.mode.controller import Info


class Rehearsal:
    """Simulates a run's infos for a controller.

    One goal comes after the other and takes some steps. Each step has one action, which succeeds.
    """

    STEPS_OF_A_GOAL = 3

    def __init__(self) -> None:
        """Begins before the first command."""
        self._step = self._horizon = self._committed = 0
        self._due = 0  # the step that ends the goal
        self._goal_is_new = False
        self._pending = self._news = self._ended = False
        self._result: Optional[Result] = None

    @property
    def info(self) -> Info:
        """The info for the next decision."""
        return Info(
            self._result,
            self._pending,
            self._news,
            self._ended,
            step=self._step,
            asked=self._horizon,
            planned_actions=self._step < self._due,
        )

    def carry_out(self, command: clingo.Symbol) -> bool:
        """Carries out a command.

        Returns:
            Whether the run goes on.
        """
        name, arguments = command.name, command.arguments
        step = arguments[0].number if arguments and name != "assign_external" else 0
        self._result = None
        if name == "assign_external" and str(arguments[1]) == "true":
            self._horizon = arguments[0].arguments[0].number
        elif name in ("query", "plan"):
            self._horizon = step
        if name in ("solve", "plan"):
            self._result = Result.SAT if self._horizon >= self._due else Result.UNSAT
        elif name == "assign_messages":
            if self._goal_is_new:
                self._due = step + self.STEPS_OF_A_GOAL
            self._news = self._goal_is_new = False
        elif name == "commit_actions":
            self._step = step
            if self._committed < step <= self._due:
                self._committed = step
                self._pending = True
        elif name == "status_update":
            self._step = step
            self._ended |= step == self._due
        elif name in ("reset", "forget"):
            self._due -= step
            self._horizon = max(0, self._due) if name == "forget" else self._horizon
            self._step = self._committed = 0
            self._ended = False
        elif name == "idle":
            self._goal_is_new = not self._pending
            self._pending = False
            self._news = True
        return name not in ("exit", "publish")
