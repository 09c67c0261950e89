"""What is expected to go wrong."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class WorldError(RosclingoError):
    """A description that cannot be read or built; the message names file, entry and remedy."""
