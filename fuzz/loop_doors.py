"""Doors of the planning loop and of interfaces: goals, messages, tokens, policies, actions."""

from __future__ import annotations

import threading
import time
from typing import Any, List, Optional, Sequence

import yaml
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from fuzzing import Door
from rosclingo import strict_yaml
from rosclingo.errors import RosclingoError, TermError
from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.loop import journal
from rosoclingo.loop.execution.policies import ActionPolicies
from rosoclingo.loop.inputs.inbox import Inbox, Item
from rosoclingo.loop.journal import AnswerArrived, MessageArrived
from rosoclingo.loop.monitor import Doing
from rosoclingo.loop.values.atoms import canonical
from rosoclingo.loop.values.environment import Environment
from rosoclingo.loop.values.execution import Execution
from rosoclingo.loop.values.goals import Goal
from rosoclingo_interfaces.executor import Executor
from rosoclingo_interfaces.interface import ActionInterface
from rosoclingo_interfaces.ledger import Token

_SECONDS = 60.0  # of wall time, in which the loop takes an input
_TERMS = (
    b"robot", b"success", b"failure", b"unknown", b"busy", b"visit(2)", b"cancel", b"info",
    b"passed",
    b"commit", b"save", b"queue", b"solver", b"first(visit(2))", b"lost", b"timeout",
    b"do(robot,go(2))",
    b"(", b")", b",", b'"', b"#inf", b"#sup", b"-f(1)", b"1..3", b"1/0", b"1\\0", b"2**99", b"X",
    b"_",
    b"@f(1)", b"a;b", b"%*", b"%", b"not", b"not a", b"0x7fffffff", b"2147483647+1",
    b"-2147483648", b"|1|",
    b"~1", b"()", b"(1,)", b"f()", b"'", b"f'(1)", b"{a}", b"#true", b"&a", b"$x", b"\\n", b".",
    b":-", b"\n",
)  # fmt: skip
_TERM = st.recursive(
    st.sampled_from(["robot", "visit(1)", "success", "1", '"a b"', "-a", "go(c3)", "x'"]),
    lambda inner: st.lists(inner, min_size=1, max_size=3).map(lambda args: f"f({','.join(args)})"),
    max_leaves=4,
)


class DroppedInputError(RosclingoError):
    """The loop has dropped an input; the text is its reason."""


class _PromptInbox(Inbox):
    """An inbox of which no input is left while a search is under way."""

    @property
    def may_hold(self) -> bool:
        """Never, so that a flood is taken as it comes."""
        return False


class _Robot(Environment):
    """Keeps what the loop says; answers nothing."""

    def __init__(self) -> None:
        self.executions: Sequence[Execution] = ()
        self.run = ""
        self.dropped: List[str] = []

    def show_executions(self, run: str, executions: Sequence[Execution]) -> None:
        """Keeps the run's id, and the last actions."""
        self.run, self.executions = run, tuple(executions)

    def note(self, record: Any) -> None:
        """Keeps the reason why a message was dropped."""
        if isinstance(record.event, journal.MessageDropped):
            self.dropped.append(record.event.reason)


