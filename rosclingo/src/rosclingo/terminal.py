"""Output of programs on a terminal: a progress line, and texts of others, escaped."""

from __future__ import annotations

import os
import sys
import threading
import time
from typing import Callable, TextIO


class ProgressLine:
    """A progress line on stderr, rewritten in place on a terminal.

    Elsewhere, such as in a file, each text is a line of its own. What else is printed meanwhile
    goes through :meth:`print`, which takes the line away first; any thread may call all methods.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shown = 0  # columns that are to be overwritten

    def show(self, text: str) -> None:
        """Shows how far the program is."""
        with self._lock:
            if not sys.stderr.isatty():
                print(text, file=sys.stderr)
                return
            text = text[: _columns() - 1]  # a line that wraps cannot be rewritten
            self._write(text)
            self._shown = len(text)

    def clear(self) -> None:
        """Takes the line away, if it is on a terminal."""
        with self._lock:
            self._clear()

    def print(self, text: str, file: TextIO) -> None:
        """Prints a text in the place of the line."""
        with self._lock:
            self._clear()
            print(text, file=file, flush=True)

    def _clear(self) -> None:
        if self._shown:
            self._write("")
            self._shown = 0

    def _write(self, text: str) -> None:
        rest = max(self._shown - len(text), 0)
        sys.stderr.write(f"\r{text}{' ' * rest}\r")
        sys.stderr.flush()


PROGRESS = ProgressLine()
"""The process's progress line, which all that it prints goes through."""


class ProgressPrinter:
    """A context that prints progress every 2 s."""

    def __init__(self, place: Callable[[], str]) -> None:
        """Prepares the output.

        Args:
            place: Says how far it is; called in another thread.
        """
        self._place = place
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()
        PROGRESS.clear()

    def _run(self) -> None:
        began = time.monotonic()
        while not self._is_over.wait(_SECONDS):
            seconds = time.monotonic() - began
            PROGRESS.show(f"{seconds:.0f} s: {self._place()}")


def _columns() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or _COLUMNS
    except OSError:
        return _COLUMNS


_COLUMNS = 80  # of a terminal that does not say so
_SECONDS = 2.0  # between two texts of a ProgressPrinter


def one_line(text: str) -> str:
    """Returns a text with all that is not printable escaped, line ends and tabs too."""
    return "".join(map(_escaped, text))


def lines(text: str) -> str:
    """Returns a text with all that is not printable escaped, but for line ends and tabs."""
    return "".join(letter if letter in "\n\t" else _escaped(letter) for letter in text)


def say(program: str, text: str) -> None:
    """Prints a message of a program on stderr, which may have texts of a bag."""
    PROGRESS.print(lines(f"{program}: {text}"), sys.stderr)


def _escaped(letter: str) -> str:
    return letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii")
