"""An action with a token is done once, by whichever process; each is told what it can know."""

from __future__ import annotations

import itertools
import logging
import os
import queue
import shutil
import signal
import threading
import warnings
from pathlib import Path
from typing import Any, Callable, Iterator, List, NoReturn, Set, Tuple

import pytest
from draws import draws

from rosoclingo_interfaces import store_file
from rosoclingo_interfaces.errors import ActionError, LedgerError
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.ledger import Ledger, LedgerEntry, Token
from rosoclingo_interfaces.retransmitter import Retransmitter

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes
RUN = "a"


class Robot(ActionInterface):
    """Counts what it does, and goes on only when it may."""

    actuators = ("robot", "arm")

    def __init__(self) -> None:
        self.after_crash = {"push": "fail"}
        self.done: queue.Queue[str] = queue.Queue()
        self.may_end = threading.Event()

    def go(self, place: str) -> bool:
        self.done.put(f"go({place})")
        return place != "nowhere"

    def pickup(self, package: int) -> bool:
        self.done.put(f"pickup({package})")
        return True

    def push(self) -> bool:
        self.done.put("push")
        return True

    def wait(self) -> bool:
        self.done.put("wait")
        while not self.may_end.is_set():
            self.sleep(0.001)
        return True

    def counted(self) -> int:
        return self.done.qsize()


class Sent:
    """The answers that a process sends, each with its token's number."""

    def __init__(self, robot: Robot, ledger: Ledger, timeout: float = 0.0) -> None:
        self.robot = robot
        self.executor = Executor(robot, timeout, ledger=ledger)
        self.answers: queue.Queue[Tuple[int, str]] = queue.Queue()

    def begin(
        self, number: int, action: str, actuator: str = "robot", run: str = RUN, **state: bool
    ) -> None:
        self.executor.begin(
            actuator,
            action,
            lambda value: self.answers.put((number, value)),
            Token(run, number),
            **state,
        )

    def wait(self, number: int) -> Sent:
        """Begins an action that goes on until the robot may end it."""
        self.begin(number, "wait")
        assert self.robot.done.get(timeout=TIMEOUT) == "wait"
        return self

    def ask(self, number: int, action: str, actuator: str = "robot", run: str = RUN) -> str:
        self.begin(number, action, actuator, run)
        answered, value = self.answers.get(timeout=TIMEOUT)
        assert answered == number
        assert self.answers.empty()
        return value


@pytest.fixture
def robot() -> Robot:
    return Robot()


Start = Callable[..., Sent]


@pytest.fixture
def start(robot: Robot, tmp_path: Path) -> Iterator[Start]:
    """Starts what stands for a process: it knows what the store of those before has."""
    started: List[Sent] = []

    def made(store: str = "", timeout: float = 0.0) -> Sent:
        for one in started:
            one.executor.close(TIMEOUT)
            guard = getattr(one.executor._ledger, "_guard", None)
            if guard is not None:
                os.close(guard)
                del one.executor._ledger._guard
        started.append(Sent(robot, Ledger(tmp_path / store if store else None), timeout))
        return started[-1]

    yield made
    for one in started:
        one.executor.close(TIMEOUT)


@pytest.mark.parametrize("store", ["", "robot.json"])
def test_a_token_is_done_once(robot: Robot, start: Start, store: str) -> None:
    sent = start(store)
    assert sent.ask(1, "go(c3)") == "success"
    for _ in range(3):  # it is answered again, because it is asked for again
        assert sent.ask(1, "go(c3)") == "success"
    assert sent.ask(2, "go(c3)") == "success"
    assert sent.ask(3, "go(nowhere)") == "failure"
    assert sent.ask(3, "go(nowhere)") == "failure"
    sent.begin(2, "go(c3)")  # is old
    assert sent.ask(4, "pickup(1)") == "success"
    assert sent.ask(1, "go(c4)", run="b") == "success"  # rosoclingo has begun anew
    assert [robot.done.get_nowait() for _ in range(5)] == [
        "go(c3)", "go(c3)", "go(nowhere)", "pickup(1)", "go(c4)",
    ]  # fmt: skip
    assert robot.done.empty()


