"""The thread that owns the solver: order, and which request ends which."""

from __future__ import annotations

import threading
from typing import Iterator, List, Optional, Sequence

import pytest
from waiting import Within

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.worker import RESTARTED, Caller, Job, Stop, Worker
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    Command,
    Externals,
    Failure,
    GetExternals,
    GetStats,
    Ground,
    Improvement,
    Load,
    Outcome,
    Part,
    Reply,
    Restart,
    Result,
    Stats,
    Truth,
)

TIMEOUT = 180.0  # seconds; no more than a bound for what never comes

# With the assumption long, clingo searches for minutes; without it, the answer comes at once.
PROGRAM = """
{ long }. #show long/0.
1 { at(P,H) : H=1..11 } 1 :- P=1..12, long.
:- at(P,H), at(Q,H), P < Q.
"""
LONG = (Assumption("long", True),)
SHORT = (Assumption("long", False),)
SET_UP: Sequence[Command] = (Restart(), Add("base", (), PROGRAM), Ground((Part("base"),)))

INTERRUPTED = Outcome(Result.UNKNOWN, interrupted=True)
ANSWER = Outcome(Result.SAT)


class RecordingJob(Job):
    """A solve call that writes down what its client would learn."""

    def __init__(
        self,
        assumptions: Sequence[Assumption],
        history: Optional[List[str]] = None,
        name: str = "",
        caller: Caller = Caller(),  # noqa: B008 (it cannot be changed)
    ) -> None:
        super().__init__(assumptions, caller)
        self.calls: List[str] = []
        self.outcome: Optional[Outcome] = None
        self.message: Optional[str] = None
        self.improvements: List[Improvement] = []
        self.has_started = threading.Event()
        self.has_ended = threading.Event()
        self.may_start = threading.Event()
        self.may_start.set()
        self.thread: Optional[threading.Thread] = None
        self._history = history if history is not None else []
        self._name = name

    def _record(self, call: str) -> None:
        self.calls.append(call)
        self._history.append(f"{self._name} {call}")

    def started(self) -> None:
        self.thread = threading.current_thread()
        self._record("started")
        self.has_started.set()
        assert self.may_start.wait(TIMEOUT)

    def improved(self, improvement: Improvement) -> None:
        self.improvements.append(improvement)

    def finished(self, outcome: Outcome) -> None:
        self.outcome = outcome
        self._record("finished")
        self.has_ended.set()

    def failed(self, message: str) -> None:
        self.message = message
        self._record("failed")
        self.has_ended.set()

    def result(self) -> Outcome:
        assert self.has_ended.wait(TIMEOUT)
        assert self.message is None, self.message
        assert self.outcome is not None
        return self.outcome


@pytest.fixture
def engine() -> Engine:
    return Engine(Options())


@pytest.fixture
def worker(engine: Engine) -> Iterator[Worker]:
    worker = Worker(engine)
    assert worker.control(SET_UP).success
    yield worker
    worker.close()
    assert worker.join(TIMEOUT)


def long_search(worker: Worker) -> RecordingJob:
    """Starts a search that only ends when it is told to."""
    job = RecordingJob(LONG)
    worker.solve(job)
    assert job.has_started.wait(TIMEOUT)
    return job


def held_search(worker: Worker, *names: object) -> RecordingJob:
    """Starts one that holds the worker, so that others wait in the queue until it may start."""
    job = RecordingJob(LONG, *names)  # type: ignore[arg-type]
    job.may_start.clear()
    worker.solve(job)
    assert job.has_started.wait(TIMEOUT)
    return job


def assert_works(worker: Worker) -> None:
    job = RecordingJob(SHORT)
    worker.solve(job)
    assert job.result() == ANSWER
    assert worker.control([GetExternals()]).success


# --- what ends well --------------------------------------------------------------------------


def test_a_job(worker: Worker) -> None:
    job = RecordingJob(SHORT)
    worker.solve(job)
    assert job.result() == ANSWER
    assert job.calls == ["started", "finished"]
    assert job.reason is None
    assert job.thread is not threading.current_thread()
    worker.control([])  # the worker has gone on to this, so it is through with the job
    assert job.ended


def test_commands_run_in_order(worker: Worker) -> None:
    commands: List[Command] = [
        Add("p", ("t",), "#external e(t)."),
        GetExternals(),
        Ground((Part("p", ("1",)),)),
        GetStats(),
        AssignExternal("e(1)", Truth.TRUE),
        GetExternals(),
    ]
    first, stats, second = worker.control(commands).answers
    assert (first, second) == (Externals(()), Externals((("e(1)", Truth.TRUE),)))
    assert isinstance(stats, Stats)


