"""The process in which questions are answered: what it says, and what becomes of it."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional

import pytest
from conftest import PACKAGE, TIMEOUT
from waiting import wait_for

from rosclingo.solver.options import Options
from rosoclingo.errors import QuestionError
from rosoclingo.loop.single.dialects import Dialect1, PaperDialect
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.snapshot import decode
from rosoclingo.why.answers import WhyGoal, WhyNoPlan
from rosoclingo.why.process import CANCELED, CLOSED, AnsweringProcess
from rosoclingo.why.question import (
    MORE_TIME,
    Question,
    QuestionKind,
    ReplyStatus,
    WhyReply,
    read,
    read_reply,
)
from rosoclingo.why.reason import MinimalReason
from rosoclingo.why.task import Encoding, QuestionTask, answer

LINE = Encoding(Options((str(PACKAGE / "example/line.lp"),)), limit=20)
SITUATION = Situation(
    told=("event(1,visit(6),0)", "event(info,close(5),0)"), last=3, goals=(("1", "visit(6)"),)
)
WHY = (
    "There is no plan for visit(6) because info says close(5). Without that, there would be a plan "
    "of 5 steps."
)
PLAN = Question()
PATIENCE = 600.0  # seconds; no more than a bound
HANGS = "import time; connection.recv_bytes(); time.sleep(1e6)"
GARBAGE = "connection.recv_bytes(); connection.send_bytes(b'%s'); connection.recv_bytes()"


def task(question: Question = PLAN, seconds: float = PATIENCE, **others: Any) -> QuestionTask:
    return QuestionTask(LINE, Situation(**{**vars(SITUATION), **others}), question, seconds)


def state(pid: int) -> str:
    """Returns the letter for what a process does: T if it is stopped, X if it has ended."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    return "X"


def is_there(pid: int) -> bool:
    """Whether a process runs, or waits for its parent to hear of its end."""
    return state(pid) not in "ZX"


def ticks(pid: int) -> int:
    """Returns how much processor time a process has taken."""
    words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(words[11]) + int(words[12])


# Who gives way to all tests that run at the same time waits for long.
IMPATIENT = (
    sys.executable,
    "-c",
    "from rosoclingo.why import serving; serving.give_way = int; serving.main()",
)


class Asked(AnsweringProcess):
    """A process, and what it has warned of."""

    def __init__(self, script: str = "", **others: Any) -> None:
        """Makes the usual process, but that it does not give way, or one that runs a script."""
        others.setdefault("command", IMPATIENT)
        self.warnings: List[str] = []
        if script:
            begin = "import sys; from multiprocessing.connection import Connection; "
            begin += "connection = Connection(int(sys.argv[1])); "
            others["command"] = (sys.executable, "-c", begin + script)
        super().__init__(self.warnings.append, **{"seconds_to_start": PATIENCE, **others})


@pytest.fixture
def make() -> Iterator[Callable[..., Asked]]:
    made: List[Asked] = []

    def maker(*arguments: str, **others: Any) -> Asked:
        made.append(Asked(*arguments, **others))
        return made[-1]

    yield maker
    for asked in made:
        asked.close()


@pytest.mark.parametrize("kind", QuestionKind)
def test_a_question_is_read(kind: QuestionKind) -> None:
    few, many = {QuestionKind.PLAN: (0, 0), QuestionKind.IF: (1, 9)}.get(kind, (1, 1))
    for number in range(4):
        arguments = ["a"] * number
        if few <= number <= many:
            assert read(kind.value, arguments) == Question(kind, tuple(arguments))
        else:
            with pytest.raises(QuestionError, match=f"^{kind.value} "):
                read(kind.value, arguments)
    with pytest.raises(QuestionError, match="'who' is no question; there are plan, goal, action,"):
        read("who", [])


@pytest.mark.costly
def test_a_task_comes_and_a_reply_goes() -> None:
    for question, found in (
        (PLAN, WHY),
        (Question(QuestionKind.GOAL, ("1",)), WHY),
        (Question(QuestionKind.IF, ("info:open(5)",)), "There would be a plan of 5 steps."),
        (
            Question(QuestionKind.ACTION, ("do(robot,go(2),1)",)),
            f"There is no plan in any case{WHY[16:]}",
        ),
        (
            Question(QuestionKind.INSTEAD, ("do(robot,go(2),2)",)),
            f"There is no plan in any case{WHY[16:]}",
        ),
    ):
        sent = task(question)
        assert pickle.loads(pickle.dumps(sent)) == sent
        reply = read_reply(answer(pickle.dumps(sent)))
        assert (reply.status, reply.text) == (ReplyStatus.ANSWERED, found)
        assert f'"text": "{found}"' in reply.structure
    goal = read_reply(answer(pickle.dumps(task(Question(QuestionKind.GOAL, ("1",))))))
    assert decode(WhyGoal, goal.structure).slot == "1"


