"""The service ``~why``, and the answers that goals get without asking.

Questions are answered one after the other by a thread of their own, which waits for a process of
its own (:mod:`rosoclingo.why.process`). The loop's thread says what it knows, when that suits it.
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
from rosoclingo.loop.journal import Event, Explained
from rosoclingo.loop.state import State
from rosoclingo.loop.values.goals import Goal
from rosoclingo.ros.encodings import Encodings
from rosoclingo.srv import Why, WhyRequest, WhyResponse
from rosoclingo.why.process import CLOSED, AnsweringProcess
from rosoclingo.why.question import Question, QuestionKind, ReplyStatus, WhyReply, read
from rosoclingo.why.situation import Situation
from rosoclingo.why.task import QuestionTask

_SECONDS_AT_END = 5.0  # how long goals wait for a reason before they end
_HELD_UP = (QuestionKind.GOAL, QuestionKind.ACTION)  # what an operator may hold up
_POLL_SECONDS = 0.05  # how often what waits looks whether the node is shutting down


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
        self._noted: Optional[Tuple[str, str]] = None  # the last question with its answer
        self._lock = threading.Lock()  # guards the next one
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

    def _explain(self, question: Question, goals: Sequence[Goal]) -> None:
        if not self._explains or self._closed.is_set():
            return
        with self._lock:
            is_new = question not in self._wanted
            self._wanted[question] = Situation.of(self._state), goals
        if is_new:
            self._reasons = {reason for reason in self._reasons if not reason.done()}
            with contextlib.suppress(RuntimeError):  # the thread takes nothing any more
                self._reasons.add(self._thread.submit(self._find_reason, question))

    # Called by rospy's threads.

    def _on_request(self, request: WhyRequest) -> WhyResponse:
        reason = too_long(question=request.question, arguments=request.arguments)
        if reason is not None:
            return WhyResponse(ReplyStatus.WRONG.value, reason, "")
        try:
            question = read(request.question or QuestionKind.PLAN.value, request.arguments)
            due = time.monotonic() + self._seconds
            reply = self._thread.submit(self._answer, question, due).result()
        except QuestionError as err:
            reply = WhyReply(ReplyStatus.WRONG, str(err))
        except RuntimeError:  # the thread takes nothing any more
            reply = CLOSED
        return WhyResponse(reply.status.value, reply.text, reply.structure)

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
            is_past = question.kind is QuestionKind.HAPPENED
            situations.append(Situation.of(self._state, whole=is_past))
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
        reply = self._ask(question, situations[0])
        if reply.status is ReplyStatus.ANSWERED and question.kind in _HELD_UP:
            return replace(reply, text=" ".join((reply.text, *held)))
        return reply

    def _find_reason(self, question: Question) -> None:
        """Finds the reason why goals wait or have no plan, and tells it to them."""
        with self._lock:
            situation, goals = self._wanted.pop(question)
        reply = self._ask(question, situation)
        if reply.status is ReplyStatus.ANSWERED:
            rospy.loginfo("why: %s", reply.text)
            self._inbox.call_soon(lambda: _tell(goals, f"why: {reply.text}"))
        elif reply is not CLOSED:
            rospy.loginfo("why %s: %s", question, reply.text)

    def _ask(self, question: Question, situation: Situation) -> WhyReply:
        """Forwards a question to the process, and adds the answer to the journal."""
        if self._closed.is_set():
            return CLOSED
        began = time.monotonic()
        try:
            encoding = self._encodings.get()
        except (RosclingoError, OSError) as err:
            return WhyReply(ReplyStatus.UNANSWERED, str(err))
        reply = self._process.ask(QuestionTask(encoding, situation, question, self._seconds))
        asked = str(question.by_request(dict(situation.goals)))
        if reply.status is ReplyStatus.ANSWERED and self._noted != (asked, reply.text):
            self._noted = asked, reply.text
            seconds = time.monotonic() - began
            self._note(Explained(asked, reply.text, reply.structure, seconds))
        return reply

    def _note(self, event: Event) -> None:
        """Adds an event to the journal, between two others of the loop's thread."""
        if not self._inbox.call_soon(lambda: self._state.note(event)):
            self._state.note(event)


def _tell(goals: Sequence[Goal], line: str) -> None:
    for goal in goals:
        if not goal.ended:
            goal.tell(line)
