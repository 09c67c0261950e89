"""Durable record of each actuator's last action, which outlasts a crash. Needs no ROS.

>>> ledger = Ledger()
>>> ledger.begin("robot", Token("a", 1), "pickup(3)")
>>> ledger.last("robot").answer is None
True
>>> ledger.end("robot", Token("a", 1), "pickup(3)", "success")
>>> ledger.last("robot")
LedgerEntry(token=Token(run='a', number=1), action='pickup(3)', answer='success')
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Optional

from rosoclingo_interfaces.store_file import load, reserve, save

_PART = "last"  # in the file: the last action of each actuator


@dataclass(frozen=True)
class Token:
    """The idempotency key of an action: it stays the same when the action is published again.

    Attributes:
        run: The id of rosoclingo's run.
        number: The action's number in it.
    """

    run: str
    number: int

    def is_before(self, other: Token) -> bool:
        """Returns whether it is of the same run as another token, and earlier."""
        return self.run == other.run and self.number < other.number


@dataclass(frozen=True)
class LedgerEntry:
    """The last action that an actuator has begun.

    Attributes:
        token: That of the action.
        action: The action, a term.
        answer: What was answered; None as long as nothing is.
    """

    token: Token
    action: str
    answer: Optional[str] = None


class Ledger:
    """The last action of each actuator, and its answer. Thread-safe.

    With a file, each change is there, whatever happens to the process or to the machine, before the
    method that makes it returns: the new file is written next to the old one, and takes its place.

    Attributes:
        is_old: Whether the file was there, so that it says what an earlier process has done.
    """

    def __init__(self, file: Optional[Path] = None) -> None:
        """Reads the file, or makes it.

        Args:
            file: Where it is kept; None for nowhere, so that a new process knows nothing.

        Raises:
            LedgerError: The file cannot be read or written, or another process has it.
        """
        self._file = file
        self._lock = threading.Lock()  # guards the entries; held while the file is written
        self._entries: Dict[str, LedgerEntry] = {}
        self.is_old = file is not None and file.exists()
        if file is not None:
            self._guard = reserve(file)  # as long as this process lives
            if self.is_old:
                self._entries = load(
                    file,
                    _PART,
                    _entries,
                    "is no store of an interface",
                    "move it away if nothing in it matters: what was begun is not known then",
                )
            self._write(self._entries)

    def last(self, actuator: str) -> Optional[LedgerEntry]:
        """Returns the last action that an actuator has begun, or None."""
        with self._lock:
            return self._entries.get(actuator)

    def begin(self, actuator: str, token: Token, action: str) -> None:
        """Records an action before it begins.

        Raises:
            LedgerError: It cannot be remembered; the action must not begin.
        """
        with self._lock:
            entries = {**self._entries, actuator: LedgerEntry(token, action)}
            self._write(entries)
            self._entries = entries

    def end(self, actuator: str, token: Token, action: str, answer: str) -> None:
        """Records an answer before it is sent, unless a later action has begun.

        Raises:
            LedgerError: It is remembered by this process only.
        """
        with self._lock:
            known = self._entries.get(actuator)
            if known is not None and token.is_before(known.token):
                return
            self._entries = {**self._entries, actuator: LedgerEntry(token, action, answer)}
            self._write(self._entries)

    def _write(self, entries: Dict[str, LedgerEntry]) -> None:
        if self._file is None:
            return
        said = {
            actuator: {
                "run": entry.token.run,
                "number": entry.token.number,
                "action": entry.action,
                "answer": entry.answer,
            }
            for actuator, entry in entries.items()
        }
        save(self._file, _PART, said)


def _entries(said: Any) -> Dict[str, LedgerEntry]:
    return {str(actuator): _entry(entry) for actuator, entry in said.items()}


def _entry(said: Any) -> LedgerEntry:
    run, number, action, answer = (said[key] for key in ("run", "number", "action", "answer"))
    if not (
        isinstance(run, str)
        and type(number) is int
        and isinstance(action, str)
        and (answer is None or isinstance(answer, str))
    ):
        raise ValueError(f"{said!r:.200} is no action")
    return LedgerEntry(Token(run, number), action, answer)
