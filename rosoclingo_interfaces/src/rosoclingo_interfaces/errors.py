"""What is expected to go wrong."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class ActionError(RosclingoError):
    """An action that cannot be done by this interface; the message names the action."""


class StoreError(RosclingoError):
    """What was done cannot be remembered, or not be read; the message names the file."""


class LineError(RosclingoError):
    """A line that the user typed and that means nothing; the message says what would."""


class CanceledError(RosclingoError):
    """The action that runs in this thread is to stop; an interface's method lets it pass."""


class WaypointError(RosclingoError):
    """A waypoint that there is not, or a waypoint file that is none; the message says which."""


class DriveError(RosclingoError):
    """The robot did not get to where it should drive; the message says why."""


class GoneError(DriveError):
    """The robot did not get there because its navigation or the clock is gone."""