def test_the_first_failure_ends_the_list(worker: Worker) -> None:
    program = Add("p", (), "#external e. [true]")
    ground = Ground((Part("p"),))
    reply = worker.control(
        [program, ground, GetExternals(), Load("none.lp"), AssignExternal("e", Truth.FALSE)]
    )
    assert reply.failure is not None
    assert (reply.failure.command, reply.failure.index) == ("load", 3)
    assert "none.lp" in reply.failure.message
    # What ran before it stays, and what comes after it does not run.
    expected = (Externals((("e", Truth.TRUE),)),)
    assert reply.answers == expected
    assert worker.control([GetExternals()]) == Reply(expected)


def test_requests_of_several_threads_do_not_mix(worker: Worker) -> None:
    replies: List[Reply] = []

    def request(number: int) -> None:
        part = Part(f"p{number}")
        program = Add(part.name, (), f"#external e({number}).")
        replies.append(worker.control([Restart(), program, Ground((part,)), GetExternals()]))

    threads = [threading.Thread(target=request, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    assert all(reply.success for reply in replies)
    # Each sees its own external and none of the others'.
    assert {reply.answers for reply in replies} == {
        (Externals(((f"e({number})", Truth.FALSE),)),) for number in range(8)
    }


def test_improvements_arrive(worker: Worker) -> None:
    program = Add("p", (), "5 { a(1..20) } 9. #minimize { X,X : a(X) }. #show a/1.")
    assert worker.control([Restart(), program, Ground((Part("p"),))]).success
    job = RecordingJob(())
    worker.solve(job)
    assert job.result().symbols == job.improvements[-1].symbols
    assert job.improvements[-1].cost == (15,)


# --- what ends early -------------------------------------------------------------------------


def test_a_control_request_ends_a_search_and_then_runs(worker: Worker) -> None:
    job = long_search(worker)
    reply = worker.control([GetExternals()])
    assert job.has_ended.is_set()  # before the commands ran
    assert job.result() == INTERRUPTED
    assert job.reason is Stop.CONTROL
    assert reply == Reply((Externals(()),))
    assert_works(worker)


def test_a_newer_job_replaces_an_older_one(worker: Worker) -> None:
    job = long_search(worker)
    newer = RecordingJob(SHORT)
    worker.solve(newer)
    assert newer.result() == ANSWER
    assert job.has_ended.is_set()
    assert job.result() == INTERRUPTED
    assert (job.reason, newer.reason) == (Stop.REPLACED, None)


@pytest.mark.parametrize("again", [None, Stop.SHUTDOWN])
def test_a_job_is_canceled(again: Optional[Stop], worker: Worker) -> None:
    job = long_search(worker)
    job.stop(Stop.CANCELED)
    if again is not None:
        job.stop(again)
    assert job.result() == INTERRUPTED
    assert job.reason is Stop.CANCELED  # the first reason counts
    assert job.calls == ["started", "finished"]
    assert_works(worker)


def test_a_job_that_was_stopped_before_its_turn_never_starts(worker: Worker) -> None:
    job = RecordingJob(LONG)
    job.stop(Stop.CANCELED)
    worker.solve(job)
    assert job.result() == INTERRUPTED
    assert job.calls == ["finished"]
    assert_works(worker)


def test_jobs_end_in_the_order_of_their_arrival(worker: Worker) -> None:
    history: List[str] = []
    first = held_search(worker, history, "first")
    others = [RecordingJob(SHORT, history, name) for name in ("second", "third", "fourth")]
    for job in others:
        worker.solve(job)
    # Those that never get their turn end at once, although the solver is busy.
    assert [job.result() for job in others[:2]] == [INTERRUPTED] * 2
    first.may_start.set()
    assert others[-1].result() == ANSWER
    assert history == [
        "first started",
        "second finished",
        "third finished",
        "first finished",
        "fourth started",
        "fourth finished",
    ]
    assert [job.reason for job in (first, *others)] == [Stop.REPLACED] * 3 + [None]


def test_a_control_request_in_between_keeps_its_place(worker: Worker) -> None:
    first = held_search(worker)
    replies: List[Reply] = []
    asking = threading.Thread(
        target=lambda: replies.append(
            worker.control([Add("p", (), "b. #show b/0."), Ground((Part("p"),))])
        )
    )
    asking.start()
    # The request has ended the job, so it stands in the queue or is about to, under the lock.
    while first.reason is None:
        assert asking.is_alive()
    last = RecordingJob(SHORT)
    worker.solve(last)
    first.may_start.set()
    assert last.result().symbols == ("b",)
    asking.join(TIMEOUT)
    assert replies == [Reply()]


# --- the end ---------------------------------------------------------------------------------


def test_close(engine: Engine) -> None:
    worker = Worker(engine)
    assert worker.control(SET_UP).success
    job = long_search(worker)
    worker.close()
    assert worker.join(TIMEOUT)
    assert job.result() == INTERRUPTED
    assert job.reason is Stop.SHUTDOWN
    refused = worker.control([GetStats()])
    assert refused.failure == Failure("commands", -1, "the node is shutting down")


def test_what_is_queued_when_it_closes_is_answered(engine: Engine) -> None:
    worker = Worker(engine)
    assert worker.control(SET_UP).success
    first = held_search(worker)
    second = RecordingJob(SHORT)
    worker.solve(second)
    worker.close()
    assert not worker.join(0)
    first.may_start.set()
    assert worker.join(TIMEOUT)
    assert (first.result(), second.result()) == (INTERRUPTED, INTERRUPTED)
    assert second.calls == ["finished"]


def test_a_job_that_comes_after_the_end_is_answered(engine: Engine) -> None:
    # "One of finished and failed last": its client must not wait for ever.
    worker = Worker(engine)
    worker.close()
    assert worker.join(TIMEOUT)
    job = RecordingJob(SHORT)
    worker.solve(job)
    assert job.has_ended.wait(TIMEOUT)


# --- what fails ------------------------------------------------------------------------------


def test_an_assumption_that_does_not_parse(worker: Worker) -> None:
    job = RecordingJob([Assumption("a(X)", True)])
    worker.solve(job)
    assert job.has_ended.wait(TIMEOUT)
    assert job.calls == ["started", "failed"]
    assert job.message is not None
    assert "'a(X)' is not a ground term" in job.message
    assert_works(worker)


def fail(*_: object) -> None:
    raise ValueError("oops")


def test_an_internal_error_in_a_command(
    worker: Worker, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(engine, "apply", fail)
        reply = worker.control([Restart(), GetStats()])
    assert reply == Reply((), Failure("restart", 0, "oops"))
    assert_works(worker)


def test_an_internal_error_while_solving(
    worker: Worker, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = RecordingJob(SHORT)
    with monkeypatch.context() as patch:
        patch.setattr(engine, "solve", fail)
        worker.solve(job)
        assert job.has_ended.wait(TIMEOUT)
    assert (job.calls, job.message) == (["started", "failed"], "oops")
    assert_works(worker)


@pytest.mark.parametrize("callbacks", [["started"], ["improved"], ["finished"]])
def test_a_callback_that_fails(
    callbacks: List[str], worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker.control([Add("p", (), "#minimize { 1 }."), Ground((Part("p"),))])
    job = RecordingJob(SHORT)
    for callback in callbacks:
        monkeypatch.setattr(job, callback, fail)
    worker.solve(job)
    assert job.has_ended.wait(TIMEOUT)
    assert job.message == "oops"
    worker.control([])
    assert job.ended
    assert_works(worker)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_two_callbacks_that_fail(
    engine: Engine, within: Within, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As when the connection to the client is gone: neither the result nor the error arrives.
    worker = Worker(engine)
    job = RecordingJob(())
    monkeypatch.setattr(job, "finished", fail)
    monkeypatch.setattr(job, "failed", fail)
    worker.solve(job)
    assert within(3, lambda: worker.control([GetExternals()])).success
    worker.close()
    assert worker.join(TIMEOUT)


# --- who has restarted the solver --------------------------------------------------------------


def test_a_restart_by_somebody_else() -> None:
    """Who wants only its own restarts is refused all else after another one; nobody else is."""
    worker = Worker(Engine(Options()))
    loop, other = Caller("/loop", only_own_restarts=True), Caller("/other")

    def assert_refused(reason: str) -> None:
        failure = worker.control([GetExternals()], loop).failure
        assert failure is not None
        assert (failure.command, failure.index) == (RESTARTED, -1)
        job = RecordingJob(SHORT, caller=loop)
        worker.solve(job)
        assert job.has_ended.wait(TIMEOUT)
        assert job.calls == ["failed"]
        assert job.message == failure.message
        assert failure.message.startswith(reason)

    assert_refused("it was started again")
    assert worker.control(SET_UP, loop).success
    assert worker.control([AssignExternal("e", Truth.TRUE)], other).failure is not None
    assert worker.control([GetExternals()], loop).success
    # A restart that another command has kept from running changes nothing.
    assert worker.control([AssignExternal("e", Truth.TRUE), Restart()], other).failure is not None
    assert worker.control([GetExternals()], loop).success
    assert worker.control([Restart()], other).success
    assert_refused("/other has restarted it")
    assert worker.control([GetExternals()], other).success
    assert worker.control([Restart()]).success
    assert_refused("somebody has restarted it")
    assert worker.control(SET_UP, loop).success
    job = RecordingJob(SHORT, caller=loop)
    worker.solve(job)
    assert job.result() == ANSWER
    worker.close()
    assert worker.join(TIMEOUT)
