"""The planner's command log: replayed on a fresh solver, it restores the planner.

>>> from rosclingo.solver.engine import Engine
>>> from rosclingo.solver.options import Options
>>> planner = RecordedSolver(Engine(Options()), SolverRetry("planner", print, print))
>>> planner.run([wire.Restart(), wire.Add("base", (), "#external e."), wire.Ground((_BASE,))])
Reply(answers=(), failure=None)
>>> [type(command).__name__ for command in planner.take()]
['Restart', 'Add', 'Ground']
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Callable, Iterable, Iterator, List, Sequence, TypeVar

from rosclingo.errors import (
    OutOfMemoryError,
    ServiceError,
    SolverEndedError,
    XmlError,
    shorten,
)
from rosclingo.wire import commands as wire
from rosclingo.wire.xml_codec import decode_commands, encode_commands
from rosoclingo.errors import (
    OverloadedError,
    PlannerError,
    RepeatedLossError,
    SpareMemoryError,
)
from rosoclingo.loop.journal import Event, NodeResumed
from rosoclingo.loop.values.solver import Forwarding, Solver
from rosoclingo.store.database import Rows

PART = "command"
"""The part of the store with the planner's command log."""

_ASKS = (wire.GetExternals, wire.GetPrograms, wire.GetStats)
_BASE = wire.Part("base")
_MOST_TRIES = 3  # of one call, by which a solver is lost
_MOST = 500  # commands in a request
_MOST_CHARACTERS = 2**20  # in a request; one command may have more


_T = TypeVar("_T")


@dataclass(eq=False)
class SolverRetry:
    """Retries calls during which a solver was lost, as soon as it is replaced.

    If it is lost at each try, the call fails. A solver that was told to end does not count as lost
    by the call.

    Attributes:
        solver: Its role, for the journal.
        wait: Returns as soon as it is replaced, or raises the error by which it was lost.
        note: Adds to the journal that it was.
    """

    solver: str
    wait: Callable[[ServiceError], None]
    note: Callable[[Event], None]

    def __call__(self, call: Callable[[], _T], restore: Callable[[], None]) -> _T:
        """Calls the solver.

        Args:
            call: Calls it.
            restore: Makes it what it was, before each further try.

        Raises:
            RepeatedLossError: It is lost each time.
            ServiceError: It does not come back.
        """
        tries, reason, since, until = 0, "", 0.0, 0.0
        while True:
            try:
                if reason:
                    restore()
                result = call()
            except ServiceError as err:
                tries += not isinstance(err, SolverEndedError)  # which is not because of the call
                if tries > _MOST_TRIES:
                    raise RepeatedLossError(str(err)) from err
                if not reason:
                    reason, since = str(err) or "no answer", time.monotonic()
                self.wait(err)
                until = time.monotonic()
                continue
            if reason:
                self.note(NodeResumed(self.solver, reason, until - since))
            return result


class RecordedSolver(Forwarding):
    """A solver that logs its commands until they are taken.

    Attributes:
        events_are_facts: Whether an event that was made true stays so, as a dialect says.
    """

    def __init__(
        self,
        solver: Solver,
        retry: SolverRetry,
        written: Callable[[], Iterable[str]] = lambda: (),
    ) -> None:
        """Wraps a solver, with an empty log.

        Args:
            solver: The solver.
            retry: Has the solver be there again after an error.
            written: Returns what :func:`write` has written, in order.
        """
        super().__init__(solver)
        self.events_are_facts = bool(getattr(solver, "events_are_facts", False))
        self._retry = retry
        self._written = written
        self._new: List[wire.Command] = []

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        reply = self._call(lambda: self._solver.run(commands), begins=_begins(commands))
        done = len(commands) if reply.failure is None else max(0, reply.failure.index)
        self._log(commands[:done])
        return reply

    def _call(self, call: Callable[[], _T], *, begins: bool = False) -> _T:
        """Calls the solver, and again if it is lost and replaced.

        It is restored before, unless the call begins with a restart.
        """
        try:
            return self._retry(call, (lambda: None) if begins else self._restore)
        except RepeatedLossError as err:
            raise OverloadedError(f"the planner was lost each time: {shorten(str(err))}") from err

    def take(self) -> List[wire.Command]:
        """Returns and clears the log: the commands since the last call, without queries."""
        new, self._new = self._new, []
        return new

    def _log(self, commands: Sequence[wire.Command]) -> None:
        if _begins(commands):
            self._new.clear()
        self._new += (one for one in commands if not isinstance(one, _ASKS))

    def restore(self) -> None:
        """Restores a fresh solver by the commands that were logged, without a search.

        Raises:
            PlannerError: A command fails that did not fail then.
            SpareMemoryError: The planner has less memory than then.
            OverloadedError: It is lost each time.
        """
        self._call(self._restore, begins=True)

    def _restore(self) -> None:
        new = [encode_commands([one]) for one in self._new]
        texts = new if _begins(self._new) else [*self._written(), *new]
        for batch in _batches(texts):
            try:
                commands = [one for text in batch for one in decode_commands(text)]
            except XmlError as err:
                raise _not_restored(f"a command in the store is wrong: {err}") from err
            try:
                failure = self._solver.run(commands).failure
            except OutOfMemoryError as err:
                raise SpareMemoryError(f"{err}; its past needs more than it has now") from err
            if failure is not None:
                raise _not_restored(f"it refused <{failure.command}>: {failure.message}")


def _begins(commands: Sequence[wire.Command]) -> bool:
    """Returns whether commands start with a restart, after which earlier ones do not count."""
    return bool(commands) and isinstance(commands[0], wire.Restart)


def _not_restored(reason: str) -> PlannerError:
    return PlannerError(
        f"the planner cannot be made what it was: {reason}; start with resume:=fresh, which begins "
        "anew"
    )


def write(rows: Rows, commands: Sequence[wire.Command], *, shortens: bool) -> None:
    """Appends commands to the log in the store, and compacts it.

    What was before a restart has no effect any more. Of the values of an external, the last counts:
    clingo grounds the same whatever they are.

    Args:
        rows: Where to write.
        commands: What has run.
        shortens: Whether only the last value of an external is needed, which a dialect may tell
            by grounding.
    """
    begin = max((i for i, one in enumerate(commands) if isinstance(one, wire.Restart)), default=-1)
    if begin >= 0:
        rows.clear(PART)
    for command in commands[max(begin, 0) :]:
        text = encode_commands([command])
        if isinstance(command, wire.AssignExternal) and shortens:
            rows.put(PART, f"={command.name}", text, last=True)
            continue
        if isinstance(command, wire.ReleaseExternal) and shortens:
            rows.delete(PART, f"={command.name}")
        rows.put(PART, str(rows.next_number), text)


def _batches(texts: Iterable[str]) -> Iterator[List[str]]:
    batch: List[str] = []
    size = 0
    for text in texts:
        if batch and (len(batch) >= _MOST or size + len(text) > _MOST_CHARACTERS):
            yield batch
            batch, size = [], 0
        batch.append(text)
        size += len(text)
    if batch:
        yield batch
