"""The store of a run: its tables and transactions."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import time
from collections import deque
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Sequence, Tuple

from rosclingo.errors import shorten
from rosclingo.wire.commands import Command
from rosoclingo.errors import StoreError
from rosoclingo.loop import journal
from rosoclingo.loop.durability import KnownGoal
from rosoclingo.loop.health import StoreSummary
from rosoclingo.loop.inputs.inbox import Cancel, Item, arrival_of, item_of
from rosoclingo.loop.journal import Entry, StatusSet
from rosoclingo.loop.journal import Fields as JournalFields
from rosoclingo.loop.loop import LoopSnapshot
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.snapshot import remade
from rosoclingo.store import commands as planner_commands
from rosoclingo.store.database import MISFITS, Database, Rows
from rosoclingo.store.fields import ChangedRows, read
from rosoclingo.store.folder import FRESH

_RUN, _STATE, _GOAL = "run", "state", "goal"
_INPUT, _JOURNAL, _OUT = "input", "journal", "out"
_ENDED = "ended"
_STARTED_WITH = "started with"
_MOST_EVENTS = 2_000  # of the journal; as many as the node's topic has for late subscribers
_DRAINED_SECONDS = 2.0  # so long after it was published, a result has left the process for sure
_Row: Any = Tuple[float, int, int, str, str, str, Tuple[str, ...], float]
"""An event of the journal: its time, step and horizon, and its ``Fields``."""
_MOST_ENDED = 1_000  # goals of which it is known how they have ended; as many as the node knows


@dataclasses.dataclass
class Changes:
    """The contents of one transaction.

    Attributes:
        records: What is new in the journal.
        actions: Actuators and actions that are about to be published.
        statuses: How goals are about to be accepted, or to end.
        taken: The numbers of the inputs that the snapshot knows of.
        snapshot: What the loop knows; None for what was written before.
        commands: What the planner has run.
        shortens: Whether of the values of an external only the last one is needed.
    """

    records: Sequence[Entry] = ()
    actions: Sequence[Tuple[str, str]] = ()
    statuses: Sequence[StatusSet] = ()
    taken: Sequence[int] = ()
    snapshot: Optional[LoopSnapshot] = None
    commands: Sequence[Command] = ()
    shortens: bool = True


class Store:
    """A run, stored in a folder. Thread-safe.

    Attributes:
        goals: The goals that were known when it was opened, and may be of interest, by their ids.
        ended: Why the run that was in it has ended; None if it has not, or there was none.
        unsure_since: Since when goals have ended of which their clients may not know it, in seconds
            of wall time.
        pause: How long ago the last event in it was when it was opened, in seconds of wall time.
        snapshot: What the loop knew; None if it has not begun.
    """

    def __init__(
        self,
        path: Path,
        *,
        lossy: bool = False,
        most_pages: int = 0,
        point: Callable[[str], None] = lambda _: None,
        now: Callable[[], float] = time.time,
    ) -> None:
        """Opens a store, or makes it. A run in it that has ended is removed.

        Args:
            path: Its folder.
            lossy: Whether it goes on with what is there if acknowledged transactions are missing.
            most_pages: How many pages of 4 KiB it may have; 0 for as many as there is room for.
            point: Called before and after whatever matters, see :class:`Database`.
            now: Returns the wall time, in seconds.

        Raises:
            StoreError: It cannot be used; the message says why.
        """
        self.point = point
        self._now = now
        self._database = Database(path, lossy=lossy, most_pages=most_pages, point=point)
        self._fields = ChangedRows(LoopSnapshot)
        try:
            records = self.records
            self.unsure_since = _unsure_since(records)
            self.pause = now() - max((record.seconds for record in records), default=0.0)
            self.ended: Optional[str] = self._database.read(_RUN).get(_ENDED)
            if self.ended is not None:
                self._clear()
            self.goals = self._read_goals()
            self._goals = dict(self.goals)  # as they are now
            self._events = list(self._database.read(_JOURNAL))
            self.snapshot = self._read_snapshot()
        except BaseException:
            self.close()
            raise
        self._gone = deque(goal.id for goal in self.ended_goals)

    def _clear(self) -> None:
        """Removes a run that has ended, but for how its last goals did."""
        with self._database.transaction() as rows:
            for part in (_RUN, _STATE, _INPUT, _JOURNAL, _OUT, planner_commands.PART):
                rows.clear(part)

    def close(self) -> None:
        """Closes the database; may be called twice."""
        self._database.close()

    @property
    def path(self) -> Path:
        """The folder."""
        return self._database.path

    @property
    def loss(self) -> str:
        """The loss that ``resume:=lossy`` has accepted, in words; empty if nothing was lost."""
        return self._database.loss

    @property
    def failure(self) -> Optional[StoreError]:
        """Why nothing can be written any more; None if it can."""
        return self._database.failure

    def summary(self, *, is_unsure: bool) -> StoreSummary:
        """Returns a summary of the store for diagnostics.

        Args:
            is_unsure: Whether it is still unconfirmed that the run in it goes on.
        """
        database, failure = self._database, self.failure
        text = "" if failure is None else str(failure)
        return StoreSummary(self.path, database.size, database.committed, text, is_unsure)

    # What was stored.

    @property
    def ended_goals(self) -> List[KnownGoal]:
        """The ended goals of ``goals``, in the order of their ends."""
        ended = (one for one in self.goals.values() if one.status.is_terminal)
        return sorted(ended, key=lambda one: one.time)

    @contextlib.contextmanager
    def understood(self) -> Iterator[None]:
        """A context that converts the errors of rows that this version does not write."""
        try:
            yield
        except MISFITS as err:
            raise StoreError(
                f"the store {self.path} was written by another version of rosoclingo: "
                f"{shorten(str(err))}; start that one, or {FRESH}"
            ) from err

    def _read_goals(self) -> Dict[str, KnownGoal]:
        with self.understood():
            return {key: _goal(key, value) for key, value in self._database.read(_GOAL).items()}

    def _read_snapshot(self) -> Optional[LoopSnapshot]:
        rows = self._database.read(_STATE)
        if not rows:
            return None
        pairs = {tuple(key.split(" ", 1)): value for key, value in rows.items()}
        with self.understood():
            snapshot = read(LoopSnapshot, pairs)  # type: ignore[arg-type]
        # What is written is what was read, so that the next snapshot differs little.
        self._fields.changes(read(LoopSnapshot, pairs))  # type: ignore[arg-type]
        assert isinstance(snapshot, LoopSnapshot)
        return snapshot

    @property
    def commands(self) -> Iterable[str]:
        """The command log that restores the planner in a fresh solver."""
        return self._database.read(planner_commands.PART).values()

    def inputs(self, goals: Callable[[str], Optional[Goal]]) -> List[Tuple[int, Optional[Item]]]:
        """Returns the inputs that are not part of the snapshot, in order, with their numbers.

        Args:
            goals: Returns a goal by its id, None if it is of no interest any more.

        Returns:
            Pairs of number and item; an item of a goal that is of no interest is None.
        """
        with self.understood():
            return [
                (int(number), _item(value, goals))
                for number, value in self._database.read(_INPUT).items()
            ]

    @property
    def unsent(self) -> Dict[str, Tuple[str, str]]:
        """Actuators and actions that may not have been published, by their keys, in order."""
        with self.understood():
            pairs = ((key, json.loads(out)) for key, out in self._database.read(_OUT).items())
            return {key: (_text(actuator), _text(action)) for key, (actuator, action) in pairs}

    @property
    def records(self) -> List[Entry]:
        """The journal's last events."""
        with self.understood():
            return [_record(int(n), value) for n, value in self._database.read(_JOURNAL).items()]

    # What is written.

    def begin(self, started_with: Mapping[str, str]) -> None:
        """Begins a run.

        Args:
            started_with: What the nodes were started with, by what that is.
        """
        with self._database.transaction() as rows:
            rows.put(_RUN, _STARTED_WITH, json.dumps(dict(started_with)))

    def check(self, started_with: Mapping[str, str]) -> None:
        """Checks that the nodes were started with the same options and files as when the run began.

        Raises:
            StoreError: It is something else; the message says what.
        """
        with self.understood():
            old = dict(json.loads(self._database.read(_RUN).get(_STARTED_WITH, "{}")))
        differs = [
            f"{what} was {old.get(what, 'not there')} and is {started_with.get(what, 'not there')}"
            for what in dict.fromkeys([*old, *started_with])
            if old.get(what) != started_with.get(what)
        ]
        if differs:
            raise StoreError(
                f"the store {self.path} is of a run with something else: {'; '.join(differs)}; "
                f"start with that, or {FRESH}"
            )

    def add(self, *items: Item) -> List[int]:
        """Stores inputs in one transaction, and returns their numbers.

        It is durable if a goal or a cancel request is among them.
        """
        durable = any(isinstance(item, (Goal, Cancel)) for item in items)
        numbers = []
        with self._database.transaction(durable=durable) as rows:
            for item in items:
                numbers.append(rows.next_number)
                rows.put(_INPUT, str(numbers[-1]), journal.to_text(arrival_of(item)))
                if isinstance(item, Goal):
                    new = KnownGoal(item.id, item.request, item.information, item.client.address)
                    self._put(rows, new)
                elif isinstance(item, Cancel) and item.goal.id in self._goals:
                    goal = self._goals[item.goal.id]
                    self._put(rows, dataclasses.replace(goal, canceling=True))
        return numbers

    def write(self, changes: Changes, *, ended: Optional[str] = None) -> List[str]:
        """Commits a transaction, durably if an effect leaves the node because of it.

        Args:
            changes: What is written.
            ended: Why the run ends with this, if it does.

        Returns:
            The keys of the actions, for :meth:`note_sent`.
        """
        durable = bool(changes.actions or changes.statuses or ended is not None)
        keys = []
        with self._database.transaction(durable=durable) as rows:
            for number in changes.taken:
                rows.delete(_INPUT, str(number))
            planner_commands.write(rows, changes.commands, shortens=changes.shortens)
            if changes.snapshot is not None:
                for field, key, value in self._fields.changes(changes.snapshot):
                    if value is None:
                        rows.delete(_STATE, f"{field} {key}")
                    else:
                        rows.put(_STATE, f"{field} {key}", value)
            for action in changes.actions:
                keys.append(str(rows.next_number))
                rows.put(_OUT, keys[-1], json.dumps(action))
            for change in changes.statuses:
                if change.goal in self._goals:
                    self._put(rows, self._goals[change.goal].changed(change, self._now()))
                    if change.status.is_terminal:
                        self._gone.append(change.goal)
            self._write_records(rows, changes.records)
            if changes.snapshot is not None:
                self._forget_goals(rows)
            if ended is not None:
                rows.put(_RUN, _ENDED, ended)
        return keys

    def note_sent(self, keys: Sequence[str]) -> None:
        """Marks actions as published."""
        with self._database.transaction(durable=False) as rows:
            for key in keys:
                rows.delete(_OUT, key)

    def _put(self, rows: Rows, goal: KnownGoal) -> None:
        self._goals[goal.id] = goal
        rows.put(_GOAL, goal.id, json.dumps(dataclasses.astuple(goal)[1:]))

    def _write_records(self, rows: Rows, records: Sequence[Entry]) -> None:
        for record in records:
            fields = journal.encode(record.event)
            value = json.dumps([record.seconds, record.step, record.horizon, *fields])
            rows.put(_JOURNAL, str(record.number), value)
            self._events.append(str(record.number))
        too_many = len(self._events) - _MOST_EVENTS
        if too_many > 0:
            for number in self._events[:too_many]:
                rows.delete(_JOURNAL, number)
            del self._events[:too_many]

    def _forget_goals(self, rows: Rows) -> None:
        """Removes the goals that ended long ago, which the snapshot does not need any more."""
        while len(self._gone) > _MOST_ENDED:
            identifier = self._gone.popleft()
            goal = self._goals.get(identifier)
            # One that came again after it was forgotten, and ended again, is there twice.
            if goal is not None and goal.status.is_terminal and identifier not in self._gone:
                del self._goals[identifier]
                rows.delete(_GOAL, identifier)


