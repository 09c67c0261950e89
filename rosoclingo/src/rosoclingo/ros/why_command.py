"""Asks a running system to explain its plan: the command ``why.py``."""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time
from typing import List, NoReturn, Optional

import rospy

from rosclingo.ros.init import init_node
from rosclingo.ros.presence import presence
from rosclingo.solver.option_parser import OptionParser
from rosclingo.terminal import PROGRESS, lines, say
from rosoclingo.srv import Why, WhyResponse
from rosoclingo.why.question import Question, QuestionKind

_PROGRAM = "why.py"
_SECONDS_TO_FIND = 5.0  # a node that was started at the same time is there by then
_POLL_SECONDS = 0.05
_PROGRESS_SECONDS = 2.0
_EPILOG = """\
Without a question: why is there no plan? Exit status: 0; 1 if there was no answer; 2 if the command
line is wrong, or the question names what there is not."""


def main() -> NoReturn:
    """Runs the command and ends the process."""
    chosen = _parse(rospy.myargv(sys.argv)[1:])
    init_node("why", anonymous=True)
    call = _Call(f"{rospy.resolve_name('rosoclingo')}/why", _question(chosen))
    status = call.wait()
    if call.response is not None and status == WhyResponse.ANSWERED:
        response = call.response
        if chosen.json:
            print(_indented(response.structure))
        else:
            print(lines(response.text))
    else:
        say(_PROGRAM, call.response.text if call.response is not None else call.failure)
    rospy.signal_shutdown("answered")
    sys.exit(status)


def _indented(structure: str) -> str:
    try:
        return json.dumps(json.loads(structure), indent=1)
    except (ValueError, RecursionError):  # of another version, or another node
        return structure


class _Call:
    """A question on its way, in a thread, so that Ctrl-C ends the command at once.

    Attributes:
        response: The answer, once it is there.
        failure: Why there is none.
    """

    def __init__(self, service: str, question: Question) -> None:
        self.response: Optional[WhyResponse] = None
        self.failure = "interrupted"
        self._service = service
        self._question = question
        self._is_found = threading.Event()
        self._is_over = threading.Event()

    def wait(self) -> int:
        """Waits for the answer, says now and then that it does, and returns the exit status."""
        threading.Thread(target=self._run, name="call", daemon=True).start()
        began = said = time.monotonic()
        while not self._is_over.wait(_POLL_SECONDS) and not rospy.is_shutdown():
            now = time.monotonic()
            if now - said >= _PROGRESS_SECONDS:
                said = now
                who = f"{self._service}, which computes the answer,"
                if not self._is_found.is_set():
                    who = f"the service {self._service} to be there"
                PROGRESS.show(f"{_PROGRAM}: waiting for {who} for {now - began:.0f} s")
        PROGRESS.clear()
        return WhyResponse.UNANSWERED if self.response is None else self.response.status

    def _run(self) -> None:
        try:
            rospy.wait_for_service(self._service, _SECONDS_TO_FIND)
            self._is_found.set()
            ask = rospy.ServiceProxy(self._service, Why)
            self.response = ask(self._question.kind.value, self._question.arguments)
        except rospy.ServiceException as err:
            self.failure = f"{self._service}: {err}"
        except rospy.ROSException:
            node = self._service.rpartition("/")[0]
            self.failure = (
                f"there is no service {self._service}: {presence(node).value}; another name is "
                "given by rosoclingo:=NAME"
            )
        self._is_over.set()


def _parse(arguments: List[str]) -> argparse.Namespace:
    parser = OptionParser(
        prog=_PROGRAM,
        usage="why.py [--goal GOAL | --action ACTION | --instead ACTION | --if EVENT... | "
        "--happened ACTION] [--json] [rosoclingo:=NAME]",
        description="Asks a running system why it plans as it does.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    one = parser.add_mutually_exclusive_group()
    one.add_argument("--goal", metavar="GOAL", help="why it waits or fails; its slot or request")
    one.add_argument("--action", metavar="do(R,A,T)", help="why the plan has this action")
    one.add_argument("--instead", metavar="do(R,A,T)", help="why it does not have this one instead")
    one.add_argument("--if", action="append", metavar="EVENT",
        help="what would be: goal:REQUEST, cancel:SLOT or SOURCE:VALUE; repeatable")  # fmt: skip
    one.add_argument("--happened", metavar="ACTION",
        help="how A, do(R,A) or do(R,A,T) went, and the probable cause")  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the answer as JSON")
    chosen: argparse.Namespace = parser.parse_args(arguments)
    return chosen


def _question(chosen: argparse.Namespace) -> Question:
    for kind in QuestionKind:
        value = getattr(chosen, kind.value, None)
        if value is not None:
            return Question(kind, tuple(value) if isinstance(value, list) else (value,))
    return Question()
