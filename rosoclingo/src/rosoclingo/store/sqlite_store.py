"""Durability by a SQLite file: commits the loop's state, and resumes a run whose process died."""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import dataclass
from typing import (
    Any,
    Callable,
    ContextManager,
    Dict,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
    TypeVar,
)

import clingo

from rosclingo.errors import ServiceError
from rosclingo.wire.commands import Result
from rosoclingo.errors import OverloadedError, SpareMemoryError, StoreError
from rosoclingo.loop.durability import Durability, KnownGoal
from rosoclingo.loop.health import StoreSummary
from rosoclingo.loop.inputs.inbox import Cancel, Inbox, Item, arrival_of
from rosoclingo.loop.journal import (
    LOOP,
    CommandDone,
    Event,
    NodeResumed,
    Reason,
    Status,
    StatusSet,
)
from rosoclingo.loop.loop import LoopSnapshot
from rosoclingo.loop.mode.controller import Decider
from rosoclingo.loop.monitor import Doing
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.solver import Solver
from rosoclingo.store.commands import RecordedSolver, SolverRetry
from rosoclingo.store.outbox import Outbox, StoredClient
from rosoclingo.store.store import Changes, Store

_SHORT_PAUSE_SECONDS = 2.0  # so soon a node is back, and an action took as long as it seems
_LATEST_SECONDS = 0.2  # so much work may be lost, besides the decision that is carried out

_T = TypeVar("_T")


