"""Port for crash recovery: commits the run, and lets effects out after what they depend on."""

from __future__ import annotations

import dataclasses
from typing import Any, Callable, Dict, Optional, Sequence, Tuple, TypeVar

import clingo

from rosoclingo.loop.health import StoreSummary
from rosoclingo.loop.inputs.inbox import DurableInputs, Inbox
from rosoclingo.loop.journal import Status, StatusSet
from rosoclingo.loop.mode.controller import Decider
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.solver import Solver

_T = TypeVar("_T")


@dataclasses.dataclass(frozen=True)
class KnownGoal:
    """A stored goal: its request and status, without the planner's view of it.

    Attributes:
        id: What the client calls it.
        request: The request, a ground term as clingo prints it.
        information: What came with it.
        address: By what the client is found again.
        accepted: Whether it was accepted, whatever has become of it.
        canceling: Whether a cancel request has come for it.
        status: How far it is.
        reason: Why it has ended.
        time: When, in seconds of wall time.
    """

    id: str
    request: str
    information: Tuple[str, ...] = ()
    address: str = ""
    accepted: bool = False
    canceling: bool = False
    status: Status = Status.PENDING
    reason: str = ""
    time: float = 0.0

    def changed(self, change: StatusSet, time: float) -> KnownGoal:
        """Returns a copy with a new status, and the time of the change."""
        if change.status is Status.ACCEPTED:
            return dataclasses.replace(self, status=change.status, accepted=True)
        return dataclasses.replace(self, status=change.status, reason=change.reason, time=time)


class Durability(DurableInputs):
    """Has a run outlast its process; this class stores nothing, and lets effects leave at once.

    The loop says where it is. An implementation commits at some of these moments, and lets the
    effects of commands out when it has committed what they depend on.

    Attributes:
        keeps_goals: Whether a shutdown ends no goals, since another process goes on with them.
    """

    keeps_goals = False

    def connect(
        self, inbox: Inbox, planner: Solver, environment: Environment
    ) -> Tuple[Solver, Environment]:
        """Returns the planner and the environment that the loop is to use; called once."""
        return planner, environment

    def retry(self, call: Callable[[], _T], restore: Callable[[], None] = lambda: None) -> _T:
        """Calls the controller; again, if its solver is lost and replaced meanwhile.

        Args:
            call: Calls it.
            restore: Called before each further try, with the new solver.
        """
        return call()

    # The run of an earlier process.

    def resume(self, state: State, client: Callable[[KnownGoal], GoalClient]) -> Dict[str, Goal]:
        """Takes over goals, queue, slots, mail and inputs; called before anything comes in.

        Args:
            state: The loop's state.
            client: Returns who has sent a goal.

        Returns:
            The goals that have not ended, by their ids.
        """
        return {}

    @property
    def ended(self) -> Sequence[KnownGoal]:
        """The stored goals that have ended, in the order of their ends."""
        return ()

    @property
    def unsure(self) -> Sequence[KnownGoal]:
        """The ended goals whose clients may not have the result, since they have ended last."""
        return ()

    def begin(self, state: State, controller: Decider, commands: Any) -> bool:
        """Begins to store the run, or goes on with that of an earlier process.

        Args:
            state: The loop's state.
            controller: Says what to do next.
            commands: The object with the mode's commands.

        Returns:
            Whether it goes on: then controller and planner are what they were.

        Raises:
            StoreError: It cannot.
            PlannerError: The planner does not become what it was.
        """
        return False

    @property
    def is_refused(self) -> bool:
        """True if it is still unconfirmed that the stored run can be resumed."""
        return False

    # Each step.

    def begin_step(self) -> None:
        """Called before a decision."""

    def begin_command(self, command: clingo.Symbol) -> None:
        """Called when a command is decided, before it changes anything."""

    def end_command(self) -> None:
        """Called when it is carried out: commits if an effect is urgent, or it is time."""

    def commit(self, *, ended: Optional[str] = None) -> None:
        """Commits everything, and lets out all effects.

        Args:
            ended: Why the run ends with this, if it does.
        """

    @property
    def summary(self) -> Optional[StoreSummary]:
        """A summary of the store for diagnostics; None if there is no store. Thread-safe."""
        return None

    def interrupts(self, reason: str) -> bool:
        """Returns whether the loop ends, and the run goes on in a later process."""
        return False

    def suspend(self, reason: str) -> bool:
        """Has a later process go on with the run, if one can; inputs are refused from now on.

        Args:
            reason: Why this process ends.

        Returns:
            Whether one can.
        """
        return False

    def close(self) -> None:
        """Called when the process ends; may be called twice."""