@pytest.mark.parametrize(
    ("question", "text"),
    [
        (
            Question(QuestionKind.GOAL, ("visit(5)",)),
            "there is no open goal visit(5); there are visit(6)",
        ),
        (Question(QuestionKind.GOAL, ("visit(",)), "'visit(' is not a ground term"),
        (Question(QuestionKind.ACTION, ("go(2)",)), "go(2) is no action; one is do(R,A,T)"),
        (
            Question(QuestionKind.ACTION, ("do(robot,go(2),-1)",)),
            "step -1 has gone by; it is step 0 now",
        ),
        (Question(QuestionKind.IF, ("close(5)",)), "close(5) is no event; one is goal:REQUEST"),
        (Question(QuestionKind.IF, ("info:shut(5)",)), "the planner does not know it"),
    ],
)
def test_a_wrong_question(question: Question, text: str) -> None:
    reply = read_reply(answer(pickle.dumps(task(question))))
    assert reply.status is ReplyStatus.WRONG
    assert text in reply.text
    assert reply.structure == ""


def test_a_reason_that_more_time_would_improve() -> None:
    for reason in (MinimalReason((), is_complete=False), MinimalReason((), is_examined=False)):
        assert not WhyNoPlan("", reason=reason).is_finished
        assert not WhyGoal("", "", "", no_plan=WhyNoPlan("", reason=reason)).is_finished
    assert WhyNoPlan("", reason=MinimalReason(())).is_finished
    assert WhyGoal("", "", "").is_finished


def test_other_answers_that_are_none(tmp_path: Path) -> None:
    reply = read_reply(answer(pickle.dumps(task(seconds=0.0))))
    assert (reply.status, reply.structure) == (ReplyStatus.UNANSWERED, "")
    assert reply.text == f"there was no time for an answer within 0 s; {MORE_TIME}"
    assert reply.is_late
    assert "~why_seconds" in MORE_TIME
    assert "~why_nice" in MORE_TIME
    lost = QuestionTask(Encoding(Options((str(tmp_path / "a.lp"),))), SITUATION, PLAN, PATIENCE)
    assert read_reply(answer(pickle.dumps(lost))).status is not ReplyStatus.ANSWERED
    reply = read_reply(answer(b"no pickle"))
    assert reply.status is ReplyStatus.UNANSWERED
    assert reply.text.startswith("internal error: ")


@pytest.mark.costly
@pytest.mark.parametrize("dialect", [Dialect1, PaperDialect])
def test_the_other_dialects(dialect: Any) -> None:
    name = "line_1.0" if dialect is Dialect1 else "line_paper"
    encoding = Encoding(Options((str(PACKAGE / f"example/{name}.lp"),)), dialect=dialect.name)
    told = ("event(1,visit(6),1)", "event(info,close(5),1)")
    situation = Situation(told, 1, 3, 3, goals=(("1", "visit(6)"),))
    sent = QuestionTask(encoding, situation, PLAN, PATIENCE)
    reply = read_reply(answer(pickle.dumps(sent)))
    assert reply.text.startswith("There is no plan for visit(6) because info says close(5).")


def test_up_to_which_step_is_planned() -> None:
    def last(limit: Optional[int], last: int, *, tells: bool = False) -> object:
        situation = Situation(last=last, tells=tells).up_to(limit)
        return situation.last, situation.is_limit

    assert last(20, 3) == (20, True)
    assert last(1000, 3) == (100, False)
    assert last(1000, 80) == (160, False)
    assert last(1000, 3, tells=True) == (1000, True)
    assert last(20, 25) == (25, True)
    assert last(None, 3) == (30, False)
    assert last(None, 20) == (40, False)


@pytest.mark.costly
def test_the_horizon_is_the_reason_only_if_it_is_the_last_one() -> None:
    for limit, text in (
        (3, "up to step 3, the last one that may be planned for. That is the only reason"),
        (None, "There is a plan for visit(6) of 5 steps."),
        (20, "There is a plan for visit(6) of 5 steps."),
    ):
        situation = Situation(SITUATION.told[:1], last=1, goals=SITUATION.goals)
        encoding = Encoding(LINE.options, limit=limit)
        goal = Question(QuestionKind.GOAL, ("1",)) if limit == 3 else PLAN
        sent = QuestionTask(encoding, situation, goal, PATIENCE)
        reply = read_reply(answer(pickle.dumps(sent)))
        assert text.replace(" for visit(6)", "") in reply.text.replace(" for visit(6)", "")


