"""Types into a command, through a pipe or a terminal, while it runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Tuple

from terminals import Terminal, Terminals

CTRL_C, CTRL_D = "\x03", "\x04"


class Typist:
    """The writing end of a command's input."""

    def __init__(self, path: Path) -> None:
        """Waits until the command has opened its end."""
        self._file = os.open(path, os.O_WRONLY)

    def type(self, text: str) -> None:
        """Types a text; the Enter at the end of a line is part of it."""
        os.write(self._file, text.encode())

    def close(self) -> None:
        """Ends the input."""
        os.close(self._file)


def pipe(terminals: Terminals, folder: Path, *command: str) -> Tuple[Terminal, Typist]:
    """Starts a command that reads from a pipe."""
    path = _make(folder)
    terminal = terminals.start(
        "bash", "-c", 'exec "$@" <"$0"', str(path), *terminals.without_rosrun(command)
    )
    return terminal, Typist(path)


def keyboard(terminals: Terminals, folder: Path, *command: str) -> Tuple[Terminal, Typist]:
    """Starts a command in a terminal."""
    path = _make(folder)
    line = 'exec script --quiet --return --flush --command "$1" /dev/null <"$0"'
    terminal = terminals.start(
        "bash", "-c", line, str(path), " ".join(terminals.without_rosrun(command))
    )
    return terminal, Typist(path)


def _make(folder: Path) -> Path:
    path = folder / f"{len(list(folder.glob('*.fifo')))}.fifo"
    os.mkfifo(path)
    return path
