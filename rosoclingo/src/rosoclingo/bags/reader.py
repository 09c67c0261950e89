"""Reads a bag into a :class:`~rosoclingo.bags.model.Recording`. Needs no ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

from rosoclingo.bags.errors import NoBagError
from rosoclingo.bags.model import Recording


def read_recording(file: Path, name: Optional[str] = None) -> Recording:
    """Reads the run of one system from a bag.

    Args:
        file: The bag.
        name: Name of the node with the planning loop; needed if the bag has several.

    Raises:
        BagError: The bag cannot be read, or has no such run.
    """
    raise NoBagError(f"{file}: no file of this name; give the path of a bag")