def test_a_token_that_comes_again_while_it_is_done(robot: Robot, start: Start) -> None:
    sent = start().wait(1)
    for _ in range(3):
        sent.begin(1, "wait")
    assert sent.ask(2, "go(c3)", "arm") == "success"
    robot.may_end.set()
    assert sent.answers.get(timeout=TIMEOUT) == (1, "success")
    assert [robot.done.get_nowait()] == ["go(c3)"]
    assert sent.ask(1, "wait") == "success"
    assert robot.done.empty()


def test_a_later_token_replaces_an_action(robot: Robot, start: Start) -> None:
    sent = start().wait(1)
    assert sent.ask(2, "go(c3)") == "success"
    sent.begin(1, "wait")
    assert sent.ask(2, "go(c3)") == "success"
    assert robot.counted() == 1


def test_an_action_that_is_to_stop(robot: Robot, start: Start) -> None:
    sent = start().wait(1)
    sent.begin(1, "wait", aborted=True)
    assert sent.answers.get(timeout=TIMEOUT) == (1, "failure")
    sent.begin(2, "go(c3)", aborted=True)  # it was late
    assert sent.answers.get(timeout=TIMEOUT) == (2, "failure")
    assert robot.done.empty()


def test_what_another_node_does(robot: Robot, start: Start) -> None:
    robot.leaves_unknown = True
    sent = start().wait(1)
    sent.begin(2, "deliver(1)")  # ends what is done here
    assert sent.ask(3, "go(c3)") == "success"
    for _ in range(2):
        sent.begin(4, "deliver(2)")
    assert sent.answers.empty()


@pytest.mark.parametrize("action", ["fly(3)", "go(", "abort"])
def test_what_cannot_be_done(robot: Robot, start: Start, action: str) -> None:
    sent = start()
    for _ in range(2):
        assert sent.ask(1, action) == "failure"
    assert robot.done.empty()


def test_a_time_limit(robot: Robot, start: Start) -> None:
    sent = start("robot.json", 0.05)
    for _ in range(2):
        assert sent.ask(1, "wait") == "failure"
    robot.may_end.set()
    assert start("robot.json").ask(1, "wait") == "failure"
    assert robot.counted() == 1


def test_an_answer_after_the_next_action_has_begun(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "store")
    ledger.begin("robot", Token(RUN, 1), "go(c3)")
    ledger.begin("robot", Token(RUN, 2), "go(c4)")
    ledger.end("robot", Token(RUN, 1), "go(c3)", "failure")
    assert ledger.last("robot") == LedgerEntry(Token(RUN, 2), "go(c4)")


# After a restart.


