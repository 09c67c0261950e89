"""Discrete-event simulation of a system: actions take a while, and inputs come as scheduled.

>>> from rosclingo.solver.options import Options
>>> from rosoclingo.in_process.inputs import read_input
>>> from rosoclingo.in_process.parts import EXAMPLES, make_parts
>>> parts = make_parts("dynamic.incremental.recording", Options((f"{EXAMPLES}/line.lp",)))
>>> inputs = [read_input("goal:visit(3)"), read_input("robot:failure", "1")]
>>> simulation = SimulatedSystem(parts.loop, inputs)
>>> simulation.run()
>>> [action for _, action in simulation.published], simulation.clock
(['go(2)', 'go(2)', 'go(3)'], 3.0)
"""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from rosclingo.errors import RosclingoError
from rosoclingo.in_process.answers import Answers
from rosoclingo.in_process.inputs import AFTER, IN, STEP, Input
from rosoclingo.in_process.system import System
from rosoclingo.loop.loop import Loop
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.arrivals import PlanTime
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.ids import CANCEL, GOAL
from rosoclingo.loop.values.plan_times import PlanTimes
from rosoclingo.loop.waiting import LOOK_SECONDS
from rosoclingo.loop.words import ABORT, SOLVER, SUCCESS

AnswerFunction = Callable[[str, str], Optional[str]]
"""Returns the answer to an actuator's action, or None for none at all."""

Seconds = Callable[[str, str], Optional[float]]
"""Returns how long an actuator's action takes, in seconds; None for as long as the plan says."""


