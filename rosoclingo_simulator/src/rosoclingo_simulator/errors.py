"""Errors of the simulator and of world descriptions."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class MapError(RosclingoError):
    """A map cannot be read; the message names the file and what is wrong with it."""


class PhysicsError(RosclingoError):
    """The physics cannot start; the message says what it needs."""


class ObstacleError(RosclingoError):
    """A command for an obstacle that cannot be done; the message says why."""


class FaultError(RosclingoError):
    """A fault that cannot be read or injected; the message names place, entry and remedy."""


class WorldError(RosclingoError):
    """A description that cannot be read or built; the message names file, entry and remedy."""
