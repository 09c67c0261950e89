"""A prompt whose lines come from a pipe."""

from __future__ import annotations

import signal
from typing import Iterator

import pytest

from rosoclingo_interfaces.prompt import Prompt


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