def test_done_before_the_restart(
    robot: Robot, start: Start, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    assert start("robot.json").ask(1, "go(nowhere)") == "failure"
    again = start("robot.json")
    assert again.ask(1, "go(nowhere)") == "failure"
    assert again.ask(1, "go(nowhere)") == "failure"
    assert "robot: action 1 was done before this node was started: failure" in caplog.text
    assert again.ask(2, "go(c3)", "arm") == "success"
    assert "arm: action 2 was not begun before this node was started" in caplog.text
    assert robot.counted() == 2
    # An older action is not done by one that knows a later one.
    last = start("robot.json")
    last.begin(0, "go(c9)")
    assert last.ask(3, "go(c3)") == "success"
    assert robot.counted() == 3


@pytest.mark.parametrize(
    ("action", "answer"), [("go(c3)", "success"), ("push", "failure"), ("pickup(1)", "unknown")]
)
def test_a_crash_in_an_action(
    start: Start, tmp_path: Path, caplog: pytest.LogCaptureFixture, action: str, answer: str
) -> None:
    ledger = Ledger(tmp_path / "robot.json")
    ledger.begin("robot", Token(RUN, 7), action)
    os.close(ledger._guard)
    for _ in range(2):  # also after the next restart
        sent = start("robot.json")
        assert sent.ask(7, action) == answer
    assert sent.robot.counted() == (1 if answer == "success" else 0)
    assert f"robot: {action} was begun before this node was started, and whether" in caplog.text


def test_a_crash_in_an_action_that_is_to_stop(robot: Robot, tmp_path: Path, start: Start) -> None:
    for number, (action, answer) in enumerate([("go(c3)", "failure"), ("pickup(1)", "unknown")]):
        ledger = Ledger(tmp_path / f"{number}.json")
        ledger.begin("robot", Token(RUN, 7), action)
        os.close(ledger._guard)
        sent = start(f"{number}.json")
        sent.begin(7, action, aborted=True)
        assert sent.answers.get(timeout=TIMEOUT) == (7, answer)
    assert robot.done.empty()


def test_a_declaration_that_means_nothing(robot: Robot) -> None:
    robot.after_crash = {"go": "maybe"}
    with pytest.raises(ActionError, match="'maybe' for the action go is none of again, fail, unkn"):
        Executor(robot)


# Sent again.


def test_an_answer_is_sent_until_it_was_taken() -> None:
    sent: queue.Queue[str] = queue.Queue()
    insistent = Retransmitter(sent.put, first_seconds=0.001)
    insistent.keep([("robot", RUN, 1), ("arm", RUN, 2)])
    insistent.add(("robot", RUN, 1), "success")
    insistent.add(("arm", RUN, 2), "failure")
    heard = {sent.get(timeout=TIMEOUT) for _ in range(4)}
    assert heard == {"success", "failure"}
    insistent.keep([("robot", RUN, 3), ("arm", RUN, 2)])
    while not sent.empty():
        sent.get()
    assert [sent.get(timeout=TIMEOUT) for _ in range(4)][1:] == [
        "failure"
    ] * 3  # one was on its way
    insistent.keep([])


def test_an_answer_to_another_run_is_not_sent_again() -> None:
    """An action may end when the run in which it began is over."""
    sent: queue.Queue[str] = queue.Queue()
    insistent = Retransmitter(sent.put, first_seconds=0.001)
    insistent.keep([("robot", RUN, 1)])
    insistent.keep([("robot", "b", 1)])
    insistent.add(("robot", RUN, 1), "late")
    insistent.add(("robot", "b", 1), "success")
    assert [sent.get(timeout=TIMEOUT) for _ in range(3)] == ["success"] * 3
    insistent.keep([])


# The file.


def test_a_file_that_another_node_uses(tmp_path: Path) -> None:
    first = Ledger(tmp_path / "store")
    with pytest.raises(LedgerError, match="is used by another node that runs"):
        Ledger(tmp_path / "store")
    os.close(first._guard)
    Ledger(tmp_path / "store")


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "{}", "[" * 100_000,
     '{"format": "' + "2" * 9999 + '"}', '{"format": 2, "last": {}}', '{"format": 1, "last": []}',
     '{"format": 1, "last": {"robot": {"run": "a", "number": "1", "action": "b", "answer": null}}}',
     '{"format": 1, "last": {"robot": {"run": "a", "number": 1, "action": "b"}}}'],
)  # fmt: skip
def test_a_file_that_is_no_store(tmp_path: Path, text: str) -> None:
    file = tmp_path / "store"
    file.write_text(text)
    with pytest.raises(
        LedgerError, match=r"store \(~store\) is no store of an interface: .*move it"
    ):
        Ledger(file)
    assert file.read_text() == text


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(LedgerError, match=r"cannot be made: .*name a file in a folder where"):
        Ledger(tmp_path / "nowhere" / "store")


