"""The mailbot in all modes: the manual's example, the three scenarios, what is documented."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Callable, List, Optional, Set, Tuple

import pytest
from draws import variants
from episode import (
    BENCH,
    DYN_RESET,
    FIXED,
    INCREMENTAL,
    MAILBOT,
    OFFICE,
    RECORDING,
    REQUEST,
    RESET,
    SINGLE,
    STATIC,
    Episode,
    walk,
)
from instance_map import InstanceMap

from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.wire.commands import Ground, Part, Result
from rosoclingo.in_process.system import System
from rosoclingo.loop.planner.planner import Planner

DYNAMIC = [FIXED, *INCREMENTAL]
# What is planned for as long as it is, with a past that is forgotten while goals are open, and with
# goals from step 1 on; test_episodes.py has random worlds in all modes.
SOME_DYNAMIC = variants([FIXED, RESET, SINGLE], DYNAMIC)
SOME = variants([RECORDING, RESET], INCREMENTAL)  # where the past is kept, and where it is not
OUTCOMES = variants(
    [(FIXED, "success"), (RESET, "failure"), (DYN_RESET, "success"), (SINGLE, "failure")],
    product(DYNAMIC, ["success", "failure"]),
)


def _office(mode: str, slots: int = 1) -> Episode:
    options = ["-c", f"slots={slots}"]
    return Episode(mode, InstanceMap.read(Path(OFFICE)), [OFFICE, MAILBOT], options=options)


def _grid(mode: str, slots: int = 2, steps: int = 60) -> Episode:
    options = ["-c", f"slots={slots}", "-c", "x=2", "-c", "y=2"]
    return Episode(
        mode, InstanceMap.grid(2, 2), [BENCH, MAILBOT], ["-c", f"steps={steps}"], options
    )


def _ok(episode: Episode, turn: Optional[Callable[[], bool]] = None) -> None:
    assert episode.play(turn) is None
    assert episode.validator.finish() == []
    assert episode.warnings == []


# The manual's example.


@pytest.mark.parametrize("mode", STATIC)
def test_a_static_mode_publishes_the_plan_for_the_request_file(mode: str) -> None:
    options = ["-c", "slots=1", "-c", "x=2", "-c", "y=2"]
    graph = InstanceMap.grid(2, 2)
    episode = Episode(mode, graph, [BENCH, REQUEST, MAILBOT], ["-c", "steps=14"], options)
    assert episode.play() is None
    ((identifier, plan),) = episode.published
    assert identifier == "solver"
    actions = ["go(1)", "pickup(1)", "go(c(1))", "go(c(3))", "go(3)", "deliver(1)"]
    expected = [f"do(mailbot,{action},{step})" for step, action in enumerate(actions, 1)]
    assert plan == f"[{', '.join(expected)}]"
    assert episode.warnings == []


@pytest.mark.costly
@pytest.mark.parametrize("mode", DYNAMIC)
def test_a_dynamic_mode_with_the_manuals_options(mode: str) -> None:
    episode = _grid(mode, slots=1, steps=14)
    goal = episode.request("bring(1,3)")
    _ok(episode)
    assert goal.words == ["accepted", "succeeded"]
    assert episode.actions == ["go(1)", "pickup(1)", "go(c(1))", "go(c(3))", "go(3)", "deliver(1)"]


# The three scenarios. Routes are the waypoints in order.


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_scenario_1_the_blocked_corridor_is_avoided(mode: str) -> None:
    episode = _office(mode)
    episode.announce("blocked(c3,c4)")
    episode.request("bring(o9,o14)")
    _ok(episode)
    assert episode.actions == walk(
        "c6 c5 o9", "pickup(1)", "c5 c6 open1 c1 c2 c3 o14", "deliver(1)"
    )


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_scenario_2_the_robot_turns_round_when_the_corridor_is_free_again(mode: str) -> None:
    episode = _office(mode)
    episode.announce("blocked(c3,c4)")
    episode.request("bring(o9,o14)")

    def turn() -> bool:
        if not episode.acting:
            return False
        if episode.answer("mailbot") == "go(c6)" and "pickup(1)" in episode.actions:
            episode.announce("unblocked(c4,c3)")
        return True

    _ok(episode, turn)
    assert episode.actions == walk("c6 c5 o9", "pickup(1)", "c5 c6", "c5 c4 c3 o14", "deliver(1)")


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_scenario_3_a_failure_changes_the_order_of_the_deliveries(mode: str) -> None:
    episode = _office(mode, slots=2)
    first = episode.request("bring(o7,o11)")
    others = []

    def answer(action: str) -> str:
        if action == "go(c6)" and not others:
            others.append(episode.request("bring(o2,o3)"))
        fails = action == "go(c4)" and episode.validator.positions["mailbot"] == "c5"
        return "failure" if fails else "success"

    _ok(episode, episode.answering(answer))
    assert episode.actions == walk(
        "c6 c5 c4",
        "c6 open1 c1 c2 o2",
        "pickup(2)",
        "c2 c1 o3",
        "deliver(2)",
        "c1 c2 c3 c4 o7",
        "pickup(1)",
        "c4 o11",
        "deliver(1)",
    )
    assert first.words == ["accepted", "succeeded"]
    assert others[0].words == ["accepted", "succeeded"]


# What is documented.


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME_DYNAMIC)
def test_failed_pickups_and_deliveries_are_tried_again(mode: str) -> None:
    episode = _grid(mode)
    goal = episode.request("bring(2,1)")
    failures = {"pickup(1)": 2, "deliver(1)": 1}

    def answer(action: str) -> str:
        failures[action] = failures.get(action, 0) - 1
        return "failure" if failures[action] >= 0 else "success"

    _ok(episode, episode.answering(answer))
    assert goal.words == ["accepted", "succeeded"]
    assert episode.actions == walk(
        "go(c(2)) go(2)",
        "pickup(1) pickup(1) pickup(1)",
        "go(c(2)) go(c(1)) go(1)",
        "deliver(1) deliver(1)",
    )


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME_DYNAMIC)
def test_a_failed_move_blocks_the_way_for_good(mode: str) -> None:
    episode = _grid(mode)
    goals = [episode.request("bring(1,2)"), episode.request("bring(2,1)")]

    def answer(action: str) -> str:
        here = episode.validator.positions["mailbot"]
        between = {f"go({here})", action} == {"go(c(1))", "go(c(2))"}
        return "failure" if between else "success"

    _ok(episode, episode.answering(answer))
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
    # It was tried once, and the way round taken ever since.
    moves = [f"{a} {b}" for a, b in zip(episode.actions, episode.actions[1:])]
    assert sum(move in ("go(c(1)) go(c(2))", "go(c(2)) go(c(1))") for move in moves) <= 1
    assert "go(c(3))" in episode.actions


@pytest.mark.parametrize("mode", SOME_DYNAMIC)
def test_cancel_before_the_pickup(mode: str) -> None:
    episode = _grid(mode)
    goal = episode.request("bring(4,1)")

    def answer(action: str) -> None:
        if action == "go(c(4))":
            episode.cancel(goal)

    _ok(episode, episode.answering(answer))
    assert goal.words == ["accepted", "canceled"]
    assert episode.actions[-1] == "go(c(4))"


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "outcome"), OUTCOMES)
def test_cancel_during_the_pickup(mode: str, outcome: str) -> None:
    episode = _grid(mode)
    goal = episode.request("bring(1,4)")

    def answer(action: str) -> Optional[str]:
        if action != "pickup(1)":
            return None
        episode.cancel(goal)
        return outcome

    _ok(episode, episode.answering(answer))
    assert goal.words == ["accepted", "canceled"]
    expected = ["go(1)", "pickup(1)"] + (["deliver(1)"] if outcome == "success" else [])
    assert episode.actions == expected


@pytest.mark.parametrize("mode", SOME_DYNAMIC)
def test_cancel_after_the_pickup_brings_the_package_back(mode: str) -> None:
    episode = _grid(mode)
    goal = episode.request("bring(1,4)")

    def answer(action: str) -> None:
        if action == "go(c(1))":
            episode.cancel(goal)

    _ok(episode, episode.answering(answer))
    assert goal.words == ["accepted", "canceled"]
    assert episode.actions == walk("go(1) pickup(1) go(c(1)) go(1) deliver(1)")


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "outcome"), OUTCOMES)
def test_cancel_during_the_delivery(mode: str, outcome: str) -> None:
    episode = _grid(mode)
    goal = episode.request("bring(1,2)")

    def answer(action: str) -> Optional[str]:
        if action != "deliver(1)" or goal in episode.cancelled:
            return None
        episode.cancel(goal)
        return outcome

    _ok(episode, episode.answering(answer))
    assert goal.words[-1] == {"success": "succeeded", "failure": "canceled"}[outcome]


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "slots"), [(RECORDING, 2), (RESET, 1), (SINGLE, 1)])
def test_more_requests_than_slots(mode: str, slots: int) -> None:
    episode = _grid(mode, slots, steps=100)
    texts = ["bring(1,2)", "bring(2,3)", "bring(3,1)"]
    goals = [episode.request(text) for text in texts]
    _ok(episode)
    assert [goal.words for goal in goals] == [["accepted", "succeeded"]] * 3
    assert episode.validator.delivered == 3


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_the_same_request_twice(mode: str) -> None:
    episode = _grid(mode)
    goals = [episode.request("bring(1,2)"), episode.request("bring(1,2)")]
    _ok(episode)
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
    assert episode.validator.delivered == 2


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_a_wrong_request_is_rejected(mode: str) -> None:
    reasons = {
        "bring(o9,o99)": "o99 is unknown as the second argument of bring",
        "bring(o9,o9)": "o9 and o9 do not go together in bring",
        "fly(o1)": "there is no request like fly(o1); one that it knows is bring(o1,o10)",
        "bring(o9)": "there is no request like bring(o9)",
    }
    episode = _office(mode)
    wrong, right = [episode.request(text) for text in reasons], episode.request("bring(o1,o3)")
    _ok(episode)
    for goal, reason in zip(wrong, reasons.values()):
        assert goal.words == ["rejected"]
        assert reason in goal.reason
    assert right.words == ["accepted", "succeeded"]


@pytest.mark.costly
@pytest.mark.parametrize("mode", SOME)
def test_what_cannot_be_reached_waits_and_the_rest_is_served(mode: str) -> None:
    episode = _office(mode, slots=2)
    episode.announce("blocked(c2,o2)")
    stuck, other = episode.request("bring(o2,o3)"), episode.request("bring(o1,o10)")

    def turn() -> bool:
        if episode.acting:
            episode.answer("mailbot")
        elif other.words[-1:] == ["succeeded"] and not stuck.words[1:]:
            if not episode.validator.believed():
                return False
            episode.announce("unblocked(o2,c2)")
        else:
            return False
        return True

    _ok(episode, turn)
    assert stuck.words == ["accepted", "succeeded"]
    assert episode.actions.index("deliver(2)") < episode.actions.index("pickup(1)")


@pytest.mark.costly
@pytest.mark.parametrize(("mode", "r"), [(RESET, 1), *((mode, 5) for mode in (RECORDING, SINGLE))])
def test_while_a_request_waits_a_message_takes_one_step(mode: str, r: int) -> None:
    """And no more, so that 25 steps suffice for 13 messages and the delivery.

    One mode alone has r.
    """
    options = ["-c", "slots=1", "-c", "x=2", "-c", "y=2"]
    steps = ["-c", "steps=25", "-c", f"r={r}"]
    episode = Episode(mode, InstanceMap.grid(2, 2), [BENCH, MAILBOT], steps, options)
    episode.announce("blocked(3,c(3))")
    goal = episode.request("bring(3,1)")
    said: List[str] = []

    def turn() -> bool:
        if episode.acting:
            episode.answer("mailbot")
        elif len(said) < 12:
            said.append("unblocked" if len(said) % 2 else "blocked")
            episode.announce(f"{said[-1]}(c(1),c(2))")
        elif goal.words == ["accepted"] and episode.validator.believed():
            episode.announce("unblocked(3,c(3))")
        else:
            return False
        return True

    _ok(episode, turn)
    assert len(said) == 12
    assert goal.words == ["accepted", "succeeded"]


@pytest.mark.parametrize("mode", SOME)
def test_two_robots(mode: str, tmp_path: Path) -> None:
    file = tmp_path / "second.lp"
    file.write_text("start(second,c(4)).")
    graph = InstanceMap.grid(2, 2)
    graph.starts["second"] = "c(4)"
    episode = Episode(mode, graph, [BENCH, str(file), MAILBOT])
    goals = [episode.request("bring(1,2)"), episode.request("bring(4,3)")]
    _ok(episode)
    assert [goal.words[-1] for goal in goals] == ["succeeded"] * 2
    steps = [actuator for actuator, _ in episode.published]
    assert steps.count("mailbot") == steps.count("second") == 6
    assert mode != RECORDING or episode.loop.state.step == 6  # at the same time


@pytest.mark.parametrize("instance", [BENCH, OFFICE])
def test_it_grounds_without_a_warning(instance: str) -> None:
    messages: List[str] = []
    planner = Planner(Engine(Options((instance, MAILBOT)), log=messages.append))
    planner.begin()
    planner.ground_steps([1, 2])
    offices = sorted(InstanceMap.read(Path(OFFICE)).offices) if instance == OFFICE else ["1", "2"]
    assert planner.tell([f"event(1,bring({offices[0]},{offices[1]}),0)"]) == []
    assert planner.search(0, 2, lambda: False).result is Result.UNSAT
    assert planner.needed is not None
    assert planner.tell(["event(info,passed,0)", "event(1,cancel,1)"]) == []
    assert planner.search(1, 2, lambda: False).result is Result.SAT
    assert messages == []


def test_the_grid_is_the_one_of_the_encoding() -> None:
    """The validator's grid, and the office as it is read, have what the instances have."""
    for instance, options, graph in (
        (BENCH, ("-c", "x=3", "-c", "y=2"), InstanceMap.grid(3, 2)),
        (OFFICE, (), InstanceMap.read(Path(OFFICE))),
    ):
        engine = Engine(Options((instance,), options))
        engine.apply(Ground((Part("base"),)))
        atoms = engine.solve().symbols
        edges = {frozenset(a[len("connection(") : -1].split(",")) for a in atoms if a[:4] == "conn"}
        assert edges == graph.edges
        assert {a[len("office(") : -1] for a in atoms if a.startswith("office(")} == graph.offices
        assert [a for a in atoms if a.startswith("start(")] == [
            f"start({robot},{place})" for robot, place in graph.starts.items()
        ]


