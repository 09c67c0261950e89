"""What the loop does for those who ask why: it says what it knows, and when somebody would ask."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any, List, Sequence, Tuple

import pytest
from conftest import TIMEOUT, Make, System

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import System as InProcessSystem
from rosoclingo.loop.inputs.inbox import Inbox
from rosoclingo.loop.inputs.replay_inbox import Phase, ReplayInbox, ScheduledInput, ScheduledKind
from rosoclingo.loop.journal import MessageArrived
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.goals import Goal

RECORDING = "dynamic.incremental.recording"
# A request of which nothing becomes, so that the goal waits.
WAITS = """
rslot(1).
#program state(t).
#external event(1,(here;there),t).
status(1,accepted,t) :- event(1,_,t).
status(1,succeeded,t) :- event(1,here,t).
#program query(t).
#external query(t).
"""


@pytest.mark.parametrize(
    "inbox", [Inbox(), ReplayInbox([ScheduledInput(9, Phase.WAIT, ScheduledKind.GOAL, "g")])]
)
def test_who_looks_wakes_the_loop_and_is_no_item(inbox: Inbox) -> None:
    seen: List[int] = []
    assert not inbox.wait(0.0)
    assert inbox.call_soon(lambda: seen.append(1))
    assert inbox.call_soon(lambda: seen.append(2))
    assert inbox.wait(TIMEOUT)
    assert (inbox.take(), seen) == ([], [1, 2])
    assert not inbox.wait(0.0)
    inbox.call_soon(lambda: seen.append(3))
    inbox.end("no plan")
    assert not inbox.call_soon(lambda: seen.append(4))
    assert (inbox.take(), seen) == ([], [1, 2, 3])


def situation(one: System) -> Tuple[Situation, str]:
    """Has the loop say what it knows; and returns in which thread it did."""
    found: List[Tuple[Situation, str]] = []
    is_there = threading.Event()

    def look() -> None:
        found.append((Situation.of(one.loop.state), threading.current_thread().name))
        is_there.set()

    assert one.inbox.call_soon(look)
    assert is_there.wait(TIMEOUT)
    return found[0]


def test_the_loop_says_what_it_knows(system: Make) -> None:
    """Also that a goal has no slot yet, and before anybody has asked for something."""
    one = system(RECORDING, "-c", "steps=20", encoding=["-c", "slots=1", f"{EXAMPLES}/line.lp"])
    one.world.answer = lambda *_: None
    one.start()
    assert situation(one)[0].goals == ()
    one.goal("visit(3)")
    one.goal("visit(4)")
    one.world.wait_for(lambda world: bool(world.published))
    known, thread = situation(one)
    assert (known.goals, known.queued) == ((("1", "visit(3)"),), ("visit(4)",))
    assert [actuator for actuator, _ in known.silent] == ["robot"]
    assert thread == one._thread.name
    one.close()
    assert not one.inbox.call_soon(lambda: None)


class Asked(InProcessSystem):
    """A system that notes when the planner would be asked."""

    def __init__(self, mode: str, *words: str) -> None:
        self.asked: List[Any] = []
        files = tuple(word for word in words if word.endswith(".lp"))
        parts = make_parts(mode, Options(files), ["-c", "steps=4"])
        super().__init__(parts.loop)

    def begin_to_wait(self, goals: Sequence[Goal]) -> None:
        self.asked.append(("wait", [goal.request for goal in goals]))

    def miss_plan(self, goals: Sequence[Goal]) -> None:
        self.asked.append(("miss", Situation.of(self.loop.state).goals))

    def finish_reasons(self) -> None:
        self.asked.append(("finish", [list(goal.words) for goal in self.goals]))


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_a_goal_begins_to_wait(mode: str, tmp_path: Path) -> None:
    (tmp_path / "waits.lp").write_text(WAITS)
    one = Asked(mode, str(tmp_path / "waits.lp"))
    one.request("there")
    one.run()
    assert one.asked == [("wait", ["there"])]


@pytest.mark.parametrize("mode", [RECORDING, SINGLE])
def test_there_is_no_plan(mode: str) -> None:
    """The goals are still open when it is said, and until the reason is known."""
    one = Asked(mode, f"{EXAMPLES}/line.lp")
    one.request("visit(6)")
    assert one.run() is not None
    assert one.asked == [("miss", (("1", "visit(6)"),)), ("finish", [[]])]
    assert one.goals[0].words[-1] == "aborted"


def test_who_waits_is_in_a_hurry_when_something_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    inbox = Inbox()
    said: List[bool] = []
    inbox.pause_background_work = said.append
    inbox.put(MessageArrived("robot", "success"))
    assert inbox.take()  # nobody has waited
    assert not inbox.wait(0.0)
    assert said == []
    inbox.put(MessageArrived("robot", "success"))
    assert inbox.wait(0.0)
    assert inbox.wait(0.0)  # it is not taken yet
    assert said == [True]
    assert inbox.take()
    assert said == [True]
    assert not inbox.wait(0.0)
    assert said == [True, False]
    inbox.put(MessageArrived("robot", "success"))
    assert inbox.wait(0.0)
    monkeypatch.setattr("rosoclingo.loop.inputs.inbox._LONGEST_REACTION", -1.0)
    inbox.run_callbacks()  # as a search does now and then, and who waits for reasons
    inbox.run_callbacks()
    assert said == [True, False, True, False]
    assert inbox.take()
    assert not inbox.wait(0.0)
    assert len(said) == 4
    inbox.call_soon(lambda: None)
    assert inbox.wait(0.0)  # a question is no reason to hurry
    assert len(said) == 4
    inbox.put(MessageArrived("robot", "success"))
    assert inbox.wait(0.0)
    inbox.end("no plan")
    assert said[4:] == [True, False]
