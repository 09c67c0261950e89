"""The mailbot of the paper: its three scenarios, requests that are cancelled, failures."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, Optional

import pytest
from episode import OFFICE, PAPER, SINGLE, Episode, walk
from instance_map import InstanceMap

from rosclingo.solver.options import Options
from rosoclingo.in_process.inputs import read_input
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.simulation import SimulatedSystem


@pytest.fixture
def episode() -> Episode:
    return Episode(SINGLE, InstanceMap.read(Path(OFFICE)), [OFFICE, PAPER])


def _run(episode: Episode, turn: Optional[Callable[[], bool]] = None) -> None:
    assert episode.play(turn) is None
    assert episode.warnings == []


@pytest.mark.costly
def test_scenario_1(episode: Episode) -> None:
    episode.announce("blocked(c3,c4)")
    goal = episode.request("bring(o9,o14)")
    _run(episode)
    assert episode.actions == walk(
        "c6 c5 o9 pickup(o9,o14) c5 c6 open1 c1 c2 c3 o14 deliver(o9,o14)"
    )
    assert goal.words == ["accepted", "succeeded"]


@pytest.mark.costly
def test_scenario_2(episode: Episode) -> None:
    episode.announce("blocked(c3,c4)")
    episode.request("bring(o9,o14)")

    def turn() -> bool:
        if not episode.acting:
            return False
        if episode.answer("mailbot") == "go(c6)" and "pickup(o9,o14)" in episode.actions:
            episode.announce("unblocked(c4,c3)")
        return True

    _run(episode, turn)
    assert episode.actions == walk("c6 c5 o9 pickup(o9,o14) c5 c6 c5 c4 c3 o14 deliver(o9,o14)")


@pytest.mark.costly
def test_scenario_3(episode: Episode) -> None:
    goals = [episode.request("bring(o7,o11)")]

    def answer(action: str) -> str:
        if action == "go(c6)" and len(goals) == 1:
            goals.append(episode.request("bring(o2,o3)"))
        fails = action == "go(c4)" and "go(open1)" not in episode.actions
        return "failure" if fails else "success"

    _run(episode, episode.answering(answer))
    assert episode.actions == walk(
        "c6 c5 c4 c6 open1 c1 c2 o2 pickup(o2,o3) c2 c1 o3 deliver(o2,o3) "
        "c1 c2 c3 c4 o7 pickup(o7,o11) c4 o11 deliver(o7,o11)"
    )
    assert [goal.words[-1] for goal in goals] == ["succeeded", "succeeded"]


@pytest.mark.costly
def test_a_package_on_the_robot_goes_back(episode: Episode) -> None:
    goal = episode.request("bring(o1,o3)")

    def answer(action: str) -> None:
        if action == "pickup(o1,o3)":
            episode.cancel(goal)

    _run(episode, episode.answering(answer))
    assert episode.actions == walk("c1 o1 pickup(o1,o3) deliver(o1,o3)")
    assert goal.words == ["accepted", "canceled"]


@pytest.mark.costly
def test_a_package_that_is_not_picked_up_stays(episode: Episode) -> None:
    goals = [episode.request("bring(o1,o3)")]

    def answer(action: str) -> None:
        if len(goals) == 1:
            episode.cancel(goals[0])
            goals.append(episode.request("bring(o3,o1)"))

    _run(episode, episode.answering(answer))
    assert episode.actions == walk("c1 o3 pickup(o3,o1) c1 o1 deliver(o3,o1)")
    assert [goal.words[-1] for goal in goals] == ["canceled", "succeeded"]


@pytest.mark.costly
def test_failures(episode: Episode) -> None:
    """A hand that fails tries again; a way that fails is gone round until it is free."""
    goal = episode.request("bring(o1,o2)")
    failing = ["pickup(o1,o2)", "deliver(o1,o2)"]

    def answer(action: str) -> str:
        fails = action in failing
        if fails:
            failing.remove(action)
        return "failure" if fails else "success"

    _run(episode, episode.answering(answer))
    assert episode.actions == walk(
        "c1 o1 pickup(o1,o2) pickup(o1,o2) c1 c2 o2 deliver(o1,o2) deliver(o1,o2)"
    )
    assert goal.words == ["accepted", "succeeded"]


@pytest.mark.costly
def test_one_of_two_requests_for_the_same_package_is_cancelled(episode: Episode) -> None:
    goals = [episode.request("bring(o1,o3)"), episode.request("bring(o1,o3)")]

    def answer(action: str) -> None:
        if action == "pickup(o1,o3)":
            episode.cancel(goals[0])

    _run(episode, episode.answering(answer))
    assert episode.actions == walk("c1 o1 pickup(o1,o3) c1 o3 deliver(o1,o3)")
    assert [goal.words[-1] for goal in goals] == ["canceled", "succeeded"]


@pytest.mark.costly
def test_a_package_on_its_way_back_is_requested_again(episode: Episode) -> None:
    goals = [episode.request("bring(o1,o2)")]

    def answer(action: str) -> None:
        if action == "go(c2)" and len(goals) == 1:
            episode.cancel(goals[0])
        elif goals[0] in episode.cancelled and len(goals) == 1:
            goals.append(episode.request("bring(o1,o2)"))

    _run(episode, episode.answering(answer))
    assert episode.actions == walk("c1 o1 pickup(o1,o2) c1 c2 c1 c2 o2 deliver(o1,o2)")
    assert [goal.words[-1] for goal in goals] == ["canceled", "succeeded"]


@pytest.mark.costly
@pytest.mark.parametrize("way", ["c5,o9", "o9,c5"])
def test_the_only_way_is_free_again_in_the_step_in_which_it_was_found_blocked(way: str) -> None:
    """While there is no plan, the horizon grows, and whatever is announced belongs to this step."""
    inputs = [
        read_input("goal:bring(o9,o14)"),
        read_input("mailbot:failure", "3"),
        read_input(f"info:unblocked({way})", "in:60"),
    ]
    parts = make_parts(SINGLE, Options((OFFICE, PAPER)), ["-c", "steps=60"])
    simulation = SimulatedSystem(parts.loop, inputs)
    assert simulation.run() is None
    assert [action for _, action in simulation.published] == walk(
        "c6 c5 o9 o9 pickup(o9,o14) c5 c4 c3 o14 deliver(o9,o14)"
    )
    assert simulation.goals[0].words == ["accepted", "succeeded"]