def test_every_waypoint_of_the_office_has_its_position() -> None:
    text = Path(OFFICE).read_text(encoding="utf-8")
    graph = InstanceMap.read(Path(OFFICE))
    for waypoint in {waypoint for edge in graph.edges for waypoint in edge}:
        assert text.count(f"position({waypoint},") == 1
    assert "position(open1,70,-80)." in text


@pytest.mark.costly
@pytest.mark.parametrize("mode", [DYN_RESET, SINGLE])
def test_goals_that_wait_for_a_blocked_way_are_counted(mode: str) -> None:
    """Among others, which are served; and none, as soon as the ways are free."""
    episode = _office(mode, slots=3)

    def count() -> Tuple[int, int]:
        summary = episode.loop.state.summarize()
        return summary.goals_open, summary.all_waiting

    ways = ["c2,o2", "c2,o13", "c5,o8"]
    for way in ways:
        episode.tell("info", f"blocked({way})")
    blocked = [episode.request(one) for one in ("bring(o2,o3)", "bring(o3,o13)", "bring(o8,o4)")]
    assert episode.run() is None
    assert count() == (3, 3)
    assert not [goal for goal in blocked if goal.ended]
    episode.tell("info", f"unblocked({ways.pop()})")
    counts: Set[Tuple[int, int]] = set()

    def turn() -> bool:
        counts.add(count())
        return System.turn(episode)

    episode.turn = turn  # type: ignore[method-assign]
    assert episode.run() is None
    assert (3, 2) in counts
    assert count() == (2, 2)
    for way in ways:
        episode.tell("info", f"unblocked({way})")
    assert episode.run() is None
    assert {goal.words[-1] for goal in blocked} == {"succeeded"}
    assert (1, 0) in counts
    assert count() == (0, 0)
