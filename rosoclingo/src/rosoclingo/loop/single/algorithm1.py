"""One-node planning: the paper's Algorithm 1 in the place of a controller's mode. Needs no ROS.

The paper calls the solver until there is a plan, one step longer each time, executes the plan step
by step, and calls the solver again when something has come. These are the decisions that the mode
``dynamic.incremental.recording`` makes too, so the loop and its commands are the same; only that
there is no last step, because no program has to be grounded for all of them.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace
from typing import Any, Callable, Mapping, Optional, Sequence, Type

import clingo

from rosclingo.errors import OptionsError, shorten
from rosclingo.solver.options import constants
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import Result
from rosclingo.wire.term_text import number
from rosoclingo.loop.journal import Status
from rosoclingo.loop.mode.controller import Info
from rosoclingo.loop.publishing import publish_abort
from rosoclingo.loop.single.dialects import Dialect2, PaperDialect
from rosoclingo.loop.state import State
from rosoclingo.loop.statuses import set_status
from rosoclingo.loop.values.snapshot import decode, encode


class Stage(enum.Enum):
    """The stages of Algorithm 1, each of which decides the next command."""

    BEGIN = "begin"
    GROUND = "ground"  # the steps before the first
    PLAN = "plan"
    EXTEND = "extend"  # the horizon, for a plan
    GROW = "grow"  # the horizon, for a step
    QUERY = "query"  # a plan for a horizon whose steps are grounded
    OPEN = "open"  # the same, for a step
    BACK = "back"  # there was no plan, and the reason is gone
    START = "start"  # the first plan has been published
    WAIT = "wait"  # for the first goal
    ACT = "act"
    DONE = "done"
    RELEASE = "release"
    ADVANCE = "advance"


_ASKING = (Stage.PLAN, Stage.EXTEND, Stage.GROW, Stage.QUERY, Stage.OPEN, Stage.BACK)


@dataclass(frozen=True)
class Position:
    """The saved state of Algorithm 1 between two decisions.

    Attributes:
        stage: What is to be done next.
        step: The current step.
        horizon: The step that is planned up to.
        grounded: The last step that was grounded in the beginning.
        started: Whether the first plan has been published.
        untouched: Whether nothing has come since the beginning.
    """

    stage: Stage
    step: int
    horizon: int
    grounded: int = 0
    started: bool = False
    untouched: bool = True


class Algorithm1:
    """Decides as Algorithm 1 of the paper does (docs/protocol.md, section "Sources").

    Attributes:
        dynamic: Whether it takes messages and goals, which it does.
        position: Where it is.
    """

    dynamic = True

    def __init__(self, first_step: int, last_step: Optional[int] = None) -> None:
        """Prepares a beginning.

        Args:
            first_step: The step to which the first goal belongs, 0 or 1.
            last_step: The last step that may be planned for; None for no such limit.
        """
        self._first = first_step
        self._last = last_step
        self._stages: Mapping[Stage, Callable[[Info], str]] = {
            Stage.BEGIN: lambda _: self._go(Stage.GROUND, "initialize"),
            Stage.GROUND: lambda _: self._ground(),
            Stage.PLAN: self._plan,
            Stage.EXTEND: lambda _: self._go(Stage.QUERY, f"ground({self.position.horizon})"),
            Stage.GROW: lambda _: self._go(Stage.OPEN, f"ground({self.position.horizon})"),
            Stage.QUERY: lambda _: self._go(Stage.PLAN, self._query(True)),
            Stage.OPEN: lambda _: self._go(Stage.RELEASE, self._query(True)),
            Stage.BACK: lambda _: self._back(),
            Stage.START: self._start,
            Stage.WAIT: self._wait,
            Stage.ACT: self._act,
            Stage.DONE: self._done,
            Stage.RELEASE: lambda _: self._release(),
            Stage.ADVANCE: lambda _: self._advance(),
        }
        self.prepare()

    @property
    def last_horizon(self) -> Optional[float]:
        """The last horizon that it may ask for."""
        return math.inf if self._last is None else self._last

    def snapshot(self) -> str:
        """Returns the position, as JSON."""
        return encode(self.position)

    def restore(self, saved: str) -> None:
        """Goes on from a snapshot."""
        self.position = decode(Position, saved)

    def prepare(self) -> None:
        """Begins anew."""
        self.position = self._before = Position(Stage.BEGIN, self._first, self._first)

    def undo(self) -> None:
        """Takes the last decision back, and with it those that made the horizon longer."""
        before = self._before
        self.position = replace(before, stage=Stage.BACK) if before.stage in _ASKING else before

    def decide(self, info: Info) -> clingo.Symbol:
        """Returns the next command, such as ``ground(3)``."""
        self._before = self.position
        return parse_term(self._stages[self.position.stage](info))

    def look_ahead(self, info: Info) -> None:
        """No-op: a decision takes no time."""

    def describe(self, info: Info) -> str:
        """Describes the inputs of the last decision."""
        position = self.position
        return f"step: {position.step}; horizon: {position.horizon}; infos: {info.events()}"

    def check(self) -> None:
        """No-op: the controller is in this process."""

    def _go(self, stage: Stage, command: str, **changes: Any) -> str:
        """Sets the stage that follows a command, and returns the command."""
        self.position = replace(self.position, stage=stage, **changes)
        return command

    def _query(self, value: bool) -> str:
        return f"assign_external(query({self.position.horizon}),{str(value).lower()})"

    def _ground(self) -> str:
        """Grounds the steps before the first, and sets the query to the first."""
        step = self.position.grounded + 1
        if step > self._first:
            return self._go(Stage.PLAN, self._query(True))
        return self._go(Stage.GROUND, f"ground({step})", grounded=step)

    def _plan(self, info: Info) -> str:
        """Searches for a plan with all that has come, up to the first horizon that has one."""
        position = self.position
        if info.new_messages:
            command = f"assign_messages({position.step})"
            return self._go(Stage.PLAN, command, untouched=False)
        if info.result is Result.SAT:
            follows = Stage.ACT if position.started else Stage.START
            return self._go(follows, f"commit_actions({position.step})", started=True)
        if info.result is not Result.UNSAT:
            return self._go(Stage.PLAN, "solve")
        if position.horizon == self._last or (info.horizon or 0) > (self._last or math.inf):
            return self._go(Stage.BACK, "exit")
        return self._extend(Stage.EXTEND, info.horizon)

    def _extend(self, follows: Stage, needed: Optional[int]) -> str:
        """Moves the goal one step later, or to the horizon that the plan needs."""
        horizon = max(self.position.horizon + 1, needed or 0)
        return self._go(follows, self._query(False), horizon=horizon)

    def _back(self) -> str:
        # That exit has not ended the node means that the reason is gone; the horizon may be nearer.
        return self._go(Stage.QUERY, self._query(False), horizon=self.position.step)

    def _start(self, info: Info) -> str:
        position = self.position
        is_through = position.step == position.horizon and not info.pending_actions
        if position.untouched and is_through:
            return self._wait(info)
        return self._act(info)

    def _wait(self, info: Info) -> str:
        """Waits for the first goal, which belongs to the first step."""
        return self._act(info) if info.new_messages else self._go(Stage.WAIT, "idle")

    def _act(self, info: Info) -> str:
        """Waits for the answers in a step; replans if an input has come."""
        if info.new_messages:
            return self._plan(info)
        if info.pending_actions:
            return self._go(Stage.ACT, "idle")
        return self._go(Stage.DONE, f"status_update({self.position.step})")

    def _done(self, info: Info) -> str:
        """Begins the next step, if the plan has one or an input has come."""
        position = self.position
        is_last = position.step == position.horizon
        if is_last and not info.new_messages:
            return self._go(Stage.DONE, "idle")
        if info.new_messages and (not is_last or position.horizon == self._last):
            return self._plan(info)
        return self._extend(Stage.GROW, None) if is_last else self._release()

    def _release(self) -> str:
        return self._go(Stage.ADVANCE, f"release_step({self.position.step})")

    def _advance(self) -> str:
        step = self.position.step + 1
        return self._go(Stage.ACT, f"commit_actions({step})", step=step)


def last_step(clingo_options: Sequence[str]) -> Optional[int]:
    """Returns the N of ``-c steps=N`` among clingo's options.

    Raises:
        OptionsError: It is no number from 1 on.
    """
    text = constants(clingo_options).get("steps")
    if text is None:
        return None
    steps = number(text)
    if steps is None or steps < 1:
        raise OptionsError(f"option -c steps={shorten(text)}: steps is a number from 1 on")
    return steps


def commands_for(
    dialect: Type[Dialect2], commands: Type[Any], has_status: bool
) -> Callable[[State], Any]:
    """Returns the class of the commands for an encoding.

    Args:
        dialect: The encoding's dialect.
        commands: Class with a method for each command, such as ``ROSCommands``.
        has_status: Whether the encoding says how goals end.
    """

    class Commands(commands):
        """The commands, and ``abort(R,T)`` of ROSoClingo 1.0."""

        def commit_actions(self, step: clingo.Symbol) -> None:
            """Publishes the actions of a step that are not published yet, and its aborts."""
            super().commit_actions(step)
            for actuator in self.state.plan.aborts(step.number):
                publish_abort(self.state, actuator)

    class PaperCommands(Commands):
        """Commands for encodings without statuses: goals succeed at the end of the plan."""

        def __init__(self, state: State) -> None:
            super().__init__(state)
            state.serves_all = True

        def status_update(self, step: clingo.Symbol) -> None:
            """Sets the goals' statuses as the plan has them in a step."""
            super().status_update(step)
            for slot in self.state.goals.slots:
                goal = self.state.goals.occupant(slot)
                if goal is None or goal.ended:
                    continue
                set_status(self.state, slot, Status.ACCEPTED, step.number)
                if step.number == self.state.horizon:
                    status = Status.CANCELED if goal.cancel_told else Status.SUCCEEDED
                    set_status(self.state, slot, status, step.number)

    ends_with_plan = issubclass(dialect, PaperDialect) and not has_status
    return PaperCommands if ends_with_plan else Commands
