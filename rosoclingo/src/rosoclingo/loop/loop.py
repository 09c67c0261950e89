"""The controller loop: asks the controller for a command, runs it on the planner, and repeats.

Nothing here needs ROS: the solvers, the world outside and the commands are arguments.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any, Callable, Dict, Mapping, Optional, Sequence

import clingo

from rosclingo.errors import OutOfMemoryError, RosclingoError, ServiceError
from rosclingo.wire.commands import Result
from rosoclingo.errors import (
    ControllerError,
    ExhaustedError,
    OutsideError,
    OverloadedError,
    PlannerError,
    ShutdownError,
)
from rosoclingo.loop import diagnosis, improving, memory, operating, publishing, statuses
from rosoclingo.loop.durability import Durability
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.journal import CommandDone, LoopEnded, Reason
from rosoclingo.loop.mode.controller import Decider, Info
from rosoclingo.loop.mode.dispatch import DispatchError, bind
from rosoclingo.loop.mode.named_steps import STEP_COMMANDS
from rosoclingo.loop.monitor import Doing
from rosoclingo.loop.planner.planner import Planner
from rosoclingo.loop.state import ASK_AGAIN_SECONDS, State, StateSnapshot
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.solver import Solver

_BEGINS_ACTIONS = "commit_actions"

# The standard commands that make sense for a planner only that is initialised.
_OF_PLANNER = STEP_COMMANDS | {"ground_all", "solve", "publish", "exit", "release_external"}
_OF_PLANNER |= {"assign_external", "assign_externals"}


@dataclass(frozen=True)
class LoopSnapshot:
    """Saved state of a :class:`Loop` between two steps, from which another loop can go on.

    Attributes:
        controller: What the controller keeps, as it says it.
        state: The state.
    """

    controller: str
    state: StateSnapshot


class Loop:
    """The loop that runs a mode. One thread calls it; any thread may fill the inbox.

    Attributes:
        state: What is known; its goals may be looked at from other threads.
    """

    def __init__(
        self,
        controller: Decider,
        planner: Solver,
        commands: Callable[[State], Any],
        inbox: Inbox,
        environment: Environment,
        *,
        durability: Optional[Durability] = None,
        action_timeout: float = 0.0,
        abort_unreachable: bool = False,
        patience: float = 0.0,
        one_by_one_seconds: float = 0.0,
        ask_before: Sequence[str] = (),
        ask_again: float = ASK_AGAIN_SECONDS,
        policies: Optional[Mapping[str, Mapping[str, object]]] = None,
        is_replaced: bool = False,
    ) -> None:
        """Prepares a loop; :meth:`run` begins to ask its controller.

        Args:
            controller: Says what to do next.
            planner: Solver with the task's encoding.
            commands: Class with a method for each command, such as ``ROSCommands``.
            inbox: Where messages, goals and cancel requests come in.
            environment: Where actions and log messages go.
            durability: Stores the run; None for nowhere.
            action_timeout: When an action without an answer times out, in seconds since
                it was published; 0 for never.
            abort_unreachable: Whether a goal without a plan ends alone, and not all with the loop.
            patience: When an optimising search ends that has found a plan, in seconds since
                it began; 0 for when it is through, DEFAULT_PATIENCE for what suits its encoding.
            one_by_one_seconds: How long one horizon after the other is searched, until several
                take turns; 0 for always.
            ask_before: Patterns of the actions that need an operator's approval, see
                :class:`.Interlock`.
            ask_again: After how many seconds an operator is asked again about an action that was
                rejected, if nothing has changed before.
            policies: How actions are treated that fail or take too long, by patterns, see
                :class:`.ActionPolicies`.
            is_replaced: Whether another process takes this one's place if its memory runs out,
                where the run is stored.

        Raises:
            ValueError: A pattern or a policy is wrong.
        """
        self._durability = durability or Durability()
        self._is_replaced = is_replaced
        self._has_decided = False
        planner, environment = self._durability.connect(inbox, planner, environment)
        self._solver = planner
        self.state = State(
            Planner(planner, patience, one_by_one_seconds),
            inbox,
            environment,
            self._check,
            self._prepare_controller,
            control=lambda *request: operating.control(self.state, *request),
            fail=lambda one, answer: publishing.fail(self.state, one, answer),
            action_timeout=action_timeout,
            abort_unreachable=abort_unreachable,
            ask_before=ask_before,
            ask_again=ask_again,
            policies=policies,
        )
        self._controller = controller
        self._commands = commands(self.state)
        self._environment = environment

    def run(self) -> None:
        """Runs until the mode is through, and then keeps refusing goals until shut down.

        When it ends, for whatever reason, every open goal is aborted with the reason.

        Raises:
            RosclingoError: The loop cannot go on; the message says why.
            ShutdownError: The inbox was closed.
        """
        try:
            self.prepare()
            while True:
                self.step()
        except ExhaustedError as err:
            if self._durability.suspend(str(err)):
                self._mark_end(str(err))
            else:
                self.end(str(err))
            raise
        except ServiceError as err:
            error = OutsideError(f"{err}; start that node again, and then rosoclingo")
            self.end(str(error), from_outside=True)
            raise error from err
        except RosclingoError as err:
            self.end(str(err), from_outside=isinstance(err, OutsideError))
            raise
        except Exception as err:
            self.end(f"internal error: {err!r}")
            raise

    @property
    def dynamic(self) -> bool:
        """True if the mode takes messages and goals; known once it is prepared."""
        return self._controller.dynamic

    def prepare(self) -> None:
        """Prepares the controller, and publishes that nothing was sent in this run yet.

        Or goes on with a stored run.
        """
        if self._durability.begin(self.state, self._controller, self._commands):
            operating.let_go(self.state)  # the patterns may be others than before
            self._durability.commit()
            return
        self._prepare_controller()
        self.state.show_executions(again=True)
        if not self.dynamic:
            self.state.warn_of_approvals()
            self.state.mail.refuse("the controller's mode is static: it takes no goals")
        self._durability.commit()

    def _prepare_controller(self) -> None:
        self._durability.retry(self._controller.prepare)

    def _restore_controller(self) -> None:
        # A decision that has failed has changed nothing of it.
        self._controller.restore(self._controller.snapshot())

    def step(self) -> None:
        """Makes one decision and carries it out; waits if the mode is through.

        Raises:
            ControllerError: The controller does not say what to do, or names no command.
            ExhaustedError: Memory has run out, and this process cannot go on.
        """
        self._has_decided = False
        try:
            if self.state.externals.lost:
                self.state.externals.retell()
            self._step()
        except (OutOfMemoryError, OverloadedError) as err:
            self._recover(err)
        except MemoryError as err:
            if self._durability.keeps_goals:
                raise ExhaustedError("out of memory outside of the planner", at_once=True) from err
            self._recover(OutOfMemoryError("out of memory"))  # which a solver in here may have used

    def _recover(self, err: Exception) -> None:
        """Goes on after the planner ran out of memory in a step, as if that had not begun."""
        if memory.recover(self.state, err) and self._has_decided:
            self._controller.undo()
        self._durability.commit()
        if self._is_replaced and self._durability.suspend(str(err)):
            raise ExhaustedError(f"{err}; goes on in another process", at_once=True)

    def _step(self) -> None:
        state = self.state
        state.monitor.begin(Doing.DECIDES)
        self._durability.begin_step()
        may_ask = not state.begins_again
        state.mail.begin_decision(may_ask=may_ask, improve=lambda: improving.improve(state))
        if state.mail.inbox.closed:
            raise ShutdownError(Reason.SHUTDOWN)
        if state.ended:
            state.waiting.rest()
        state.mail.take(may_ask=may_ask)
        state.poll()
        statuses.release(state)
        mail = state.mail
        needed = state.needed_horizon
        info = Info(
            state.result,
            state.executions.pending_actions,
            mail.tell(),
            state.goals.some_ended,
            needed,
            None if needed is None else needed - state.step,
            step=state.step,
            asked=state.horizon,
            planned_actions=state.actions_left(state.step) > 0,
            is_endless=state.planner.demand.has_tasks,
        )
        command = self._durability.retry(
            lambda: self._controller.decide(info), self._restore_controller
        )
        self._has_decided = True
        text = str(command)
        state.monitor.note_decision(text)
        state.planner.note_last_horizon(self._controller.last_horizon)
        ahead = self._guess(command, info)
        begins = command.type is clingo.SymbolType.Function and command.name == _BEGINS_ACTIONS
        if not begins:
            self._controller.look_ahead(ahead)  # while the planner works
        state.result = None
        mail.begin_command()
        self._durability.begin_command(command)
        begin = time.perf_counter()
        self._call(command, info)
        state.note(CommandDone(text, state.result, time.perf_counter() - begin))
        state.show_plan()
        self._durability.end_command()
        if begins:
            self._controller.look_ahead(ahead)  # while the robots act, who wait for nothing else

    def _guess(self, command: clingo.Symbol, info: Info) -> Info:
        """Predicts the controller's infos after a command."""
        probable: Dict[str, Any] = {"result": None, "horizon": None, "ahead": None}
        is_term = command.type is clingo.SymbolType.Function
        name, arguments = (command.name, command.arguments) if is_term else ("", [])
        steps = [a.number for a in arguments if a.type is clingo.SymbolType.Number]
        probable.update(self._position_after(name, steps[0] if steps else 0, info))
        if name in ("solve", "plan"):
            needed = self.state.planner.needed
            horizon = steps[0] if steps else self.state.horizon
            stands = needed is not None and needed <= horizon
            probable.update(result=Result.SAT if stands else Result.UNSAT, new_messages=False)
        elif name == "assign_messages":
            probable.update(new_messages=False)
        elif name == "commit_actions":
            probable.update(pending_actions=True)
        elif name == "idle":
            probable.update(new_messages=True, pending_actions=False)
        elif name in ("reset", "forget"):
            probable.update(request_reset=False)
        return replace(info, **probable)

    def _position_after(self, name: str, step: int, info: Info) -> Dict[str, Any]:
        """Returns the fields of the position that a command changes, by its name and its step."""
        if name in ("commit_actions", "status_update"):
            return {"step": step, "planned_actions": self.state.actions_left(step) > 0}
        if name in ("query", "plan"):
            return {"asked": step}
        if name in ("reset", "forget"):
            asked = self.state.actions_left(step) if name == "forget" else info.asked
            return {"step": 0, "asked": asked, "planned_actions": False}
        return {"step": 0, "asked": 0} if name == "initialize" else {}

    def _check(self) -> None:
        self._durability.retry(self._controller.check, self._restore_controller)
        self._solver.check()

    def _call(self, command: clingo.Symbol, info: Info) -> None:
        try:
            run = bind(self._commands, command, "command")
        except DispatchError as err:
            raise ControllerError(f"{err}; {self._controller.describe(info)}") from err
        if command.name in _OF_PLANNER and not self.state.externals.grounded:
            raise ControllerError(
                f"the mode gave {command} before initialize, without which the planner has no "
                f"program: initialize has to come first; {self._controller.describe(info)}"
            )
        try:
            run()
        except ControllerError as err:
            raise ControllerError(f"the mode gave {command}: {err}") from err
        except PlannerError as err:
            diagnosis.recover(self.state, err)

    def end(self, reason: str, *, from_outside: bool = False) -> None:
        """Aborts the open goals, and rejects those that are still to come.

        Does nothing if the run can go on later.

        Args:
            reason: Why the loop ends.
            from_outside: Whether the cause is no part of the run, so that a replay does not end.
        """
        if self._durability.interrupts(reason):
            self._mark_end(reason)
            return
        mail = self.state.mail
        if not mail.inbox.closed:
            self._environment.finish_reasons()
        mail.begin_end()
        if mail.inbox.closed:
            reason = Reason.SHUTDOWN
        mail.inbox.end(reason)
        self.state.note(LoopEnded(reason, from_outside))
        mail.refuse(reason)
        mail.take()
        self.state.goals.abort_all(reason)
        self._mark_end(reason)
        self._durability.commit(ended=reason)

    def _mark_end(self, reason: str) -> None:
        monitor = self.state.monitor
        monitor.summary = self.state.summarize()
        monitor.begin(Doing.ENDED)
        monitor.end = "" if self.state.mail.inbox.closed else reason
