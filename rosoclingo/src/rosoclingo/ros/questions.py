"""The service ``~why``, and the answers that goals get without asking.

Questions are answered one after the other by a thread of their own, which waits for a process of
its own (:mod:`rosoclingo.why.process`). The loop's thread says what it knows, when that suits it.
What has happened is read from the journal, by the thread that is asked.
"""

from __future__ import annotations

import contextlib
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import replace
from typing import Dict, List, Optional, Sequence, Set, Tuple

import rospy

from rosclingo.errors import RosclingoError
from rosclingo.limits import too_long
from rosclingo.ros.init import on_shutdown
from rosoclingo.errors import QuestionError
from rosoclingo.loop.journal import Event, Explained, Record
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.state import State
from rosoclingo.loop.values.goals import Goal
from rosoclingo.loop.values.snapshot import encode
from rosoclingo.ros.encodings import Encodings
from rosoclingo.srv import Why, WhyRequest, WhyResponse
from rosoclingo.why.happened import happened
from rosoclingo.why.past import Past, PastReader
from rosoclingo.why.process import CANCELED, CLOSED, AnsweringProcess
from rosoclingo.why.question import Question, QuestionKind, ReplyStatus, WhyReply, read
from rosoclingo.why.task import QuestionTask

_SECONDS_AT_END = 5.0  # how long goals wait for a reason before they end
_HELD_UP = (QuestionKind.GOAL, QuestionKind.ACTION)  # what an operator may hold up
_POLL_SECONDS = 0.05  # how often what waits looks whether the node is shutting down
_MORE = 2.0  # the factor by which a reason has more time when it is looked for again


