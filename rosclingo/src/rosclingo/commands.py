"""The values that cross the border between a client and the solver: commands and their answers.

All of them are immutable, compare by value and may be shared between threads. Atoms, terms and
programs stand in them as text, as they do on the wire; :class:`rosclingo.engine.Engine` parses
them. See docs/protocol.md, section "Control service", for what each command means.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any, Mapping, Optional, Tuple, Union


class Truth(enum.Enum):
    """Truth value of an external atom; its value is the word on the wire."""

    TRUE = "true"
    FALSE = "false"
    FREE = "free"


@dataclass(frozen=True)
class Add:
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
class Ground:
    """Grounds program parts together.

    Attributes:
        parts: The parts.
        asking: Whether the parts are grounded that the program asks for, too: for each external
            ``ground(P)`` that it declares, the part P, until it asks for nothing new. Then each
            part is grounded once, whether it is given or asked for.
        reserved: Names of parts that the program must not ask for; ``base`` is always one.
    """

    parts: Tuple[Part, ...]
    asking: bool = False
    reserved: Tuple[str, ...] = ()


@dataclass(frozen=True)
class Load:
    """Adds the statements of a file, named as the node sees it."""

    file: str


@dataclass(frozen=True)
class AssignExternal:
    """Gives an external atom a truth value."""

    name: str
    value: Truth


@dataclass(frozen=True)
class ReleaseExternal:
    """Makes an external atom false for good."""

    name: str


@dataclass(frozen=True)
class CleanupDomains:
    """Simplifies the domains with what is known at top level (clingo 5's ``cleanup``)."""


@dataclass(frozen=True)
class GetExternals:
    """Asks for every external atom of the current grounding; answered by :class:`Externals`."""


@dataclass(frozen=True)
class GetPrograms:
    """Asks for the program parts that there are; answered by :class:`Programs`."""


@dataclass(frozen=True)
class GetStats:
    """Asks for the solver's statistics; answered by :class:`Stats`."""


@dataclass(frozen=True)
class Restart:
    """Replaces the solver by a fresh one, made from the command line at start."""


Command = Union[
    Add,
    Ground,
    Load,
    AssignExternal,
    ReleaseExternal,
    CleanupDomains,
    GetExternals,
    GetPrograms,
    GetStats,
    Restart,
]


@dataclass(frozen=True)
class Externals:
    """Answer to :class:`GetExternals`: pairs of atom and value, sorted by the atom's text."""

    values: Tuple[Tuple[str, Truth], ...]


@dataclass(frozen=True)
class Programs:
    """Answer to :class:`GetPrograms`: sorted pairs of name and number of parameters."""

    parts: Tuple[Tuple[str, int], ...]


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
        """Whether every command ran."""
        return self.failure is None


@dataclass(frozen=True)
class Assumption:
    """An atom and the truth value that it is assumed to have during one solve call."""

    name: str
    value: bool