@dataclass(eq=False)
class SqliteStore(Durability):
    """Commits before an action, a status or a result leaves, and before the loop waits.

    And after a decision if the last commit was some time ago. What has been decided since then is
    decided again after a crash.

    Goals and cancel requests outlast a failure of power when they are in the inbox, messages the
    end of the process.

    Attributes:
        store: Where all is written; the run in it goes on, or one begins.
        started_with: Returns what the nodes were started with, by what that is; called when they
            are there.
        wait_for_solvers: Returns when the solvers are there, or raises a ServiceError after a
            while; without it, the loop ends when one was lost.
    """

    keeps_goals = True
    store: Store
    started_with: Callable[[], Mapping[str, str]]
    wait_for_solvers: Optional[Callable[[], None]] = None

    def __post_init__(self) -> None:
        self._created = time.monotonic()
        self._is_unsure = True  # whether the solvers are those of the run
        self._has_begun = False  # which is written
        self._order = threading.Lock()  # has inputs written in the order in which they are taken
        self._numbers: Dict[int, int] = {}  # of the inputs that wait, by their ids in Python
        self._taken: List[int] = []  # numbers of inputs to be removed with the next commit
        self._stopped: Optional[str] = None  # why nothing is taken any more of a run that goes on
        self._committed_at = 0.0
        self._untold: List[Event] = []  # by the journal, of goals that have ended
        # What the controller knew before the decision that is carried out, and the result of a
        # search that it was told; None as soon as its command may have changed something else.
        self._before: Optional[Tuple[str, Optional[Result]]] = None
        self._inbox: Inbox
        self._planner: RecordedSolver
        self._outbox: Outbox
        self._state: State
        self._controller: Decider

    def connect(
        self, inbox: Inbox, planner: Solver, environment: Environment
    ) -> Tuple[Solver, Environment]:
        """Returns a planner that logs its commands, and the outbox."""
        for record in self.store.records:
            environment.note(record)  # for those who come late
        inbox.durability = self
        self._inbox = inbox
        self._outbox = Outbox(environment, self.store)
        planner_retry, controller_retry = (
            SolverRetry(name, self.wait_for_solver, self._note)
            for name in ("planner", "controller")
        )
        self._retry_controller = controller_retry
        self._planner = RecordedSolver(planner, planner_retry, lambda: self.store.commands)
        return self._planner, self._outbox

    def retry(self, call: Callable[[], _T], restore: Callable[[], None] = lambda: None) -> _T:
        """Calls the controller; again, if its solver is lost and replaced meanwhile."""
        return self._retry_controller(call, restore)

    def _note(self, event: Event) -> None:
        self._state.note(event)

    def wait_for_solver(self, err: ServiceError) -> None:
        """Waits until the solvers are there, one of which was lost.

        Raises:
            ServiceError: They do not come.
            StoreError: They are others.
        """
        if self._inbox.closed or self.wait_for_solvers is None:
            raise err
        self._outbox.warn(f"{err}; waits until that node is there, and gives it its commands again")
        with self._state.monitor.interlude(Doing.LACKS, str(err)):
            self.wait_for_solvers()
        was_unsure, self._is_unsure = self._is_unsure, True  # goals stay open if they are others
        self.store.check(self.started_with())
        self._is_unsure = was_unsure

    # Inputs, in any thread.

    @contextlib.contextmanager
    def receiving(self, items: Sequence[Item], end: Optional[str]) -> Iterator[None]:
        """Stores inputs, which are added to the inbox in the context that is returned.

        That is one transaction, and what their goals are told at once is another one.

        After the end of the run, a goal is rejected, which is written, too: whoever sends it again,
        to the next run, hears the same. A shutdown does not end the run: what comes meanwhile is
        for the process that goes on.
        """
        with self._order:
            if end is not None and any(isinstance(item, Cancel) for item in items):
                raise StoreError(end)
            if self._stopped is not None:
                raise StoreError(self._stopped)
            for item in items:
                if isinstance(item, Goal):
                    item.client = StoredClient(item.client, self._outbox)
            kept = [item for item in items if end is None or isinstance(item, Goal)]
            self._numbers.update(zip(map(id, kept), self.store.add(*kept)))
            with self.together():
                yield

    def together(self) -> ContextManager[None]:
        """A context in which all that this thread tells goals is one transaction."""
        return self._outbox.together()

    def took(self, items: Sequence[Item]) -> None:
        """Has the next commit remove inputs."""
        numbers = (self._numbers.pop(id(item), None) for item in items)
        self._taken += (number for number in numbers if number is not None)

    # The run of an earlier process.

    def resume(self, state: State, client: Callable[[KnownGoal], GoalClient]) -> Dict[str, Goal]:
        """Takes over goals, queue, slots, mail and inputs.

        How a goal has ended is what the store says of it: another thread may have recalled it, or
        it was rejected in a search, after the snapshot.

        Raises:
            StoreError: The store has what this version does not understand.
        """
        with self.store.understood():
            return self._resume(state, client)

    def _resume(self, state: State, client: Callable[[KnownGoal], GoalClient]) -> Dict[str, Goal]:
        self._state = state
        known = self.store.goals
        events = (record.event for record in self.store.records)
        told = {event.goal for event in events if isinstance(event, StatusSet)}
        goals: Dict[str, Goal] = {}

        def sender(identifier: str) -> GoalClient:
            """Returns who has sent a goal, if it has not ended."""
            one = known.get(identifier)
            if one is None or one.status.is_terminal:
                return GoalClient()
            return StoredClient(client(one), self._outbox)

        def tell_end(goal: KnownGoal, *before: Event) -> None:
            """Records the end of a goal, after earlier events, unless the journal has it."""
            if goal.id not in told:
                told.add(goal.id)
                end = StatusSet(goal.id, goal.status, "", Reason.of(goal.reason))
                self._untold += [*before, end]

        def end(goal: Goal) -> bool:
            """Ends a goal as the store says, and returns whether it had not ended."""
            one = known.get(goal.id)
            if one is None or not one.status.is_terminal or goal.ended:
                return False
            goal.status, goal.reason = one.status, one.reason
            tell_end(one)
            return True

        def find(identifier: str) -> Optional[Goal]:
            """Returns a goal of the snapshot, or a new one that it does not have."""
            one = known.get(identifier)
            if identifier in goals or one is None:
                return goals.get(identifier)
            goal = Goal(one.request, one.information, one.id, sender(identifier))
            if one.status.is_terminal and one.reason != Reason.RECALLED:
                if one.status is Status.REJECTED:
                    tell_end(one, arrival_of(goal))
                return None
            goals[identifier] = goal
            end(goal)
            return goal

        if self.store.snapshot is not None:
            goals = state.restore(self.store.snapshot.state, sender)
            if self.store.pause > _SHORT_PAUSE_SECONDS:
                state.executions.interrupt()
        for goal in goals.values():
            state.goals.some_ended |= end(goal)
        for number, item in self.store.inputs(find):
            if item is None:
                self._taken.append(number)
            else:
                self._numbers[id(item)] = number
                self._inbox.add(item)
        return {key: goal for key, goal in goals.items() if not goal.ended}

    @property
    def ended(self) -> List[KnownGoal]:
        """The stored goals that have ended, in the order of their ends."""
        return self.store.ended_goals

    @property
    def unsure(self) -> List[KnownGoal]:
        """The ended goals whose clients may not have the result, since they have ended last."""
        return [one for one in self.ended if one.time >= self.store.unsure_since]

    def begin(self, state: State, controller: Decider, commands: Any) -> bool:
        """Begins to store the run, or goes on with that of an earlier process."""
        self._state, self._controller = state, controller
        started_with = self.started_with()
        saved = self.store.snapshot
        if saved is not None:
            self.store.check(started_with)
        self._outbox.begin()
        if saved is None:
            self.store.begin(started_with)
            self._is_unsure = False
            return False
        with self.store.understood():
            self.retry(lambda: controller.restore(saved.controller))
        if not state.externals.lost:
            try:
                self._planner.restore()
            except (SpareMemoryError, OverloadedError) as err:
                state.environment.warn(f"the planner cannot be restored: {err}")
                state.externals.lost = True  # it is told what counts now, which is less
        self.store.snapshot = None
        self._is_unsure = False
        state.note(NodeResumed(LOOP, seconds=time.monotonic() - self._created))
        for event in self._untold:
            state.note(event)
        state.show_plan()
        self.commit()
        if self._has_published():
            commands.publish()  # for those who come late: the topic is another process's
            self.commit()
        else:
            self._outbox.send_again()
        return True

    def _has_published(self) -> bool:
        """Returns whether the mode has run the command ``publish``."""
        events = (record.event for record in self.store.records)
        return any(isinstance(event, CommandDone) and event.publishes for event in events)

    @property
    def is_refused(self) -> bool:
        """Whether it is still unconfirmed that the stored run can be resumed."""
        return self._is_unsure or (not self._has_begun and self.store.failure is not None)

    # Each step.

    def begin_step(self) -> None:
        """Remembers what the decision rests on."""
        self._before = self._controller.snapshot(), self._state.result

    def begin_command(self, command: clingo.Symbol) -> None:
        """Forgets that, unless the command waits before it changes anything."""
        done = CommandDone(str(command))
        if not (done.waits or done.resets):  # a reset changes nothing before it has waited
            self._before = None

    def flush(self) -> None:
        """Lets out effects that need no commit, such as feedback."""
        self._outbox.flush()

    def about_to_wait(self) -> None:
        """Commits while the loop waits, as if the decision to wait were still to come."""
        if self._before is None or self.store.failure is not None or self._outbox.is_empty:
            self._outbox.flush()
            return
        controller, told = self._before
        result, self._state.result = self._state.result, told
        self._write(controller)
        self._state.result = result

    def end_command(self) -> None:
        """Commits if an effect is urgent, or the last commit was some time ago."""
        now = self._outbox.now()
        if self._outbox.is_urgent or now - self._committed_at >= _LATEST_SECONDS:
            self.commit()

    def commit(self, *, ended: Optional[str] = None) -> None:
        """Commits everything, and lets out all effects."""
        self._write(self._controller.snapshot(), ended)
        self._has_begun = True

    def _write(self, controller: str, ended: Optional[str] = None) -> None:
        taken, self._taken = self._taken, []
        changes = Changes(
            taken=taken,
            snapshot=LoopSnapshot(controller, self._state.snapshot()),
            commands=self._planner.take(),
            shortens=not self._planner.events_are_facts,
        )
        self._outbox.save(changes, ended=ended)
        self._committed_at = self._outbox.now()

    @property
    def summary(self) -> StoreSummary:
        """A summary of the store for diagnostics. Thread-safe."""
        return self.store.summary(is_unsure=self._is_unsure)

    def interrupts(self, reason: str) -> bool:
        """Returns whether the run goes on in a later process, and refuses inputs until then."""
        if self._inbox.closed:
            return True
        is_unsure = self.is_refused or self.store.failure is not None
        return is_unsure and self.suspend(reason)

    def suspend(self, reason: str) -> bool:
        """Refuses inputs, which are for a later process that goes on with the run."""
        with self._order:
            self._stopped = reason
        return True

    def close(self) -> None:
        """Closes the store."""
        self.store.close()