class Questions:
    """Answers questions about a loop's plan."""

    def __init__(
        self, state: State, encodings: Encodings, *, seconds: float, nice: int, explains: bool
    ) -> None:
        """Opens the service; make it after the node is initialised.

        Args:
            state: The loop's state, which only the loop's thread uses.
            encodings: What the planner plans with.
            seconds: How long an answer may take, and before that, the way to it.
            nice: How much what answers gives way to others, see :func:`.serving.give_way`.
            explains: Whether goals are told why they wait or fail.
        """
        self._state = state
        self._inbox = state.mail.inbox
        self._encodings = encodings
        self._seconds = seconds
        self._explains = explains
        self._process = AnsweringProcess(lambda text: rospy.logwarn("%s", text), nice=nice)
        self._inbox.pause_background_work = self._process.rest
        self._thread = ThreadPoolExecutor(1, "why")
        self._closed = threading.Event()
        self._past = PastReader()
        self._lock = threading.Lock()  # guards the next two; held for moments
        self._noted: Optional[Tuple[str, str]] = None  # the last question with its answer
        self._wanted: Dict[Question, Tuple[Situation, Sequence[Goal]]] = {}  # without being asked
        self._reasons: Set[Future[None]] = set()  # of the loop's thread
        on_shutdown(self.close)
        self._service = rospy.Service("~why", Why, self._on_request)

    def close(self) -> None:
        """Cancels all questions. Thread-safe; may be called twice."""
        self._closed.set()
        self._process.close()
        self._thread.shutdown(wait=False)
        self._encodings.close()

    def hear(self, record: Record) -> None:
        """Reads a record of the journal. Thread-safe, does not block."""
        self._past.hear(record)

    def resume(self) -> None:
        """Takes the past of a run that goes on from its state, before the loop begins."""
        self._past.take_over(Past.of(self._state))

    # Called by the loop's thread.

    def explain_waiting(self, goals: Sequence[Goal]) -> None:
        """Tells goals why they wait, as soon as that is known."""
        for goal in goals:
            self._explain(Question(QuestionKind.GOAL, (goal.slot or goal.request,)), [goal])

    def explain_no_plan(self, goals: Sequence[Goal]) -> None:
        """Tells goals why there is no plan for them, as soon as that is known."""
        self._explain(Question(), goals)

    def finish(self) -> None:
        """Waits for pending answers about reasons, before goals end without them."""
        due = time.monotonic() + min(self._seconds, _SECONDS_AT_END)
        while self._reasons and not self._inbox.closed and time.monotonic() < due:
            self._reasons -= wait(self._reasons, _POLL_SECONDS).done
            self._inbox.run_callbacks()

    def _explain(
        self, question: Question, goals: Sequence[Goal], seconds: float = 0.0, told: str = ""
    ) -> None:
        """Has a reason looked for.

        Args:
            question: What to answer.
            goals: Whom to tell.
            seconds: How long it may take, if the default was too short.
            told: What they were told so far.
        """
        if not self._explains or self._closed.is_set():
            return
        with self._lock:
            is_new = question not in self._wanted
            self._wanted[question] = Situation.of(self._state), goals
        if is_new:
            self._reasons = {reason for reason in self._reasons if not reason.done()}
            with contextlib.suppress(RuntimeError):  # the thread takes nothing any more
                seconds = seconds or self._seconds
                self._reasons.add(self._thread.submit(self._find_reason, question, seconds, told))

    def _explain_again(
        self, question: Question, goals: Sequence[Goal], seconds: float, told: str
    ) -> None:
        """Has a reason looked for again, if there are goals that still wait for a plan."""
        goals = [goal for goal in goals if not goal.ended]
        is_executed = self._state.executions.pending_actions or bool(self._state.ahead())
        if goals and not is_executed:
            self._explain(question, goals, seconds, told)

    # Called by rospy's threads.

    def _on_request(self, request: WhyRequest) -> WhyResponse:
        reason = too_long(question=request.question, arguments=request.arguments)
        if reason is not None:
            return WhyResponse(ReplyStatus.WRONG.value, reason, "")
        try:
            question = read(request.question or QuestionKind.PLAN.value, request.arguments)
            if question.kind is QuestionKind.HAPPENED:
                return _response(self._tell_past(question))
            due = time.monotonic() + self._seconds
            with self._process.client_waits():
                reply = self._thread.submit(self._answer, question, due).result()
        except QuestionError as err:
            reply = WhyReply(ReplyStatus.WRONG, str(err))
        except RuntimeError:  # the thread takes nothing any more
            reply = CLOSED
        return _response(reply)

    def _tell_past(self, question: Question) -> WhyReply:
        """Answers how an action went, at once: neither the loop nor a search is waited for."""
        began = time.monotonic()
        try:
            found = happened(question.arguments[0], self._past.now(), self._encodings.phrases())
        except RosclingoError as err:
            return WhyReply(ReplyStatus.WRONG, str(err))
        reply = WhyReply(ReplyStatus.ANSWERED, found.text, encode(found))
        self._note_answer(str(question), reply, began)
        return reply

    # Called by the thread that answers.

    def _answer(self, question: Question, due: float) -> WhyReply:
        """Answers a question about the loop's current situation."""
        if time.monotonic() > due:
            text = f"other questions have taken more than {self._seconds:g} s; ask again"
            return WhyReply(ReplyStatus.UNANSWERED, text)
        situations: List[Situation] = []
        held: List[str] = []
        taken = threading.Event()

        def take() -> None:
            situations.append(Situation.of(self._state))
            held.extend(self._state.held_sentences())
            taken.set()

        if not self._inbox.call_soon(take):
            return WhyReply(ReplyStatus.UNANSWERED, "the planning loop has ended")
        while not taken.wait(_POLL_SECONDS):
            if self._closed.is_set():
                return CLOSED
            if time.monotonic() > due:
                text = (
                    f"the planning loop had no time for {self._seconds:g} s: it waits for a solver "
                    "to start, to ground or to decide; ask again"
                )
                return WhyReply(ReplyStatus.UNANSWERED, text)
        reply = self._ask(question, situations[0], self._seconds)
        if reply.status is ReplyStatus.ANSWERED and question.kind in _HELD_UP:
            return replace(reply, text=" ".join((reply.text, *held)))
        return reply

    def _find_reason(self, question: Question, seconds: float, told: str) -> None:
        """Finds the reason why goals wait or have no plan, and tells it to them.

        If there was no time for that, or only for a part, it is looked for again, for longer; and
        if a client's question came first, after that.
        """
        with self._lock:
            situation, goals = self._wanted.pop(question)
        reply = self._ask(question, situation, seconds, is_background=True)
        text = told
        if reply.status is ReplyStatus.ANSWERED:
            text = f"why: {reply.text}"
        elif reply not in (CLOSED, CANCELED):
            text = f"no reason found yet: {reply.text}"
        if text != told:
            rospy.loginfo("%s", text)
            self._inbox.call_soon(lambda: _tell(goals, text))
        if reply.is_late or reply is CANCELED:
            more = seconds * _MORE if reply.is_late else seconds
            self._inbox.call_soon(lambda: self._explain_again(question, goals, more, text))

    def _ask(
        self,
        question: Question,
        situation: Situation,
        seconds: float,
        *,
        is_background: bool = False,
    ) -> WhyReply:
        """Forwards a question to the process, and adds the answer to the journal."""
        if self._closed.is_set():
            return CLOSED
        began = time.monotonic()
        try:
            encoding = self._encodings.get()
        except (RosclingoError, OSError) as err:
            return WhyReply(ReplyStatus.UNANSWERED, str(err))
        task = QuestionTask(encoding, situation, question, seconds)
        reply = self._process.ask(task, is_background=is_background)
        if reply.status is ReplyStatus.ANSWERED:
            asked = str(question.by_request(dict(situation.goals)))
            self._note_answer(asked, reply, began)
        return reply

    def _note_answer(self, asked: str, reply: WhyReply, began: float) -> None:
        """Adds an answer to the journal, unless it is the last one that was added."""
        with self._lock:
            is_new = self._noted != (asked, reply.text)
            self._noted = asked, reply.text
        if is_new:
            seconds = time.monotonic() - began
            self._note(Explained(asked, reply.text, reply.structure, seconds))

    def _note(self, event: Event) -> None:
        """Adds an event to the journal, between two others of the loop's thread."""
        if not self._inbox.call_soon(lambda: self._state.note(event)):
            self._state.note(event)


def _response(reply: WhyReply) -> WhyResponse:
    return WhyResponse(reply.status.value, reply.text, reply.structure)


def _tell(goals: Sequence[Goal], line: str) -> None:
    for goal in goals:
        if not goal.ended:
            goal.tell(line)
