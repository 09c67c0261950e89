"""What has made the planner what it is, so that a fresh one becomes the same.

>>> from rosclingo.solver.engine import Engine
>>> from rosclingo.solver.options import Options
>>> planner = RecordedSolver(Engine(Options()))
>>> planner.run([wire.Restart(), wire.Add("base", (), "#external e."), wire.Ground((_BASE,))])
Reply(answers=(), failure=None)
>>> [type(command).__name__ for command in planner.take()]
['Restart', 'Add', 'Ground']
"""

from __future__ import annotations

from typing import Iterable, Iterator, List, Sequence

from rosclingo.wire import commands as wire
from rosclingo.wire.xml_codec import decode_commands, encode_commands
from rosoclingo.errors import PlannerError
from rosoclingo.loop.solver import Forwarding, Solver
from rosoclingo.store.database import Rows

PART = "command"
"""The part of the store that has the planner's commands, in their order."""

_ASKS = (wire.GetExternals, wire.GetPrograms, wire.GetStats)
_BASE = wire.Part("base")
_MOST = 500  # commands in a request
_MOST_CHARACTERS = 2**20  # likewise; one command may have more


class RecordedSolver(Forwarding):
    """A solver whose commands are kept until they are taken.

    Attributes:
        events_are_facts: Whether an event that was made true stays so, as a dialect says.
    """

    def __init__(self, solver: Solver) -> None:
        super().__init__(solver)
        self.events_are_facts = bool(getattr(solver, "events_are_facts", False))
        self._new: List[wire.Command] = []

    def run(self, commands: Sequence[wire.Command]) -> wire.Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        reply = super().run(commands)
        done = len(commands) if reply.failure is None else max(0, reply.failure.index)
        self._new += (one for one in commands[:done] if not isinstance(one, _ASKS))
        return reply

    def take(self) -> List[wire.Command]:
        """Returns the commands that have run since the last call, but for questions."""
        new, self._new = self._new, []
        return new

    def restore(self, texts: Iterable[str]) -> None:
        """Makes a fresh solver what it was, without a search.

        Args:
            texts: What :func:`write` has written, in order.

        Raises:
            PlannerError: A command fails that did not fail then.
        """
        for batch in _batches(texts):
            commands = [one for text in batch for one in decode_commands(text)]
            failure = super().run(commands).failure
            if failure is not None:
                raise PlannerError(
                    f"the planner cannot be made what it was: it refused <{failure.command}>: "
                    f"{failure.message}; start with resume:=fresh, which begins anew"
                )


def write(rows: Rows, commands: Sequence[wire.Command], *, shortens: bool) -> None:
    """Writes commands after those that are written, without what they make unneeded.

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