def _goal(identifier: str, text: str) -> KnownGoal:
    names = [field.name for field in dataclasses.fields(KnownGoal)]
    return remade(KnownGoal, dict(zip(names, [identifier, *json.loads(text)])))


def _unsure_since(records: Sequence[Entry]) -> float:
    """Returns since when goals have ended whose clients may not know their results.

    A process that goes on publishes results again, and may die before they have left it: then those
    are unsure of which it was so when it began.
    """
    last = records[-1].seconds if records else 0.0
    for event, before in zip(reversed(records), list(reversed(records))[1:]):
        if isinstance(event.event, journal.NodeResumed) and event.event.node == journal.LOOP:
            if last - event.seconds >= _DRAINED_SECONDS:
                break
            last = before.seconds
    return last - _DRAINED_SECONDS


def _record(number: int, text: str) -> Entry:
    seconds, step, horizon, *fields = remade(_Row, json.loads(text))
    if not all(0 <= one < 2**32 for one in (number, step, horizon, seconds)):  # as in a message
        raise ValueError(f"{text:.80} is no event")
    return Entry(journal.decode(JournalFields(*fields)), step, horizon, number, seconds)


def _item(text: str, goals: Callable[[str], Optional[Goal]]) -> Optional[Item]:
    event = journal.from_text(text)
    if not isinstance(event, (*journal.ARRIVALS, journal.AnswerArrived)):
        raise ValueError(f"{text:.80} is no input")
    return item_of(event, goals)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r:.80} is no text")
    return value
