"""Retransmits answers until they are acknowledged. Needs no ROS."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Any, Callable, Dict, FrozenSet, Iterable, Tuple

AnswerKey = Tuple[str, str, int]
"""What an answer is to: actuator, run and number."""

_FIRST_SECONDS = 0.5  # after which an answer is sent again; then after twice as long, and so on
_LONGEST_SECONDS = 5.0


@dataclass
class _Sent:
    answer: Any
    due: float
    pause: float


class Retransmitter:
    """Retransmits sent answers until they are acknowledged. Thread-safe.

    A publisher cannot know that its subscriber has died: what it sends then is lost. The one that
    starts again takes an answer once, however often it comes.
    """

    def __init__(self, send: Callable[[Any], None], first_seconds: float = _FIRST_SECONDS) -> None:
        """Prepares a retransmitter without answers.

        Args:
            send: Sends an answer again, in a thread of this object's; does not wait.
            first_seconds: After how many seconds of wall time that is done first.
        """
        self._send = send
        self._first_seconds = first_seconds
        self._changed = threading.Condition()  # guards the answers; held for moments only
        self._sent: Dict[AnswerKey, _Sent] = {}
        self._open: FrozenSet[AnswerKey] = frozenset()  # the open actions
        threading.Thread(target=self._run, name="answers", daemon=True).start()

    def add(self, key: AnswerKey, answer: Any) -> None:
        """Schedules the retransmission of an answer, which is about to be sent for the first time.

        An answer of a run that is over is sent only once.
        """
        with self._changed:
            if key not in self._open:
                return
            pause = self._first_seconds
            self._sent[key] = _Sent(answer, time.monotonic() + pause, pause)
            self._changed.notify()

    def keep(self, keys: Iterable[AnswerKey]) -> None:
        """Sets the actions that still need an answer, and drops the answers to all others."""
        with self._changed:
            self._open = frozenset(keys)
            self._sent = {key: sent for key, sent in self._sent.items() if key in self._open}

    def _run(self) -> None:
        while True:
            with self._changed:
                rest = min((sent.due for sent in self._sent.values()), default=None)
                if rest is None or rest > time.monotonic():
                    self._changed.wait(None if rest is None else rest - time.monotonic())
                now = time.monotonic()
                due = [sent for sent in self._sent.values() if sent.due <= now]
                for sent in due:
                    sent.pause = min(2 * sent.pause, _LONGEST_SECONDS)
                    sent.due = now + sent.pause
            for sent in due:
                self._send(sent.answer)
