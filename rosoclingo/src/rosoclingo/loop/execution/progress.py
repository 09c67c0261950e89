"""Progress of a run: its plan, current step and horizon."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional, Set

from rosclingo.wire.commands import Result
from rosoclingo.loop.values.atoms import SAVE, Action, Plan


@dataclass
class Progress:
    """Progress of a run: the saved fields of :class:`.State` itself.

    Attributes:
        plan: The last plan found.
        shows_plan: Whether the plan's steps are those that are counted now.
        step: The current step: that of the last ``status_update`` or ``commit_actions``.
        horizon: The step T for which ``query(T)`` was made true last.
        result: The result of the last command, if that was a search.
        ended: Whether the loop is through with its work.
        planned: The horizon of the last plan since the planner was initialised; -1 without one.
        failures: How many searches in a row have found that there is no plan.
        visible: What of that which has to be seen, an answer set of the planner has shown.
        after_message: Whether a message was told since the last search.
        tries: How often it was looked for the reason why there is no plan, since there was one.
        held: The steps whose terminal statuses wait for the answers to their actions.
    """

    plan: Plan = field(default_factory=Plan)
    shows_plan: bool = False
    step: int = 0
    horizon: int = 0
    result: Optional[Result] = None
    ended: bool = False
    planned: int = -1
    failures: int = 0
    visible: Set[str] = field(default_factory=set)
    after_message: bool = False
    tries: int = 0
    held: List[int] = field(default_factory=list)
    _again: Optional[List[str]] = None  # what the planner is to begin with next
    _warned: Set[str] = field(default_factory=set)  # the kinds of what is said once

    def begin_with(self, events: List[str]) -> None:
        """Sets the events with which the planner begins when it is re-initialised."""
        self._again = events

    def saved(self) -> List[str]:
        """Returns the events ``event(save,F,0)`` that the planner is to begin with."""
        return [atom for atom in self._again or () if atom.startswith(SAVE)]

    @property
    def begins_again(self) -> bool:
        """Whether the planner is re-initialised next."""
        return self._again is not None

    def take_beginning(self) -> Optional[List[str]]:
        """Returns the events that the planner begins with, once; None if it begins anew."""
        again, self._again = self._again, None
        return again

    def begin_steps(self) -> None:
        """Resets the steps and the plan when the planner is initialised."""
        self.step = self.horizon = 0
        self.plan, self.shows_plan = Plan(), False
        self.planned, self.failures = -1, 0
        self.visible.clear()
        self.held.clear()

    def forget_steps(self) -> None:
        """Applies a reset: the current step becomes step 0, and the plan's steps are outdated."""
        self.held.clear()
        self.step = 0
        self.shows_plan = False

    def ahead(self) -> List[Action]:
        """Returns the actions of the plan from the current step up to the horizon.

        A plan may have more: after a reset, steps beyond the horizon are still grounded. The steps
        of a plan from before a reset are others.
        """
        if not self.shows_plan:
            return []
        actions = self.plan.actions_from(self.step)
        return [action for action in actions if action.step <= max(self.step, self.horizon)]

    def actions_left(self, step: int) -> int:
        """Returns how many steps the plan goes on after a step, until its last action."""
        return self.plan.last_actions(step, self.horizon) - step if self.shows_plan else 0

    def has_warned(self, kind: str) -> bool:
        """Whether a warning of a kind was logged, so that it is not logged again."""
        return kind in self._warned
