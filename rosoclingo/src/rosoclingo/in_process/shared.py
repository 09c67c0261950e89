"""Finds the package's files. Imports nothing of the rest, so that commands start fast."""

from __future__ import annotations

from pathlib import Path


def shared() -> Path:
    """Returns the folder of the package's shared files, in a clone or installed."""
    here = Path(__file__).resolve()
    places = [p for folder in here.parents for p in (folder, folder / "share" / "rosoclingo")]
    return next((place for place in places if (place / "modes").is_dir()), here.parent)
