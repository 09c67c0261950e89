"""Failures with actions.lp: tries, what they take, and blocked ways that are free again."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any, List, Sequence, Tuple

import pytest
from episode import DYN_RESET, PACKAGE, RECORDING, RESET, SINGLE

from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import EXAMPLES, make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import ActionRetried, MessageArrived
from rosoclingo.store.sqlite_store import SqliteStore
from rosoclingo.store.store import Store

ACTIONS = str(PACKAGE / "lib" / "actions.lp")
MAP = """
#program base.
way(dock,hall). way(hall,table). way(V,W) :- way(W,V).
moves(r). initially(at(r),dock).
number(battery,full). drains(r,battery,1).
request(visit(V)) :- place(V).
wants(visit(V),at(r),V) :- place(V).
"""
LAMP = """
#program base.
action(r,press). sets(r,press,lamp,on). initially(lamp,off).
request(light). wants(light,lamp,on).
"""
STEPS = {
    RECORDING: ["-c", "steps=60"],
    RESET: ["-c", "steps=60", "-c", "r=1"],
    DYN_RESET: ["-c", "steps=60"],
    SINGLE: [],
}


class Robot(System):
    """A robot whose first answers are given; then all its actions succeed."""

    def __init__(
        self,
        folder: Path,
        text: str,
        answers: Sequence[str],
        options: Sequence[str] = (),
        *,
        mode: str = RECORDING,
        full: int = 20,
        **parameters: Any,
    ) -> None:
        file = folder / "task.lp"
        file.write_text(text)
        solver = Options((ACTIONS, str(file)), ("-c", f"full={full}", *options))
        self.answers = list(answers)
        self.times: List[Tuple[float, str]] = []
        super().__init__(make_parts(mode, solver, STEPS[mode]).loop, **parameters)

    def turn(self) -> bool:
        for actuator in sorted(self.acting):
            self.answer(actuator, self.answers.pop(0) if self.answers else "success")
        return bool(self._items)

    def publish(self, actuator: str, action: str) -> None:
        super().publish(actuator, action)
        self.times.append((self.clock, action))

    def ask(self, request: str) -> List[str]:
        """Has the robot do something, and returns the goal's statuses."""
        goal = self.request(request)
        assert self.run() is None
        return goal.words

    @property
    def retries(self) -> int:
        return sum(isinstance(entry.event, ActionRetried) for entry in self.journal)

    @property
    def fluents(self) -> List[str]:
        """The fluents after the last step."""
        return self.loop.state.plan.last_fluents(self.loop.state.step)


@pytest.mark.parametrize("mode", STEPS)
def test_a_failed_move_is_tried_again(tmp_path: Path, mode: str) -> None:
    """The way is not blocked, and each try has taken of the battery."""
    robot = Robot(tmp_path, MAP, ["failure", "failure"], mode=mode)
    assert robot.ask("visit(hall)")[-1] == "succeeded"
    assert robot.times == [(0.0, "go(hall)"), (5.0, "go(hall)"), (10.0, "go(hall)")]
    assert robot.retries == 2
    assert "is(battery,17)" in robot.fluents
    assert not any(one.startswith("blocked") for one in robot.fluents)


@pytest.mark.parametrize("mode", STEPS)
def test_the_only_way_is_free_again(tmp_path: Path, mode: str) -> None:
    """In the end the goal is met, after the time for which the way was blocked."""
    robot = Robot(tmp_path, MAP, ["success", *["failure"] * 3], mode=mode)
    assert robot.ask("visit(table)")[-1] == "succeeded"
    assert [action for _, action in robot.times] == ["go(hall)", *["go(table)"] * 4]
    assert robot.times[-1][0] >= robot.times[-2][0] + 60
    said = [e.event for e in robot.journal if isinstance(e.event, MessageArrived)]
    assert [one.value for one in said if one.source == "info"] == ["unblocked(hall,table)"]
    assert "is(battery,15)" in robot.fluents


def test_a_way_stays_blocked_that_a_message_blocks(tmp_path: Path) -> None:
    robot = Robot(tmp_path, MAP, [])
    robot.tell("info", "blocked(hall,table)")
    assert robot.ask("visit(table)") == ["accepted"]
    assert "blocked(hall,table)" in robot.fluents


def test_a_message_takes_the_place_of_a_failure(tmp_path: Path) -> None:
    """After a failure, a message says that the way is blocked: then it stays so."""
    robot = Robot(tmp_path, MAP, ["success", *["failure"] * 3])
    goal = robot.request("visit(table)")
    turn = robot.turn

    def tell_once() -> bool:
        if len(robot.times) == 4 and not robot.acting and not told:
            told.append(robot.tell("info", "blocked(hall,table)"))
            return True
        return turn()

    told: List[object] = []
    robot.turn = tell_once  # type: ignore[method-assign]
    assert robot.run() is None
    assert goal.words == ["accepted"]
    assert "blocked(hall,table)" in robot.fluents


