"""Tracks the actuators of a step: which act, have answered, or stay busy in the next step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Tuple

from rosoclingo.loop.atoms import event
from rosoclingo.loop.demand import Pair
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.externals import PlannerExternals
from rosoclingo.loop.words import BUSY


@dataclass(frozen=True)
class Actor:
    """An actuator that acts in the current step.

    Attributes:
        began: When, in seconds of the environment's clock; in a snapshot, of one that stands at 0
            then.
        reminded: When its silence was logged last, likewise.
        is_overdue: Whether it has timed out.
        answer: What it has answered.
        goes_on: Whether it was busy in the step before.
        is_busy: Whether it is busy in this step, so that its answer belongs to the next one.
    """

    began: float
    reminded: float
    is_overdue: bool = False
    answer: Optional[str] = None
    goes_on: bool = False
    is_busy: bool = False

    def since(self, time: float) -> Actor:
        """Returns the same with seconds since a time."""
        return replace(self, began=self.began - time, reminded=self.reminded - time)


class Acting:
    """The actuators that act in the current step.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.
    """

    def __init__(self, externals: PlannerExternals, environment: Environment) -> None:
        """Starts without actuators.

        Args:
            externals: What the planner's encoding knows: it says who can be busy.
            environment: Where the clock is.
        """
        self._externals = externals
        self._environment = environment
        self._actors: Dict[str, Actor] = {}

    def snapshot(self) -> Dict[str, Actor]:
        """Returns the state to save: the acting actuators by their ids."""
        now = self._environment.now()
        return {actuator: one.since(now) for actuator, one in self._actors.items()}

    def restore(self, saved: Dict[str, Actor]) -> None:
        """Restores the acting actuators of a run that was interrupted."""
        now = self._environment.now()
        self._actors = {actuator: one.since(-now) for actuator, one in saved.items()}

    # Whether the step is over.

    @property
    def pending_actions(self) -> bool:
        """Whether the step has to wait for an actuator's answer; may ask the planner."""
        return bool(self._awaited) and not self.is_over

    @property
    def leaves_some_busy(self) -> bool:
        """Whether the step may end although an actuator has not answered; may ask the planner."""
        return bool(self._awaited) and self.is_over

    @property
    def is_over(self) -> bool:
        """Whether the step may end: an actuator is through with it, and all others can be busy."""
        is_through = len(self._awaited) < len(self._actors)
        return is_through and all(self._externals.declares(a, BUSY) for a in self._awaited)

    @property
    def is_awaited(self) -> bool:
        """Whether an actuator that is not known to be busy has still to answer."""
        return bool(self._awaited)

    @property
    def _awaited(self) -> List[str]:
        """The actuators without an answer that are not known to be busy."""
        return [a for a, one in self._actors.items() if one.answer is None and not one.is_busy]

    @property
    def keeps_answers(self) -> bool:
        """Whether a busy actuator has answered, which the planner is told in the next step."""
        return any(one.is_busy and one.answer is not None for one in self._actors.values())

    # Who acts.

    def actor(self, actuator: str) -> Optional[Actor]:
        """Returns an actuator that acts in the current step, or has answered in it."""
        return self._actors.get(actuator)

    def goes_on(self, actuator: str) -> bool:
        """Whether an actuator was busy in the step before, so that it is told nothing new."""
        one = self._actors.get(actuator)
        return one is not None and one.goes_on

    def can_be_aborted(self, actuator: str) -> bool:
        """Whether an actuator that can be busy has not answered; may ask the planner."""
        one = self._actors.get(actuator)
        acts = one is not None and one.answer is None
        return acts and self._externals.declares(actuator, BUSY)

    def begin_action(self, actuator: str) -> None:
        """Notes that an actuator was told to act, and forgets its answer to the action before."""
        now = self._environment.now()
        self._actors[actuator] = Actor(now, now)

    def answer(self, actuator: str, value: str) -> None:
        """Notes the answer of an actuator that acts."""
        self._actors[actuator] = replace(self._actors[actuator], answer=value)

    # From step to step.

    def begin(self, *, keep: bool) -> None:
        """Resets the actuators when the planner is initialised.

        Args:
            keep: Whether those who were busy before the current step are so again.
        """
        self._actors = {
            actuator: replace(one, is_busy=True)
            for actuator, one in self._actors.items()
            if keep and one.goes_on and (one.is_busy or one.answer is None)
        }

    def end_step(self, step: int) -> List[str]:
        """Marks the actuators as busy that have not answered and can be busy.

        Returns:
            The events that say so.
        """
        busy = [a for a in self._awaited if self._externals.declares(a, BUSY)]
        for actuator in busy:
            self._actors[actuator] = replace(self._actors[actuator], is_busy=True)
        return [event(actuator, BUSY, step) for actuator in busy]

    def begin_step(self) -> List[Pair]:
        """Begins a step, in which only the busy actuators of the step before go on.

        Returns:
            Who has answered already, and what, as far as the planner can be told.
        """
        self._keep_busy(is_busy=False)
        answers = [(a, one.answer) for a, one in self._actors.items() if one.answer is not None]
        return [pair for pair in answers if self._externals.knows([pair])]

    def reset(self) -> None:
        """Applies a reset: nobody acts in step 0, and the busy actuators go on in step 1."""
        self._keep_busy(is_busy=True)

    def _keep_busy(self, *, is_busy: bool) -> None:
        self._actors = {
            actuator: replace(one, goes_on=True, is_busy=is_busy)
            for actuator, one in self._actors.items()
            if one.is_busy
        }

    # Who does not answer.

    def silent(self) -> List[Tuple[str, float]]:
        """Returns the actuators without an answer, and for how many seconds they were told to act.

        One whose time is over is none of them.
        """
        now = self._environment.now()
        return [(actuator, now - one.began) for actuator, one in self._silent()]

    def overdue(self, seconds: float) -> List[str]:
        """Returns the actuators that have timed out after so many seconds, once for each action."""
        now = self._environment.now()
        late = {name: one for name, one in self._silent() if now - one.began >= seconds}
        for name, one in late.items():
            self._actors[name] = replace(one, is_overdue=True)
        return list(late)

    def late(self, seconds: float) -> List[Tuple[str, float]]:
        """Returns the actuators without an answer, and for how many seconds they were told to act.

        Args:
            seconds: Longest silence; each actuator is returned again after so much more of it.
        """
        now = self._environment.now()
        late = []
        for actuator, one in self._silent():
            if now - one.reminded >= seconds:
                self._actors[actuator] = replace(one, reminded=now)
                late.append((actuator, now - one.began))
        return late

    def _silent(self) -> List[Tuple[str, Actor]]:
        return [
            (actuator, one)
            for actuator, one in self._actors.items()
            if one.answer is None and not one.is_overdue
        ]
