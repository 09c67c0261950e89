"""A journal on the map: what the validator of mailbots finds wrong in it."""

from __future__ import annotations

from pathlib import Path
from typing import List

import pytest

from journal_validator import JournalValidator
from rosoclingo.loop.journal import (
    ActionPublished,
    GoalArrived,
    MessageArrived,
    PlanFound,
    Status,
    StatusSet,
)
from rosoclingo_aspprograms.validator import Map

REPOSITORY = Path(__file__).resolve().parents[3]
OFFICE = REPOSITORY / "rosoclingo_aspprograms" / "mailbot" / "instances" / "graph_wg.lp"
DELIVERY = ("go(o1)", "pickup(1)", "go(c1)", "go(o3)", "deliver(1)")


class Delivery:
    """A journal of two robots, of which the first has one package to deliver."""

    def __init__(self) -> None:
        graph = Map.read(OFFICE)
        graph.starts = {"mailbot": "c1", "mailbot2": "c5"}
        graph.durations = {"pickup": 1}  # so that it is planned in seconds
        self.journal = JournalValidator(graph)
        self.journal.learns(GoalArrived("goal", "bring(o1,o3)"))
        self.journal.learns(StatusSet("goal", Status.ACCEPTED, "1"))

    def act(self, action: str, answer: str = "success") -> None:
        self.journal.learns(ActionPublished("mailbot", action))
        self.journal.learns(MessageArrived("mailbot", answer))

    def deliver(self) -> None:
        for action in DELIVERY:
            self.act(action)
        self.journal.learns(StatusSet("goal", Status.SUCCEEDED, "1"))

    def wrong(self) -> List[str]:
        return self.journal.validator.finish()


def test_a_delivery() -> None:
    told = Delivery()
    told.deliver()
    assert told.wrong() == []


def test_success_without_a_delivery() -> None:
    told = Delivery()
    for action in DELIVERY[:-1]:
        told.act(action)
    told.journal.learns(StatusSet("goal", Status.SUCCEEDED, "1"))
    assert any("its package is on a robot" in text for text in told.wrong())


def test_a_way_that_is_not_there() -> None:
    told = Delivery()
    told.act("go(o1)", "failure")
    told.act("go(o13)")
    wrong = "\n".join(told.wrong())
    for text in ("not connected", "has not ended"):
        assert text in wrong


def test_a_pickup_before_the_request_is_accepted() -> None:
    """It is accepted only when the step ends, be it that its slot had another one before."""
    told = Delivery()
    told.deliver()
    for goal, request in (
        ("up", "bring(o3,o2)"),
        ("down", "bring(o3,o1)"),
        ("far", "bring(o1,o3)"),
    ):
        told.journal.learns(GoalArrived(goal, request, (goal,)))
    plan = ["pickup(2)", "go(c1)", "go(o1)", "deliver(2)"]
    actions = [f"do(mailbot,{action},{step})" for step, action in enumerate(plan, 6)]
    told.journal.learns(PlanFound(("do(mailbot2,go(o9),6)", *actions)))
    told.act("pickup(2)")
    for slot, goal in (("1", "up"), ("2", "down"), ("3", "far")):
        told.journal.learns(StatusSet(goal, Status.ACCEPTED, slot))
    for action in plan[1:]:
        told.act(action)
    told.journal.learns(StatusSet("down", Status.SUCCEEDED, "2"))
    wrong = told.wrong()
    assert len(wrong) == 2
    assert all("has not ended" in text for text in wrong)


@pytest.mark.parametrize("asked", ["bring(o1,o3)", "bring(o2,o3)", ""])
def test_a_pickup_of_what_was_not_asked_for(asked: str) -> None:
    told = Delivery()
    told.act("go(o1)")
    told.act("pickup(1)", "failure")
    if asked:
        told.journal.learns(GoalArrived("other", asked, ("other",)))
        told.journal.learns(StatusSet("other", Status.CANCELED))
    told.act("pickup(2)")
    assert "mailbot is to do pickup(2): no goal is in this slot" in told.wrong()
