"""Sends commands to the planner's solver, in batches, and skips externals that do not exist."""

from __future__ import annotations

from typing import Container, Dict, List, Sequence, Tuple

from rosclingo.wire import commands as wire
from rosoclingo.errors import PlannerError
from rosoclingo.loop.planner.demand import Demand, Pair
from rosoclingo.loop.values.atoms import EVENT, QUERY
from rosoclingo.loop.values.solver import Solver

_BATCH_CHARACTERS = 2**20  # of the atoms in one request, far below what a solver node allows
_MANY = 20  # from so many externals on, it is quicker to ask for all, than about each that fails


class Requests:
    """Sends commands to a solver; stateless. One thread makes the calls."""

    def __init__(self, solver: Solver) -> None:
        self._solver = solver

    def run(
        self, commands: Sequence[wire.Command], optional: Container[str] = ()
    ) -> Tuple[wire.Reply, List[wire.AssignExternal]]:
        """Runs commands, and skips those that make a ``query(T)`` false which does not exist.

        Args:
            commands: The commands.
            optional: Externals that need not be there to be assigned a value.

        Returns:
            The reply, and the assignments that have no effect, as there is no such external.

        Raises:
            PlannerError: A command failed.
        """
        skipped: List[wire.AssignExternal] = []
        reply = self._solver.run(commands)
        while reply.failure is not None and reply.failure.index >= 0:
            failed = commands[reply.failure.index]
            if not isinstance(failed, wire.AssignExternal):
                break
            if not (_is_false_query(failed) or failed.name in optional):
                break
            skipped.append(failed)
            commands = commands[reply.failure.index + 1 :]
            reply = self._solver.run(commands) if commands else wire.Reply()
        if reply.failure is not None:
            failure = reply.failure
            raise PlannerError(
                f"the planner refused <{failure.command}>: {failure.message}; check that its "
                "encoding fits the mode, and that nothing else restarted it"
            )
        return reply, skipped

    def programs(self) -> wire.Programs:
        """Returns the program parts; none if the solver is one that cannot tell."""
        reply = self._solver.run([wire.GetPrograms()])
        found = (answer for answer in reply.answers if isinstance(answer, wire.Programs))
        return next(found, wire.Programs(()))

    def assign(self, atoms: Sequence[str], value: wire.Truth) -> List[Tuple[str, str]]:
        """Assigns a value to those atoms that are externals.

        Returns:
            The other atoms, each with the reason.

        Raises:
            PlannerError: The solver refuses a whole request.
        """
        missing: List[Tuple[str, str]] = []
        rest = list(atoms)
        while rest:
            batch = rest[: _fitting(rest)]
            reply = self._solver.run([wire.AssignExternal(atom, value) for atom in batch])
            done = len(batch)
            if reply.failure is not None:
                index, message = reply.failure.index, reply.failure.message
                if index < 0 and len(batch) > 1:
                    raise PlannerError(f"the planner refused a request: {message}")
                index = max(index, 0)
                missing.append((batch[index], message))
                done = index + 1
            rest = rest[done:]
            if reply.failure is not None and len(rest) > _MANY:
                declared = read_externals(self.run([wire.GetExternals()])[0])
                unknown = [atom for atom in rest if atom not in declared]
                missing += [(atom, f"there is no external {atom}") for atom in unknown]
                rest = [atom for atom in rest if atom in declared]
        return missing

    def declare(self, demand: Demand, pairs: Sequence[Pair]) -> None:
        """Asks an encoding which of some told events it declares.

        Args:
            demand: Learns the answers, and is not asked what it knows.
            pairs: The events.

        Raises:
            PlannerError: The solver refuses a whole request.
        """
        questions = demand.questions(pairs)
        while questions:
            fitting = _fitting(list(map(",".join, questions)))
            self._declare(demand, questions[:fitting])
            questions = questions[fitting:]

    def _declare(self, demand: Demand, rest: List[Pair]) -> None:
        has_unknown = False
        while rest:
            asking, *questions = demand.ask(rest)
            if len(rest) > _MANY and has_unknown:
                known = read_externals(self.run([asking, wire.GetExternals()])[0])
                for pair in rest:
                    demand.learn(pair, f"{EVENT}{','.join(pair)})" in known)
                return
            failure = self._solver.run([asking, *questions]).failure
            if failure is not None and failure.index < 1:
                raise PlannerError(f"the planner refused a request: {failure.message}")
            count = len(rest) if failure is None else failure.index - 1
            has_unknown = failure is not None
            for pair in rest[:count]:
                demand.learn(pair, True)
            for pair in rest[count : count + 1]:
                demand.learn(pair, False)
            rest = rest[count + 1 :]


def read_externals(reply: wire.Reply) -> Dict[str, wire.Truth]:
    """Returns the externals with their values from a reply to ``get_externals`` alone."""
    (answer,) = reply.answers
    assert isinstance(answer, wire.Externals)
    return dict(answer.values)


def _is_false_query(command: wire.AssignExternal) -> bool:
    return command.value is wire.Truth.FALSE and command.name.startswith(QUERY)


def _fitting(texts: Sequence[str]) -> int:
    """Returns how many of the first atoms or events fit into one request; one at least."""
    size = 0
    for number, text in enumerate(texts):
        size += len(text)
        if number and size > _BATCH_CHARACTERS:
            return number
    return len(texts)
