"""A loop that is checkpointed to a store, and resumes a run whose process has died."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

import clingo

from rosclingo.errors import ServiceError
from rosclingo.wire.commands import Result
from rosoclingo.errors import StoreError
from rosoclingo.loop.inputs.inbox import Cancel, Inbox, Item, arrival_of
from rosoclingo.loop.inputs.replay_inbox import ReplayInbox
from rosoclingo.loop.journal import (
    LOOP,
    CommandDone,
    Event,
    NodeResumed,
    Reason,
    Status,
    StatusSet,
)
from rosoclingo.loop.loop import Loop, LoopSnapshot
from rosoclingo.loop.mode.controller import Decider, Info
from rosoclingo.loop.state import State
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.loop.values.solver import Solver
from rosoclingo.store.commands import RecordedSolver
from rosoclingo.store.lasting_controller import LastingController
from rosoclingo.store.outbox import Outbox, StoredClient
from rosoclingo.store.store import Changes, KnownGoal, Store

_SHORT_PAUSE_SECONDS = 2.0  # so soon a node is back, and an action took as long as it seems
_LATEST_SECONDS = 0.2  # so much work may be lost, besides the decision that is carried out


class StoredInbox(Inbox):
    """An inbox that stores each input before anybody sees it. Thread-safe.

    Goals and cancel requests outlast a failure of power when :meth:`put` returns, messages the end
    of the process.

    Attributes:
        looked: Called by the loop's thread when it polls.
        waits: Called by the loop's thread before it waits.
        way: Wraps a goal's client.
    """

    def __init__(self, store: Store, *arguments: Any, **parameters: Any) -> None:
        """Makes an empty inbox.

        Args:
            store: Where all is written.
            arguments: What a further base class takes.
            parameters: Likewise.
        """
        self._store = store
        self._order = threading.Lock()  # has things written in the order in which they are taken
        self._numbers: Dict[int, int] = {}  # of the things that wait, by their ids in Python
        self._taken: List[int] = []
        self._stopped: Optional[str] = None  # why nothing is taken any more of a run that goes on
        self.looked: Callable[[], None] = lambda: None
        self.waits: Callable[[], None] = lambda: None
        self.way: Callable[[GoalClient], GoalClient] = lambda client: client
        super().__init__(*arguments, **parameters)

    def put(self, item: Item) -> None:
        """Writes and adds an item.

        After the end of the run, a goal is rejected instead, which is written, too: whoever sends
        it again, to the next run, hears the same. A shutdown does not end the run: what comes
        meanwhile is for the process that goes on.

        Raises:
            StoreError: It cannot be written, and is not added; or :meth:`stop` was called.
        """
        with self._order:
            if self._stopped is not None:
                raise StoreError(self._stopped)
            if isinstance(item, Goal):
                item.reroute(self.way)
            elif self._end is not None:
                return
            self.put_known(item, self._store.add(item))

    def put_known(self, item: Item, number: Optional[int]) -> None:
        """Adds an item that is written.

        Args:
            item: The item.
            number: Its number in the store; None if it is not to be known there.
        """
        if number is not None:
            self._numbers[id(item)] = number
        super().put(item)

    def cancel(self, goal: Goal) -> None:
        """Writes and adds a cancel request; the goal is recalled at once if it has no slot.

        Raises:
            StoreError: It cannot be written, and is not added; the loop may have ended.
        """
        with self._order:
            stopped = self._stopped if self._end is None else self._end
            if stopped is not None:
                raise StoreError(stopped)
            item = Cancel(goal)
            number = self._store.add(item)
            if self.recalls_at_once(item):
                goal.recall()
            self.put_known(item, number)

    def stop(self, reason: str) -> None:
        """Refuses inputs from now on, since the run cannot go on in this process."""
        with self._order:
            self._stopped = reason

    def begin_decision(self, waits: Callable[[], None]) -> None:
        """Called before the controller decides; a replay's inbox may wait."""
        super().begin_decision(lambda: self._wait(waits))

    def begin_command(self, waits: Callable[[], None]) -> None:
        """Called before a command is carried out; a replay's inbox may wait."""
        super().begin_command(lambda: self._wait(waits))

    def begin_end(self, waits: Callable[[], None]) -> None:
        """Called before the loop ends; a replay's inbox may wait."""
        super().begin_end(lambda: self._wait(waits))

    def _wait(self, waits: Callable[[], None]) -> None:
        waits()
        self.waits()

    def run_callbacks(self) -> None:
        """Flushes outputs that need no transaction, and runs what :meth:`call_soon` has queued."""
        self.looked()
        super().run_callbacks()

    def take(self) -> List[Item]:
        """Returns all items in order of arrival and removes them; does not wait."""
        items = super().take()
        numbers = (self._numbers.pop(id(item), None) for item in items)
        self._taken += (number for number in numbers if number is not None)
        return items

    def begin_improving(self) -> None:
        """Commits the state before a search that may last."""
        super().begin_improving()
        self.waits()

    def wait(self, timeout: float) -> bool:
        """Waits until there is an item."""
        self.waits()
        return super().wait(timeout)

    def forget(self, number: int) -> None:
        """Removes an input from the store with the next commit."""
        self._taken.append(number)

    def written(self) -> List[int]:
        """Returns the numbers of the inputs that were taken since the last call."""
        taken, self._taken = self._taken, []
        return taken


