"""The standard commands that a controller's mode may give: the extension point of the manual.

A mode's answer set holds ``do(controller,Command,1)``. The method with the command's name is called
with the command's arguments, which are clingo symbols. So a method of a subclass that is given to
``rosoclingo.ros.node.main`` is a new command; ``nodes/commands.py`` is the place for it.
"""

from __future__ import annotations

from typing import List

from clingo import Number, Symbol, SymbolType

from rosclingo.wire.commands import Truth
from rosoclingo.errors import ControllerError, ShutdownError
from rosoclingo.loop import beginning, diagnosis, operating, publishing, statuses
from rosoclingo.loop.improving import improve
from rosoclingo.loop.journal import Reason
from rosoclingo.loop.search import search, settle
from rosoclingo.loop.state import State
from rosoclingo.loop.values.atoms import query
from rosoclingo.loop.words import SOLVER

_TRUTHS = frozenset(truth.value for truth in Truth)


class ROSCommands:
    """The standard commands, a method for each: docs/protocol.md, section "Commands"."""

    def __init__(self, state: State) -> None:
        self.state = state
        self.planner = state.planner

    def initialize(self) -> None:
        """Grounds base, state(0) and query(0) on a fresh planner, and reads the slots."""
        beginning.begin(self.state, self.planner.begin(self.state.saved()))

    def ground(self, step: Symbol) -> None:
        """Grounds the state, transition and query of a step, unless they are grounded already.

        If the planner has said which horizon it needs, all steps up to there that are missing.
        """
        steps = self._missing_steps(_step(step))
        if steps:
            self.planner.ground_steps(steps)
            self.state.externals.grounded.update(steps)

    def ground_all(self, last: Symbol) -> None:
        """Grounds all steps up to a last one, one by one.

        Raises:
            ShutdownError: The node is shutting down.
        """
        for step in range(1, _step(last) + 1):
            if self.state.mail.inbox.closed:
                raise ShutdownError(Reason.SHUTDOWN)
            self.ground(Number(step))

    def _missing_steps(self, last: int) -> List[int]:
        """Returns the steps that are to be grounded for a horizon."""
        self.state.waiting.tell_progress(self.state.horizon, self.planner.last_horizon)
        first = last if self.planner.needed is None else 1
        return [
            step for step in range(first, last + 1) if step not in self.state.externals.grounded
        ]

    def query(self, step: Symbol) -> None:
        """Sets the query to another horizon, whose steps are grounded before if need be.

        It does what three commands of the manual do, in one request to the planner.
        """
        horizon = _step(step)
        steps = self._missing_steps(horizon)
        before = None if self.state.horizon == horizon else self.state.horizon
        self.planner.query(horizon, before, steps)
        self.state.externals.grounded.update(steps)
        if before is not None:
            self.state.externals.note_assigned(query(before), False)
        self.state.externals.note_assigned(query(horizon), True)
        self.state.horizon = horizon

    def assign_external(self, external: Symbol, value: Symbol) -> None:
        """Sets an external of the planner to true, false or free; ignored if it does not exist."""
        if str(value) not in _TRUTHS:
            raise ControllerError(f"{value} is not a value: it is true, false or free")
        truth = Truth(str(value))
        is_true = self.planner.set_external(str(external), truth) and truth is Truth.TRUE
        if external.match("query", 1) and is_true:
            self.state.horizon = _step(external.arguments[0])
        self.state.externals.note_assigned(str(external), is_true)

    def assign_externals(self, external: Symbol, value: Symbol) -> None:
        """Alias of assign_external; the manual spells it so."""
        self.assign_external(external, value)

    def release_external(self, external: Symbol) -> None:
        """Makes an external of the planner false permanently."""
        self.state.externals.release(str(external))

    def solve(self) -> None:
        """Searches for a plan; a message, goal or cancel request ends the search."""
        search(self.state)

    def plan(self, step: Symbol) -> None:
        """Searches for a plan with another horizon: does what query and solve do."""
        self.query(step)
        self.solve()

    def assign_messages(self, step: Symbol) -> None:
        """Makes the event of each message, goal and cancel request that has come true.

        What was held when a goal is cancelled, the next plan may do without.
        """
        if self.state.assign_messages(_step(step)) or self.planner.avoids:
            operating.take_back(self.state)

    def status_update(self, step: Symbol) -> None:
        """Sets the goals' statuses as the plan has them in a step."""
        state, number = self.state, _step(step)
        state.externals.make_true(state.move_to(number))
        statuses.update(state, number)

    def commit_actions(self, step: Symbol) -> None:
        """Publishes the actions of a step that are not published yet."""
        state, number = self.state, _step(step)
        passed = state.move_to(number)
        executions = state.executions
        unknown = [a for a in state.plan.actions(number) if a not in executions.published]
        new, repeated = publishing.split(state, unknown)
        # The robot first: what the planner is told now, it needs only for its next search.
        publishing.publish(state, new)
        operating.withdraw(state, number)
        executions.published.update(repeated)
        for actuator in state.plan.aborts(number):
            if executions.can_be_aborted(actuator):
                publishing.publish_abort(state, actuator)
        commits = [action.commit for action in unknown]
        for atom, _ in state.externals.make_true_soon(passed + commits):
            if atom in commits:
                state.warn_once(
                    "commit",
                    f"the planner's encoding does not declare #external {atom}: it does not know "
                    "which actions were published, so that a later plan may have another past than "
                    "the one that was executed",
                )
        if new:
            state.mail.end_attempt(acts=True)  # those who act now are heard at once
            state.goals.tell(f"step {step} of {state.horizon}")
        state.timing.tell_clients()

    def release_step(self, step: Symbol) -> None:
        """Releases the externals of a step that were not made true."""
        self.state.externals.release_later(_number(step))

    def reset(self, step: Symbol) -> None:
        """Makes the fluents of a step the initial ones, and forgets what happened until then.

        A mode that resets before the actions of the step are answered waits here for that.
        """
        self._settle(step)
        beginning.reset(self.state, _step(step))

    def forget(self, step: Symbol) -> None:
        """Resets, and sets the horizon to the number of steps that the plan had left."""
        self._settle(step)
        left = self.state.actions_left(_step(step))
        beginning.reset(self.state, _step(step))
        self.query(Number(left))

    def _settle(self, step: Symbol) -> None:
        """Publishes the actions of a step and awaits their answers, unless the mode has done so."""
        number = _step(step)
        if statuses.is_unsettled(self.state):
            self.commit_actions(step)
            settle(self.state, number)

    def publish(self) -> None:
        """Publishes the whole plan as one message; the loop is through then."""
        plan = ", ".join(str(action) for action in self.state.plan.actions_from(0))
        self.state.environment.publish(SOLVER, f"[{plan}]")
        self.state.finish("the plan is published, and the mode is through: it takes no goals")

    def idle(self) -> None:
        """Waits for a message, a goal or a cancel request."""
        self.planner.run()  # flushes the queue, while no robot waits
        self.state.externals.release_now()
        self.state.show_executions()
        self.state.waiting.wait(self.state.step, lambda: improve(self.state))

    def exit(self) -> None:
        """Ends the node, with the reason: there is no plan within the maximal horizon.

        The loop goes on if the reason can be removed, see :mod:`rosoclingo.loop.diagnosis`.
        """
        diagnosis.end(self.state)


def _step(symbol: Symbol) -> int:
    step = _number(symbol)
    if step < 0:
        raise ControllerError(f"a step is a number from 0 on, and {symbol} is none")
    return step


def _number(symbol: Symbol) -> int:
    if symbol.type is not SymbolType.Number:
        raise ControllerError(f"a step is a number, and {symbol} is none")
    return symbol.number
