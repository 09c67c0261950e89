"""Errors of this package, a class each.

Every message names the input, the place and the remedy, because it reaches a user unchanged: in
a control reply, in the text of a goal's status, or on the terminal.
"""

from __future__ import annotations

from typing import Optional

_LONGEST_MESSAGE = 4000  # characters of an error that a client is told


def shorten(text: str, longest: int = 200) -> str:
    """Returns the text, or its beginning and its length if it is longer than that."""
    if len(text) <= longest:
        return text
    return f"{text[: longest * 3 // 4]}... ({len(text)} characters)"


class RosclingoError(Exception):
    """Base class of every error that this package raises on purpose."""


def report(err: Exception, where: str) -> str:
    """Returns the message of an error for a client; logs a bug, too, with its traceback."""
    if not isinstance(err, RosclingoError):
        import logging  # noqa: PLC0415 (commands that report no bug start faster without it)

        logging.getLogger("rosout").error("internal error %s", where, exc_info=err)
    return shorten(str(err) or type(err).__name__, _LONGEST_MESSAGE)


class OptionsError(RosclingoError):
    """The command line is wrong, or clingo refuses an option of it."""


class ParameterError(RosclingoError):
    """A parameter of a node has a value that it may not have; the message names both."""


class TermError(RosclingoError):
    """A text is not a single ground term."""


class ProgramError(RosclingoError):
    """A logic program does not parse or is not safe; the message quotes line and column."""


class ForbiddenError(RosclingoError):
    """A client's program or file needs a permission that the node's settings do not give."""


class UnknownProgramError(RosclingoError):
    """A program part that no loaded file or added program has."""


class UnknownExternalError(RosclingoError):
    """An atom that is no external of the current grounding."""


class SolverError(RosclingoError):
    """clingo itself failed."""


class OutOfMemoryError(SolverError):
    """The process of a solver ran out of memory; the solver has lost all that it was told."""


class ServiceError(RosclingoError):
    """A solver node is missing, was lost, or sent an unreadable reply."""


class SolverEndedError(ServiceError):
    """A solver node has refused a request because it is shutting down."""


class XmlError(RosclingoError):
    """An XML text that does not keep to the manual's format.

    Attributes:
        line: Line of the fault, counted from 1; 0 when it is not at a place in the text.
        column: Column of the fault, counted from 1; 0 with no line.
        command: Name of the command that holds the fault, or of the root element.
        index: Position of that command in the list, counted from 0; -1 outside of any.
    """

    def __init__(self, message: str, line: int = 0, column: int = 0) -> None:
        place = f"line {line}, column {column}: " if line else ""
        super().__init__(place + message)
        self.line = line
        self.column = column
        self.command: Optional[str] = None
        self.index = -1
