from __future__ import annotations

from typing import List, Tuple

import pytest
from journals import Journal, long_journal

from rosoclingo.bags.model import Recording
from rosoclingo.bags.report.run import Statistics
from rosoclingo.bags.report.statistics import compute
from rosoclingo.loop.values.plan_times import PlanTimes


def kinds(run: Statistics) -> List[List[Tuple[str, str]]]:
    return [[(cause.kind, cause.text) for cause in change.causes] for change in run.changes]


# Goals.


def test_a_goal_from_its_arrival_to_its_end() -> None:
    journal = Journal().goal("g", "bring(1,3)", "a box").plan("do(r,go(1),1)")
    journal.status("g", "accepted", "1").move(1).action("r", "go(1)").move(2).message(
        "r", "success"
    )
    (goal,) = journal.status("g", "succeeded", "1", "as planned").compute().goals
    assert (goal.id, goal.request, goal.information) == ("g", "bring(1,3)", ("a box",))
    assert (goal.came, goal.accepted, goal.ended) == (1, 4, 7)
    assert (goal.outcome, goal.reason, goal.slot) == ("succeeded", "as planned", "1")
    assert (goal.behind, goal.cancels, goal.steps) == ("", None, 2)


def test_a_goal_that_has_not_ended_is_open() -> None:
    (goal,) = Journal().goal("g", "a").status("g", "accepted", "1").compute().goals
    assert (goal.outcome, goal.ended) == ("open", None)


def test_a_goal_whose_slot_was_taken_was_queued_behind_another() -> None:
    journal = Journal().goal("a", "first").status("a", "accepted", "1").goal("b", "second")
    journal.status("a", "succeeded", "1").status("b", "accepted", "1").goal("c", "third")
    first, second, third = journal.status("c", "accepted", "2").compute().goals
    assert [first.behind, second.behind, third.behind] == ["", "first", ""]


def test_a_goal_in_a_slot_that_was_free_when_it_came_was_not_queued() -> None:
    journal = Journal().goal("a", "first").status("a", "accepted", "1")
    journal.status("a", "succeeded", "1").goal("b", "second").status("b", "accepted", "1")
    assert journal.compute().goals[1].behind == ""


def test_a_rejected_goal() -> None:
    (goal,) = Journal().goal("g", "x").status("g", "rejected", "", "unknown").compute().goals
    assert (goal.outcome, goal.reason, goal.accepted) == ("rejected", "unknown", None)


@pytest.mark.parametrize("first", ["goal", "status"])
def test_a_goal_that_is_cancelled_without_a_slot_is_recalled(first: str) -> None:
    # The status may be told before the loop has taken the goal.
    journal = Journal()
    if first == "goal":
        journal.goal("g", "x")
    journal.status("g", "canceled", "", "recalled before it had a slot")
    if first == "status":
        journal.goal("g", "x")
    (goal,) = journal.add("cancel", "g").compute().goals
    assert (goal.request, goal.outcome, goal.cancels) == ("x", "recalled", 3)


def test_a_goal_that_is_cancelled_in_its_slot_is_canceled() -> None:
    journal = Journal().goal("g", "x").status("g", "accepted", "1").add("cancel", "g")
    (goal,) = journal.status("g", "canceled", "1").compute().goals
    assert (goal.outcome, goal.cancels, goal.ended) == ("canceled", 3, 4)


# Actions and messages.


def test_an_action_ends_with_the_next_message_of_its_actuator() -> None:
    journal = Journal().move(1).action("r(1)", "go(a)").message("info", "x")
    run = journal.message("r( 1 )", "failure").message("r(1)", "success").compute()
    (action,) = run.actions
    assert (action.began, action.ended, action.answer, action.step) == (1, 3, "failure", 1)
    assert [(message.id, message.value) for message in run.messages] == [
        ("info", "x"),
        ("r(1)", "success"),
    ]
    assert run.received == 3


def test_an_action_without_an_answer_ends_with_the_next_one() -> None:
    first, second = Journal().action("r", "a").action("r", "b").compute().actions
    assert (first.ended, first.answer) == (2, "")
    assert (second.ended, second.answer) == (None, "")


