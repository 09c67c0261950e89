"""The judge of a soak's warnings finds planted false ones, and lets true ones be."""

from __future__ import annotations

import math
from typing import List

import pytest

from soak_alarms import NO_NEWS, Alarm, AlarmJudge, Order

RUN = "run"
OLD = "its actuator was told something else since then"
ROBOT = "rosoclingo: actuator r1"


@pytest.fixture
def judge() -> AlarmJudge:
    """A robot that has done an action, has failed in one after that was given up, and acts."""
    judge = AlarmJudge()
    judge.tells(RUN, [Order(1, "r1", "go(2)", True)], 0.0, 100.0)
    judge.answers(RUN, 1, "success", 110.0)
    judge.tells(RUN, [Order(2, "r1", "go(3)", True)], 200.0, 111.0)
    judge.tells(RUN, [Order(2, "r1", "go(3)", False)], 800.0, 141.0)
    judge.answers(RUN, 2, "success", 151.0)
    judge.tells(RUN, [Order(3, "r1", "go(4)", True)], 1200.0, 161.0)
    judge.ends("planner", 165.0)
    return judge


def found(judge: AlarmJudge, text: str, source: str = "/rosoclingo", wall: float = 170.0) -> str:
    """Returns what is wrong with a warning; empty if it is true."""
    judge.warns(Alarm(source, text, 20.0 * (wall - 100.0), wall))
    assert judge.judge(wall) == [], "it may be too early"
    return "".join(why for _, why in judge.judge(math.inf))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (f"answer success to action 1: {OLD}", NO_NEWS),
        ("dropped a message: answer failure to action 1: r1 has answered success already", ""),
        (f"answer success to action 2: {OLD}", ""),
        ("answer success to action 3: there is none", "r1 was told go(4)"),
        ("answer success to action 9: there is none", ""),
        (f"answer success to action 9: {OLD}", "the robots' log has no such action"),
        ("answer success to action 1: it is of the run run, and this is run", "it is of this run"),
        ("answer success to action 1: it is of the run old, and this is run", ""),
        ("id r1, value success: it has answered failure already", ""),
        ("id info, value blocked(a,b): the planner's encoding declares no such event", ""),
        ("r1 has not answered for 30 s; does an interface of it run", ""),
        ("r1 has not answered for 5 s (~policies): go(c3) has timed out", ""),
        ("r2 has not answered for 30 s; does an interface of it run", "r2 was told nothing"),
        ("whether r1 has done its action is unknown, and", "r1 has not said so"),
        ("a search of /planner was ended by a goal of /rival, and is tried again", ""),
        ("a search of /planner was ended by a goal of /planner, and is tried again",
         "/planner is a part of the system"),
        ("the solver /planner went away; waits until that node is there, and", ""),
        ("why goal 1: there was no answer within 20 s; the process that looks for it has no", ""),
        ("goes on with the run in the store", "the node was not ended"),
        ("mailbot: go(3): is not done, as ~faults says", ""),
        ("too slow: simulated time goes 8 times as fast as real time", ""),
        ("r1: go(3): /r1/move_base ended the drive as ABORTED: no progress", ""),
        ("r1: go(2): /r1/move_base ended the drive as ABORTED", "its action has succeeded"),
        ("r1: go(9): /r1/move_base ended the drive as ABORTED", "r1 was not told go(9)"),
        ("something strange", "nothing is known of such a warning"),
    ],
)  # fmt: skip
def test_a_warning(judge: AlarmJudge, text: str, why: str) -> None:
    assert found(judge, text) == why
    assert sum(judge.counts.values()) == 1


def test_what_was_true_earlier(judge: AlarmJudge) -> None:
    silent = "r1 has not answered for 30 s; does an interface of it run"
    assert found(judge, silent, wall=115.0) == ""
    judge.answers(RUN, 3, "failure", 171.0)
    assert found(judge, silent, wall=190.0) == "it has answered failure"
    lost = "the solver /planner went away; waits until that node is there"
    assert found(judge, lost, wall=160.0) == "no node that plans was ended"
    assert found(judge, lost, wall=300.0) == "no node that plans was ended"
    assert found(judge, "/planner does not listen", wall=300.0) != ""


def test_an_answer_that_takes_longer_than_its_node_lives(judge: AlarmJudge) -> None:
    late = "why goal 1: there was no answer within 20 s; the process that looks for it has no time"
    judge.ends("rosoclingo", 160.0)
    assert found(judge, late, wall=170.0) == "the node was ended 10 s before"
    assert found(judge, late, wall=181.0) == ""


def test_diagnostics(judge: AlarmJudge) -> None:
    """A message that a part repeats is one alarm."""

    def report(text: str, wall: float, *, is_well: bool = False) -> None:
        alarm = Alarm(ROBOT, text, 20.0 * (wall - 100.0), wall)
        judge.reports(alarm, is_well=is_well)

    for second in range(3):
        report(f"go(4) takes {100 + second} s, and 12 s were expected; does", 170.0 + second)
    assert judge.judge(math.inf) == []
    assert judge.counts == {"late": 1}
    report("go(4), for 12.0 s", 174.0, is_well=True)
    report("go(4) takes 1100 s, and 12 s were expected; does", 175.0)
    judge.answers(RUN, 3, "success", 176.0)
    report("go(4), for 12.0 s", 178.0, is_well=True)
    report("go(4) takes 300 s, and 12 s were expected; does", 180.0)
    reasons: List[str] = [why for _, why in judge.judge(math.inf)]
    assert reasons == ["it has had 300 s", "it has answered success"]
