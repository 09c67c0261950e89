"""The register of executions: what each actuator does, has answered, and was told before.

A published action is entered once, with its token, and its answer once:

>>> executions = Executions(Environment())
>>> executions.begin(Action("robot", "go(3)", 1))
>>> executions.pending_actions, executions.end("robot", "success").action
(True, 'go(3)')
>>> executions.pending_actions, executions.last["robot"].answer
(False, 'success')
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import Callable, Dict, Iterator, List, Optional, Set, Tuple

from rosoclingo.loop.planner.demand import Pair
from rosoclingo.loop.values.atoms import Action, event
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.words import ABORT, BUSY

# How many answers are kept: interfaces repeat those that they have given last.
_LEAST_ANSWERS = 12
_ANSWERS_OF_EACH = 4


@dataclass
class ExecutionsState:
    """Saved state of :class:`Executions`.

    Attributes:
        run: The id of the run, which it keeps when it goes on after a restart.
        number: That of the last action.
        last: The last execution of each actuator, by the actuator.
        published: The actions that were published since the last reset.
        told: By actuators whose action is held, the one before, which they were told last; its
            answer is not awaited any more.
        answers: The answers that were taken last, by the numbers of their actions.
        clock: What time it was when this was saved, in seconds of the environment's clock.
        rejected: When an operator is asked again about an action that was rejected, in seconds of
            the same clock, by actuator and action.
    """

    run: str = field(default_factory=lambda: os.urandom(16).hex())
    number: int = 0
    last: Dict[str, Execution] = field(default_factory=dict)
    published: Set[Action] = field(default_factory=set)
    told: Dict[str, Execution] = field(default_factory=dict)
    answers: Dict[int, str] = field(default_factory=dict)
    clock: float = 0.0
    rejected: Dict[Tuple[str, str], float] = field(default_factory=dict)


class Executions(ExecutionsState):
    """The register of executions: who acts in the current step, and what was published.

    Used by the loop's thread, and by the callback that polls whether its search is to stop.

    Attributes:
        changed: Whether an execution has begun, was aborted or answered, and that was not shown.
    """

    def __init__(
        self, environment: Environment, can_be_busy: Callable[[str], bool] = lambda _: False
    ) -> None:
        """Starts without executions.

        Args:
            environment: Where the clocks are.
            can_be_busy: Whether an actuator's action may go on in the next step; may ask the
                planner.
        """
        super().__init__()
        self.changed = False
        self._environment = environment
        self._can_be_busy = can_be_busy

    def snapshot(self) -> ExecutionsState:
        """Returns the state to save."""
        self.clock = self._environment.now()
        return self

    def restore(self) -> None:
        """Goes on with a state that was taken over, which had another clock.

        Raises:
            ValueError: An execution is filed under another actuator.
        """
        passed = self._environment.now() - self.clock
        self.rejected = {key: ask_at + passed for key, ask_at in self.rejected.items()}
        for actuator, one in list(self.last.items()):
            if actuator != one.actuator:
                raise ValueError(f"an execution of {one.actuator} is filed under {actuator}")
            self._set(
                one,
                began=one.began + passed,
                reminded=one.reminded + passed,
                retry_at=one.retry_at + passed,
            )

    def _set(self, one: Execution, **changes: object) -> None:
        self.last[one.actuator] = replace(one, **changes)  # type: ignore[arg-type]

    # One execution, from its publication to its answer.

    @property
    def ordered(self) -> List[Execution]:
        """The last execution of each actuator, ordered by number."""
        return sorted(self.last.values(), key=lambda one: one.number)

    @property
    def dispatched(self) -> List[Execution]:
        """The last executions of which actuators have been told, ordered by number."""
        told = {**self.told, **{who: one for who, one in self.last.items() if not one.is_held}}
        return sorted(told.values(), key=lambda one: one.number)

    @property
    def held(self) -> List[Execution]:
        """The executions that are held back, without those that were rejected."""
        return [one for one in self.ordered if one.is_held and one.is_open and not one.is_rejected]

    def acting(self, actuator: str) -> Optional[Execution]:
        """Returns the execution of an actuator that acts in the step, or has answered in it."""
        one = self.last.get(actuator)
        return one if one is not None and one.acts else None

    def begin(
        self,
        action: Action,
        kind: str = "",
        seconds: int = 0,
        *,
        retries: Tuple[int, int] = (0, 0),
        is_held: bool = False,
    ) -> None:
        """Enters an action that is about to be published, with its token.

        Args:
            action: The action.
            kind: What the encoding calls such actions, if it says how long they take.
            seconds: How long that is.
            retries: How often it is tried again after a failure, and after how many seconds.
            is_held: Whether it is published later, with :meth:`dispatch`.
        """
        self.published.add(action)
        before = self.last.get(action.actuator)
        if is_held and before is not None and not before.is_held:
            self.told[action.actuator] = replace(before, answer=before.answer or "")
        self.last[action.actuator] = Execution(
            0,
            action.step,
            action.actuator,
            action.name,
            kind=kind,
            seconds=seconds,
            retries=retries[0],
            pause=retries[1],
        )
        self._number(action.actuator, is_held=is_held)

    def dispatch(self, actuator: str) -> None:
        """Enters that an action is about to be published that was held: it begins now."""
        self._number(actuator, is_held=False)

    def _number(self, actuator: str, *, is_held: bool) -> None:
        """Gives an actuator's action its number and its times, from now on."""
        self.number += 1
        now = self._environment.now()
        self._set(
            self.last[actuator],
            number=self.number,
            began=now,
            world_began=self._environment.world_now(),
            reminded=now,
            is_timed=not is_held,  # if it is rejected, it has taken no time
            is_enqueued=False,
            is_held=is_held,
            held_as=self.number if is_held else self.last[actuator].held_as,
        )
        self.changed = True

    # What an operator decides of one that is held, and what becomes of it without its goal.

    def approve(self, actuator: str) -> None:
        """Enters that an operator has approved an action that is held."""
        self._set(self.last[actuator], is_approved=True)
        one = self.last[actuator]
        self.rejected.pop((actuator, one.action), None)

    def reject(self, actuator: str, seconds: float) -> None:
        """Enters that an operator has rejected an action that is held.

        Args:
            actuator: Whose action it is.
            seconds: In how many seconds it may be asked for again, if nothing changes before.
        """
        self.fail_held(actuator)
        self.rejected[actuator, self.last[actuator].action] = self._environment.now() + seconds

    def fail_held(self, actuator: str) -> None:
        """Enters that an action which is held counts as failed, whatever an operator says later."""
        self._set(self.last[actuator], is_rejected=True)

    def forget_rejections(self) -> None:
        """Says that something has changed: what was rejected may be asked for again."""
        self.rejected.clear()

    def open_to_change(self) -> List[Action]:
        """Lets the next plan do without what is held, and returns it as it was published.

        What has been begun before, and is to be tried again or goes on over steps, stays.
        """
        free = [one for one in self.held if one.acts and one.attempt == 1 and not one.goes_on]
        free = [one for one in free if not one.is_busy]
        for one in free:
            self.published.discard(one.published)
            self._set(one, is_open_to_change=True)
        return [one.published for one in free]

    def plan_again(self, action: Action) -> bool:
        """Enters an action of a new plan that is held already, and returns whether it is."""
        one = self.last.get(action.actuator)
        if one is None or not one.is_open_to_change or one.action != action.name:
            return False
        self.published.add(action)
        self._set(one, is_open_to_change=False, step=action.step, acts=True)
        return True

    def withdraw(self, actuator: str) -> None:
        """Forgets an action that is held: its actuator was not told of it."""
        del self.last[actuator]
        self.changed = True

    def retry(self, actuator: str, answer: str, pause: float) -> None:
        """Enters that an action has failed and is held, to be dispatched again after a pause.

        Args:
            actuator: Whose action it is.
            answer: The answer to its last attempt.
            pause: How long that is, in seconds.
        """
        one = self.last[actuator]
        self.record_answer(one.number, answer)
        self.told[actuator] = replace(one, answer=answer)
        self.published -= {
            action
            for action in self.published
            if (action.actuator, action.name) == (actuator, ABORT)
        }
        self._set(
            one,
            aborted=False,
            is_enqueued=False,
            is_held=True,
            attempt=one.attempt + 1,
            held_as=one.number,
            pauses=True,
            retry_at=self._environment.now() + pause,
        )
        self.changed = True

    def end_pause(self, actuator: str) -> None:
        """Ends the pause before an action's next attempt, if there is one."""
        one = self.last.get(actuator)
        if one is not None and one.pauses:
            self._set(one, pauses=False)

    def record_answer(self, number: int, answer: str) -> None:
        """Records the first answer to an action; those to actions of long ago are forgotten."""
        self.answers.setdefault(number, answer)
        while len(self.answers) > max(_LEAST_ANSWERS, _ANSWERS_OF_EACH * len(self.last)):
            del self.answers[next(iter(self.answers))]

    def end(self, actuator: str, answer: str, outcome: str = "") -> Optional[Execution]:
        """Enters the answer to an actuator's action, if it owes one.

        Args:
            actuator: Who has answered, if it is an actuator at all.
            answer: What it has said.
            outcome: The same as the planner is told it.

        Returns:
            The execution without its answer; None if it had one, or is no part of the step.
        """
        one = self.last.get(actuator)
        if one is None or not one.is_open:
            return None
        self.record_answer(one.number, answer)
        self._set(one, answer=answer, outcome=outcome or answer)
        self.changed = True
        if not one.is_held:  # elsewhere, or later, it may be right
            self.rejected = {key: at for key, at in self.rejected.items() if key[0] != actuator}
        return one if one.acts else None

    def can_be_aborted(self, actuator: str) -> bool:
        """Returns whether an unanswered action may last beyond the step; may ask the planner."""
        one = self.acting(actuator)
        return one is not None and one.is_open and self._can_be_busy(actuator)

    def abort(self, actuator: str, step: int) -> bool:
        """Requests the abort of an actuator's action, which it is told once in a step.

        Returns:
            Whether it is still to be told.
        """
        abort = Action(actuator, ABORT, step)
        owed = [one for one in self.last.values() if one.actuator == actuator and one.is_open]
        if abort in self.published or any(one.aborted for one in owed):
            return False
        self.published.add(abort)
        for one in owed:
            self._set(one, aborted=True)
            self.changed = True
        return True

    def interrupt(self) -> None:
        """Excludes open executions from learning: their answers may come late after a restart."""
        for one in self.last.values():
            if one.is_open:
                self._set(one, is_timed=False)

    # Whether the step is over.

    @property
    def pending_actions(self) -> bool:
        """Tells whether the step waits for an actuator's answer; may ask the planner."""
        return self.is_awaited and not self.is_over

    @property
    def leaves_some_busy(self) -> bool:
        """Tells whether the step may end while some actuators act on; may ask the planner."""
        return self.is_awaited and self.is_over

    @property
    def is_over(self) -> bool:
        """Tells whether the step may end: one actuator is through, and all others may act on."""
        is_through = any(not _is_awaited(one) for one in self._of_step)
        return is_through and self.can_all_act_on

    @property
    def can_all_act_on(self) -> bool:
        """Tells whether all may act on who have not answered yet; may ask the planner."""
        return all(self._can_be_busy(one.actuator) for one in self._awaited)

    @property
    def is_awaited(self) -> bool:
        """Tells whether the answer of an actuator is missing that is not known to act on."""
        return any(self._awaited)

    @property
    def awaits_begun(self) -> bool:
        """Tells the same of those whose actions have begun, or count as failed."""
        return any(not one.is_held or one.is_rejected for one in self._awaited)

    @property
    def _of_step(self) -> Iterator[Execution]:
        return (one for one in self.last.values() if one.acts)

    @property
    def _awaited(self) -> Iterator[Execution]:
        return filter(_is_awaited, self._of_step)

    @property
    def keeps_answers(self) -> bool:
        """Tells whether an answer has come that the planner learns only in the next step."""
        return any(one.is_busy and not one.is_open for one in self._of_step)

    # From step to step.

    def initialize(self, *, keep: bool) -> None:
        """Resets the step when the planner is initialised.

        Args:
            keep: Whether those who were busy before the current step are so again.
        """
        self._go_on(
            lambda one: keep and one.goes_on and (one.is_busy or one.is_open), is_busy=True
        )  # fmt: skip
        self._forget_held()
        self.published.clear()

    def end_step(self, step: int) -> List[str]:
        """Marks the actuators as busy that have not answered and can be busy.

        Returns:
            The events that say so.
        """
        busy = [one for one in self.ordered if one.acts and _is_awaited(one)]
        busy = [one for one in busy if self._can_be_busy(one.actuator)]
        for one in busy:
            self._set(one, is_busy=True)
        return [event(one.actuator, BUSY, step) for one in busy]

    def begin_step(self) -> List[Pair]:
        """Begins a step, in which only the busy actuators of the step before go on.

        Returns:
            Who has answered already, and what.
        """
        self._go_on(lambda one: one.is_busy, is_busy=False)
        return [
            (one.actuator, one.outcome)
            for one in self.ordered
            if one.acts and one.outcome is not None
        ]

    def reset(self) -> None:
        """Applies a reset: no actuator acts in step 0, and the busy ones go on in step 1."""
        self._go_on(lambda one: one.is_busy, is_busy=True)
        self._forget_held()
        self.published.clear()

    def _forget_held(self) -> None:
        """Forgets held actions that are no part of the plan any more, which is made anew."""
        for one in self.held:
            if not (one.acts or one.is_open_to_change):
                del self.last[one.actuator]

    def _go_on(self, goes_on: Callable[[Execution], bool], *, is_busy: bool) -> None:
        for one in [*self._of_step]:
            acts = goes_on(one)
            self._set(one, acts=acts, goes_on=acts, is_busy=acts and is_busy)

    # Who does not answer.

    @property
    def silent(self) -> List[Execution]:
        """The executions with an awaited answer, ordered by number."""
        return [one for one in self.dispatched if one.acts and one.is_open and not one.is_enqueued]

    @property
    def retrying(self) -> List[Execution]:
        """The executions that pause before the next attempt, ordered by number."""
        return [one for one in self.held if one.pauses and not one.is_enqueued]

    def mark_enqueued(self, actuator: str) -> None:
        """Enters that an actuator's timeout, or the end of its pause, is in the inbox."""
        self._set(self.last[actuator], is_enqueued=True)

    def late(self, seconds: float) -> List[Tuple[str, float]]:
        """Returns the actuators without an answer, and for how many seconds they were told to act.

        Args:
            seconds: Longest silence; each actuator is returned again after so much more of it.
        """
        now = self._environment.now()
        late = [one for one in self.silent if now - one.reminded >= seconds]
        for one in late:
            self._set(one, reminded=now)
        return [(one.actuator, now - one.began) for one in late]


def _is_awaited(one: Execution) -> bool:
    """Returns whether an action is unanswered, and not known to last beyond the step."""
    return one.is_open and not one.is_busy