def test_a_dropped_message_is_told_with_its_reason() -> None:
    reason = "id nobody, value x(1): the planner's encoding declares no such event"
    run = Journal().message("nobody", "x( 1 )").message("b", "y").dropped(reason).compute()
    assert [(message.id, message.dropped) for message in run.messages] == [
        ("nobody", reason),
        ("b", ""),
    ]


def test_a_message_that_is_no_term_is_found_by_its_text() -> None:
    run = Journal().message("r", "x(").dropped("'x(' is not a ground term: ...").compute()
    assert [(m.id, m.value, bool(m.dropped)) for m in run.messages] == [("r", "x(", True)]


def test_a_dropped_answer_leaves_its_action_without_one() -> None:
    journal = Journal().action("r", "a").message("r", "sucess")
    run = journal.dropped("id r, value sucess: there is no such event").compute()
    assert [(action.answer, action.ended) for action in run.actions] == [("", None)]
    assert [message.value for message in run.messages] == ["sucess"]


def test_a_drop_whose_message_was_not_recorded_is_told() -> None:
    (message,) = Journal().dropped("id a, value b: why").compute().messages
    assert (message.id, message.dropped) == ("", "id a, value b: why")


# Steps and searches.


def test_steps_have_their_searches_and_times() -> None:
    journal = Journal().search("unsat").search("unknown", 1.5).move(1, 7).command("idle", "", 60.0)
    run = journal.command("ground(8)").search("sat").compute()
    first, second = run.steps
    assert (first.number, first.searches, first.interrupted, first.solving) == (0, 2, 1, 2.0)
    assert (second.number, second.horizon, second.searches, second.other) == (1, 7, 1, 0.25)
    assert [search.result for search in run.searches] == ["unsat", "unknown", "sat"]


def test_a_reset_renumbers_the_step() -> None:
    journal = Journal().command("x").move(4, 9).command("x").move(0).command("reset(4)")
    run = journal.move(1, 3).command("x").compute()
    assert [(step.number, step.horizon) for step in run.steps] == [(0, 0), (0, 9), (1, 3)]


def test_the_end_of_the_loop() -> None:
    run = Journal().command("exit").add("end", text="no plan").compute()
    assert (run.began, run.ended, run.end) == (1, 2, "no plan")


def test_an_empty_journal() -> None:
    run = Journal().compute()
    assert (run.began, run.ended, run.goals, run.steps) == (0, 0, (), ())


# Changes of the plan.


def test_the_first_plan_and_one_that_goes_on_alike() -> None:
    journal = Journal().plan("do(r,a,1)", "do(r,b,2)").move(2).action("r", "b")
    run = journal.message("r", "success").plan("do(r,b,2)").compute()
    assert run.plans == 2
    (change,) = run.changes
    assert (change.old, change.new, change.first, change.after) == (0, 2, 1, ("r: a",))
    assert kinds(run) == [[("start", "")]]


def test_a_failure_changes_the_plan() -> None:
    journal = Journal().plan("do(r(1,2),go(a,b),1)", "do(r(1,2),c,2)").move(1)
    journal.action("r(1,2)", "go(a,b)").message("r(1,2)", "failure")
    run = journal.plan("do(r(1,2),go(a,b),1)", "do(r(1,2),d,2)", "do(r(1,2),c,3)").compute()
    change = run.changes[1]
    assert kinds(run)[1] == [("failure", "r(1,2): go(a,b)")]
    assert (change.step, change.old, change.new, change.first) == (1, 2, 3, 2)
    assert (change.before, change.after) == (("r(1,2): c",), ("r(1,2): d",))


@pytest.mark.parametrize(
    ("value", "cause"),
    [
        ("success", ("success", "r: a")),
        ("blocked(x)", ("answer", "r: a answered blocked(x)")),
    ],
)
def test_an_answer_changes_the_plan(value: str, cause: Tuple[str, str]) -> None:
    journal = Journal().plan("do(r,a,1)").action("r", "a").message("r", value)
    assert kinds(journal.plan("do(r,b,2)").compute())[1] == [cause]