def test_it_gives_way() -> None:
    script = """
import os, sys
from rosoclingo.why.serving import give_way
give_way(int(sys.argv[1]))
print(os.sched_getscheduler(0) == os.SCHED_IDLE, os.getpriority(os.PRIO_PROCESS, 0))
print(open("/proc/self/oom_score_adj").read())
"""
    for nice, is_idle in (("19", "True"), ("5", "False")):
        said = subprocess.run(
            [sys.executable, "-c", script, nice], stdout=subprocess.PIPE, text=True, check=True
        )
        value = min(19, os.getpriority(os.PRIO_PROCESS, 0) + int(nice))
        assert said.stdout.split() == [is_idle, str(value), "1000"]


@pytest.mark.costly
def test_one_process_answers_all_questions(make: Callable[..., Asked]) -> None:
    usual = make()
    assert usual.ask(task()).text == WHY
    pid = usual.pid
    assert pid is not None
    assert os.getsid(pid) == pid  # priorities count within a session
    assert usual.ask(task(Question(QuestionKind.GOAL, ("1",)))).text == WHY
    assert (usual.pid, usual.warnings) == (pid, [])


@pytest.mark.costly
def test_one_that_was_ended_between_questions_is_replaced(make: Callable[..., Asked]) -> None:
    asked = make()
    assert asked.ask(task()).text == WHY
    first = asked.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)
    wait_for(lambda: not is_there(first))
    assert asked.ask(task()).text == WHY
    assert asked.pid != first
    assert asked.warnings == [
        "the process that answers questions has ended by SIGKILL; another starts"
    ]


def test_one_that_ends_with_a_question_is_replaced(make: Callable[..., Asked]) -> None:
    asked = make("connection.send_bytes(b'ready'); connection.recv_bytes(); sys.exit(3)")
    for _ in range(2):
        reply = asked.ask(task())
        assert (reply.status, reply.structure) == (ReplyStatus.UNANSWERED, "")
        assert reply.text == "the process that looks for the answer has ended with exit status 3"
    assert len(asked.warnings) == 2
    assert asked.warnings[0] == f"why plan: {reply.text}; the next question starts another one"


def test_one_that_hangs_is_ended(make: Callable[..., Asked]) -> None:
    asked = make(f"connection.send_bytes(b'ready'); {HANGS}", seconds_more=0.0)
    reply = asked.ask(task(seconds=0.1))
    assert reply.status is ReplyStatus.UNANSWERED
    assert reply.text.startswith("there was no answer within 0.1 s; the process that looks for it")
    assert reply.text.endswith(MORE_TIME)
    assert asked.pid is None
    never_ready = make(HANGS, seconds_to_start=0.1)
    assert never_ready.ask(task()).status is ReplyStatus.UNANSWERED


def test_one_that_takes_nothing_is_ended(make: Callable[..., Asked]) -> None:
    """A large question does not fit into the socket."""
    asked = make("connection.send_bytes(b'ready'); sys.stdin.read(); import time; time.sleep(1e6)")
    asked._seconds_more = 0.0
    told = tuple(f"event(info,close({number}),0)" for number in range(100_000))
    assert asked.ask(task(seconds=0.1, told=told)).status is ReplyStatus.UNANSWERED


@pytest.mark.parametrize("garbage", ["", "no JSON", "{}", "7", '[7, "", ""]', "[0]"])
def test_one_that_sends_garbage_is_ended(make: Callable[..., Asked], garbage: str) -> None:
    asked = make(f"connection.send_bytes(b'ready'); {GARBAGE}" % garbage)
    reply = asked.ask(task())
    assert reply.status is ReplyStatus.UNANSWERED
    assert reply.text.startswith("the process that looks for the answer sends what nobody can read")
    assert asked.pid is None
    other = make(GARBAGE.replace("connection.recv_bytes(); ", "", 1) % garbage)
    assert "sends what nobody can read" in other.ask(task()).text


def test_what_cannot_be_started_is_said(make: Callable[..., Asked]) -> None:
    asked = make(command=("/there/is/no/such/program",))
    reply = asked.ask(task())
    assert reply.status is ReplyStatus.UNANSWERED
    assert "the process that answers cannot be started: " in reply.text


def test_who_closes_it_need_not_wait(make: Callable[..., Asked]) -> None:
    asked = make(f"connection.send_bytes(b'ready'); {HANGS}")
    replies: List[WhyReply] = []
    thread = threading.Thread(target=lambda: replies.append(asked.ask(task())), daemon=True)
    thread.start()
    wait_for(lambda: asked.pid is not None)
    asked.close()
    thread.join(TIMEOUT)
    assert replies == [CLOSED]
    assert asked.ask(task()) == CLOSED
    assert asked.warnings == []


