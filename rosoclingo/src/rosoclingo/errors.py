"""Errors that end the controller loop, and errors of this package's programs."""

from __future__ import annotations

from rosclingo.errors import OutOfMemoryError, RosclingoError, ServiceError


class LoopError(RosclingoError):
    """The loop has to end; the message says why and what to do."""


class ShutdownError(LoopError):
    """The process is told to end."""


class OutsideError(LoopError):
    """The loop ends for a cause outside of its run, such as a solver that is gone."""


class PlannerError(LoopError):
    """The planner refused a command of the controller, or failed at it."""


class SpareMemoryError(OutOfMemoryError):
    """A search that no goal has asked for ran out of memory, such as one for a better plan."""


class RepeatedLossError(ServiceError):
    """A solver was lost each time at the same call."""


class OverloadedError(LoopError):
    """The planner was lost each time that it was asked for the same."""


class ExhaustedError(LoopError):
    """Memory ran out, and this process cannot go on; another one can, if the run is stored.

    Attributes:
        at_once: Whether another process can go on at once, since a goal that asked for too much
            has ended.
    """

    def __init__(self, message: str, *, at_once: bool = False) -> None:
        super().__init__(message)
        self.at_once = at_once


class ControllerError(LoopError):
    """The controller gave no valid command."""


class LaunchedError(RosclingoError):
    """A node's ``~about`` does not say how it was started; the message says where and why."""


class StoreError(RosclingoError):
    """A store cannot be opened, read or written; the message says which, why and what to do."""


class BagError(RosclingoError):
    """A bag cannot be read, written, compared or replayed; the message says why and what to do."""


class LiveError(RosclingoError):
    """There is no running system to look at."""


class QuestionError(RosclingoError):
    """A question names something unknown, or cannot be answered for this encoding."""


class InterruptedQuestionError(RosclingoError):
    """A question was not answered in time."""


class TaskError(RosclingoError):
    """A plan is none for its task."""


class SearchProcessError(RosclingoError):
    """The process that searches for plans cannot be started."""