def test_parameters_end_both(tmp_path: Path) -> None:
    """Without retries, and with blocks that stay, all is as without this library."""
    options = ["-c", "retries=0", "-c", "unblock_after=0"]
    robot = Robot(tmp_path, MAP, ["success", "failure"], options)
    assert robot.ask("visit(table)") == ["accepted"]
    assert [action for _, action in robot.times] == ["go(hall)", "go(table)"]
    robot.tell("info", "unblocked(hall,table)")
    assert robot.run() is None
    assert robot.goals[0].words[-1] == "succeeded"


def test_parameters_say_how_often_and_when(tmp_path: Path) -> None:
    options = ["-c", "retries=1", "-c", "retry_pause=3", "-c", "unblock_after=20"]
    robot = Robot(tmp_path, MAP, ["failure"] * 2, options)
    assert robot.ask("visit(hall)")[-1] == "succeeded"
    assert [time for time, _ in robot.times] == [0.0, 3.0, 23.0]


@pytest.mark.parametrize(
    ("said", "tries"),
    [("", 3), ("retries(r,press,0).", 1), ("retries(r,press,1).", 2),
     ("#program present(k,t). retries(r,press,1,k) :- now(is(lamp,off),k).", 2),
     ("fails(r,press,lamp,broken).", 1)],
)  # fmt: skip
def test_an_encoding_says_what_is_tried_again(tmp_path: Path, said: str, tries: int) -> None:
    """Nothing is that leaves something else behind when it fails, unless it is said."""
    robot = Robot(tmp_path, LAMP + said, ["failure"] * tries)
    robot.request("light")
    assert robot.run() is None
    assert len(robot.times) == tries + 1  # by another plan
    assert robot.retries == tries - 1


def test_a_policy_goes_before_an_encoding(tmp_path: Path) -> None:
    never = {"go(*)": {"retries": 0}, "press": {"timeout": 60}}
    robot = Robot(tmp_path, MAP, ["failure"], policies=never)
    robot.ask("visit(hall)")
    assert robot.retries == 0
    robot = Robot(tmp_path, LAMP, ["failure"] * 2, policies=never)
    assert robot.ask("light")[-1] == "succeeded"
    assert robot.retries == 2


@pytest.mark.parametrize(
    ("full", "reserves", "tries"),
    [(3, "", 3), (2, "", 2), (1, "", 1), (8, "reserves(r,battery).", 3),
     (4, "reserves(r,battery).", 2)],
)  # fmt: skip
def test_no_try_takes_more_than_there_is(
    tmp_path: Path, full: int, reserves: str, tries: int
) -> None:
    charger = " action(r,charge). needs(r,charge,at(r),dock). fills(r,charge,battery). "
    robot = Robot(tmp_path, MAP + charger + reserves, ["failure"] * 3, full=full)
    goal = robot.request("visit(hall)")
    robot.run()
    moves = [action for _, action in robot.times]
    first = next((n for n, one in enumerate(moves) if one != "go(hall)"), len(moves))
    blocked = [time for time, _ in robot.times if time < 60]
    assert min(first, len(blocked)) == tries, robot.times
    assert goal.words[-1] in ("accepted", "succeeded")


def test_other_encodings_are_as_before(tmp_path: Path) -> None:
    parts = make_parts(RECORDING, Options((f"{EXAMPLES}/line.lp",)), ("-c", "steps=30"))
    system = System(parts.loop)
    answers = ["failure"]
    system.turn = lambda: (
        [  # type: ignore[method-assign]
            system.answer(one, answers.pop() if answers else "success") for one in [*system.acting]
        ]
        != []
    )
    goal = system.request("visit(2)")
    assert system.run() is None
    assert goal.words[-1] == "succeeded"
    assert not any(isinstance(entry.event, ActionRetried) for entry in system.journal)
    assert system.clock == 0.0


def test_a_block_ends_after_a_restart(tmp_path: Path) -> None:
    """The store knows how long the way has been blocked."""

    class Blocked(Robot):
        def own_moments(self) -> List[float]:
            moments = super().own_moments()
            return [] if not stays and len(self.times) == 4 else moments

    answers, stays = ["success", *["failure"] * 3], False
    with closing(Store(tmp_path / "run.store")) as store:
        robot = Blocked(tmp_path, MAP, answers, durability=SqliteStore(store, dict))
        goal = robot.request("visit(table)")
        robot.run()
        assert goal.words == ["accepted"]
        due = robot.loop.state.alarms.due
        assert list(due) == ["unblocked(hall,table)"]
        left = due["unblocked(hall,table)"] - robot.clock
    with closing(Store(tmp_path / "run.store")) as store:
        stored = SqliteStore(store, dict)
        again = Blocked(tmp_path, MAP, [], durability=stored)
        again.clock = 0.0
        stays = True
        stored.resume(again.loop.state, lambda known: again.new_goal(known.request, (), known.id))
        again.run()
        assert [action for _, action in again.times] == ["go(table)"]
        assert again.times[0][0] == pytest.approx(left)
