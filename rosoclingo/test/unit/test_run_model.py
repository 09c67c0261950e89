"""The state of a run, folded from its journal."""

from __future__ import annotations

from typing import List, Tuple

import pytest
from journals import Journal

from rosoclingo.bags.run_model import RunModel
from rosoclingo.loop.journal import Status


def fold(journal: Journal, most: int = 1000) -> RunModel:
    run = RunModel(most)
    for entry in journal.entries:
        run.apply(entry)
    return run


def ends(run: RunModel) -> List[Tuple[str, bool, str]]:
    return [(action.name, action.ended is not None, action.answer) for action in run.actions]


def test_each_try_of_an_action_is_one() -> None:
    journal = Journal().action("r", "go").add("retry", "r", "go", ("1", "timeout"))
    assert not fold(journal).is_acting
    run = fold(journal.action("r", "go").message("r", "success"))
    assert ends(run) == [("go", True, "timeout"), ("go", True, "success")]


def test_an_action_that_was_answered_wrongly_goes_on() -> None:
    journal = Journal().action("r( 1 )", "go").message("r(1)", "yes")
    run = fold(journal.dropped("id r(1), value yes: unknown").message("r(1)", "success"))
    assert ends(run) == [("go", True, "success")]
    assert [message.dropped for message in run.messages] == ["id r(1), value yes: unknown", None]


def test_an_answer_that_is_dropped_late_ends_no_other_action() -> None:
    journal = Journal().action("r", "go").message("r", "yes").action("r", "stay")
    run = fold(journal.dropped("id r, value yes: unknown"))
    assert ends(run) == [("go", True, ""), ("stay", False, "")]


def test_a_message_may_be_dropped_when_the_planner_was_told() -> None:
    """If the program has no answer set with it."""
    journal = Journal().message("info", "a").message("info", "b").command("assign_messages(1)")
    run = fold(journal.dropped("id info, value a: no answer set").message("info", "a"))
    dropped = [message.dropped for message in run.messages]
    assert dropped == ["id info, value a: no answer set", "", None]


def test_of_equal_messages_the_last_one_is_dropped_first() -> None:
    journal = Journal().action("r", "go").message("r", "yes").message("r", "yes")
    run = fold(journal.dropped("id r, value yes: it has answered"))
    assert ends(run) == [("go", True, "yes")]
    run = fold(journal.dropped("id r, value yes: unknown"))
    assert ends(run) == [("go", False, "")]


def test_a_reason_may_be_long() -> None:
    run = fold(Journal().message("r", "x").dropped(f"id r, value x: {':' * 10**6}"))
    assert run.messages[0].dropped
    run = fold(Journal().message("r", "x").dropped(":" * 10**6))
    assert [message.source for message in run.messages] == ["r", ""]


def test_only_the_last_messages_and_actions_are_kept() -> None:
    journal = Journal()
    for number in range(5):
        journal.action("r", f"go({number})").message("r", f"no({number})")
    run = fold(journal.dropped("id r, value no(0): unknown"), most=3)
    assert [action.name for action in run.actions] == ["go(2)", "go(3)", "go(4)"]
    assert [message.value for message in run.messages] == ["no(3)", "no(4)", ""]
    for value in ("no(4)", "no(3)"):
        run = fold(journal.dropped(f"id r, value {value}: unknown"), most=3)
        assert not fold(journal, most=1).messages[0].source
    assert run.is_acting


@pytest.mark.parametrize("later", ["accepted", "succeeded", "pending"])
def test_the_first_end_of_a_goal_counts(later: str) -> None:
    journal = (
        Journal().goal("g", "x").status("g", "accepted", "1").status("g", "aborted", "1", "no")
    )
    goal = fold(journal.status("g", later, "2", "why")).goals["g"]
    assert (goal.status, goal.slot, goal.reason, goal.ended) == (Status.ABORTED, "1", "no", 3)


def test_a_goal_that_is_forgotten_is_another_one_then() -> None:
    run = fold(Journal().goal("g", "x").status("g", "rejected", "", "no"))
    run.forget("g")
    run.forget("g")
    run.apply(Journal().goal("g", "y").entries[0])
    assert [(goal.number, goal.request, goal.ended) for goal in run.goals.values()] == [
        (2, "y", None)
    ]


def test_a_run_that_goes_on_has_not_ended() -> None:
    journal = Journal().add("end", text="no plan")
    assert fold(journal).end == "no plan"
    assert fold(journal.add("resumed", "rosoclingo")).end is None


def test_plans_by_their_steps_after_resets() -> None:
    journal = Journal().plan("do(r,a,1)", "do(r,b,3)", "do(s,c,4)", "other(4)")
    journal.command("reset(1)").command("reset(1)")
    assert fold(journal).plan.steps() == {1: {"r: b"}, 2: {"s: c"}}
    run = fold(journal.plan("do(r,d,1)").command("reset(2)"))
    assert run.plan_before.steps(2) == {2: {"s: c"}}
    assert run.plan.steps() == {}