class StoredReplayInbox(StoredInbox, ReplayInbox):
    """The inbox of a replay whose nodes are killed as the recorded ones were."""


class _Back:
    """Waits for a lost solver, and records in the journal that it was replaced."""

    def __init__(self, solver: str, loop: StoredLoop) -> None:
        self._solver = solver
        self._loop = loop
        self._reason = ""  # why it was lost first
        self._since = self._until = 0.0  # when it was missed

    def wait(self, err: ServiceError) -> None:
        """Waits; see :class:`.commands.Back`."""
        if not self._reason:
            self._reason, self._since = str(err), time.monotonic()
        self._loop.wait_for_solver(err)
        self._until = time.monotonic()

    def done(self) -> None:
        """Records in the journal that the solver is restored."""
        seconds = self._until - self._since
        self._loop.state.note(NodeResumed(self._solver, self._reason, seconds))
        self._reason = ""


class StoredLoop(Loop):
    """A loop that checkpoints to a store, from which it resumes after a crash.

    It commits before an action, a status or a result leaves, before the loop waits, and after
    a decision if the last commit was some time ago. What has been decided since then is
    decided again after a crash. Call :meth:`resume` before anything comes in. With a store, a
    shutdown ends no goals.
    """

    def __init__(
        self,
        controller: Decider,
        planner: Solver,
        commands: Callable[[State], Any],
        inbox: StoredInbox,
        environment: Environment,
        *,
        store: Store,
        started_with: Callable[[], Mapping[str, str]],
        wait_for_solvers: Optional[Callable[[], None]] = None,
        **parameters: Any,
    ) -> None:
        """Prepares a loop; :meth:`resume` reads the run in the store.

        Args:
            controller: Says what to do next.
            planner: Solver with the task's encoding.
            commands: Class with a method for each command.
            inbox: Where everything comes in.
            environment: Where actions and log messages go.
            store: Where all is written.
            started_with: Returns what the nodes were started with, by what that is; called when
                they are there.
            wait_for_solvers: Returns when the solvers are there, or raises a ServiceError after a
                while; without it, the loop ends when one was lost.
            parameters: Those of :class:`Loop` that have a name.
        """
        self._store = store
        self._started_with = started_with
        self._inbox = inbox
        self._outbox = Outbox(environment, store)
        self._wait_for_solvers = wait_for_solvers
        self._begun = time.monotonic()
        if wait_for_solvers is None:
            self._planner = RecordedSolver(planner)
        else:
            self._planner = RecordedSolver(planner, _Back("planner", self))
            controller = LastingController(controller, _Back("controller", self))
        self._planner.written = lambda: store.commands
        self._saved: Optional[LoopSnapshot] = None
        self._is_unsure = True  # whether the solvers are those of the run
        self._has_begun = False  # which is written
        inbox.looked = self._outbox.flush
        inbox.waits = self._wait
        self._saved_at = 0.0
        self._untold: List[Event] = []  # by the journal, of goals that have ended
        # What the controller knew before the decision that is carried out, and the result of a
        # search that it was told; None as soon as its command may have changed something else.
        self._before: Optional[Tuple[str, Optional[Result]]] = None
        inbox.way = partial(StoredClient, outbox=self._outbox)
        super().__init__(
            controller, self._planner, commands, inbox, self._outbox, **parameters
        )  # fmt: skip

    def wait_for_solver(self, err: ServiceError) -> None:
        """Waits until the solvers are there, one of which was lost.

        Raises:
            ServiceError: They do not come.
            StoreError: They are others.
        """
        if self._inbox.closed or self._wait_for_solvers is None:
            raise err
        self._outbox.warn(f"{err}; waits until that node is there, and gives it its commands again")
        self._wait_for_solvers()
        was_unsure, self._is_unsure = self._is_unsure, True  # goals stay open if they are others
        self._store.check(self._started_with())
        self._is_unsure = was_unsure

    @property
    def is_refused(self) -> bool:
        """Whether it is still unconfirmed that the stored run can be resumed."""
        return self._is_unsure or (not self._has_begun and self._store.failure is not None)

    def resume(self, client: Callable[[KnownGoal], GoalClient]) -> Dict[str, Goal]:
        """Restores goals, queue, slots, mail and untaken inputs from the store.

        Args:
            client: Returns who has sent a goal.

        Returns:
            The goals that have not ended, by their ids.
        """
        known = self._store.goals
        goals: Dict[str, Goal] = {}

        def sender(identifier: str) -> GoalClient:
            """Returns who has sent a goal, if it has not ended."""
            one = known.get(identifier)
            if one is None or one.status.is_terminal:
                return GoalClient()
            return self._inbox.way(client(one))

        if self._store.snapshot is not None:
            self._saved = self._store.snapshot
            goals = self.state.restore(self._saved.state, sender)
            if self._store.pause > _SHORT_PAUSE_SECONDS:
                self.state.executions.interrupt()
        for goal in goals.values():
            end = known.get(goal.id)
            if end is not None and end.status.is_terminal and not goal.ended:
                self._end(goal, end)
                self.state.goals.some_ended = True

        def find(identifier: str) -> Optional[Goal]:
            """Returns a goal of the snapshot, or a new one that it does not have."""
            new = known.get(identifier)
            if identifier in goals or new is None:
                return goals.get(identifier)
            goal = Goal(new.request, new.information, new.id, sender(identifier))
            if new.status.is_terminal and new.reason != Reason.RECALLED:
                if new.status is Status.REJECTED:
                    self._tell_end(new, arrival_of(goal))
                return None
            goals[identifier] = goal
            if new.status.is_terminal:
                self._end(goal, new)
            return goal

        for number, item in self._store.inputs(find):
            if item is None:
                self._inbox.forget(number)
            else:
                self._inbox.put_known(item, number)
        return {key: goal for key, goal in goals.items() if not goal.ended}

    def _end(self, goal: Goal, known: KnownGoal) -> None:
        """Ends a goal whose end the snapshot does not have.

        Another thread had recalled it, or it was rejected in a search.
        """
        goal.status, goal.reason = known.status, known.reason
        self._tell_end(known)

    def _tell_end(self, goal: KnownGoal, *before: Event) -> None:
        """Records the end of a goal in the journal, after earlier events, unless it has it."""
        told = (*(record.event for record in self._store.records), *self._untold)
        if not any(isinstance(one, StatusSet) and one.goal == goal.id for one in told):
            end = StatusSet(goal.id, goal.status, "", Reason.of(goal.reason))
            self._untold += [*before, end]

    def unsure(self) -> List[KnownGoal]:
        """Returns the goals that ended so late that their clients may not have the result."""
        return [one for one in self.ended() if one.time >= self._store.unsure_since]

    def ended(self) -> List[KnownGoal]:
        """Returns the ended goals of the store, in the order of their ends."""
        return self._store.ended_goals

    def prepare(self) -> None:
        """Prepares the controller, and the planner if the run goes on.

        Raises:
            StoreError: The nodes were started with something else than before.
            PlannerError: The planner does not become what it was.
        """
        started_with = self._started_with()
        if self._saved is not None:
            self._store.check(started_with)
        self._outbox.begin()
        if self._saved is None:
            self._store.begin(started_with)
            self._is_unsure = False
            super().prepare()
            self._save()
            self._has_begun = True
            return
        self._controller.restore(self._saved.controller)
        self._planner.restore()
        self._saved = None
        self._is_unsure = False
        state = self.state
        state.note(NodeResumed(LOOP, seconds=time.monotonic() - self._begun))
        for event in self._untold:
            state.note(event)
        state.show_plan()
        self._save()
        self._has_begun = True
        if self._has_published():
            self._commands.publish()  # for those who come late: the topic is another process's
            self._save()
        else:
            self._outbox.send_again()

    def _has_published(self) -> bool:
        """Whether the mode has run the command ``publish``."""
        events = (record.event for record in self._store.records)
        return any(isinstance(event, CommandDone) and event.publishes for event in events)

    def step(self) -> None:
        """Makes one decision, carries it out, and commits if it is time.

        Raises:
            StoreError: It cannot be written; nothing has left the node then.
        """
        self._before = self._controller.snapshot(), self.state.result
        super().step()

    def _let_out(self) -> None:
        if self._outbox.is_urgent or self._outbox.now() - self._saved_at >= _LATEST_SECONDS:
            self._save()

    def _call(self, command: clingo.Symbol, info: Info) -> None:
        done = CommandDone(str(command))
        if not (done.waits or done.resets):  # a reset changes nothing before it has waited
            self._before = None
        super()._call(command, info)

    def _wait(self) -> None:
        """Commits while the loop waits, as if the decision to wait were still to come."""
        if self._before is None or self._store.failure is not None or self._outbox.is_empty:
            self._outbox.flush()
            return
        state = self.state
        controller, told = self._before
        result, state.result = state.result, told
        self._write(LoopSnapshot(controller, state.snapshot()))
        state.result = result

    def _save(self, ended: Optional[str] = None) -> None:
        self._write(self.parts(), ended)

    def _write(self, snapshot: LoopSnapshot, ended: Optional[str] = None) -> None:
        changes = Changes(
            taken=self._inbox.written(),
            snapshot=snapshot,
            commands=self._planner.take(),
            shortens=not self._planner.events_are_facts,
        )
        self._outbox.save(changes, ended=ended)
        self._saved_at = self._outbox.now()

    def end(self, reason: str, *, from_outside: bool = False) -> None:
        """Ends the run: open goals are aborted; or interrupts it, if it can go on later."""
        if self._inbox.closed:
            return
        if self.is_refused or self._store.failure is not None:
            self._inbox.stop(reason)
            return
        super().end(reason, from_outside=from_outside)
        self._save(ended=reason)