class SimulatedSystem(System):
    """A system with actuators that answer after a while, and inputs at given moments.

    Whenever the loop waits, the next thing happens: first the inputs of the step, then the answers
    that are due next. A message from an actuator that acts is its answer: in a step, when that is
    due; in or after a command, at once. When nothing else is left, inputs of later steps come;
    those of commands that are never given are left.

    Attributes:
        commands: How many commands were begun.
        left: The inputs that have not come.
        strange: The inputs that make no sense, in words.
        is_too_long: Whether it has ended because there were too many steps.
        plan_times: The times that were said with each plan, with when, in seconds of the clock.
        situation: The last one in which there was no plan; see :meth:`take_situation`.
    """

    def __init__(
        self,
        make: Callable[..., Loop],
        inputs: Sequence[Input] = (),
        answer: Optional[AnswerFunction] = None,
        *,
        seconds: Seconds = lambda actuator, action: 1.0,
        most_steps: int = 1000,
        action_timeout: float = 0.0,
        improves: bool = True,
        **parameters: Any,
    ) -> None:
        """Makes the loop, which runs by :meth:`run`.

        Args:
            make: Makes a loop of its inbox and environment, such as :meth:`.parts.Parts.loop`.
            inputs: What comes from outside.
            answer: Says how actions end; by default all succeed.
            seconds: Says how long actions take.
            most_steps: The run is over when so many steps have begun.
            action_timeout: From when on an action without an answer counts as failed, or as timed
                out where the encoding knows that, in seconds; 0 for never.
            improves: Whether a better plan is looked for while actuators act, however long that
                takes, since no time goes by meanwhile.
            parameters: Further arguments for the loop.
        """
        self.commands = 0
        self.left: List[Input] = list(inputs)
        self.strange: List[str] = []
        self.is_too_long = False
        self.situation: Optional[Situation] = None
        self._answer = answer or Answers().next
        self._seconds = seconds
        self._most_steps = most_steps
        self._is_patient = action_timeout == 0
        self.plan_times: List[Tuple[float, PlanTimes]] = []
        self._due: Dict[str, float] = {}  # when those who act answer
        self._answers: Dict[str, str] = {}
        super().__init__(make, action_timeout=action_timeout, **parameters)
        self.improves = improves
        self.loop.state.planner.is_awaited = not improves
        self._come([one for one in self.left if (one.moment.kind, one.moment.number) == (STEP, 0)])

    def turn(self) -> bool:
        """Advances to the next event, if there is one."""
        self.is_too_long = self.elapsed >= self._most_steps
        if self.is_too_long:
            return False
        by_step = [one for one in self.left if one.moment.kind == STEP]
        inputs = [one for one in by_step if one.moment.number <= self.elapsed]
        if not (inputs or self._due):
            first = min((one.moment.number for one in by_step), default=None)
            inputs = [one for one in by_step if one.moment.number == first]
        if inputs:
            self._come(inputs)
            return True
        return self._pass()

    def _duration(self, actuator: str, action: str) -> float:
        """Returns how long an action takes, in seconds: 1 if nothing is said."""
        seconds = self._seconds(actuator, action)
        if seconds is None:
            execution = self.loop.state.executions.last.get(actuator)
            seconds = (execution.seconds if execution is not None else 0) or 1.0
        return seconds

    def _pass(self) -> bool:
        """Advances the clock to the next answer, or the loop's next check of silent actuators."""
        moments = [*self._due.values(), *self.own_moments()]
        if not self._is_patient and self.loop.state.executions.silent:
            moments.append(self.clock + LOOK_SECONDS)
        if not moments:
            return False
        self.clock = min(moments)
        for actuator in [one for one, due in self._due.items() if due <= self.clock]:
            self.answer(actuator, self._answers[actuator])
        return True

    @property
    def silent(self) -> List[str]:
        """The actuators that act and will never answer."""
        return [actuator for actuator in self.acting if actuator not in self._due]

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        """Remembers the situation; when the loop has ended, no goal is open any more."""
        self.situation = Situation.of(self.loop.state)

    def take_situation(self, failure: Optional[RosclingoError]) -> None:
        """Remembers the situation at the end, unless there was one without a plan.

        There is none if the loop has ended by itself, or if an actuator has to answer.

        Args:
            failure: Why it has ended by itself.
        """
        if self.situation is None and failure is None and not (self.silent or self.is_too_long):
            self.situation = Situation.of(self.loop.state)

    def show_plan(
        self,
        step: int,
        horizon: int,
        actions: Sequence[Action],
        times: Sequence[PlanTime] = (),
    ) -> None:
        """Remembers the times of the plan."""
        self.plan_times.append((self.clock, PlanTimes.read(map(str, times))))

    def publish(self, actuator: str, action: str) -> None:
        """Starts a simulated action, and decides now how it ends."""
        super().publish(actuator, action)
        if actuator == SOLVER or action == ABORT:
            return
        answer = self._answer(actuator, action)
        self._due.pop(actuator, None)
        if answer is not None:
            self._due[actuator] = self.clock + self._duration(actuator, action)
            self._answers[actuator] = answer

    def answer(self, actuator: str, value: str = SUCCESS) -> str:
        """Answers the action of an actuator that acts, and returns the action."""
        self._due.pop(actuator, None)
        return super().answer(actuator, value)

    def begin_decision(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Delivers the inputs that come between two commands."""
        self._come_at(AFTER)

    def begin_command(
        self, waits: Callable[[], None], take: Callable[[], None] = lambda: None
    ) -> None:
        """Delivers the inputs that come in a command, which end a search."""
        self.commands += 1
        self._come_at(IN)

    def _come_at(self, kind: str) -> None:
        at = (kind, self.commands)
        self._come([one for one in self.left if (one.moment.kind, one.moment.number) == at])

    def _come(self, inputs: Sequence[Input]) -> None:
        for one in inputs:
            self.left.remove(one)
            if one.kind == GOAL:
                self.request(one.value)
            elif one.kind == CANCEL and int(one.value) > len(self.goals):
                self.strange.append(f"{one}: there is no such goal yet, but {len(self.goals)}")
            elif one.kind == CANCEL:
                self.cancel(self.goals[int(one.value) - 1])
            elif one.source in self.acting and one.moment.kind == STEP:
                self._answers[one.source] = one.value
                if one.source not in self._due:
                    seconds = self._duration(one.source, self.acting[one.source])
                    self._due[one.source] = self.clock + seconds
            elif one.source in self.acting:
                self.answer(one.source, one.value)
            else:
                self.tell(one.source, one.value)
