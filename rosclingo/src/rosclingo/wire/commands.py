"""The values that cross the border between a client and the solver: commands and their answers.

All of them are immutable, compare by value and may be shared between threads. Atoms, terms and
programs stand in them as text, as they do on the wire; :mod:`rosclingo.solver` parses them. See
docs/protocol.md, section "Control service", for what each command means.
"""

from __future__ import annotations

import enum
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, FrozenSet, Mapping, Optional, Tuple, Union


class Truth(enum.Enum):
    """Truth value of an external atom; its value is the word on the wire."""

    TRUE = "true"
    FALSE = "false"
    FREE = "free"


class Command:
    """Base class of the commands that a client may send to the solver."""


@dataclass(frozen=True)
class Add(Command):
    """Adds a program part ``name(parameters)`` with the statements of ``program``."""

    name: str
    parameters: Tuple[str, ...]
    program: str


@dataclass(frozen=True)
class Part:
    """A program part to ground, with one ground term for each of its parameters."""

    name: str
    parameters: Tuple[str, ...] = ()


@dataclass(frozen=True)
class Ground(Command):
    """Grounds program parts together.

    Attributes:
        parts: The parts.
        asking: Whether the parts are grounded that the program requests, too: for each external
            ``ground(P)`` that it declares, the part P, until it requests nothing new. Then each
            part is grounded once, whether it is given or asked for.
        reserved: Names of parts that the program must not ask for; ``base`` is always one.
    """

    parts: Tuple[Part, ...]
    asking: bool = False
    reserved: Tuple[str, ...] = ()


@dataclass(frozen=True)
class Load(Command):
    """Adds the statements of a file, named as the node sees it."""

    file: str


@dataclass(frozen=True)
class AssignExternal(Command):
    """Gives an external atom a truth value."""

    name: str
    value: Truth


@dataclass(frozen=True)
class ReleaseExternal(Command):
    """Makes an external atom false permanently; by a signature such as ``p/2``, all of these."""

    name: str


@dataclass(frozen=True)
class CleanupDomains(Command):
    """Simplifies the domains with what is known at top level (clingo 5's ``cleanup``)."""


@dataclass(frozen=True)
class GetExternals(Command):
    """Requests every external atom of the current grounding; answered by :class:`Externals`."""


@dataclass(frozen=True)
class GetPrograms(Command):
    """Requests the list of program parts; answered by :class:`Programs`."""


@dataclass(frozen=True)
class GetStats(Command):
    """Requests the solver's statistics; answered by :class:`Stats`."""


@dataclass(frozen=True)
class Restart(Command):
    """Replaces the solver by a fresh one, made from the command line at start."""


@dataclass(frozen=True)
class Externals:
    """Answer to :class:`GetExternals`: pairs of atom and value, sorted by the atom's text."""

    values: Tuple[Tuple[str, Truth], ...]


@dataclass(frozen=True)
class Programs:
    """Answer to :class:`GetPrograms`.

    Attributes:
        parts: Sorted pairs of name and number of parameters.
        extended: Those to which more than one file has added something.
    """

    parts: Tuple[Tuple[str, int], ...]
    extended: FrozenSet[Tuple[str, int]] = frozenset()


@dataclass(frozen=True)
class Stats:
    """Answer to :class:`GetStats`: clingo's statistics, as its documentation names them."""

    values: Mapping[str, Any]


Answer = Union[Externals, Programs, Stats]


@dataclass(frozen=True)
class Failure:
    """The command that ended a list.

    Attributes:
        command: Its element's name, such as ``ground``.
        index: Its position in the list, counted from 0; -1 for a fault outside of any command.
        message: What is wrong, where, and what to do.
    """

    command: str
    index: int
    message: str


@dataclass(frozen=True)
class Reply:
    """Reply to a list of commands: the answers in order, and the failure if there was one."""

    answers: Tuple[Answer, ...] = ()
    failure: Optional[Failure] = None

    @property
    def success(self) -> bool:
        """True if every command ran."""
        return self.failure is None


@dataclass(frozen=True)
class Assumption:
    """An atom and the truth value that it is assumed to have during one solve call."""

    name: str
    value: bool


@dataclass(frozen=True)
class CostBound:
    """An assumption that answer sets cost at most something during one solve call.

    Attributes:
        cost: A number for each priority, the highest one first; greater ones are compared first.
    """

    cost: Tuple[int, ...]


@dataclass(frozen=True)
class ConflictLimit:
    """A limit of one solve call, which ends as it would with clingo's ``--solve-limit``.

    Attributes:
        conflicts: After how many conflicts it ends, 0 or more.
    """

    conflicts: int


@dataclass(frozen=True)
class Restarts:
    """The restart strategy of one solve call; ignored by a solver with several threads.

    Attributes:
        strategy: As the value of clingo's option ``--restarts``, such as ``D,100,0.7``.
    """

    strategy: str


Assumed = Union[Assumption, CostBound, ConflictLimit, Restarts]
"""An assumption of one solve call: an atom, a bound of costs, a limit, a restart strategy."""


class Result(enum.Enum):
    """Answer of a solve call; its value is the word on the wire."""

    SAT = "sat"
    UNSAT = "unsat"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Improvement:
    """A model that is better than the ones before it.

    Attributes:
        number: Number of the model, counted from 1.
        cost: Its costs, the highest priority first.
        symbols: Its shown symbols, as text.
    """

    number: int
    cost: Tuple[int, ...]
    symbols: Tuple[str, ...]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a solve call.

    Attributes:
        result: What was found; UNKNOWN whenever the call was interrupted.
        interrupted: Whether the call was told to stop before it was through.
        symbols: The shown symbols of the last model, as text; with an optimisation statement, of
            the best one. Those of an interrupted call are the last that it had found.
        ended_by: The other client whose request has interrupted the call; empty if none has, or
            that is not known.
    """

    result: Result
    interrupted: bool = False
    symbols: Tuple[str, ...] = ()
    ended_by: str = ""


def command_name(command: Command) -> str:
    """Returns the name of a command's element, such as ``assign_external``."""
    return _element_name(type(command).__name__)


@lru_cache(maxsize=None)
def _element_name(kind: str) -> str:
    return re.sub(r"\B[A-Z]", r"_\g<0>", kind).lower()


PLAIN = {
    command_name(command): command
    for command in (CleanupDomains(), GetExternals(), GetPrograms(), GetStats(), Restart())
}
"""The commands without arguments, by the names of their elements."""