def test_background_questions_are_cancelled_for_a_client(make: Callable[..., Asked]) -> None:
    asked = make(f"connection.send_bytes(b'ready'); {HANGS}")
    with ThreadPoolExecutor(1) as thread:
        replies = [thread.submit(asked.ask, task(), is_background=True) for _ in range(2)]
        wait_for(lambda: asked.pid is not None)
        assert not replies[0].done()
        with asked.client_waits():
            assert [reply.result(PATIENCE) for reply in replies] == [CANCELED, CANCELED]
    assert asked.pid is None
    assert asked.warnings == []


@pytest.mark.costly
def test_a_client_does_not_wait_for_background_questions(make: Callable[..., Asked]) -> None:
    """Those that come before its question do not even reach the process."""
    asked = make()
    assert asked.ask(task()).text == WHY
    pid = asked.pid
    with ThreadPoolExecutor(1) as thread, asked.client_waits():
        waiting = [thread.submit(asked.ask, task(), is_background=True) for _ in range(20)]
        assert thread.submit(asked.ask, task()).result(PATIENCE).text == WHY
    assert [reply.result() for reply in waiting] == [CANCELED] * 20
    assert asked.pid == pid
    assert asked.ask(task(), is_background=True).text == WHY


@pytest.mark.costly
def test_it_rests_while_the_loop_is_in_a_hurry(make: Callable[..., Asked]) -> None:
    asked = make()
    asked.rest(True)  # before there is a process, and a question
    with ThreadPoolExecutor(1) as thread:
        reply = thread.submit(asked.ask, task())
        wait_for(lambda: asked.pid is not None)
        pid = asked.pid
        assert pid is not None
        wait_for(lambda: state(pid) == "T")
        assert not reply.done()
        asked.rest(False)
        assert reply.result(PATIENCE).text == WHY
        asked.rest(True)  # nothing is asked
        assert state(pid) != "T"
        asked.rest(False)
        assert thread.submit(asked.ask, task()).result(PATIENCE).text == WHY
        assert (asked.pid, asked.warnings) == (pid, [])


PARENT = """
import sys, threading
import pickle
from rosoclingo.why.process import AnsweringProcess
process = AnsweringProcess(print, command=eval(sys.argv[3]))
process.ask(pickle.loads(eval(sys.argv[1])))
work = pickle.loads(eval(sys.argv[2]))
"""


@contextlib.contextmanager
def killed_parent(folder: Path, work: QuestionTask, *lines: str) -> Iterator[int]:
    """Has a process of its own start one, whose id it yields, and kills the former in the end."""
    script = folder / "parent.py"
    script.write_text(PARENT + "\n".join(lines))
    words = map(repr, (pickle.dumps(task()), pickle.dumps(work), IMPATIENT))
    command = [sys.executable, str(script), *words]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        yield pid
        parent.kill()
        wait_for(lambda: not is_there(pid))


def test_one_that_rests_ends_with_the_process_that_has_started_it(tmp_path: Path) -> None:
    rest = "process.rest(True)", "threading.Thread(target=process.ask, args=[work]).start()"
    with killed_parent(tmp_path, task(), *rest, "print(process.pid, flush=True)") as pid:
        wait_for(lambda: state(pid) == "T")


def test_one_that_is_to_rest_while_it_starts_ends_with_the_process_that_has_started_it(
    tmp_path: Path,
) -> None:
    begin = (
        "late = AnsweringProcess(print, command=eval(sys.argv[3]))",
        "late.rest(True)",
        "threading.Thread(target=late.ask, args=[work]).start()",
        "while late.pid is None: pass",
        "print(late.pid, flush=True)",
    )
    with killed_parent(tmp_path, task(), *begin):
        pass  # it is killed at once


def test_it_ends_with_the_process_that_has_started_it(tmp_path: Path) -> None:
    """Also while it works, if that one is killed."""
    slow = tmp_path / "slow.lp"
    slow.write_text("#program state(t). p :- X = 1..1000000, Y = 1..1000000, X * Y < t.")
    work = QuestionTask(Encoding(Options((str(slow),))), SITUATION, PLAN, 3600.0)
    ask = "print(process.pid, flush=True)", "process.ask(work)"
    with killed_parent(tmp_path, work, *ask) as pid:
        before = ticks(pid)
        wait_for(lambda: ticks(pid) > before + 5)  # it works


@pytest.mark.costly
def test_no_plan_is_a_structure() -> None:
    reply = read_reply(answer(pickle.dumps(task())))
    found = decode(WhyNoPlan, reply.structure)
    assert found.reason is not None
    assert [member.fact.content for member in found.reason.members] == ["visit(6)", "close(5)"]
