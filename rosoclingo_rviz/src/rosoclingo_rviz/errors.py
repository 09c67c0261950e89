"""Errors of the markers for rviz."""

from __future__ import annotations

from rosclingo.errors import RosclingoError


class MarkerFileError(RosclingoError):
    """A file that is no visualization_msgs/MarkerArray; the message names it and the remedy."""