class LoopDoor(Door):
    """A door of a loop that runs, with a robot that has something to do all the time."""

    words: Sequence[bytes] = _TERMS

    def __init__(self) -> None:
        self.inbox: Inbox = _PromptInbox()
        self.robot = _Robot()
        self.goal = Goal("visit(2)")
        self.failure: Optional[BaseException] = None

    def __enter__(self) -> Door:
        self.inbox, self.robot, self.failure = _PromptInbox(), _Robot(), None
        files = Options((f"{EXAMPLES}/line.lp",))
        steps = ("-c", "steps=10000")  # each failure takes one more
        parts = make_parts("dynamic.incremental.dyn_reset", files, steps)
        self._loop = parts.loop(self.inbox, self.robot)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self.busy()
        return self

    def __exit__(self, *_: object) -> None:
        self.inbox.close()
        self._thread.join(_SECONDS)

    def _run(self) -> None:
        try:
            self._loop.run()
        except Exception as err:
            self.failure = err

    def busy(self) -> None:
        """Sends a goal if none is open, when the loop is idle and has reset."""
        if self.goal.ended or self.goal.slot is None:
            self.rest()
        if self.goal.ended or self.goal.slot is None:
            self.goal = Goal("visit(5)" if self.goal.request == "visit(2)" else "visit(2)")
            self.inbox.put(self.goal)

    def rest(self) -> None:
        """Waits until the loop is idle, with an empty inbox."""
        end = time.monotonic() + _SECONDS
        monitor = self._loop.state.monitor
        while monitor.activity.doing is not Doing.WAITS or self.inbox.waiting():
            assert time.monotonic() < end, f"the loop never rests: {self.failure!r}"
            time.sleep(1e-4)

    def take(self, item: Item) -> None:
        """Gives the loop an input, and waits until it has taken it.

        Raises:
            DroppedInputError: It has dropped it.
        """
        self.robot.dropped.clear()
        self.inbox.put(item)
        for is_taken in (False, True):  # callbacks come before inputs
            while True:
                called = threading.Event()
                self.inbox.call_soon(called.set)
                assert called.wait(_SECONDS), f"the loop is stuck: {self.failure!r}"
                if is_taken or not self.inbox.waiting():
                    break
        assert self.failure is None, f"the loop has ended: {self.failure!r}"
        for reason in self.robot.dropped:
            raise DroppedInputError(reason)

    def parts(self, data: bytes, number: int) -> List[str]:
        """Returns the texts of an input, as rospy decodes them."""
        texts = data.decode("utf-8", "surrogateescape").split("\n")
        return [*texts, "", "", ""][:number]


class GoalDoor(LoopDoor):
    """Goals of the action: their requests."""

    name = "goals"
    inputs = 4_000
    errors = (TermError, DroppedInputError)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns terms."""
        return _TERM.map(str.encode)

    def read(self, data: bytes) -> None:
        """Does as the node does with a goal; one that nobody knows is rejected."""
        text = data.decode("utf-8", "surrogateescape")
        request = canonical(text)
        assert canonical(request) == request
        goal = Goal(request, (text,))
        self.take(goal)
        self.inbox.cancel(goal)
        self.busy()


class MessageDoor(LoopDoor):
    """Messages on ``~in``: id and value."""

    name = "messages"
    inputs = 1_000
    errors = (DroppedInputError,)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns pairs of terms."""
        pairs = st.tuples(_TERM, _TERM).map(lambda pair: "\n".join(pair).encode())
        return st.sampled_from([b"robot\nsuccess", b"robot\nfailure"]) | pairs

    def read(self, data: bytes) -> None:
        """Sends the message, with or without a sender."""
        source, value = self.parts(data, 2)
        self.busy()
        self.take(MessageArrived(source, value, sender="/robot" if len(data) % 3 else ""))


class TokenDoor(LoopDoor):
    """Answers with tokens on ``~answer``: run, number and value."""

    name = "tokens"
    inputs = 1_000
    errors = (DroppedInputError,)
    words = (*_TERMS, b"RUN", b"LAST", b"\n", b"4294967295", b"0", b"1")

    def valid(self) -> SearchStrategy[bytes]:
        """Returns answers, most of them to the last action."""
        run = st.sampled_from(["RUN", "RUN", "RUN", "other", ""])
        number = st.sampled_from(["LAST", "LAST", "0", "1", "4294967295"])
        answers = st.tuples(run, number, _TERM).map(lambda answer: "\n".join(answer).encode())
        return st.sampled_from([b"RUN\nLAST\nsuccess", b"RUN\nLAST\nfailure"]) | answers

    def read(self, data: bytes) -> None:
        """Sends the answer, to a loop that has told the robot what to do."""
        run, number, value = self.parts(data, 3)
        self.busy()
        self.rest()
        last = max((one.number for one in self.robot.executions), default=0)
        digits = number if number.isascii() and number.isdigit() else "0"
        said = last if number == "LAST" else int(digits[:10]) % 2**32
        run = run.replace("RUN", self.robot.run)
        self.take(AnswerArrived(run, said, value, sender="/robot"))


