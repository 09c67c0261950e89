"""Whether a recording can be replayed, and may be. Needs no ROS."""

from __future__ import annotations

import re
from pathlib import Path

from rosclingo.solver import lexical
from rosoclingo.bags.model import Recording
from rosoclingo.bags.replay.unpack import ReplayError

_NAME = re.compile(r"/[A-Za-z]\w*(/[A-Za-z]\w*)*")


def check(bag: Path, recording: Recording, allow_scripts: bool) -> None:
    """Checks that a recording can be replayed on this machine.

    Args:
        bag: Where it was read from.
        recording: The recording.
        allow_scripts: Whether the ``#script`` blocks in its files may run.

    Raises:
        ReplayError: It cannot; the message says why and what to do.
    """
    for name in (recording.name, *recording.programs):
        if not _NAME.fullmatch(name):
            raise ReplayError(f"{bag}: {name!r} is no name of a node")
    for program in recording.programs.values():
        for file, text in program.files.items():
            if lexical.script(text) is not None and not allow_scripts:
                raise ReplayError(
                    f"{bag}: {file} has a #script block, which would run on this machine; if you "
                    "trust the bag, allow it with --allow-scripts"
                )
