"""The files of a recorded node as they are on this machine's disk."""

from __future__ import annotations

import os
import posixpath
from pathlib import Path
from typing import Iterator, List

import rospkg

from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.unpack import find, with_files
from rosoclingo.errors import BagError


def from_disk(launched: Launched) -> List[str]:
    """Returns the command line with the files as they are now.

    A file of a ROS package is looked for in that package, wherever it is on this machine, and else
    where it was when it was recorded: first by the name that the command line has for it, which may
    be a link, and next to which its includes are.

    Raises:
        BagError: One is not there any more.
    """
    packages = rospkg.RosPack()

    def existing(path: str) -> str:
        recorded = find(path, launched)
        named = posixpath.join(launched.directory, os.path.expanduser(path))
        names = [named, f"{named}.lp"] if launched.directory else []
        for place in (*names, recorded):
            for candidate in (*_in_packages(place, packages), place):
                if os.path.isfile(candidate):
                    return candidate
        for candidate in (path, f"{path}.lp"):
            if os.path.isfile(candidate):
                return candidate
        raise BagError(
            f"{recorded} of {launched.node} is not there any more; leave out --files disk to use "
            "what the bag has"
        )

    return with_files(launched, existing)


def is_unchanged(launched: Launched) -> bool:
    """Tells if the files that :func:`from_disk` uses have the contents that the bag has."""
    packages = rospkg.RosPack()

    def is_same(path: str, text: str) -> bool:
        found = next(filter(os.path.isfile, (*_in_packages(path, packages), path)), None)
        try:
            return found is not None and Path(found).read_text(encoding="utf-8") == text
        except (OSError, ValueError):  # unreadable, or no text
            return False

    return all(is_same(path, text) for path, text in launched.files.items())


def _in_packages(path: str, packages: rospkg.RosPack) -> Iterator[str]:
    """Yields the paths that a file may have in packages named as its folders, the nearest first."""
    parts = path.split("/")
    for place in range(len(parts) - 2, 0, -1):
        try:
            yield os.path.join(packages.get_path(parts[place]), *parts[place + 1 :])
        except rospkg.ResourceNotFound:
            continue