class PolicyDoor(Door):
    """The parameter ``~policies`` of the planning node, as a text."""

    name = "policies"
    words = (
        b"&a ", b"*a", b"go(*)", b"timeout", b"retries: 2", b"then: stuck", b"heartbeat", b".inf",
        b".nan",
        b"9" * 400, b"-1", b"1e999", b"{", b"}", b"[", b"]", b"do(*,*)", b"**", b"then: busy",
        b"then: 1",
        b"!!binary a", b"!!timestamp x", b"? [a]", b'"\\0"', b"true", b"~", b"'go(3)': {}",
        b"factor: x",
    )  # fmt: skip
    errors = (ValueError, yaml.YAMLError)
    inputs = 3_000

    def valid(self) -> SearchStrategy[bytes]:
        """Returns policies of some patterns."""
        policy = st.fixed_dictionaries(
            {},
            optional={
                "timeout": st.sampled_from([0, 60, 1.5]), "factor": st.just(3),
                "retries": st.integers(0, 3), "pause": st.just(5), "heartbeat": st.just(1),
                "then": st.sampled_from(["stuck", "failure", 1]),
            },
        )  # fmt: skip
        patterns = st.sampled_from(["go(*)", "deliver(*)", "do(robot,*)", "*"])
        return st.dictionaries(patterns, policy, max_size=3).map(
            lambda value: yaml.safe_dump(value).encode()
        )

    def read(self, data: bytes) -> None:
        """Reads the text, as the node does."""
        value = strict_yaml.load(data.decode("utf-8", "surrogateescape"))
        if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
            raise ValueError("no mapping")
        ActionPolicies(value).of("robot", "go(3)")


class _Robots(ActionInterface):
    """Does at once what it is told."""

    actuators = ("robot", "arm")

    def go(self, place: object) -> bool:
        """Goes nowhere."""
        return True

    def say(self, text: str, *more: object) -> str:
        """Returns an answer, whatever that is."""
        return text


class ActionDoor(Door):
    """Actions that an interface is told: actuator, action, run, number and state."""

    name = "actions"
    inputs = 3_000
    words = (
        *_TERMS, b"go(3)", b"say(a)", b"abort", b"\n", b"perform(a)", b"__init__", b"sleep(1)",
        b"knows(a)",
        b"execution", b"actuators", b"timeout", b"say", b"go(1,2,3)", b"0", b"4294967295",
    )  # fmt: skip
    errors = ()

    def __init__(self) -> None:
        self._executor = Executor(_Robots())

    def __enter__(self) -> Door:
        self._executor = Executor(_Robots())
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.close(1.0)

    def valid(self) -> SearchStrategy[bytes]:
        """Returns actions."""
        action = st.sampled_from(["go(c3)", "say(success)", 'say("x y",1)', "abort"])
        rest = st.tuples(st.sampled_from(["a", "b", ""]), st.integers(0, 9), st.integers(0, 2))
        return st.tuples(st.sampled_from(["robot", "arm", "x"]), action, rest).map(
            lambda told: "\n".join([told[0], told[1], *map(str, told[2])]).encode()
        )

    def read(self, data: bytes) -> None:
        """Tells the action, and waits for its end; there is one answer at most, a term."""
        texts = [*data.decode("utf-8", "surrogateescape").split("\n"), "", "", "", "", ""]
        actuator, action, run, number, state = texts[:5]
        answers: List[str] = []
        digits = number if number.isascii() and number.isdigit() else "0"
        token = Token(run, int(digits[:10]) % 2**32) if run else None
        self._executor.begin(actuator, action, answers.append, token, aborted=state == "1")
        for execution in self._executor.running:
            assert execution.ended.wait(_SECONDS), f"{execution} does not end"
        assert len(answers) <= 1, answers
        assert all(canonical(answer) == answer for answer in answers), answers


def doors() -> List[Door]:
    """Returns the doors."""
    return [GoalDoor(), MessageDoor(), TokenDoor(), PolicyDoor(), ActionDoor()]