def test_an_announcement_and_a_goal_come_before_routine() -> None:
    journal = Journal().plan("do(r,a,1)").action("r", "a").goal("g", "x").message("info", "y")
    journal.message("r", "success").plan("do(r,b,2)")
    run = journal.status("g", "accepted", "1").compute()
    assert kinds(run)[1] == [("goal", "x"), ("message", "info: y")]


def test_what_came_while_a_search_was_interrupted_belongs_to_the_next_plan() -> None:
    journal = Journal().plan("do(r,a,1)").message("info", "y").search("unknown")
    run = journal.message("info", "z").plan("do(r,b,1)").compute()
    assert kinds(run)[1] == [("message", "info: y"), ("message", "info: z")]
    assert run.plans == 2


def test_a_queued_goal_changes_the_plan_when_it_gets_its_slot() -> None:
    journal = Journal().goal("a", "first").plan("do(r,a,1)").status("a", "accepted", "1")
    journal.goal("b", "second").action("r", "a").message("r", "failure").plan("do(r,c,2)")
    journal.status("a", "aborted", "1").plan("do(r,d,3)").status("b", "accepted", "1")
    assert kinds(journal.compute()) == [
        [("goal", "first")],
        [("failure", "r: a")],
        [("queued", "second")],
    ]


def test_a_queued_goal_is_accepted_after_further_plans() -> None:
    """Its plan is the first one after it got the slot; a better one may have been found since."""
    journal = Journal().goal("a", "first").command("assign_messages(1)").plan("do(r,a,1)")
    journal.status("a", "accepted", "1").goal("b", "second").move(1).status("a", "aborted", "1")
    journal.command("assign_messages(1)").message("info", "x").plan("do(r,c,1)")  # still of first
    journal.move(2).command("assign_messages(2)").plan("do(r,d,2)").plan("do(r,e,2)")
    journal.message("r", "failure").command("assign_messages(2)").plan("do(r,f,2)")
    assert kinds(journal.status("b", "accepted", "1").compute()) == [
        [("goal", "first")],
        [("message", "info: x")],
        [("queued", "second")],
        [("none", "")],
        [("message", "r: failure")],
    ]


def test_a_slot_becomes_free_with_the_next_step() -> None:
    journal = Journal().goal("a", "first").command("assign_messages(1)").plan("do(r,a,1)")
    journal.status("a", "accepted", "1").move(1).status("a", "succeeded", "1").goal("b", "second")
    journal.command("assign_messages(1)").message("info", "x").plan("do(r,c,1)").move(2)
    journal.command("assign_messages(2)").plan("do(r,d,2)").plan("do(r,e,2)")
    assert kinds(journal.status("b", "accepted", "1").compute()) == [
        [("goal", "first")],
        [("message", "info: x")],
        [("goal", "second")],
        [("none", "")],
    ]


def test_a_cancel_request_changes_the_plan_but_not_that_of_a_recalled_goal() -> None:
    journal = Journal().goal("a", "first").plan("do(r,a,1)").status("a", "accepted", "1")
    journal.goal("b", "second").status("b", "canceled").add("cancel", "b").add("cancel", "a")
    assert kinds(journal.plan("do(r,c,2)").compute())[1] == [("cancel", "first")]


def test_rejected_goals_and_dropped_messages_change_no_plan() -> None:
    journal = Journal().plan("do(r,a,1)").goal("g", "x").status("g", "rejected")
    journal.message("a", "b").dropped("id a, value b: why").plan("do(r,c,2)")
    assert kinds(journal.compute())[1] == [("none", "")]


def test_a_reset_alone_changes_no_plan() -> None:
    journal = Journal().move(4).plan("do(r,a,4)", "do(r,b,5)", "do(r,c,6)").move(0)
    journal.command("reset(4)")
    assert len(journal.plan("do(r,b,1)", "do(r,c,2)").compute().changes) == 1


def test_a_text_with_a_comma_is_one_actuator() -> None:
    run = Journal().plan(r'do("a,\"(",b,1)').compute()
    assert run.changes[0].after == (r'"a,\"(": b',)


