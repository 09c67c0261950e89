"""A prompt whose lines come from a pipe."""

from __future__ import annotations

import signal
import threading
from typing import Iterator, List, Optional, Sequence

import pytest

from rosoclingo_interfaces.prompt import Prompt, _StoppedError


@pytest.fixture
def prompt() -> Iterator[Prompt]:
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)
    handlers = [signal.getsignal(number) for number in numbers]
    yield Prompt("> ")
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
