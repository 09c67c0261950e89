"""Transactional outbox: releases effects only after the state they depend on is committed."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from functools import partial, wraps
from typing import (
    Any,
    Callable,
    Deque,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    TypeVar,
    Union,
    cast,
)

from rosoclingo.errors import StoreError
from rosoclingo.loop.journal import Entry, Reason, Record, Status, StatusSet
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.goals import GoalClient
from rosoclingo.store.store import Changes, Store

_Method = TypeVar("_Method", bound=Callable[..., Any])

_URGENT = ("dispatch", "publication")
"""The effects that are let out first, because actuators wait for them."""


_FOR_OPERATORS = ("held", "answer to an operator")


class HeldEffect(NamedTuple):
    """Something that leaves the loop, or a goal, after a commit.

    Attributes:
        kind: What it is.
        let_out: Lets it out.
        action: Actuator and action, if it publishes one.
        change: How a goal is accepted or ends, if it tells that.
    """

    kind: str
    let_out: Callable[[], None]
    action: Optional[Tuple[str, str]] = None
    change: Optional[StatusSet] = None


def _held(kind: str, method: _Method) -> _Method:
    """Returns a method of the outbox that holds an effect: the same method of its environment."""

    @wraps(method)
    def hold(self: Outbox, *args: Any) -> None:
        self.add(HeldEffect(kind, partial(getattr(self._environment, method.__name__), *args)))

    return cast(_Method, hold)


def _passed_on(method: _Method) -> _Method:
    """Returns a method of the outbox that calls the same method of its environment at once."""

    @wraps(method)
    def call(self: Outbox, *args: Any) -> Any:
        return getattr(self._environment, method.__name__)(*args)

    return cast(_Method, call)


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
        # Of the loop's thread, until its next commit; others add to the records.
        self._effects: List[HeldEffect] = []
        self._records: List[Entry] = []  # whose numbers follow when they are written
        # Guards the journal's number, and that its records leave in their order. Held while it is
        # written, and actions leave; whoever has it takes no lock of actionlib's or of a goal.
        self._lock = threading.Lock()
        self._number = max((record.number for record in store.records), default=0)
        self._written: Deque[Entry] = deque()  # and have not left yet
        # Of other threads, to be written with the next transaction of any thread; these records are
        # before those above. Who has added an effect lets it out: another may lack a lock for that.
        self._joint_effects: List[HeldEffect] = []
        self._joint_records: List[Entry] = []
        self._gathered = threading.local()  # the effects of a thread that is in :meth:`together`

    def begin(self) -> None:
        """Confirms that the run is resumed, in this thread, which is the loop's."""
        with self._lock:
            self._owner = threading.get_ident()
            self._is_unsure = False

    # What the loop calls.

    now = _passed_on(Environment.now)
    world_now = _passed_on(Environment.world_now)
    begin_to_wait = _passed_on(Environment.begin_to_wait)
    miss_plan = _passed_on(Environment.miss_plan)
    finish_reasons = _passed_on(Environment.finish_reasons)
    info = _passed_on(Environment.info)
    warn = _passed_on(Environment.warn)

    show_served = _held("dispatch", Environment.show_served)
    show_executions = _held("dispatch", Environment.show_executions)
    show_held = _held("held", Environment.show_held)
    answer_control = _held("answer to an operator", Environment.answer_control)
    show_plan = _held("plan", Environment.show_plan)
    show_quality = _held("plan", Environment.show_quality)
    show_beliefs = _held("beliefs", Environment.show_beliefs)

    def publish(self, actuator: str, action: str) -> None:
        """Sends an action."""
        out = (actuator, action)
        self.add(HeldEffect("publication", partial(self._environment.publish, *out), action=out))

    def note(self, record: Record) -> None:
        """Adds an event to the journal."""
        self.add(Entry(record.event, record.step, record.horizon, seconds=time.time()))

    # What lets it out.

    def add(self, one: Union[HeldEffect, Entry]) -> None:
        """Holds an effect of the loop's thread, and lets one of another thread out."""
        effects, records = ([one], []) if isinstance(one, HeldEffect) else ([], [one])
        if threading.get_ident() == self._owner:
            self._effects += effects
            self._records += records
            return
        with contextlib.suppress(StoreError):  # the loop's thread ends because of it
            with self._lock:
                # Who reads the journal goes by what the loop has done before.
                waits_for_loop = self._records and any(map(_is_recall, records))
                if self._is_unsure or waits_for_loop:
                    self._effects += effects
                    self._records += records
                    return
                self._joint_effects += effects
                self._joint_records += records
            gathered = getattr(self._gathered, "effects", None)
            if gathered is None:
                self._write_joint(effects)
            else:
                gathered += effects

    @contextlib.contextmanager
    def together(self) -> Iterator[None]:
        """A context in which the effects of this thread are gathered for one transaction.

        Their records are before all that the loop's thread notes meanwhile. Effects of the loop's
        thread itself are held anyway.
        """
        if threading.get_ident() == self._owner:
            yield
            return
        effects: List[HeldEffect] = []
        self._gathered.effects = effects
        try:
            yield
        finally:
            self._gathered.effects = None
            with contextlib.suppress(StoreError):  # the loop's thread ends because of it
                self._write_joint(effects)

    def _write_joint(self, own: Sequence[HeldEffect]) -> None:
        """Commits what other threads than the loop's have added, and lets this thread's out."""
        with self._lock:
            effects, records = self._take_joint()
            if effects or records:
                self._write(effects, records, Changes())
                self._tell()
            elif self._store.failure is not None:  # another thread could not write them
                raise self._store.failure
        self._let_out(own)

    def _take_joint(self) -> Tuple[List[HeldEffect], List[Entry]]:
        joint = self._joint_effects, self._joint_records
        self._joint_effects, self._joint_records = [], []
        return joint

    @property
    def is_urgent(self) -> bool:
        """True if a client, an actuator or an operator waits for an effect that is held.

        An operator decides about actions by their tokens, which are those of the committed state.
        """
        return any(one.action or one.change or one.kind in _FOR_OPERATORS for one in self._effects)

    @property
    def is_empty(self) -> bool:
        """Whether no effect is held."""
        return not (self._effects or self._records)

    def flush(self) -> None:
        """Lets out effects that need no commit, such as feedback.

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
        changes = [one.change for one in self._effects if one.change is not None]
        ends = [change for change in changes if change.status.is_terminal]
        if ends and all(end.status is Status.REJECTED for end in ends):
            with self._lock:
                self._effects = [
                    one._replace(change=None) if one.change in ends else one
                    for one in self._effects
                ]
                self._store.write(Changes(statuses=ends))
        if self._effects and not self.is_urgent:
            with self._lock:
                effects, self._effects = self._effects, []
            self._let_out(effects)

    def save(self, changes: Changes, *, ended: Optional[str] = None) -> None:
        """Commits the loop's state, and lets out the effects that are held.

        Args:
            changes: What is to be written besides what is held.
            ended: Why the run ends with this, if it does.

        Raises:
            StoreError: It cannot be written; nothing leaves.
        """
        with self._lock:
            joint, records = self._take_joint()
            effects, self._effects = self._effects, []
            records += self._records
            self._records = []
            keys = self._write([*joint, *effects], records, changes, ended)
            self._let_out([one for one in effects if one.kind in _URGENT])
            if keys:
                self._store.note_sent(keys)
            self._tell()
        self._let_out([one for one in effects if one.kind not in _URGENT])

    def _write(
        self,
        effects: Sequence[HeldEffect],
        records: Sequence[Entry],
        changes: Changes,
        ended: Optional[str] = None,
    ) -> List[str]:
        """Commits, and returns the keys of the actions to publish."""
        changes.actions = [one.action for one in effects if one.action is not None]
        changes.statuses = [one.change for one in effects if one.change is not None]
        first = self._number + 1
        changes.records = [replace(one, number=n) for n, one in enumerate(records, first)]
        self._number += len(records)
        keys = self._store.write(changes, ended=ended)
        self._written += changes.records
        return keys

    def _tell(self) -> None:
        """Lets out the journal's records, also those before an action that cannot be published."""
        while self._written:
            self._environment.note(self._written.popleft())

    def _let_out(self, effects: Sequence[HeldEffect]) -> None:
        for one in effects:
            self._store.point(f"before {one.kind}")
            one.let_out()
            self._store.point(f"after {one.kind}")

    def send_again(self) -> None:
        """Publishes again the actions that may not have been published (at least once)."""
        publish, unsent = self._environment.publish, self._store.unsent
        self._let_out(
            [HeldEffect("publication", partial(publish, *out)) for out in unsent.values()]
        )
        self._store.note_sent(list(unsent))


def _is_recall(record: Record) -> bool:
    return isinstance(record.event, StatusSet) and record.event.reason is Reason.RECALLED


@dataclass(eq=False)
class StoredClient(GoalClient):
    """Calls a goal's client back only after the commit.

    Attributes:
        client: Who has sent the goal.
        outbox: Where it is held.
    """

    client: GoalClient
    outbox: Outbox

    def noted(self, change: StatusSet) -> None:
        """Has the change noted, which the outbox holds by itself."""
        self.client.noted(change)

    def changed(self, change: StatusSet) -> None:
        """Tells the client the change after its commit."""
        kind = "result" if change.status.is_terminal else "status"
        self.outbox.add(HeldEffect(kind, partial(self.client.changed, change), change=change))

    def feedback(self, line: str) -> None:
        """Tells the client a line after the commit of everything before it."""
        self.outbox.add(HeldEffect("feedback", partial(self.client.feedback, line)))

    @property
    def address(self) -> str:
        """The address by which the client is found again."""
        return self.client.address
