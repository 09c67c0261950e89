"""The journal's events as they are on the wire."""

from __future__ import annotations

from typing import Set, Tuple, Type

import pytest

from rosclingo.wire.commands import Result
from rosoclingo.loop.journal import (
    ActionPublished,
    ActionRetried,
    ActionTook,
    ActionWithdrawn,
    AnswerArrived,
    BeliefsChanged,
    CancelArrived,
    ClockRead,
    CommandDone,
    Control,
    ControlArrived,
    Ended,
    Event,
    Explained,
    Fields,
    GoalArrived,
    LoopEnded,
    LoopWaits,
    MessageArrived,
    MessageDropped,
    NodeResumed,
    PlanFound,
    Reason,
    SearchEnded,
    Status,
    StatusSet,
    Unknown,
    decode,
    encode,
    from_text,
    naming,
)
from rosoclingo.loop.quality import Quality

EVENTS = [
    (GoalArrived("g", "visit(1)", ("a", "b"), 0.5),
     Fields("goal", "g", "visit(1)", ("a", "b"), 0.5)),
    (CancelArrived("g", 0.5), Fields("cancel", "g", "", (), 0.5)),
    (MessageArrived("r", "success", 0.5), Fields("message", "r", "success", (), 0.5)),
    (MessageArrived("r", "success", sender="/n"),
     Fields("message", "r", "success", ("/n",), 0.0)),
    (ControlArrived(Control.HOLD, "r", 0.5), Fields("control", "r", "hold", (), 0.5)),
    (ControlArrived(Control.PAUSE), Fields("control", "", "pause", (), 0.0)),
    (ControlArrived(Control.REJECT, "r", 0.0, "go(3)", 7, "it has begun"),
     Fields("control", "r", "reject", ("go(3)", "7", "it has begun"), 0.0)),
    (ActionWithdrawn("r", "go(3)"), Fields("withdrawn", "r", "go(3)")),
    (ActionRetried("r", "go(3)", 2, "failure"),
     Fields("retry", "r", "go(3)", ("2", "failure"), 0.0)),
    (AnswerArrived("run", 3, "success", "/n"),
     Fields("answer", "run", "success", ("3", "/n"), 0.0)),
    (MessageDropped("id r, value x: unknown"),
     Fields("dropped", "", "id r, value x: unknown", (), 0.0)),
    (CommandDone("solve", Result.SAT, 0.5), Fields("command", "sat", "solve", (), 0.5)),
    (CommandDone("idle", None, 0.5), Fields("command", "", "idle", (), 0.5)),
    (PlanFound(("do(r,a,1)",)), Fields("plan", "", "", ("do(r,a,1)",), 0.0)),
    (PlanFound((), is_best=False), Fields("plan", "", "the best so far", (), 0.0)),
    (PlanFound((), False, Quality((1, -2), (1, -3))),
     Fields("plan", "1 -2/1 -3", "the best so far", (), 0.0)),
    (PlanFound((), False, Quality((7,))), Fields("plan", "7/", "the best so far", (), 0.0)),
    (BeliefsChanged(("belief(1,2,c)",)), Fields("belief", "", "", ("belief(1,2,c)",), 0.0)),
    (SearchEnded(Ended.CUT, ("do(r,a,1)", "b"), Quality((2,), (2,)), 1),
     Fields("search", "2/2", "the best so far", ("1", "do(r,a,1)", "b"), 0.0)),
    (SearchEnded(Ended.FINISHED, ("b",)),
     Fields("search", "", "finished", ("0", "b"), 0.0)),
    (SearchEnded(Ended.NOTHING), Fields("search", "", "nothing", ("0",), 0.0)),
    (ActionPublished("r", "go(1)"), Fields("action", "r", "go(1)", (), 0.0)),
    (StatusSet("g", Status.ACCEPTED, "1"), Fields("status", "g", "accepted", ("1",), 0.0)),
    (StatusSet("g", Status.SUCCEEDED, "1", "as planned"),
     Fields("status", "g", "succeeded", ("1", "as planned"), 0.0)),
    (StatusSet("g", Status.REJECTED), Fields("status", "g", "rejected", ("", ""), 0.0)),
    (StatusSet("g", Status.CANCELED, "", Reason.RECALLED),
     Fields("status", "g", "canceled", ("", "recalled before it had a slot"), 0.0)),
    (StatusSet("g", Status.ABORTED, "1", Reason.SHUTDOWN),
     Fields("status", "g", "aborted", ("1", "the node is shutting down"), 0.0)),
    (LoopWaits(), Fields("waiting", "", "", (), 0.0)),
    (LoopWaits(for_a_replay=True), Fields("waiting", "", "for the replay", (), 0.0)),
    (ActionTook("robot", "go(a,b)", 3, 12.5), Fields("took", "robot", "go(a,b)", ("3",), 12.5)),
    (ClockRead(7, 12.5), Fields("clock", "7", "", (), 12.5)),
    (Explained("goal visit(2)", "It ends.", '{"ends": 3}', 0.5),
     Fields("why", "goal visit(2)", "It ends.", ('{"ends": 3}',), 0.5)),
    (NodeResumed("planner", "it is gone", 0.5),
     Fields("resumed", "planner", "it is gone", (), 0.5)),
    (LoopEnded("no plan"), Fields("end", "", "no plan", (), 0.0)),
    (LoopEnded("gone", from_outside=True), Fields("end", "from outside", "gone", (), 0.0)),
    (LoopEnded(Reason.SHUTDOWN), Fields("end", "", "the node is shutting down", (), 0.0)),
    (Unknown(Fields("pause", "x")), Fields("pause", "x", "", (), 0.0)),
]  # fmt: skip


