"""Input lines from a terminal or a pipe; output meanwhile does not disturb the typed line."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import Callable, Iterator, List, Optional, Sequence

_POLL_SECONDS = 0.05  # how often a wait looks at its condition
_MOST_WORDS = 200  # that TAB lists
_WAKE = signal.SIGUSR1  # interrupts the reading of a line
_HANDLED = (signal.SIGINT, signal.SIGTERM, _WAKE)


class _StoppedError(Exception):
    """Ends the reading of a line."""


class Prompt:
    """Reads lines until their end, Ctrl-C, or :meth:`stop`.

    Make it in the main thread, after the node is initialised: it handles SIGINT and SIGTERM from
    then on. Only the main thread reads and waits; any thread may print and stop.

    Attributes:
        interactive: Whether a user types the lines and sees the output.
        interrupted: Whether Ctrl-C or SIGTERM has come.
        reason: Why reading was stopped; None as long as it was not.
    """

    def __init__(self, prompt: str) -> None:
        """Prepares a prompt.

        Args:
            prompt: Printed when a line may be typed; not when lines come from a pipe.
        """
        self.interactive = sys.stdin.isatty() and sys.stdout.isatty()
        self.interrupted = False
        self.reason: Optional[str] = None
        self._prompt = prompt
        self._reading = False
        self._has_ended = False
        self._fitting: List[str] = []  # the words that TAB offers
        self._output = threading.Lock()  # one line at a time; guards the one above
        if self.interactive:
            import readline  # noqa: PLC0415 (it may write to the terminal when imported)

            self._typed: Callable[[], str] = readline.get_line_buffer
        for number in _HANDLED:
            signal.signal(number, self._on_signal)
        signals, to_watch = os.pipe()
        os.set_blocking(to_watch, False)
        signal.set_wakeup_fd(to_watch, warn_on_full_buffer=False)
        threading.Thread(target=self._watch, args=(signals,), daemon=True).start()

    def lines(self) -> Iterator[str]:
        """Yields the lines without white space around them, until their end or a stop."""
        while True:
            line = self._read()
            if line is None:
                return
            yield line.strip()

    def complete(self, offered: Callable[[Sequence[str]], Sequence[str]]) -> None:
        """Has TAB complete words; without effect when lines come from a pipe.

        Args:
            offered: Returns the words that may come next, of those of the line before. Called in
                the main thread, while it reads.
        """
        if self.interactive:
            import readline  # noqa: PLC0415 (as above)

            self._offered = offered
            self._begins: Callable[[], int] = readline.get_begidx
            readline.set_completer_delims(" \t")
            readline.set_completer(self._complete)
            readline.set_completion_display_matches_hook(self._list)
            readline.parse_and_bind("tab: complete")

    def _complete(self, begun: str, number: int) -> Optional[str]:
        """Returns the N-th completion of the typed word; None after the last."""
        if number == 0:
            before = self._typed()[: self._begins()].split()
            self._fitting = [word for word in self._offered(before) if word.startswith(begun)]
            if len(self._fitting) == 1:
                self._fitting[0] += " "
        return self._fitting[number] if number < len(self._fitting) else None

    def _list(self, _begun: str, words: Sequence[str], _longest: int) -> None:
        # readline itself would print amid what others say, and wait for a key if there are many.
        more = f"  and {len(words) - _MOST_WORDS} more" if len(words) > _MOST_WORDS else ""
        self.say("  ".join(words[:_MOST_WORDS]) + more)

    def say(self, text: str, last: bool = False) -> None:
        """Prints a line above the typed one; nothing, once the last line was typed."""
        with self._output:
            if self._has_ended:
                return
            self._has_ended = last
            if self.interactive and self._reading:
                print(f"\r\033[K{text}\n{self._prompt}{self._typed()}", end="", flush=True)
            else:
                print(text, flush=True)

    def stop(self, reason: str) -> None:
        """Ends reading and waiting; the first reason is kept."""
        if self.reason is None:
            self.reason = reason
            _wake()

    def wait(self, condition: Callable[[], bool], seconds: float = math.inf) -> bool:
        """Waits until a condition holds, for some time or for a stop.

        Returns:
            Whether the condition holds.
        """
        end = time.monotonic() + seconds
        pause = threading.Event()
        while not condition():
            if self.reason is not None or time.monotonic() > end:
                return False
            pause.wait(_POLL_SECONDS)
        return True

    def _read(self) -> Optional[str]:
        try:
            # In this order: a signal in between is not lost.
            self._reading = True
            if self.reason is not None:
                return None
            if self.interactive:
                return input(self._prompt)
            return sys.stdin.readline() or None
        except (EOFError, _StoppedError):
            if self.interactive:
                print(flush=True)
            return None
        except UnicodeDecodeError:
            return "\ufffd"  # no line that anybody understands
        finally:
            self._reading = False

    def _on_signal(self, number: int, frame: Optional[FrameType]) -> None:
        if number != _WAKE:
            self.interrupted = True
            self.reason = self.reason or "interrupted"
        called = (Prompt._complete.__code__, Prompt._list.__code__)
        while frame is not None and frame.f_code not in called:
            frame = frame.f_back
        # What readline has called must not raise: it would be ignored. The next signal does.
        if self._reading and frame is None:
            raise _StoppedError

    def _watch(self, signals: int) -> None:
        """Interrupts the main thread after each of our signals until it reads no longer.

        A signal that comes when ``input`` has begun, and does not wait for a key yet, interrupts
        nothing, and Python handles it only after the next key.

        Args:
            signals: The pipe to which Python writes each signal, before it handles it.
        """
        while True:
            (number,) = os.read(signals, 1)
            time.sleep(_POLL_SECONDS)
            while number in _HANDLED and (self._reading or self.reason is None):
                _wake()
                time.sleep(_POLL_SECONDS)


def _wake() -> None:
    # A system call that reads is interrupted by nothing but a signal to its thread.
    identifier = threading.main_thread().ident
    if identifier is not None:
        signal.pthread_kill(identifier, _WAKE)
