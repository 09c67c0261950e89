"""The validator finds every kind of error that is planted into an episode without one."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, List, Tuple

import pytest
from instance_map import InstanceMap

from rosoclingo_aspprograms.validator import Validator, arguments

INSTANCES = Path(__file__).resolve().parents[2] / "mailbot" / "instances"
OFFICE = INSTANCES / "graph_wg.lp"
Step = Tuple[str, ...]

# A whole episode: two goals, one cancelled after its pickup.
GOOD: List[Step] = [
    ("request", "a", "bring(1,2)"),
    ("status", "a", "accepted", "1"),
    ("action", "go(1)"),
    ("answer", "success"),
    ("action", "pickup(1)"),
    ("answer", "failure"),
    ("action", "pickup(1)"),
    ("answer", "success"),
    ("request", "b", "bring(3,4)"),
    ("action", "go(c(1))"),
    ("status", "b", "accepted", "2"),
    ("answer", "success"),
    ("action", "go(c(2))"),
    ("answer", "success"),
    ("action", "go(2)"),
    ("answer", "success"),
    ("action", "deliver(1)"),
    ("answer", "success"),
    ("status", "a", "succeeded", "1"),
    ("info", "blocked(c(1),c(2))"),
    ("action", "go(c(2))"),
    ("answer", "success"),
    ("action", "go(c(4))"),
    ("answer", "success"),
    ("action", "go(c(3))"),
    ("answer", "success"),
    ("action", "go(3)"),
    ("answer", "success"),
    ("action", "pickup(2)"),
    ("answer", "success"),
    ("cancel", "b"),
    ("action", "go(c(3))"),
    ("answer", "success"),
    ("action", "go(3)"),
    ("answer", "success"),
    ("action", "deliver(2)"),
    ("answer", "success"),
    ("status", "b", "canceled", "2"),
]


def _violations(steps: List[Step]) -> List[str]:
    validator = Validator(InstanceMap.grid(2, 2))
    for kind, *rest in steps:
        if kind == "action":
            validator.action("mailbot", rest[0])
        elif kind == "answer":
            validator.message("mailbot", rest[0])
        elif kind == "info":
            validator.message("info", rest[0])
        else:
            getattr(validator, kind)(*rest)
    return validator.finish()


def _replace(index: int, *steps: Step) -> List[Step]:
    return [*GOOD[:index], *steps, *GOOD[index + 1 :]]


def _after(index: int, *steps: Step) -> List[Step]:
    return [*GOOD[: index + 1], *steps, *GOOD[index + 1 :]]


def test_an_episode_without_an_error() -> None:
    assert _violations(GOOD) == []


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: _replace(2, ("action", "go(c(4))")), "not connected"),
        (lambda: _replace(2, ("action", "go(7)")), "not connected"),
        (lambda: _replace(2, ("action", "fly(1)")), "there is no action fly(1)"),
        (lambda: _replace(2, ("action", "pickup(1)")), "it is at c(1), not at 1"),
        (lambda: _replace(4, ("action", "pickup(2)")), "no goal is in this slot"),
        (lambda: _replace(9, ("action", "pickup(1)")), "carries the package of bring(1,2)"),
        (lambda: _replace(4, ("action", "deliver(1)")), "does not carry this package"),
        (lambda: _replace(9, ("action", "deliver(1)")), "it is for 2"),
        (lambda: _after(9, ("action", "go(1)")), "while it does"),
        (lambda: _replace(20, ("action", "go(c(1))")), "not connected"),
        (
            lambda: _replace(
                22, ("action", "go(c(1))"), ("answer", "failure"), ("action", "go(c(1))")
            ),
            "blocked",
        ),
        (lambda: GOOD[:-1], "bring(3,4) in slot 2 has not ended"),
        (lambda: [*GOOD, ("action", "go(c(3))")], "there is no request"),
        (lambda: _replace(18, ("status", "a", "canceled", "1")), "nobody asked for that"),
        (lambda: _replace(18, ("status", "a", "rejected", "1")), "for no reason"),
        (lambda: _replace(18, ("status", "a", "aborted", "1")), "is aborted"),
        (lambda: _replace(-1, ("status", "b", "succeeded", "2")), "its package is at 3"),
        (lambda: _after(7, ("status", "a", "succeeded", "1")), "on a robot"),
        (lambda: _after(8, ("cancel", "a"), ("status", "a", "canceled", "1")), "on a robot"),
        (lambda: _after(18, ("status", "a", "succeeded", "1")), "was succeeded before"),
        (lambda: _after(1, ("status", "a", "accepted", "1")), "twice"),
        (lambda: _replace(10, ("status", "b", "accepted", "1")), "slot has another goal"),
        (lambda: [("request", "c", "bring(1,9)"), ("status", "c", "accepted", "1")], "no sense"),
        (lambda: [("request", "c", "bring(1,1)"), ("status", "c", "succeeded", "1")], "package"),
        (lambda: _replace(31, ("action", "deliver(2)"))[:-6], "still carries"),
        (lambda: GOOD[:-2], "has not ended its action deliver(2)"),
        (
            lambda: [*GOOD[:3], ("cancel", "a"), GOOD[3], ("action", "pickup(1)")],
            "its goal is cancelled",
        ),
    ],
)
def test_a_planted_error_is_found(make: Callable[[], List[Step]], text: str) -> None:
    violations = _violations(make())
    assert any(text in violation for violation in violations), violations


def test_a_blocked_way_is_found_only_when_it_can_be_known() -> None:
    begin: List[Step] = [*GOOD[:2], ("action", "go(c(2))")]
    said = ("info", "blocked(c(4),c(2))")
    late = _violations([*begin, ("answer", "success"), said, ("action", "go(c(4))")])
    assert not any(text.endswith("blocked") for text in late)
    early = _violations([*begin, said, ("answer", "success"), ("action", "go(c(4))")])
    assert any(text.endswith("blocked") for text in early)
    freed = ("info", "unblocked(c(2),c(4))")
    both = _violations([*begin, said, freed, ("answer", "success"), ("action", "go(c(4))")])
    assert not any(text.endswith("blocked") for text in both)


LOST: List[Step] = [*GOOD[:5], ("answer", "unknown"), ("status", "a", "aborted", "1")]
FOUND: List[Step] = [*LOST, *GOOD[8:9], ("info", "at(mailbot,1)"), *GOOD[9:11]]


def test_nobody_knows_whether_an_action_was_done() -> None:
    assert _violations(LOST) == []
    assert _violations([*FOUND, ("answer", "success")]) == [
        "the goal bring(3,4) in slot 2 has not ended"
    ]
    again = ("action", "pickup(1)")
    for steps in ([*LOST[:-1], again], [*LOST, *GOOD[8:9], *GOOD[9:11]]):
        assert any(text.endswith("nobody knows where it is") for text in _violations(steps))
    assert any("on a robot" in text for text in _violations([*LOST[:-1], *GOOD[18:19]]))


@pytest.fixture
def validator() -> Validator:
    """A validator of two robots at a waypoint with three ways on, and a request."""
    hall = InstanceMap({"a", "b", "c"}, {frozenset(("hall", office)) for office in "abc"})
    hall.starts = {"one": "hall", "other": "hall"}
    validator = Validator(hall, immediate=True)
    validator.request("goal", "bring(a,b)")
    validator.status("goal", "accepted", "1")
    return validator


def _go(validator: Validator, robot: str, target: str, answer: str = "failure") -> None:
    validator.action(robot, f"go({target})")
    validator.message(robot, answer)


A, B = frozenset(("hall", "a")), frozenset(("hall", "b"))


def test_a_robot_that_is_stuck(validator: Validator) -> None:
    """It has failed on two ways in a row: these are free then, and it does nothing more."""
    _go(validator, "one", "a")
    assert validator.believed() == {A}
    assert not validator.lost
    _go(validator, "one", "b")
    assert validator.lost == {"one"}
    assert validator.believed() == set()
    _go(validator, "other", "a", "success")
    assert validator.violations == []
    validator.action("one", "go(c)")
    assert validator.violations == ["one is to do go(c), and nobody knows where it is"]


def test_a_robot_that_has_come_away_is_not_stuck(validator: Validator) -> None:
    for target, answer in (
        ("a", "failure"),
        ("c", "success"),
        ("hall", "success"),
        ("b", "failure"),
    ):
        _go(validator, "one", target, answer)
    assert not validator.lost
    assert validator.believed() == {A, B}


def test_a_robot_that_fails_on_the_same_way_is_not_stuck(validator: Validator) -> None:
    for _ in range(3):
        _go(validator, "one", "a")
        validator.message("info", "unblocked(a,hall)")
    assert not validator.lost


@pytest.mark.parametrize("first", [True, False])
def test_what_others_say_of_a_way_stays(validator: Validator, first: bool) -> None:
    """A robot that is stuck is no reason to believe otherwise, before that or afterwards."""
    _go(validator, "one", "a")
    if first:
        validator.message("info", "blocked(hall,a)")
    _go(validator, "one", "b")
    if not first:
        validator.message("info", "blocked(hall,a)")
    assert validator.lost == {"one"}
    assert validator.believed() == {A}


def test_what_another_robot_has_found_stays(validator: Validator) -> None:
    for robot in ("one", "other"):
        validator.action(robot, "go(a)")
    for robot in ("one", "other"):
        validator.message(robot, "failure")
    _go(validator, "one", "b")
    assert validator.lost == {"one"}
    assert validator.believed() == {A}


def test_a_robot_that_is_alone_is_not_stuck() -> None:
    validator = Validator(InstanceMap.grid(2, 2), immediate=True)
    validator.request("a", "bring(1,2)")
    for target in ("1", "c(2)", "c(3)"):
        _go(validator, "mailbot", target)
    assert not validator.lost
    assert len(validator.believed()) == 3


def test_an_unknown_robot() -> None:
    validator = Validator(InstanceMap.grid(2, 2))
    validator.action("postman", "go(1)")
    assert "postman is no robot" in validator.violations[0]


def test_terms() -> None:
    assert arguments("blocked(c(1), c(2))", "blocked") == ["c(1)", "c(2)"]
    assert arguments("blocked(a)", "unblocked") == []
    assert arguments("blocked", "blocked") == []


def test_what_was_freed_and_is_blocked_again() -> None:
    validator = Validator(InstanceMap.grid(2, 1))
    validator.request("a", "bring(1,2)")
    validator.message("info", "unblocked(c(1),c(2))")
    validator.settle()
    validator.message("info", "blocked(c(1),c(2))")
    validator.settle()
    assert validator.believed() == {frozenset(("c(1)", "c(2)"))}
    validator.action("mailbot", "go(c(2))")
    assert "blocked" in validator.violations[-1]


def test_what_was_freed_may_fail_once_more() -> None:
    """In the step in which it was said to be free, a move that fails says nothing else."""
    validator = Validator(InstanceMap.grid(2, 1), immediate=True)
    validator.request("a", "bring(1,2)")
    validator.status("a", "accepted", "1")
    validator.message("info", "unblocked(c(1),c(2))")
    for number in range(3):
        validator.action("mailbot", "go(c(2))")
        assert len(validator.violations) == (number == 2)
        validator.message("mailbot", "failure")
        assert validator.believed() == {frozenset(("c(1)", "c(2)"))}


def test_a_move_may_fail_in_the_step_in_which_its_way_is_freed() -> None:
    """Although another robot answers between the announcement and the failure."""
    graph = InstanceMap.grid(2, 1)
    graph.starts = {"one": "c(1)", "other": "c(1)"}
    validator = Validator(graph)
    validator.request("a", "bring(1,2)")
    for robot, place in (("one", "c(2)"), ("other", "1")):
        validator.action(robot, f"go({place})")
    validator.message("info", "unblocked(c(1),c(2))")
    validator.message("other", "success")
    validator.message("one", "failure")
    validator.action("one", "go(c(2))")
    assert validator.violations == []
    validator.message("one", "failure")
    validator.action("one", "go(c(2))")
    assert "blocked" in validator.violations[-1]


def test_two_robots_may_not_pick_up_the_same_package() -> None:
    graph = InstanceMap.read(OFFICE)
    graph.starts = {"one": "o1", "other": "o1"}
    validator = Validator(graph)
    validator.request("goal", "bring(o1,o2)")
    validator.status("goal", "accepted", "1")
    validator.action("one", "pickup(1)")
    assert validator.violations == []
    validator.action("other", "pickup(1)")
    assert validator.violations == ["other is to do pickup(1): one and other do that already"]


def test_what_a_request_may_say_of_its_time() -> None:
    graph = InstanceMap.read(OFFICE)
    for timed in (False, True):
        graph.durations = {"pickup": 5} if timed else {}
        validator = Validator(graph)
        for text in ("bring(o1,o2,by(30))", "bring(o1,o2,urgent)"):
            validator.request(text, text)
            validator.status(text, "rejected")
        validator.request("wrong", "bring(o1,o2,by(0))")
        validator.status("wrong", "rejected")
        assert len(validator.violations) == (2 if timed else 0)


def test_lengths_are_read_and_written(tmp_path: Path) -> None:
    graph = InstanceMap.read(INSTANCES / "graph_hall.lp")
    assert graph.distances("a") == {"a": 0, "hall": 5, "b": 13, "c": 8, "d": 17}
    assert graph.seconds("a", "go(hall)") == 5
    assert graph.seconds("a", "deliver(1)") == 4
    written = tmp_path / "hall.lp"
    written.write_text(graph.facts())
    assert InstanceMap.read(written) == graph