def test_a_full_disk(
    robot: Robot, start: Start, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """An action of which nobody could know later is not begun."""
    sent = start("robot.json")
    write = store_file.replace

    def full(file: Path, data: bytes) -> NoReturn:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(store_file, "replace", full)
    assert sent.ask(1, "pickup(1)") == "failure"
    assert robot.done.empty()
    assert (
        "(~store) cannot be written: [Errno 28] No space left on device; make room" in caplog.text
    )
    monkeypatch.setattr(store_file, "replace", write)
    assert sent.ask(2, "pickup(1)") == "success"


# Killed at every write.


class Crash:
    """Kills the process before one of the points that it comes by; the points are counted."""

    def __init__(self, names: Set[str], number: int) -> None:
        self._names = names
        self._number = number
        self.count = 0

    def __getattr__(self, name: str) -> Any:
        """Stands for the module ``os``."""
        return self.point(name, getattr(os, name))

    def point(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Returns a function that is a point, if points of its name count."""

        def call(*arguments: Any) -> Any:
            self.count += 1
            if self.count == self._number:
                os.kill(os.getpid(), signal.SIGKILL)
            return function(*arguments)

        return call if name in self._names else function


ALL = {"open", "write", "fsync", "close", "replace", "effect", "reply", "replied"}
SOME = {"fsync", "replace", "effect", "reply", "replied"}


def run(folder: Path, after_crash: str, names: Set[str], number: int) -> bool:
    """Runs a process that does an action and answers, and returns whether it was killed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the child starts threads of its own
        process = os.fork()
    if process:
        _, status = os.waitpid(process, 0)
        assert os.WIFSIGNALED(status) or os.WEXITSTATUS(status) == 0
        return os.WIFSIGNALED(status)
    try:
        crash = Crash(names, number)
        store_file.os = crash  # type: ignore[assignment]
        ended = threading.Event()

        class Hand(ActionInterface):
            def act(self) -> bool:
                crash.point("effect", add)(folder / "effects", "x")
                return True

        Hand.after_crash = {"act": after_crash}
        executor = Executor(Hand(), ledger=Ledger(folder / "store"))

        def reply(value: str) -> None:
            crash.point("reply", add)(folder / "answers", f"{value}\n")
            crash.point("replied", ended.set)()

        executor.begin("robot", "act", reply, Token(RUN, 1))
        os._exit(0 if ended.wait(TIMEOUT) else 1)
    finally:
        os._exit(2)


def add(file: Path, text: str) -> None:
    with file.open("a") as opened:
        opened.write(text)


def judge(folder: Path, after_crash: str, crashes: int) -> str:
    """Says how an action has ended, by an account of its own of what was done."""
    effects = len((folder / "effects").read_text()) if (folder / "effects").exists() else 0
    answers = set((folder / "answers").read_text().splitlines())
    assert len(answers) == 1, answers
    answer = answers.pop()
    if after_crash == "again":
        assert answer == "success"
        assert 1 <= effects <= 1 + crashes
    else:
        assert answer in ("success", "unknown" if after_crash == "unknown" else "failure")
        assert effects <= 1
        assert effects == 1 or answer != "success"
    return f"{answer} {min(effects, 1)}"


@pytest.mark.costly
@pytest.mark.parametrize("after_crash", ["again", "fail", "unknown"])
def test_killed_at_each_write(tmp_path: Path, after_crash: str) -> None:
    """Before each: that is after the one before, too, as nothing in between outlives it."""
    ends: Set[str] = set()
    for number in itertools.count(1):
        folder = tmp_path / str(number)
        folder.mkdir()
        if not run(folder, after_crash, ALL, number):
            break
        assert not run(folder, after_crash, ALL, 0)
        ends.add(judge(folder, after_crash, 1))
    assert number > 25  # three times the file is written
    assert (
        ends
        == {
            "again": {"success 1"},
            "fail": {"success 1", "failure 0", "failure 1"},
            "unknown": {"success 1", "unknown 0", "unknown 1"},
        }[after_crash]
    )


@pytest.mark.costly
def test_killed_again_while_it_recovers(tmp_path: Path) -> None:
    """At each second write first, with FULL=1 at each."""
    pairs = 0
    for first in draws(range(0, 100, 2), 100):
        killed = tmp_path / str(first)
        killed.mkdir()
        if not run(killed, "unknown", SOME, first + 1):
            assert first > 10
            break
        for second in itertools.count(1):
            folder = tmp_path / f"{first}.{second}"
            shutil.copytree(str(killed), str(folder))
            if not run(folder, "unknown", SOME, second):
                break
            pairs += 1
            assert not run(folder, "unknown", SOME, 0)
            judge(folder, "unknown", 2)
    assert pairs > 25
