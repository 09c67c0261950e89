"""A loop that goes on where another one was whose process has died."""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, List, Mapping, Optional

from rosclingo.errors import ServiceError
from rosoclingo.loop.controller import Decider
from rosoclingo.loop.environment import Environment
from rosoclingo.loop.goals import Goal, GoalClient, Stage
from rosoclingo.loop.inbox import Cancel, Inbox, Item
from rosoclingo.loop.loop import Loop, LoopSnapshot
from rosoclingo.loop.solver import Solver
from rosoclingo.loop.state import State
from rosoclingo.store.commands import RecordedSolver
from rosoclingo.store.lasting_controller import LastingController
from rosoclingo.store.outbox import Outbox, StoredClient
from rosoclingo.store.store import Changes, KnownGoal, Store

_DRAINED_SECONDS = 2.0  # so long after it was published, a result has left the process for sure


class StoredInbox(Inbox):
    """An inbox that writes what comes before anybody learns of it. Thread-safe.

    Goals and cancel requests outlast a failure of power when :meth:`put` returns, messages the end
    of the process.

    Attributes:
        looked: Called by who looks what has come.
        way: Returns what is told in the place of a goal's client.
    """

    def __init__(self, store: Store, *arguments: Any, **parameters: Any) -> None:
        """Begins empty.

        Args:
            store: Where all is written.
            arguments: What a further base class takes.
            parameters: Likewise.
        """
        self._store = store
        self._order = threading.Lock()  # has things written in the order in which they are taken
        self._numbers: Dict[int, int] = {}  # of the things that wait, by their ids in Python
        self._taken: List[int] = []
        self.looked: Callable[[], None] = lambda: None
        self.way: Callable[[Goal], Callable[[GoalClient], GoalClient]] = lambda _: lambda c: c
        super().__init__(*arguments, **parameters)

    def put(self, item: Item) -> None:
        """Writes and adds an item.

        Raises:
            StoreError: It cannot be written, and is not added.
        """
        with self._order:
            if self._end is not None:
                super().put(item)
                return
            if isinstance(item, Goal):
                item.reroute(self.way(item))
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
        """Writes and adds a cancel request; the goal is recalled at once if it has no slot."""
        with self._order:
            item = Cancel(goal)
            number = None if self._end is not None else self._store.add(item)
            goal.recall()
            self.put_known(item, number)

    def take(self) -> List[Item]:
        """Returns all items in order of arrival and removes them; does not wait."""
        self.looked()
        items = super().take()
        numbers = (self._numbers.pop(id(item), None) for item in items)
        self._taken += (number for number in numbers if number is not None)
        return items

    def wait(self, timeout: float) -> bool:
        """Waits until there is something."""
        self.looked()
        return super().wait(timeout)

    def forget(self, number: int) -> None:
        """Has something removed from the store, together with what is taken next."""
        self._taken.append(number)

    def written(self) -> List[int]:
        """Returns the numbers of what was taken since the last call."""
        taken, self._taken = self._taken, []
        return taken


class StoredLoop(Loop):
    """A loop that is written to a store after each command, and goes on from there.

    Call :meth:`resume` before anything comes in. With a store, a shutdown ends no goals.
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
        """Prepares a loop that asks nobody yet.

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
        back = None if wait_for_solvers is None else self._back
        self._planner = RecordedSolver(planner, back)
        self._planner.written = lambda: store.commands
        if back is not None:
            controller = LastingController(controller, back)
        self._saved: Optional[LoopSnapshot] = None
        self._is_refused = store.snapshot is not None  # until it is sure that it can go on
        inbox.looked = self._outbox.flush
        inbox.way = self._way
        super().__init__(
            controller, self._planner, commands, inbox, self._outbox, **parameters
        )  # fmt: skip

    def _back(self, err: ServiceError) -> None:
        """Waits for solvers of which one was lost; see :data:`.commands.Back`."""
        if self._inbox.closed or self._wait_for_solvers is None:
            raise err
        self._outbox.warn(f"{err}; waits for the node to be started again")
        self._wait_for_solvers()
        self._store.check(self._started_with())

    def _way(self, goal: Goal) -> Callable[[GoalClient], GoalClient]:
        return lambda client: StoredClient(client, self._outbox, goal.id)

    def resume(self, client: Callable[[KnownGoal], GoalClient]) -> Dict[str, Goal]:
        """Takes over goals, queue, slots, mail and what has come from the store.

        Args:
            client: Returns who has sent a goal.

        Returns:
            The goals that have not ended, by their ids.
        """
        known = self._store.goals
        goals: Dict[str, Goal] = {}
        if self._store.snapshot is not None:
            self._saved = self._store.snapshot
            goals = self.state.restore(
                self._saved.state,
                lambda key: (
                    StoredClient(client(known[key]), self._outbox, key)
                    if key in known and not known[key].word
                    else GoalClient()
                ),
            )
        for goal in goals.values():
            end = known.get(goal.id)
            if end is not None and end.word and goal.stage is not Stage.ENDED:
                goal.stage = Stage.ENDED
                goal.recalled = end.word == "canceled" and goal.slot is None
                self.state.goals.some_ended = True

        def find(identifier: str) -> Optional[Goal]:
            """Returns a goal, be it in the snapshot, or one that it does not know of."""
            new = known.get(identifier)
            if identifier not in goals and new is not None and not new.word:
                goal = Goal(new.request, new.information, new.id, client(new))
                goal.reroute(self._way(goal))
                goals[identifier] = goal
            return goals.get(identifier)

        for number, item in self._store.inputs(find):
            if item is None:
                self._inbox.forget(number)
            else:
                self._inbox.put_known(item, number)
        return {key: goal for key, goal in goals.items() if goal.stage is not Stage.ENDED}

    def unsure(self) -> List[KnownGoal]:
        """Returns the goals that ended so late that their clients may not know it."""
        ended = (goal for goal in self._store.goals.values() if goal.word)
        return [goal for goal in ended if goal.time >= self._store.last - _DRAINED_SECONDS]

    def prepare(self) -> None:
        """Prepares the controller, and the planner if the run goes on.

        Raises:
            StoreError: The nodes were started with something else than before.
            PlannerError: The planner does not become what it was.
        """
        self._outbox.begin()
        started_with = self._started_with()
        if self._saved is None:
            self._store.begin(started_with)
            super().prepare()
            self._save()
            return
        self._store.check(started_with)
        self._controller.restore(self._saved.controller)
        self._planner.restore()
        self._saved = None
        self._is_refused = False
        state = self.state
        self._outbox.show_plan(state.step, state.horizon, state.ahead())
        self._outbox.flush()
        self._outbox.send_again()

    def step(self) -> None:
        """Makes one decision, carries it out, and writes what that has changed.

        Raises:
            StoreError: It cannot be written; nothing has left the node then.
        """
        super().step()
        self._save()

    def _save(self, ended: Optional[str] = None) -> None:
        changes = Changes(
            taken=self._inbox.written(),
            snapshot=self.parts(),
            commands=self._planner.take(),
            shortens=not self._planner.events_are_facts,
        )
        self._outbox.save(changes, ended=ended)

    def end(self, reason: str) -> None:
        """Ends the run: open goals are aborted; or interrupts it, if it can go on later."""
        inbox = self._inbox
        if inbox.closed or self._is_refused or self._store.failure is not None:
            inbox.end(reason)
            return
        super().end(reason)
        self._save(ended=reason)
