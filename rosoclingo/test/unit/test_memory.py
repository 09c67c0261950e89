"""A planner in this process runs out of memory, really: the goal that is the cause ends alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import List

import pytest
import short_of_memory
from short_of_memory import ENCODING, LARGE

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import SINGLE
from rosoclingo.loop.situation import Situation
from rosoclingo.why.process import AnsweringProcess
from rosoclingo.why.question import Question, ReplyStatus
from rosoclingo.why.task import Encoding, QuestionTask

LINE = ENCODING.parents[2] / "example" / "line.lp"
MODES = ["dynamic.incremental.dyn_reset", "dynamic.incremental.recording", SINGLE]


def child(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.costly
@pytest.mark.parametrize(
    ("mode", "megabytes", "kind"),
    [(mode, 40, kind) for mode in MODES for kind in ("together", "meanwhile")]  # to ground
    + [(mode, 300, "alone") for mode in (MODES[0], SINGLE)],  # to search
)
def test_the_goal_that_asks_for_too_much_ends_alone(mode: str, megabytes: int, kind: str) -> None:
    """Those that were told with it, or that a robot is busy with, go on, and later ones, too."""
    script = short_of_memory.__file__
    ended = child(script, mode, str(megabytes), kind)
    assert ended.returncode == 0, ended.stderr
    goals, published, error = json.loads(ended.stdout)
    assert error is None
    for request, words, reason in goals:
        if request == LARGE:
            assert words in (["rejected"], ["accepted", "aborted"])
            assert "out of memory" in reason
            assert " MB" in reason
        else:
            assert words == ["accepted", "succeeded"], (request, reason)
    done = [action for robot, action in published if robot == "r2"]
    assert done == (["go(2)"] if kind == "alone" else ["go(2)", "go(3)", "go(2)"])


_ENGINE = f"""
import resource, threading
from rosclingo.errors import OutOfMemoryError
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire import commands as wire

engine = Engine(Options(({str(ENCODING)!r},)))
engine.run([wire.Ground((wire.Part("base"),))])

def step():
    try:
        engine.run([wire.Ground((wire.Part("transition", ("3",)),))])
    except OutOfMemoryError as err:
        print("1", err)

pages = int(open("/proc/self/statm").read().split()[0])
limit = pages * resource.getpagesize() + 50 * 2**20
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
thread = threading.Thread(target=step)  # in which clingo has thrown nothing before
thread.start()
thread.join()
try:
    engine.run([wire.GetExternals()])
except OutOfMemoryError as err:
    print("2", err)
reply = engine.run([wire.Restart(), wire.Ground((wire.Part("base"),))])
print("3", reply.failure, engine.solve().result)
"""


@pytest.mark.costly
def test_an_engine_is_refused_until_it_is_restarted() -> None:
    ended = child("-c", _ENGINE)
    assert ended.returncode == 0, ended.stderr
    first, second, third = ended.stdout.splitlines()
    assert first.startswith("1 out of memory while grounding (the process is limited to ")
    assert second.endswith("begin with a restart")
    assert third == "3 None Result.SAT"


_ANSWERS = """
import resource
from pathlib import Path
from rosoclingo.why import serving, task

serving.give_way = int
pages = int(Path("/proc/self/statm").read_text().split()[0])
limit = pages * resource.getpagesize() + 120 * 2**20
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
serving.main()
"""


@pytest.mark.costly
def test_a_copy_of_the_planner_says_that_it_ran_out_of_memory() -> None:
    """The next question, which needs less, has an answer, of another process."""
    warnings: List[str] = []
    asked = AnsweringProcess(warnings.append, command=(sys.executable, "-c", _ANSWERS))

    def why(encoding: Path, request: str) -> QuestionTask:
        told, goals = (f"event(1,{request},0)",), (("1", request),)
        situation = Situation(told=told, last=3, goals=goals)
        return QuestionTask(
            Encoding(Options((str(encoding),)), limit=9), situation, Question(), 600.0
        )

    try:
        reply = asked.ask(why(ENCODING, LARGE))
        assert reply.status is ReplyStatus.UNANSWERED
        assert "the copy of the planner: out of memory" in reply.text
        assert asked.ask(why(LINE, "visit(2)")).status is ReplyStatus.ANSWERED
        assert len(warnings) == 1
    finally:
        asked.close()