def test_a_long_journal_is_computed_as_one_would_count() -> None:
    run = long_journal(200).compute()
    assert len(run.actions) == 400
    assert len(run.goals) == 20
    assert len(run.searches) == 300
    assert {goal.outcome for goal in run.goals} == {"succeeded"}
    assert {goal.steps for goal in run.goals} == {9}
    assert run.plans == len(run.changes) == 200


# Restarts.


def test_nodes_that_go_on() -> None:
    journal = (
        Journal().action("r", "go(1)").add("waiting").add("resumed", "rosoclingo", seconds=0.5)
    )
    journal.move(1).add("resumed", "planner", "it is gone", seconds=2.0).message("r", "success")
    run = journal.compute()
    first, second = run.restarts
    assert (first.node, first.seconds, first.last, first.duration) == ("rosoclingo", 3, 2, 0.5)
    assert (second.node, second.reason, second.step) == ("planner", "it is gone", 1)
    (action,) = run.actions
    assert (action.began, action.ended, action.answer) == (1, 5, "success")


def test_a_journal_may_begin_with_a_restart() -> None:
    (restart,) = Journal().add("resumed", "rosoclingo").compute().restarts
    assert restart.last == restart.seconds


@pytest.mark.parametrize(("answer", "count"), [("success", 1), ("failure", 2)])
def test_a_plan_that_is_timed_anew_after_a_success_is_no_change(answer: str, count: int) -> None:
    """One robot is late, and so is the other one, who waits for it."""
    journal = Journal().goal("g", "a").plan("do(r,go,1)", "do(s,stay,1)", "do(s,put,2)")
    journal.move(1).action("r", "go").action("s", "stay").message("r", answer)
    run = journal.plan("do(r,go,1)", "do(s,stay,1)", "do(s,stay,2)", "do(s,put,3)").compute()
    assert len(run.changes) == count


@pytest.mark.parametrize(("last", "count"), [((), 1), (("do(s,take,3)",), 2)])
def test_a_plan_that_is_not_shown_to_its_end_is_no_change(
    last: Tuple[str, ...], count: int
) -> None:
    """What the other robot fetches becomes ready by itself, some time after the success."""
    journal = Journal().goal("g", "a").plan("do(r,cook,1)", "do(s,stay,1)", "do(s,fetch,2)")
    journal.move(1).action("r", "cook").action("s", "stay").message("r", "success")
    assert len(journal.plan("do(r,cook,1)", "do(s,stay,1)", *last).compute().changes) == count


# Times.


def test_deadlines_and_the_plan_that_stands() -> None:
    """The second goal gets the slot of the first one; ROS's time goes twice as fast."""
    journal = Journal().goal("a", "first").status("a", "accepted", "1").goal("b", "second")
    journal.action("r", "go(1)").message("r", "success").status("a", "succeeded", "1")
    journal.status("b", "accepted", "1").action("r", "go(2)")
    said = [
        (2.5, "now(100)", "due(1,105)", "expected(1,106)"),
        (7.5, "now(110)", "due(1,114)", "expected(1,118)", "timed(do(r,go(1),1),102,110)",
         "timed(do(r,go(2),1),110,112)", "timed(do(r,give,2),112,118)"),
    ]  # fmt: skip
    plan_times = tuple((seconds, PlanTimes.read(terms)) for seconds, *terms in said)
    run = compute(Recording("/rosoclingo", tuple(journal.entries), plan_times=plan_times))
    first, second = run.goals
    assert (first.due, first.expected, first.late) == (5.0, None, 1.0)
    assert (second.due, second.expected, second.late) == (9.5, 11.5, 2.0)
    planned = [(one.name, one.began, one.ended, one.answer) for one in run.planned]
    assert planned == [("go(2)", 8.0, 8.5, "planned"), ("give", 8.5, 11.5, "planned")]
    assert (run.ended, run.until) == (8.0, 11.5)


def test_no_plan_stands_when_the_loop_has_ended() -> None:
    journal = Journal().goal("a", "first").status("a", "accepted", "1").add("end", "", "enough")
    times = PlanTimes.read(["now(1)", "timed(do(r,give,2),2,9)"])
    run = compute(Recording("/rosoclingo", tuple(journal.entries), plan_times=((2.5, times),)))
    assert (run.planned, run.until) == ((), 3.0)
