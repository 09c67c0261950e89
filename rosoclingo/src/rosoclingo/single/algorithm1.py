"""One-node planning: the paper's Algorithm 1 in the place of a controller's mode. Needs no ROS.

The paper calls the solver until there is a plan, one step longer each time, executes the plan step
by step, and calls the solver again when something has come. These are the decisions that the mode
``dynamic.incremental.recording`` makes too, so the loop and its commands are the same; only that
there is no last step, because no program has to be grounded for all of them.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Generator, Optional, Sequence, Set, Tuple, Type

import clingo

from rosclingo.errors import OptionsError
from rosclingo.solver.terms import parse_term
from rosclingo.wire.commands import Result
from rosoclingo.loop.atoms import event
from rosoclingo.loop.controller import Info
from rosoclingo.loop.goals import Goal, Stage
from rosoclingo.loop.state import State
from rosoclingo.single.dialects import Dialect2, PaperDialect

_Commands = Generator[str, Info, Info]


class Algorithm1:
    """Decides as Algorithm 1 of the paper does (docs/protocol.md, section "Sources").

    Attributes:
        dynamic: Whether it takes messages and goals, which it does.
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
        self.prepare()

    def prepare(self) -> None:
        """Begins anew."""
        self._step = self._horizon = self._first
        self._commands = self._run()
        self._begun = False
        self._untouched = True  # nothing has come since the beginning

    def decide(self, info: Info) -> clingo.Symbol:
        """Returns the next command, such as ``ground(3)``."""
        command = self._commands.send(info) if self._begun else next(self._commands)
        self._begun = True
        return parse_term(command)

    def look_ahead(self, info: Info) -> None:
        """Does nothing: a decision takes no time."""

    def describe(self, info: Info) -> str:
        """Describes what the last decision was made from."""
        return f"step: {self._step}; horizon: {self._horizon}; infos: {info.events()}"

    def check(self) -> None:
        """Checks nothing: it is in this process."""

    def _run(self) -> Generator[str, Info, None]:
        yield "initialize"
        for step in range(1, self._first + 1):
            yield f"ground({step})"
        info = yield f"assign_external(query({self._horizon}),true)"
        info = yield from self._plan(info)
        info = yield f"commit_actions({self._step})"
        if self._untouched and self._step == self._horizon and not info.pending_actions:
            while not info.new_messages:
                info = yield "idle"  # the first goal belongs to the first step
        while True:
            while info.new_messages or info.pending_actions:
                if info.new_messages:
                    info = yield from self._plan(info)
                    info = yield f"commit_actions({self._step})"
                else:
                    info = yield "idle"
            info = yield f"status_update({self._step})"
            while self._step == self._horizon and not info.new_messages:
                info = yield "idle"
            if info.new_messages and (self._step < self._horizon or self._horizon == self._last):
                info = yield from self._plan(info)
                info = yield f"commit_actions({self._step})"
                continue
            if self._step == self._horizon:
                yield from self._extend(None)
            yield f"release_step({self._step})"
            self._step += 1
            info = yield f"commit_actions({self._step})"

    def _plan(self, info: Info) -> _Commands:
        """Searches for a plan with all that has come, up to the first horizon that has one."""
        while info.new_messages or info.result is not Result.SAT:
            if info.new_messages:
                self._untouched = False
                info = yield f"assign_messages({self._step})"
            elif info.result is not Result.UNSAT:
                info = yield "solve"
            elif self._horizon == self._last or (info.horizon or 0) > (self._last or math.inf):
                yield "exit"
                # Going on means that the reason is gone, and the horizon may be nearer again.
                yield f"assign_external(query({self._horizon}),false)"
                self._horizon = self._step
                info = yield f"assign_external(query({self._horizon}),true)"
            else:
                info = yield from self._extend(info.horizon)
        return info

    def _extend(self, needed: Optional[int]) -> _Commands:
        """Asks for the goal one step later, or at the horizon that the plan needs."""
        yield f"assign_external(query({self._horizon}),false)"
        self._horizon = max(self._horizon + 1, needed or 0)
        yield f"ground({self._horizon})"
        return (yield f"assign_external(query({self._horizon}),true)")


def last_step(clingo_options: Sequence[str]) -> Optional[int]:
    """Returns the N of ``-c steps=N`` among clingo's options.

    Raises:
        OptionsError: It is no number from 1 on.
    """
    last = None
    for option, value in zip(clingo_options, clingo_options[1:]):
        name, _, text = value.partition("=")
        if option == "-c" and name.strip() == "steps":
            if not text.strip().isdigit() or int(text) < 1:
                raise OptionsError(f"option -c {value}: steps is a number from 1 on")
            last = int(text)
    return last


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

        def __init__(self, state: State) -> None:
            super().__init__(state)
            self._aborts: Set[Tuple[str, int]] = set()

        def commit_actions(self, step: clingo.Symbol) -> None:
            """Publishes the actions of a step that are not published yet, and its aborts."""
            super().commit_actions(step)
            for actuator in self.state.plan.aborts(step.number):
                if (actuator, step.number) not in self._aborts:
                    self._aborts.add((actuator, step.number))
                    self.state.environment.publish(actuator, "abort")

    class PaperCommands(Commands):
        """Of an encoding that does not say how goals end: they do when the plan is through."""

        def __init__(self, state: State) -> None:
            super().__init__(state)
            self._canceled: Set[Goal] = set()

        def assign_messages(self, step: clingo.Symbol) -> None:
            """Makes the event of each message, goal and cancel request that has come true."""
            canceled = [(goal, goal.slot or "") for goal in self.state.mail.cancels]
            super().assign_messages(step)
            self._canceled.update(
                goal
                for goal, slot in canceled
                if self.state.is_true(event(slot, "cancel", step.number))
            )

        def status_update(self, step: clingo.Symbol) -> None:
            """Sets the goals' statuses as the plan has them in a step."""
            super().status_update(step)
            for slot in self.state.goals.slots:
                goal = self.state.goals.occupant(slot)
                if goal is None or goal.stage is Stage.ENDED:
                    continue
                self.state.set_status(slot, "accepted")
                if step.number == self.state.horizon:
                    canceled = goal in self._canceled
                    self._canceled.discard(goal)
                    self.state.set_status(slot, "canceled" if canceled else "succeeded")

    ends_with_plan = issubclass(dialect, PaperDialect) and not has_status
    return PaperCommands if ends_with_plan else Commands
