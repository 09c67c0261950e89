"""Errors of interfaces."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class ActionError(RosclingoError):
    """An action that cannot be done by this interface; the message names the action."""


class LedgerError(RosclingoError):
    """The record of actions cannot be written or read; the message names the file."""


class LineError(RosclingoError):
    """A line of the user that is no command; the message says which lines are."""


class CanceledError(RosclingoError):
    """The action that runs in this thread was cancelled; an interface's method lets it pass."""


class WaypointError(RosclingoError):
    """An unknown waypoint, or an invalid waypoint file; the message says which."""


class DriveError(RosclingoError):
    """The robot did not get to where it should drive; the message says why."""


class GoneError(RosclingoError):
    """An action cannot be done because a server or the clock is gone; the message says which."""


class EntryError(RosclingoError):
    """An invalid entry of a YAML file; the message names the file, the line and the remedy."""


class ReadingError(RosclingoError):
    """A message that does not say whether a condition holds; the message says why."""
