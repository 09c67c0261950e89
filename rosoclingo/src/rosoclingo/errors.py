"""Errors that end the controller loop, and errors of this package's programs."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class LoopError(RosclingoError):
    """The loop has to end; the message says why and what to do."""


class ShutdownError(LoopError):
    """The process is told to end."""


class OutsideError(LoopError):
    """The loop ends for a cause outside of its run, such as a solver that is gone."""


class PlannerError(LoopError):
    """The planner refused or failed at what the controller asked for."""


class ControllerError(LoopError):
    """The controller did not say what to do."""


class LaunchedError(RosclingoError):
    """A node's ``~about`` does not say how it was started; the message says where and why."""


class StoreError(RosclingoError):
    """A store cannot be opened, read or written; the message says which, why and what to do."""


class DamagedStoreError(StoreError):
    """A store and its log are not whole, or do not belong together."""


class BagError(RosclingoError):
    """A bag cannot be read, written, compared or replayed; the message says why and what to do."""


class LiveError(RosclingoError):
    """There is no running system to look at."""


class QuestionError(RosclingoError):
    """A question names something unknown, or cannot be answered for this encoding."""


class InterruptedQuestionError(RosclingoError):
    """A question was not answered in time."""


class SeedPlannerError(RosclingoError):
    """The planner for first plans is unknown, or not installed."""
