"""The summary of a run in a line: docs/protocol.md, section "Summary"."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, List

import pytest

from rosoclingo.loop.actuator_health import HealthClocks, actuator_health
from rosoclingo.loop.monitor import CurrentActivity, Doing, LoopSummary
from rosoclingo.loop.summary import ActuatorActivity, actuator_activity, summary_text
from rosoclingo.loop.values.execution import Execution, HeldAction, HoldReason

GO = Execution(7, 3, "robot", "go(c4)", began=100.0)
HELD = (HeldAction("robot", "go(c4)", HoldReason.PAUSE),)
GOALS = "at step 3 of 7: 0 goals open, 0 wait"


def text(doing: Doing, what: str = "", end: str = "", **known: Any) -> str:
    summary = LoopSummary(step=3, horizon=7, **known)
    return summary_text(CurrentActivity(doing, what, 0.0), summary, [], end)


def robot(one: Execution, *answers: str, **known: Any) -> ActuatorActivity:
    """Returns the activity of the robot 12 s after it was told something."""
    summary = LoopSummary(executions=(one,), **known)
    health = actuator_health("robot", summary, HealthClocks(112.0, 112.0), answers)
    return actuator_activity("robot", health, summary, 112.0)


def of_actuators(*activities: ActuatorActivity) -> List[str]:
    doing = CurrentActivity(Doing.WAITS, "", 0.0)
    return summary_text(doing, LoopSummary(), activities).split("; ")[1:]


@pytest.mark.parametrize("doing", [one for one in Doing if one is not Doing.RUNS])
def test_a_phrase_for_each_activity(doing: Doing) -> None:
    said = text(doing)
    assert said.endswith(f" {GOALS}")
    assert said[0] != " "


def test_what_the_loop_does() -> None:
    assert text(Doing.RUNS, "plan(3)") == f"carries out plan(3) {GOALS}"
    assert text(Doing.SEARCHES, "horizon 9") == f"searches for a plan {GOALS}"
    assert text(Doing.SEARCHES, is_paused=True) == f"paused, searches for a plan {GOALS}"
    assert text(Doing.DECIDES, is_paused=True) == f"paused {GOALS}"
    assert text(Doing.WAITS) == f"waits for inputs {GOALS}"
    assert text(Doing.WAITS, executions=(GO,)) == f"waits for actuators {GOALS}"
    assert text(Doing.WAITS, is_through=True) == f"has published its plan {GOALS}"
    assert text(Doing.ENDED, is_through=True) == f"has ended {GOALS}"
    assert text(Doing.ENDED, end="no plan", is_paused=True) == f"has ended (no plan) {GOALS}"


def test_numbers_of_goals() -> None:
    assert text(Doing.WAITS, goals_open=1, goals_waiting=1).endswith(": 1 goal open, 1 waits")
    assert text(Doing.WAITS, goals_open=2, goals_waiting=3).endswith(": 2 goals open, 3 wait")
    unserved = text(Doing.WAITS, goals_open=3, goals_unserved=3)
    assert unserved.endswith(": 3 goals open, 3 wait"), "for a blocked way, for instance"


def test_what_actuators_do() -> None:
    """In the words of the diagnostics."""
    held = replace(GO, is_held=True)
    cases = {
        robot(GO): "robot does go(c4) for 12 s",
        robot(replace(GO, aborted=True)): "robot is to stop go(c4) since 12 s",
        robot(GO, "robot"): "robot has answered go(c4)",
        robot(held, held=HELD): "robot waits for an operator to begin go(c4)",
        robot(replace(held, pauses=True)): "robot tries go(c4) again",
        robot(replace(GO, is_enqueued=True)): "robot has not answered go(c4) in time",
        robot(replace(GO, is_enqueued=True, answer="lost")): "robot was lost in go(c4)",
        robot(GO, on_hold=("robot",)): "robot does go(c4) for 12 s and is on hold",
    }
    for activity, expected in cases.items():
        assert of_actuators(activity) == [expected]
        assert activity.action == "go(c4)"
    assert robot(GO).seconds == 12.0
    assert robot(held, held=HELD).seconds == 0.0


def test_idle_actuators_are_left_out() -> None:
    done = robot(replace(GO, answer="success"))
    assert done == ActuatorActivity("robot", "idle")
    assert of_actuators(done) == []
    on_hold = robot(replace(GO, answer="success"), on_hold=("robot",))
    assert of_actuators(on_hold) == ["robot is on hold"]
    summary = LoopSummary(on_hold=("arm",))
    health = actuator_health("arm", summary, HealthClocks(0.0, 0.0))
    assert of_actuators(actuator_activity("arm", health, summary, 0.0)) == ["arm is on hold"]


def test_a_large_fleet_makes_no_long_line() -> None:
    fleet = [ActuatorActivity(f"r({number})", "acts", "go", 1.0) for number in range(40)]
    said = of_actuators(*fleet)
    assert said[:1] == ["r(0) does go for 1 s"]
    assert said[5:] == ["35 more"]
