"""clingo's solvers, and the messages that they write."""

from __future__ import annotations

from typing import List, Sequence

import clingo
import clingo.core
from clingo import _internal

from rosclingo.errors import OptionsError


def _lenient(c_str: object) -> str:
    ffi = _internal._ffi  # type: ignore[attr-defined]  # clingo has no public way to it
    return ffi.string(c_str).decode("utf-8", "backslashreplace")


# clingo quotes single bytes of a character outside of ASCII. Its Python module fails to decode
# such a message inside of a callback that must not fail, which ends the process.
clingo.core._to_str = _lenient  # type: ignore[attr-defined]


def new_control(options: Sequence[str], messages: Messages) -> clingo.Control:
    """Makes a solver.

    Raises:
        OptionsError: clingo refuses an option.
    """
    try:
        return clingo.Control(list(options), logger=messages)
    except RuntimeError as err:
        detail = messages.text() or str(err)
        raise OptionsError(f"clingo refuses the options {' '.join(options)}: {detail}") from err


class Messages:
    """Collects clingo's messages; an instance serves as its logger.

    Nothing may be raised from here: it would end the process.
    """

    def __init__(self) -> None:
        self._messages: List[str] = []

    def __call__(self, code: clingo.MessageCode, message: str) -> None:
        """Takes a message."""
        self._messages.append(message.strip())

    def text(self) -> str:
        """Returns the messages collected so far and forgets them."""
        text = "\n".join(self._messages)
        self._messages.clear()
        return text
