"""Planning comes to its end under any rate of input, in simulated time and one thread."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence

import pytest

from rosclingo.solver.options import Options
from rosclingo.wire.commands import Assumed, Improvement, Outcome, Result
from rosoclingo.in_process.parts import EXAMPLES, SINGLE, make_parts
from rosoclingo.in_process.system import Request, System
from rosoclingo.loop.inputs.inbox import MOST_QUEUED
from rosoclingo.loop.journal import ARRIVALS, GoalArrived, MessageArrived, MessageDropped
from rosoclingo.loop.values.solver import Forwarding

LOOK = 0.01  # seconds between two looks at what has come
NOTES = 200  # values of the messages that are known, and different
MOST_LOOKS = 20_000
SEARCH_LOOKS = 20  # so many times a search looks at least
DECLARED = f"#program state(t). #external event(info,note(1..{NOTES}),t)."


class Flooded(System):
    """A system into which something comes each time that the loop looks, which takes its time."""

    def __init__(self, make: Callable[..., Any], flood: Callable[[Flooded], None]) -> None:
        self.looks = 0
        self.flood = flood
        self.others: List[Request] = []
        super().__init__(make)

    @property
    def may_hold(self) -> bool:
        return True

    def run_callbacks(self) -> None:
        self.looks += 1
        self.clock += LOOK
        assert self.looks < MOST_LOOKS, "the loop makes no progress"
        self.flood(self)
        super().run_callbacks()

    def turn(self) -> bool:
        return bool(self._items) or super().turn()

    def until(self, condition: Callable[[], bool]) -> int:
        """Lets the loop work until something is so, and returns how often it has looked."""
        before = self.looks
        if not self._is_prepared:
            self._is_prepared = True
            self.loop.prepare()
        while not condition():
            self.step()
        return self.looks - before


def nothing(system: Flooded) -> None:
    """No flood."""


def equal(system: Flooded) -> None:
    system.tell("info", "note(1)")


def different(system: Flooded) -> None:
    system.tell("info", f"note({system.looks % NOTES + 1})")


def unknown(system: Flooded) -> None:
    system.tell("info", f"nonsense({system.looks})")


def goals(system: Flooded) -> None:
    if system.others:
        system.cancel(system.others[-1])
    system.others.append(system.new_goal("visit(1)", (), f"other {system.looks}"))
    system.put(system.others[-1])


def answers(system: Flooded) -> None:
    # At random: in turn, each answer that counts could be a failure.
    system.tell("robot", random.Random(system.looks).choice(("failure", "success")))


class Slow(Forwarding):
    """A solver whose searches take a while."""

    def solve(
        self,
        assumptions: Sequence[Assumed] = (),
        stopped: Optional[Callable[[], bool]] = None,
        improved: Callable[[Improvement], None] = lambda _: None,
    ) -> Outcome:
        if stopped is not None and any(stopped() for _ in range(SEARCH_LOOKS)):
            return Outcome(Result.UNKNOWN, interrupted=True)
        return super().solve(assumptions, None, improved)


FLOODS = [equal, different, unknown, goals, answers]
CASES = [
    *((mode, flood) for mode in ("dynamic.incremental.dyn_reset", SINGLE) for flood in FLOODS),
    ("dynamic.fixed.recording", different),
    ("dynamic.incremental.recording", different),
    ("dynamic.incremental.reset", different),
]


def parts(mode: str, folder: Path) -> Any:
    (folder / "notes.lp").write_text(DECLARED)
    files = (f"{EXAMPLES}/line.lp", str(folder / "notes.lp"))
    made = make_parts(mode, Options(files, ("-c", "slots=3")), ("-c", "steps=20"))
    return replace(made, planner=Slow(made.planner))


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "flood"), CASES)
def test_the_first_action_comes_soon_and_each_goal_ends(
    mode: str, flood: Callable[[Flooded], None], tmp_path: Path
) -> None:
    looks = []
    for each in (nothing, flood):
        system = Flooded(parts(mode, tmp_path).loop, each)
        goal = system.request("visit(3)")
        looks.append(system.until(lambda made=system: bool(made.published)))
        system.until(lambda made=goal: made.words[-1:] not in ([], ["accepted"]))
        assert goal.words == ["accepted", "succeeded"], goal.reason
    assert looks[1] <= 3 * looks[0]
    system.flood = nothing
    for goal in system.others[:-1]:
        system.until(lambda made=goal: made.words[-1:] not in ([], ["accepted"]))


def test_goals_are_told_how_much_waits(tmp_path: Path) -> None:
    system = Flooded(parts("dynamic.incremental.dyn_reset", tmp_path).loop, different)
    goal = system.request("visit(3)")

    def is_told() -> bool:
        return any(line.endswith(" messages wait for the search") for line in goal.lines)

    def flood(flooded: Flooded) -> None:
        different(flooded)
        flooded.clock += 0.5  # the machine is slow

    system.flood = flood
    system.until(lambda: bool(system.published))
    assert is_told()
    assert goal.words == ["accepted"]


@pytest.mark.parametrize("mode", ["dynamic.incremental.recording", SINGLE])
def test_what_is_known_already_ends_no_wait(mode: str, tmp_path: Path) -> None:
    system = Flooded(parts(mode, tmp_path).loop, nothing)
    goal = system.request("visit(3)")
    system.until(lambda: bool(system.acting))
    system.tell("info", "note(1)")
    system.cancel(system.request("visit(1)"))  # recalled before it has a slot
    system.until(lambda: "event(info,note(1),1)" in system.loop.state.externals.true)
    mail = system.loop.state.mail
    system.tell("info", "note(1)")
    mail.take()
    assert (mail.has_news, mail.new_messages) == (False, False)
    system.tell("robot", "success")  # it acts: that is its answer
    mail.take()
    assert mail.has_news
    system.acting.clear()
    system.until(lambda: goal.words == ["accepted", "succeeded"])
    # The step is over, so that the same is something else.
    assert system.run() is None
    system.tell("info", "note(1)")
    mail.take()
    assert mail.has_news


def test_few_of_the_messages_that_are_dropped_are_logged_one_by_one(tmp_path: Path) -> None:
    def flood(flooded: Flooded) -> None:
        for _ in range(30):
            unknown(flooded)

    system = Flooded(parts("dynamic.incremental.dyn_reset", tmp_path).loop, flood)
    system.request("visit(2)")
    system.until(lambda: bool(system.published))
    system.flood = nothing
    before = len(system.warnings)
    assert system.run() is None
    system.clock += 1
    system.loop.state.mail.take()
    assert before <= 2 * 100 * (1 + system.clock)
    dropped = sum(isinstance(entry.event, MessageDropped) for entry in system.journal)
    single = sum("dropped a message" in warning for warning in system.warnings)
    more = [re.match(r"dropped (\d+) more", warning) for warning in system.warnings]
    assert single + sum(int(found[1]) for found in more if found) == dropped


@pytest.mark.costly
@pytest.mark.parametrize("mode", ["dynamic.incremental.recording", SINGLE])
def test_an_idle_robot_begins_few_steps(mode: str, tmp_path: Path) -> None:
    system = Flooded(parts(mode, tmp_path).loop, different)
    goal = system.request("visit(2)")
    system.until(lambda: goal.words == ["accepted", "succeeded"])
    step, begin = system.elapsed, system.clock
    system.until(lambda: system.elapsed >= step + 10)
    assert system.clock - begin > 4
    goal = system.request("visit(3)")  # waits for nothing
    begin = system.clock
    system.until(lambda: system.acting.get("robot") == "go(3)")
    assert system.clock - begin < 3


def test_what_waits_when_the_loop_ends_is_refused(tmp_path: Path) -> None:
    system = Flooded(parts("dynamic.incremental.recording", tmp_path).loop, different)
    system.request("visit(3)")
    system.until(lambda: bool(system.waiting()))  # after a command that has not taken it
    late = system.request("visit(2)")
    system.loop.end("it is over")
    assert (late.words, late.reason) == (["rejected"], "it is over")


@pytest.mark.costly
@pytest.mark.parametrize("mode", ["dynamic.incremental.dyn_reset", SINGLE])
def test_a_queue_of_goals_holds_nothing_up(mode: str, tmp_path: Path) -> None:
    """An answer, a message and a cancel request are taken before goals that have come earlier."""
    system = Flooded(parts(mode, tmp_path).loop, nothing)
    system.request("visit(3)")
    system.until(lambda: bool(system.acting))
    flood = [system.new_goal("visit(1)", (), f"flood {n}") for n in range(5 * MOST_QUEUED)]
    system.put(*flood)
    system.cancel(flood[-1])
    assert flood[-1].words == ["canceled"]
    before = len(system.journal)
    system.tell("robot", "success")
    system.tell("info", "note(1)")
    system.loop.state.mail.take()
    taken = [entry.event for entry in system.journal[before:]]
    assert [type(event) for event in taken if isinstance(event, ARRIVALS)][-2:] == [
        MessageArrived, MessageArrived
    ]  # fmt: skip
    most = MOST_QUEUED + len(system.loop.state.goals.slots)
    assert sum(isinstance(event, GoalArrived) for event in taken) <= most
    state = system.loop.state.snapshot()
    assert len(state.goals.goals) <= most + 1  # what is stored in a step does not grow


@pytest.mark.costly
def test_each_goal_of_a_flood_ends_in_its_turn(tmp_path: Path) -> None:
    system = System(parts("dynamic.incremental.dyn_reset", tmp_path).loop)
    goals = [system.request(f"visit({1 + n % 2})") for n in range(3 * MOST_QUEUED)]
    for goal in goals[5::7]:
        system.cancel(goal)
    assert system.loop.state.mail.inbox.backlog > MOST_QUEUED
    assert system.run() is None
    ends = {"canceled": goals[5::7], "succeeded": [g for g in goals if g not in goals[5::7]]}
    for end, ended in ends.items():
        assert {goal.words[-1] for goal in ended} == {end}
    came = [e.event.goal for e in system.journal if isinstance(e.event, GoalArrived)]
    assert came == [goal.id for goal in goals]


def test_goals_in_the_backlog_are_refused_when_the_loop_ends(tmp_path: Path) -> None:
    system = Flooded(parts("dynamic.incremental.dyn_reset", tmp_path).loop, nothing)
    goals = [system.request("visit(3)") for _ in range(3 * MOST_QUEUED)]
    system.until(lambda: bool(system.acting))
    system.loop.end("it is over")
    assert {goal.words[-1] for goal in goals} == {"aborted", "rejected"}
    assert {goal.reason for goal in goals} == {"it is over"}
    assert system.backlog == 0
