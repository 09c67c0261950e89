"""Timeouts, retries and heartbeats of actions: docs/protocol.md, section "Policies"."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple, Type

import pytest

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.execution.patterns import ActionPattern
from rosoclingo.loop.execution.policies import ActionPolicies
from rosoclingo.loop.journal import (
    ActionPublished,
    ActionRetried,
    Control,
    ControlArrived,
    MessageArrived,
)
from rosoclingo.loop.words import ABORT

MODES = ("dynamic.incremental.recording", "dynamic.incremental.dyn_reset", SINGLE)
TWICE = {"go(*)": {"retries": 2, "pause": 1.5}}


class Failing(System):
    """A robot on a line with some answers, None for none; then all actions succeed at once.

    The clock goes on by a second when nothing else happens, for as long as somebody may look.
    """

    def __init__(
        self, mode: str, answers: Sequence[Any], policies: Dict[str, Any], **parameters: Any
    ) -> None:
        self.answers = list(answers)
        self.seconds = 0
        self.beats: List[float] = []
        name = "line_1.0.lp" if mode == SINGLE else "line.lp"
        encoding = parameters.pop("encoding", f"{EXAMPLES}/{name}")
        self.parts = make_parts(mode, Options((encoding,)), ("-c", "steps=30"))
        super().__init__(self.parts.loop, policies=policies, **parameters)

    def own_moments(self) -> List[float]:
        return []

    def turn(self) -> bool:
        if self.acting:
            answer = self.answers.pop(0) if self.answers else "success"
            if answer is None:
                self.acting.clear()  # it never answers
            else:
                self.answer("robot", answer)
                return True
        state = self.loop.state
        if self.seconds < 60 and any(not goal.ended for goal in self.goals):
            self.seconds += 1
            self.clock += 1.0
            for beat in [one for one in self.beats if one <= self.clock]:
                self.beats.remove(beat)
                state.heartbeats.hear(state.executions.last["robot"].number, beat / 10)
            return True
        return False


@pytest.fixture(params=MODES)
def mode(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def visit(
    mode: str, answers: Sequence[Any], policies: Dict[str, Any], kind: Type[Failing] = Failing
) -> Failing:
    """Returns a robot that is asked to visit cell 2, after its run."""
    system = kind(mode, answers, policies)
    system.request("visit(2)")
    assert system.run() is None
    return system


def gone(system: System) -> List[str]:
    return [action for _, action in system.published]


def told(system: System) -> List[str]:
    """Returns the answers that the planner was told."""
    return [text for text in system.loop.state.externals.true if text.startswith("event(robot,")]


def retries(system: System) -> List[Tuple[int, str]]:
    events = [entry.event for entry in system.journal]
    return [(one.retry, one.answer) for one in events if isinstance(one, ActionRetried)]


def test_two_failures_and_a_success_are_one_success(mode: str) -> None:
    system = visit(mode, ["failure", "failure", "success"], TWICE)
    (goal,) = system.goals
    assert goal.words[-1] == "succeeded"
    assert gone(system) == ["go(2)"] * 3
    assert retries(system) == [(1, "failure"), (2, "failure")]
    assert "robot go(2): failure, retry 1 of 2 in 1.5 s" in goal.lines
    assert not any("failure" in one for one in told(system))
    times = [one.seconds for one in system.journal if isinstance(one.event, ActionPublished)]
    assert times[1] - times[0] >= 1.5
    assert times[2] - times[1] >= 1.5
    asked = [one.event for one in system.journal if isinstance(one.event, ControlArrived)]
    assert [one.words for one in asked] == ["retry robot"] * 2


def test_a_third_failure_is_told(mode: str) -> None:
    system = visit(mode, ["failure"] * 3, TWICE)
    assert system.goals[0].words[-1] == "succeeded"  # by another action of another step
    assert len(retries(system)) == 2
    assert gone(system) == ["go(2)"] * 4


def test_a_retry_has_a_new_token(mode: str) -> None:
    system = visit(mode, ["failure"], TWICE)
    assert system.loop.state.executions.last["robot"].number == 2


def test_what_was_aborted_is_not_tried_again(mode: str) -> None:
    system = visit(mode, [None], TWICE)
    system.put(ControlArrived(Control.HALT))
    system.tell("robot", "failure")
    system.run()
    assert retries(system) == []


def test_each_attempt_is_aborted_at_its_timeout(mode: str) -> None:
    system = visit(mode, [None] * 3, {"go(*)": {"timeout": 3, "retries": 2}})
    assert gone(system)[:6] == ["go(2)", ABORT] * 3


def test_what_was_halted_is_not_tried_again_after_a_timeout(mode: str) -> None:
    system = Failing(mode, [None], {"go(*)": {"timeout": 30, "retries": 2}})
    system.seconds = 60 - 3  # which pass before somebody looks after the robot
    system.request("visit(2)")
    system.run()
    system.put(ControlArrived(Control.HALT))
    system.seconds = 0
    system.run()
    assert gone(system)[:2] == ["go(2)", ABORT]
    assert retries(system) == []


def test_the_failure_of_an_attempt_after_its_timeout_is_no_news(mode: str) -> None:
    """An older interface answers the abort, without a token."""

    class Late(Failing):
        def publish(self, actuator: str, action: str) -> None:
            super().publish(actuator, action)
            if action == ABORT:
                self.tell("robot", "failure")

    system = visit(mode, [None], {"go(*)": {"timeout": 3, "retries": 1}}, Late)
    assert gone(system) == ["go(2)", ABORT, "go(2)"]
    assert system.goals[0].words[-1] == "succeeded"
    assert len(system.warnings) == 1, "that the time was up"


def test_time_in_which_nobody_looked_counts_for_nothing(mode: str) -> None:
    """The process was stopped for a minute: answers that have come meanwhile are taken first."""

    class Stopped(Failing):
        def turn(self) -> bool:
            if self.acting and not self.seconds:
                self.seconds += 1
                self.clock += 60.0
                return True
            return super().turn()

    for policy in ({"timeout": 30}, {"heartbeat": 5}):
        system = visit(mode, [], {"go(*)": policy}, Stopped)
        assert system.goals[0].words[-1] == "succeeded"
        assert not any("~policies" in warning for warning in system.warnings)


def test_a_pause_of_the_run_holds_a_retry(mode: str) -> None:
    class Paused(Failing):
        def note(self, record: Any) -> None:
            super().note(record)
            if isinstance(record.event, ActionRetried):
                self.put(ControlArrived(Control.PAUSE))

    system = visit(mode, ["failure"], TWICE, Paused)
    assert gone(system) == ["go(2)"]
    system.put(ControlArrived(Control.RESUME))
    system.run()
    assert gone(system) == ["go(2)", "go(2)"]
    assert system.goals[0].words[-1] == "succeeded"


def test_an_operator_ends_a_pause_by_an_approval(mode: str) -> None:
    system = visit(mode, ["failure"], {"go(*)": {"retries": 1, "pause": 1000}})
    assert gone(system) == ["go(2)"]
    system.put(ControlArrived(Control.APPROVE))
    system.run()
    assert system.goals[0].words[-1] == "succeeded"


def test_an_operator_rejects_a_retry(mode: str) -> None:
    system = visit(mode, ["failure"], {"go(*)": {"retries": 5, "pause": 1000}})
    system.put(ControlArrived(Control.REJECT))
    system.run()
    assert retries(system) == [(1, "failure")]
    assert system.goals[0].words[-1] == "succeeded"  # the planner plans the action anew


def test_a_timeout_aborts_and_is_tried_again(mode: str) -> None:
    system = visit(mode, [None], {"go(*)": {"timeout": 3, "retries": 1}})
    assert gone(system) == ["go(2)", ABORT, "go(2)"]
    assert retries(system) == [(1, "timeout")]
    assert "robot has not answered for 3 s (~policies)" in system.warnings[0]
    assert system.goals[0].words[-1] == "succeeded"


def test_a_timeout_is_told_as_what_the_policy_says(tmp_path: Path) -> None:
    encoding = tmp_path / "line.lp"
    text = (Path(EXAMPLES) / "line.lp").read_text()
    encoding.write_text(text + "#program state(t).\n#external event(robot,stuck,t).\n")
    policies = {"go(*)": {"timeout": 3, "then": "stuck"}}
    system = Failing(MODES[0], [None], policies, encoding=str(encoding))
    system.request("visit(2)")
    system.run()
    assert any(one.startswith("event(robot,stuck,") for one in told(system))
    without = visit(MODES[0], [None], policies)
    assert any(one.startswith("event(robot,failure,") for one in told(without))


def test_an_interface_without_heartbeats_is_lost(mode: str) -> None:
    system = Failing(mode, [None], {"go(*)": {"heartbeat": 2}})
    system.beats = [2.0, 4.0, 6.0]
    goal = system.request("visit(2)")
    system.run()
    messages = [one for one in system.journal if isinstance(one.event, MessageArrived)]
    said = [(one.seconds, one.event.value) for one in messages]
    assert said[0] == (10.0, "lost")  # two heartbeats after the last one
    assert "the interface of robot is lost: no heartbeat for 4.0 s" in system.warnings[0]
    assert "whether robot has done its action is unknown" in system.warnings[1]
    assert goal.lines.count("robot go(2): 20 %") == 1


def test_an_interface_with_heartbeats_is_not_lost(mode: str) -> None:
    system = Failing(mode, [None], {"go(*)": {"heartbeat": 2}})
    system.beats = [float(second) for second in range(1, 200)]
    system.request("visit(2)")
    system.run()
    assert not any("lost" in warning for warning in system.warnings)


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"go(": {}}, "'go(' is no pattern of actions"),
        ({"go(*)": 3}, "go(*): expected some of timeout, factor, retries,"),
        ({"go(*)": {"retry": 3}}, "go(*): there is no retry, but timeout, factor, retries,"),
        ({"go(*)": {"timeout": "3"}}, "timeout has to be a number from 0 on, and is '3'"),
        ({"go(*)": {"then": "no term("}}, "then has to be a ground term that is an answer,"),
        ({"go(*)": {"then": "busy"}}, "then has to be a ground term that is an answer,"),
        ({"go(*)": {"then": False}}, "and is False"),
    ],
)
def test_what_is_wrong_is_named(wrong: Dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError, match=re.escape(why)):
        ActionPolicies(wrong)


def test_the_longest_pattern_decides() -> None:
    policies = ActionPolicies(
        {"*": {"retries": 1}, "go(*)": {"retries": 2}, "go(7)": {"retries": 3}}
    )
    actions = ("wave", "go(3)", "go(7)")
    assert [policies.of("robot", one).retries for one in actions] == [1, 2, 3]


@pytest.mark.parametrize(
    ("pattern", "action", "fits"),
    [
        *(("*", action, True) for action in ("go(3)", "a")),
        *(("go(*)", action, True) for action in ("go(3)", "go()", "go(a,go(b))", 'go("\n")')),
        *(("go(*)", action, False) for action in ("go", "go(3", "ago(3)", "go(3)b", "o(3)")),
        *(("a*b*a", action, True) for action in ("aba", "abba", "acbcaca")),
        *(("a*b*a", action, False) for action in ("ab", "ba", "aa", "abc", "ab)")),
        ("aa*aa", "aaa", False),
        ("a*", "a", True),
        ("do(robot,go(*))", "go(3)", True),
        ("do(arm,*)", "go(3)", False),
        ("go(.)", "go(3)", False),
    ],
)
def test_what_a_pattern_fits(pattern: str, action: str, fits: bool) -> None:
    assert ActionPattern(pattern).fits("robot", action) is fits


def test_a_pattern_of_many_stars_takes_little_time() -> None:
    began = time.process_time()
    assert not ActionPattern("*a" * 500 + "*b").fits("robot", "a" * 2_000)
    assert not ActionPattern("*" * 5_000 + "b").fits("robot", "a" * 2_000)
    assert time.process_time() - began < 10.0


@pytest.mark.parametrize(
    "policies",
    [
        {"a" * 9_999: 7},
        {"(" * 9_999: {}},
        {"a": "b" * 9_999},
        {"a": {"b" * 9_999: 1}},
        {"a": {"then": "b" * 9_999 + "("}},
        {"a": {"timeout": 10**400}},
        {"a": {"timeout": ["b"] * 9_999}},
    ],
)
def test_what_is_wrong_is_told_in_few_words(policies: Dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"expected|there is no|has to be|no pattern") as caught:
        ActionPolicies(policies)
    assert len(str(caught.value)) < 1000
