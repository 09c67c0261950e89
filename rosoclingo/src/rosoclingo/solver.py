"""What the loop needs of a solver.

:class:`rosclingo.client.Client` is one over ROS, :class:`rosclingo.engine.Engine` one in process.
"""

from __future__ import annotations

from typing import Callable, Dict, List, Optional, Protocol, Sequence, Tuple

from rosclingo.commands import (
    Add,
    AssignExternal,
    Assumption,
    Command,
    Externals,
    GetExternals,
    Reply,
    Truth,
)
from rosclingo.engine import Improvement, Outcome, Result
from rosoclingo.errors import PlannerError

HAS = "rosoclingo_has"
"""A term that is shown with an answer set in which there is an atom, be that shown or not."""

SEEN = {"do": 3, "status": 3}
"""What rosoclingo has to see of an answer set, with the number of arguments."""

_SHOWS = " ".join(
    f"#defined {name}/{arity}. #show {HAS}({name}) : {name}({'_,' * (arity - 1)}t)."
    for name, arity in SEEN.items()
)
EMPTY_PARTS = (
    Add("state", ("t",), ""),
    Add("transition", ("t",), ""),
    Add("query", ("t",), _SHOWS),
)
"""What lets an encoding leave out a part that it does not need, and tells what it hides."""

_BATCH_CHARACTERS = 2**20  # of the atoms in one request, far below what a solver node allows
_MANY = 20  # so many assignments after one that failed, it is quicker to ask for all externals


class Solver(Protocol):
    """Runs commands and solve calls. One thread makes the calls."""

    def run(self, commands: Sequence[Command]) -> Reply:
        """Runs commands in order until one fails; what ran before that stays."""

    def solve(
        self,
        assumptions: Sequence[Assumption] = ...,
        stopped: Optional[Callable[[], bool]] = ...,
        improved: Callable[[Improvement], None] = ...,
    ) -> Outcome:
        """Searches for answer sets until told to stop."""

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""


class Forwarding:
    """A solver that hands all on to another; subclasses change some of it."""

    def __init__(self, solver: Solver) -> None:
        self._solver = solver

    def run(self, commands: Sequence[Command]) -> Reply:
        """Runs commands in order until one fails; what ran before that stays."""
        return self._solver.run(commands)

    def solve(
        self,
        assumptions: Sequence[Assumption] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        """Searches for answer sets until told to stop."""
        return self._solver.solve(assumptions, stopped, improved)

    def check(self) -> None:
        """Raises an error if the solver is not there any more."""
        self._solver.check()


class Planner:
    """The planner's solver, with what the commands need of it.

    Attributes:
        events_are_facts: Whether an event that was made true stays so.
    """

    def __init__(self, solver: Solver) -> None:
        self._solver = solver
        # A dialect's translation may be in between.
        self.events_are_facts = bool(getattr(solver, "events_are_facts", False))

    def run(self, *commands: Command) -> Reply:
        """Runs commands.

        Raises:
            PlannerError: A command failed.
        """
        reply = self._solver.run(commands)
        if reply.failure is not None:
            failure = reply.failure
            raise PlannerError(
                f"the planner refused <{failure.command}>: {failure.message}; check that its "
                "encoding fits the mode, and that nothing else restarted it"
            )
        return reply

    def solve(self, stopped: Callable[[], bool]) -> Outcome:
        """Searches for a plan until told to stop, which may be so from the beginning."""
        if stopped():
            return Outcome(Result.UNKNOWN, interrupted=True)
        return self._solver.solve((), stopped)

    def has_answer_set(self, stopped: Callable[[], bool]) -> Optional[bool]:
        """Returns whether there is any, be it the best one or not; None if told to stop before."""
        if stopped():
            return None
        found: List[Improvement] = []
        outcome = self._solver.solve((), lambda: bool(found) or stopped(), found.append)
        if found or outcome.result is Result.SAT:
            return True
        return False if outcome.result is Result.UNSAT else None

    def externals(self) -> Dict[str, Truth]:
        """Returns all externals with their values."""
        (answer,) = self.run(GetExternals()).answers
        assert isinstance(answer, Externals)
        return dict(answer.values)

    def assign(self, atoms: Sequence[str], value: Truth) -> List[Tuple[str, str]]:
        """Assigns a value to those atoms that are externals.

        Returns:
            The other atoms, each with the reason.
        """
        missing: List[Tuple[str, str]] = []
        rest = list(atoms)
        while rest:
            batch = _batch(rest)
            reply = self._solver.run([AssignExternal(atom, value) for atom in batch])
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
                declared = self.externals()
                unknown = [atom for atom in rest if atom not in declared]
                missing += [(atom, f"there is no external {atom}") for atom in unknown]
                rest = [atom for atom in rest if atom in declared]
        return missing


def _batch(atoms: Sequence[str]) -> List[str]:
    """Returns the first atoms, as many as fit into one request; at least one."""
    size = 0
    for number, atom in enumerate(atoms):
        size += len(atom)
        if number and size > _BATCH_CHARACTERS:
            return list(atoms[:number])
    return list(atoms)
