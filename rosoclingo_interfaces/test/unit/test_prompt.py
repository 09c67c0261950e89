"""A prompt whose lines come from a pipe."""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path
from typing import Iterator, List, Optional, Sequence

import pytest
from waiting import wait_for

from rosoclingo_interfaces.prompt import Prompt, _StoppedError


@pytest.fixture
def prompt() -> Iterator[Prompt]:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)
    handlers = [signal.getsignal(number) for number in numbers]
    yield Prompt("> ")
    signal.set_wakeup_fd(-1)
    for number, handler in zip(numbers, handlers):
        signal.signal(number, handler)


def test_nothing_is_printed_after_the_last_line(
    prompt: Prompt, capsys: pytest.CaptureFixture[str]
) -> None:
    """Feedback may still come, in another thread, while the process ends."""
    prompt.say("[1] accepted")
    prompt.say("0 deliveries, 1 open", last=True)
    prompt.say("[1] step 1 of 6")
    assert capsys.readouterr().out == "[1] accepted\n0 deliveries, 1 open\n"


def test_a_signal_that_interrupts_nothing(prompt: Prompt, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another thread gets Ctrl-C, so that the main thread goes on waiting for a line."""
    reading, typing = os.pipe()
    state = Path(f"/proc/self/task/{threading.get_native_id()}/stat")
    is_over = threading.Event()

    def interrupt() -> None:
        wait_for(lambda: prompt._reading and state.read_text().rpartition(")")[2].split()[0] == "S")
        os.kill(os.getpid(), signal.SIGINT)
        is_over.wait(60.0)  # no more than a bound, at which the lines end
        os.close(typing)

    other = threading.Thread(target=interrupt)
    other.start()
    with os.fdopen(reading) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            assert list(prompt.lines()) == []
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    assert other.is_alive(), "the end of the lines came first"
    is_over.set()
    other.join()
    assert prompt.interrupted


def test_a_stop_while_a_word_is_completed(prompt: Prompt, monkeypatch: pytest.MonkeyPatch) -> None:
    """readline ignores what is raised by what it calls, and reads on."""
    before: List[Sequence[str]] = []

    def offered(words: Sequence[str]) -> Sequence[str]:
        before.append(words)
        prompt.stop("the server has gone")
        return ["kitchen", "lab"]

    for name, value in {
        "_typed": lambda: "kitchen l", "_begins": lambda: 8, "_offered": offered, "_reading": True,
    }.items():  # fmt: skip
        monkeypatch.setattr(prompt, name, value, raising=False)
    fitting: List[Optional[str]] = []

    def read() -> None:
        fitting.extend(prompt._complete("l", number) for number in (0, 1))
        threading.Event().wait(60.0)

    with pytest.raises(_StoppedError):
        read()
    assert fitting == ["lab ", None]
    assert before == [["kitchen"]]
