"""Transactional outbox: releases effects only after the state they depend on is committed."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from dataclasses import dataclass, field, replace
from typing import Callable, Deque, List, Optional, Sequence, Tuple

from rosoclingo.errors import StoreError
from rosoclingo.loop.journal import NumberedRecord, Reason, Record, Status, StatusSet
from rosoclingo.loop.quality import Quality
from rosoclingo.loop.values.arrivals import ExpectedArrival
from rosoclingo.loop.values.atoms import Action
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal, GoalClient
from rosoclingo.store.store import Changes, Store

_Release = Tuple[str, Callable[[], None]]
_URGENT = ("dispatch", "publication")
"""The effects that are released first, because somebody waits for them."""


@dataclass
class _Held:
    """Effects that are held until the next commit.

    Attributes:
        records: For the journal, with their times; numbers follow when they are written.
        actions: Actuators and actions, in order.
        statuses: How goals are accepted, or end.
        releases: What lets all but the journal's records out, in order, each with what it is.
    """

    records: List[NumberedRecord] = field(default_factory=list)
    actions: List[Tuple[str, str]] = field(default_factory=list)
    statuses: List[StatusSet] = field(default_factory=list)
    releases: List[_Release] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.records or self.releases)

    def add(self, said: _Held) -> None:
        """Appends later effects."""
        self.records += said.records
        self.actions += said.actions
        self.statuses += said.statuses
        self.releases += said.releases


class Outbox(Environment):
    """Wraps an environment so that no action, status, result or event precedes its commit.

    Effects of the loop's thread are released by its next commit, those of other threads at once.
    But nothing of a stored run is released before it is confirmed that the run is resumed.
    Thread-safe.
    """

    def __init__(self, environment: Environment, store: Store) -> None:
        """Wraps an environment.

        Args:
            environment: Where all leaves.
            store: Where all is written.
        """
        self._environment = environment
        self._store = store
        self._owner: Optional[int] = None  # the loop's thread
        self._is_unsure = store.snapshot is not None  # whether the run in the store goes on
        self._held = _Held()  # of the loop's thread; others add to its records
        # Guards the journal's number, and that its records leave in their order. Held while it is
        # written, and actions leave; whoever has it takes no lock of actionlib's or of a goal.
        self._lock = threading.Lock()
        self._number = max((record.number for record in store.records), default=0)
        self._written: Deque[NumberedRecord] = deque()  # and have not left yet

    def begin(self) -> None:
        """Confirms that the run is resumed, in this thread, which is the loop's."""
        with self._lock:
            self._owner = threading.get_ident()
            self._is_unsure = False

    # What the loop calls.

    def now(self) -> float:
        """Returns the environment's time."""
        return self._environment.now()

    def world_now(self) -> float:
        """Returns the time where actuators act."""
        return self._environment.world_now()

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action."""
        held = _Held(actions=[(actuator, action)])
        held.releases = [("publication", lambda: self._environment.publish(actuator, action))]
        self._take(held)

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        """Publishes the last action of each actuator."""
        self.later("dispatch", lambda: self._environment.show_executions(run, executions))

    def show_plan(
        self,
        step: int,
        horizon: int,
        actions: Sequence[Action],
        arrivals: Sequence[ExpectedArrival] = (),
    ) -> None:
        """Publishes the plan."""
        self.later("plan", lambda: self._environment.show_plan(step, horizon, actions, arrivals))

    def show_quality(self, quality: Optional[Quality]) -> None:
        """Publishes the plan's quality."""
        self.later("plan", lambda: self._environment.show_quality(quality))

    def begin_to_wait(self, goals: Sequence[Goal]) -> None:
        """Passes on that there is no action for goals now."""
        self._environment.begin_to_wait(goals)

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        """Passes on that there is no plan for goals."""
        self._environment.miss_plan(goals)

    def finish_reasons(self) -> None:
        """Waits for explanations under way."""
        self._environment.finish_reasons()

    def note(self, record: Record) -> None:
        """Adds an event to the journal."""
        timed = NumberedRecord(record.event, record.step, record.horizon, time=time.time())
        self._take(_Held(records=[timed]))

    def info(self, text: str) -> None:
        """Logs information."""
        self._environment.info(text)

    def warn(self, text: str) -> None:
        """Logs a warning."""
        self._environment.warn(text)

    # What goals' clients call.

    def later(self, what: str, release: Callable[[], None]) -> None:
        """Releases an effect after the commit of everything before it."""
        self._take(_Held(releases=[(what, release)]))

    def change_goal(self, change: StatusSet, release: Callable[[], None]) -> None:
        """Releases the acceptance or the result of a goal after its commit."""
        what = "result" if change.status.is_terminal else "status"
        self._take(_Held(statuses=[change], releases=[(what, release)]))

    # What lets it out.

    def _take(self, said: _Held) -> None:
        if threading.get_ident() != self._owner:
            with contextlib.suppress(StoreError):  # the loop's thread ends because of it
                self._let_out_of_another(said)
            return
        self._held.add(said)

    def _let_out_of_another(self, said: _Held) -> None:
        """Releases effects of another thread."""
        with self._lock:
            # Who reads the journal goes by what the loop has done before.
            waits_for_loop = self._held.records and any(map(_is_recall, said.records))
            if self._is_unsure or waits_for_loop:
                self._held.add(said)
                return
            self._write(said, Changes())
            self._tell()
        self._release(said.releases)

    @property
    def is_urgent(self) -> bool:
        """Whether an effect is held for which somebody waits: an action, a status or a result."""
        return bool(self._held.actions or self._held.statuses)

    @property
    def is_empty(self) -> bool:
        """Whether no effect is held."""
        return not self._held

    def flush(self) -> None:
        """Releases effects that need no commit, such as feedback.

        That goals are rejected is written before, without the loop's snapshot, in which the search
        may be half done for which it would wait. Whoever goes on from there knows these goals no
        more, and has the journal tell of them.

        Raises:
            StoreError: It cannot be written, or what came before could not.
        """
        if threading.get_ident() != self._owner:
            return
        if self._store.failure is not None:
            raise self._store.failure
        ends = [one for one in self._held.statuses if one.status.is_terminal]
        if ends and all(one.status is Status.REJECTED for one in ends):
            with self._lock:
                self._held.statuses = [one for one in self._held.statuses if one not in ends]
                self._store.write(Changes(statuses=ends))
        if self._held.releases and not self.is_urgent:
            releases, self._held.releases = self._held.releases, []
            self._release(releases)

    def save(self, changes: Changes, *, ended: Optional[str] = None) -> None:
        """Commits the loop's state, and releases the effects that are held.

        Args:
            changes: What is to be written besides what is held.
            ended: Why the run ends with this, if it does.

        Raises:
            StoreError: It cannot be written; nothing leaves.
        """
        with self._lock:
            held, self._held = self._held, _Held()
            keys = self._write(held, changes, ended)
            self._release([one for one in held.releases if one[0] in _URGENT])
            if keys:
                self._store.note_sent(keys)
            self._tell()
        self._release([one for one in held.releases if one[0] not in _URGENT])

    def _write(self, held: _Held, changes: Changes, ended: Optional[str] = None) -> List[str]:
        """Commits, and returns the keys of the actions to publish."""
        changes.actions, changes.statuses = held.actions, held.statuses
        first = self._number + 1
        changes.records = [replace(one, number=n) for n, one in enumerate(held.records, first)]
        self._number += len(held.records)
        keys = self._store.write(changes, ended=ended)
        self._written += changes.records
        return keys

    def _tell(self) -> None:
        """Releases the journal's records, also those before an action that cannot be published."""
        while self._written:
            self._environment.note(self._written.popleft())

    def _release(self, releases: Sequence[_Release]) -> None:
        for what, release in releases:
            self._store.point(f"before {what}")
            release()
            self._store.point(f"after {what}")

    def send_again(self) -> None:
        """Publishes again the actions that may not have been published (at least once)."""
        for actuator, action in self._store.unsent:
            self._store.point("before publication")
            self._environment.publish(actuator, action)
            self._store.point("after publication")
        self._store.note_all_sent()


def _is_recall(record: Record) -> bool:
    return isinstance(record.event, StatusSet) and record.event.reason is Reason.RECALLED


class StoredClient(GoalClient):
    """Calls a goal's client back only after the commit."""

    def __init__(self, client: GoalClient, outbox: Outbox) -> None:
        """Wraps a client.

        Args:
            client: Who has sent the goal.
            outbox: Where it is held.
        """
        self._client = client
        self._outbox = outbox

    def noted(self, change: StatusSet) -> None:
        """Has the change noted, which the outbox holds by itself."""
        self._client.noted(change)

    def changed(self, change: StatusSet) -> None:
        """Tells the client the change after its commit."""
        self._outbox.change_goal(change, lambda: self._client.changed(change))

    def feedback(self, line: str) -> None:
        """Tells the client a line after the commit of everything before it."""
        self._outbox.later("feedback", lambda: self._client.feedback(line))

    @property
    def address(self) -> str:
        """The address by which the client is found again."""
        return self._client.address
