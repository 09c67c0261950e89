"""Refuses a file that exists, and names one that is free, before something begins to write it.

>>> free_name(Path("/none/run.bag"))
PosixPath('/none/run.bag')
"""

from __future__ import annotations

import itertools
import os
import sys
from pathlib import Path
from typing import NoReturn, Sequence


def free_name(file: Path) -> Path:
    """Returns the path, or the first of ``run-2.bag``, ``run-3.bag`` and so on that is free."""
    names = itertools.chain(
        [file.name], (f"{file.stem}-{n}{file.suffix}" for n in itertools.count(2))
    )
    return next(path for path in map(file.with_name, names) if not os.path.lexists(path))


def refusal(file: Path) -> str:
    """Returns why a file cannot be made, with the remedy; nothing if it can."""
    free = free_name(file)
    if free != file:
        return (
            f"{file}: there is such a file already, and it is not overwritten; give another name, "
            f"such as {free.name}, or move it"
        )
    if not os.access(file.parent, os.W_OK | os.X_OK):
        return f"{file}: its folder is not there, or cannot be written to; give another one"
    return ""


def main(arguments: Sequence[str]) -> NoReturn:
    """Prints the absolute path of a file that can be made, for roslaunch, and ends the process.

    Args:
        arguments: The program's name and the file.

    The exit status is 1 if the file cannot be made, which is said on stderr.
    """
    file = Path(arguments[1]).expanduser().absolute()
    reason = refusal(file)
    print(reason or file, file=sys.stderr if reason else sys.stdout)
    sys.exit(1 if reason else 0)