@pytest.mark.parametrize(("event", "fields"), EVENTS, ids=[repr(event) for event, _ in EVENTS])
def test_there_and_back(event: Event, fields: Fields) -> None:
    assert encode(event) == fields
    assert decode(fields) == event
    assert {type(text) for text in (*encode(event)[:3], *encode(event).details)} == {str}


def test_every_kind_is_among_them() -> None:
    kinds: Set[Type[Event]] = {type(event) for event, _ in EVENTS}
    assert kinds == set(Event.__subclasses__())


@pytest.mark.parametrize("reason", Reason)
def test_reasons_by_which_readers_go_are_told_from_words(reason: Reason) -> None:
    for event in (LoopEnded(str(reason)), StatusSet("g", Status.ABORTED, "", f"{reason}")):
        again = decode(encode(event))
        assert isinstance(again, (LoopEnded, StatusSet))
        assert again.reason is reason
    assert Reason.of(f"{reason}, or not") == f"{reason}, or not"


@pytest.mark.parametrize(
    "fields",
    [
        Fields("Goal", "g", "visit(1)"),
        Fields("", "", "", ("",), 1.0),
        Fields("status", "g", "paused", ("1", "soon")),
        Fields("command", "perhaps", "solve"),
    ],
)
def test_what_is_unknown_is_kept_as_it_is(fields: Fields) -> None:
    assert decode(fields) == Unknown(fields)
    assert encode(decode(fields)) == fields


@pytest.mark.parametrize(
    ("details", "slot", "reason"),
    [((), "", ""), (("1",), "1", ""), (("1", "why", "more"), "1", "why")],
)
def test_what_a_status_lacks_is_empty(details: Tuple[str, ...], slot: str, reason: str) -> None:
    status = decode(Fields("status", "g", "aborted", details))
    assert status == StatusSet("g", Status.ABORTED, slot, reason)


@pytest.mark.parametrize("seconds", ["9" * 400, '"late"', "[" * 9999, "null"])
def test_a_text_that_is_no_event(seconds: str) -> None:
    with pytest.raises((TypeError, ValueError)):
        from_text(f'["goal", "g", "", [], {seconds}]')


def test_an_event_with_more_numbers_is_unknown() -> None:
    fields = Fields("search", "", Ended.FINISHED.value, (" ".join(map(str, range(30))),))
    assert decode(fields) == Unknown(fields)


def test_commands() -> None:
    searches = ["solve", "plan(7)", "solve(x)"]
    others = ["idle", "publish", "ground(solve)", "planning", ""]
    assert all(CommandDone(command).is_search for command in searches)
    assert not any(CommandDone(command).is_search for command in others)
    assert [c for c in searches + others if CommandDone(c).publishes] == ["publish"]
    assert [c for c in [*searches, *others] if CommandDone(c).waits] == ["idle"]
    resets = {
        "reset(4)": 4,
        "forget(4)": 4,
        "reset(x)": None,
        "reset": None,
        "rest(4)": None,
        "solve(4)": None,
    }
    assert {command: CommandDone(command).resets_to for command in resets} == resets


def test_a_reason_names_its_message() -> None:
    assert naming("info", "open(5)") == "id info, value open(5): "
    assert len(naming("a" * 5000, "b")) < 300
