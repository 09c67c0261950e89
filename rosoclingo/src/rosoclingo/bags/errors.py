"""The error of bags, whose message names the bag and the remedy."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class BagError(RosclingoError):
    """A bag cannot be read, written, compared or replayed; the message says what to do."""
