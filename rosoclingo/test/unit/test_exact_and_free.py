"""When inputs are sent: exactly as recorded, or by cause, whatever the replayed run does."""

from __future__ import annotations

from typing import Any, List, Optional, Sequence, Union

import pytest
from replay_maker import ASK, END, RUN, Made, drive, records, run, run_of, status

from rosoclingo.bags.compare.comparison import compare
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.inputs import LoopActivity, RecordedInput, inputs
from rosoclingo.bags.replay.progress import ReplayProgress
from rosoclingo.bags.replay.replays import ExactReplay, FreeReplay
from rosoclingo.loop.journal import (
    CancelArrived,
    GoalArrived,
    LoopEnded,
    LoopWaits,
    MessageArrived,
    Reason,
    Record,
    Status,
    StatusSet,
)


class Replay:
    """A replay with a clock, and what it has had sent; free from the beginning or exact."""

    def __init__(
        self,
        recorded: Run,
        rate: Optional[float] = None,
        is_exact: bool = False,
        kills: bool = False,
    ) -> None:
        self.exact = ExactReplay(recorded, rate=rate, kills=kills)
        self.progress = self.exact.progress
        self.replay: Union[ExactReplay, FreeReplay] = self.exact
        if not is_exact:
            self.replay = FreeReplay(self.progress)
        self.now = 100.0
        self.sent: List[str] = []

    def see(self, made: Sequence[Made]) -> None:
        self.see_records(*records(made))

    def see_records(self, *made: Record) -> None:
        for record in made:
            self.replay.see(record, self.now)

    def send(self) -> List[str]:
        """Sends all that is due, and returns it."""
        sent: List[str] = []
        while True:
            planned = self.replay.due(self.now)
            if planned is not None:
                sent.append(said(planned))
            elif isinstance(self.replay, ExactReplay) and not self.is_exact:
                self.replay = FreeReplay(self.progress)
            else:
                break
        self.sent += sent
        return sent

    @property
    def is_exact(self) -> bool:
        return self.replay.is_exact

    @property
    def finished(self) -> bool:
        return self.progress.is_finished(self.now)


def begun(recorded: Run, *sent: str, **how: Any) -> Replay:
    """A replay of a loop that waits for the first time, by when so much was sent."""
    replay = Replay(recorded, **how)
    replay.see(ASK[:1])
    assert replay.send() == list(sent)
    return replay


def said(planned: RecordedInput) -> str:
    event = planned.event
    if isinstance(event, MessageArrived):
        return f"{event.source} {event.value}"
    return f"{event.goal} {event.request}" if isinstance(event, GoalArrived) else event.goal


def test_a_run_that_is_the_same() -> None:
    replay = Replay(run(RUN))
    sent = []
    for event in RUN:
        if event[0] in ("goal", "message"):
            (one,) = replay.send()
            sent.append(one)
        else:
            assert replay.send() == [], event
        assert not replay.finished
        replay.see([event])
    assert sent == ["g visit(3)", "robot success", "robot success"]
    assert replay.finished
    assert replay.progress.stalls == []


def test_an_answer_comes_after_its_action_even_if_the_loop_does_not_wait() -> None:
    recorded = [made for made in RUN if made[0] != "waiting" or made[3] == 0] + END
    replay = begun(run(recorded), "g visit(3)")
    replay.see([*ASK[1:], *status("accepted", 1)])
    assert replay.send() == []
    replay.see(drive(2)[:1])
    assert replay.send() == ["robot success"]
    assert replay.send() == []


def test_what_came_while_the_loop_waited_is_sent_when_it_waits_again() -> None:
    second: List[Made] = [("goal", "h", "visit(1)", 1), ("command", "", "idle", 1)]
    recorded = ASK + drive(2)[:3] + second + drive(2)[2:] + END
    replay = begun(run(recorded), "g visit(3)")
    replay.see(ASK[1:] + drive(2)[:2])
    assert replay.send() == []  # the action is there, but the loop does not wait yet
    replay.see(drive(2)[2:3])
    assert replay.send() == ["h visit(1)"]
    assert replay.send() == []  # the loop has to take it, and to wait again
    replay.see(second)
    assert replay.send() == []
    replay.see(drive(2)[2:3])
    assert replay.send() == ["robot success"]


def test_what_was_taken_together_is_sent_together() -> None:
    both: List[Made] = [("message", "info", "a", 0), ("message", "info", "b", 0)]
    replay = Replay(run([ASK[0], *both, ASK[2], *END]))
    assert replay.send() == []
    replay.see(ASK[:1])
    assert replay.send() == ["info a", "info b"]


def test_what_interrupted_a_search_is_sent_when_it_has_begun() -> None:
    made = records([
        *ASK, ("command", "", "assign_messages(1)", 1), ("message", "info", "late", 1),
        ("command", "unknown", "solve", 1), *END,
    ])  # fmt: skip
    recorded = run_of(made)
    made[4] = Record(MessageArrived("info", "late", seconds=0.2), 1)
    late = run_of(made)
    assert [one.point for one in inputs(recorded)] == [LoopActivity.WAITING, LoopActivity.BUSY]
    assert [one.point for one in inputs(late)] == [LoopActivity.WAITING, LoopActivity.SEARCHING]
    replay = begun(late, "g visit(3)")
    replay.see(ASK[1:])
    assert replay.send() == []
    replay.see([("command", "", "assign_messages(1)", 1)])
    assert replay.send() == ["info late"]


RECALL = Record(StatusSet("h", Status.CANCELED, reason=Reason.RECALLED))
GOAL = Record(GoalArrived("h", "visit(1)"))
CANCEL = Record(CancelArrived("h"))


@pytest.mark.parametrize("is_taken", [True, False])
def test_a_goal_that_was_recalled(is_taken: bool) -> None:
    """Its status is noted before the cancel request, or both, which nevertheless are the cause."""
    before, after = ([GOAL], []) if is_taken else ([], [GOAL])
    rest = [Record(MessageArrived("info", "a")), CANCEL]
    made = [*records(ASK[:1]), *before, RECALL, *after, *rest]
    replay = begun(run_of(made, gap=0.1, has_journal=False), "h visit(1)")
    replay.now += 1.1  # lets it arrive, since what comes next takes another way
    assert replay.send() == ["h"]
    replay.now += 1.1
    assert replay.send() == []
    replay.see_records(RECALL)
    replay.now += 1.1
    assert replay.send() == ["info a"]


def test_a_recording_that_ends_with_a_recall_is_heard_to_its_cancel_request() -> None:
    replay = begun(run_of([*records(ASK[:1]), GOAL, RECALL, CANCEL]), "h visit(1)", is_exact=True)
    replay.now += 1.1
    assert replay.send() == ["h"]
    for record in (RECALL, GOAL, CANCEL):
        assert not replay.finished
        replay.see_records(record)
    assert replay.finished


def test_a_recording_that_ends_after_a_rejection_is_heard_to_that() -> None:
    """The loop takes the message before it looks at the goal, maybe other than when recorded."""
    rejected = Record(StatusSet("h", Status.REJECTED, reason="unknown"))
    message = Record(MessageArrived("info", "a"))
    replay = begun(
        run_of([*records(ASK[:1]), GOAL, rejected, message]), "h visit(1)", "info a", is_exact=True
    )
    for record in (GOAL, message, rejected):
        assert not replay.finished
        replay.see_records(record)
    assert replay.finished


def test_a_goal_that_is_refused_while_the_loop_begins_to_wait() -> None:
    """The thread that takes goals notes it and its status, and the loop its wait in between."""
    goal = Record(GoalArrived("h", "visit("))
    rejected = Record(StatusSet("h", Status.REJECTED, reason="it is no ground term"))
    replay = Replay(run_of([*records(END), goal, rejected]), is_exact=True)
    assert replay.send() == ["h visit("]
    for record in (goal, *records(END), rejected):
        assert not replay.finished
        replay.see_records(record)
    replay.now += 1.1
    assert replay.finished
    assert replay.progress.stalls == []


def test_a_replay_that_goes_another_way_is_noted_and_goes_on() -> None:
    replay = begun(run(RUN), "g visit(3)")
    replay.see(ASK[1:] + status("accepted", 1) + drive(5)[:3])
    assert replay.send() == ["robot success"]  # an answer to another action is one, too
    (stall,) = replay.progress.stalls
    assert (stall.position, stall.pending) == (1, ("robot",))
    replay.see(drive(5)[3:] + status("succeeded", 1) + END)
    assert replay.send() == []
    assert replay.progress.skipped == 1  # there is no second action to answer
    assert replay.finished


def test_a_missing_answer_is_noted_where_it_is_missing() -> None:
    recorded = [made for place, made in enumerate(RUN) if place != RUN.index(drive(2)[3])]
    replay = begun(run(recorded), "g visit(3)")
    replay.see(ASK[1:] + status("accepted", 1) + drive(2)[:3])
    assert replay.send() == ["robot success"]
    (stall,) = replay.progress.stalls
    assert (stall.position, stall.pending) == (2, ("robot",))


def test_an_input_that_is_never_taken_is_given_up() -> None:
    replay = begun(run(RUN), "g visit(3)")
    assert replay.send() == []
    replay.now += 10.0
    assert replay.send() == []
    assert replay.progress.skipped == 2  # there is no action to answer
    assert replay.progress.stalls
    assert replay.finished


def test_the_end() -> None:
    replay = begun(run([*RUN[:-1], ("end", "", "no plan", 2)]), "g visit(3)")
    replay.see([*ASK[1:], ("end", "", "no plan", 1)])
    assert replay.send() == []
    assert not replay.finished  # what becomes of the goal is still to come
    replay.now += 100.0
    assert not replay.finished
    replay.see([("status", "g", "aborted", 1)])
    assert replay.finished


def test_a_goal_that_the_loop_takes_when_it_has_ended() -> None:
    """The journal tells of the end first, then of the goal."""
    last: List[Made] = [("goal", "g", "visit(3)", 0), ("status", "g", "rejected", 0)]
    end: List[Made] = [("end", "", "no plan", 0)]
    replay = begun(run([ASK[0], *end, *last]), "g visit(3)")
    replay.see(end)
    assert not replay.finished
    replay.see(last)
    assert replay.finished


def test_a_recording_that_lacks_what_became_of_a_goal_in_the_end_is_cut() -> None:
    ended: List[Made] = [*ASK, ("end", "", "no plan", 0)]
    assert run(ended).is_open
    assert not run([*ended, ("status", "g", "aborted", 0)]).is_open


def test_an_end_from_outside_is_no_part_of_the_run() -> None:
    """Neither are the goals that it has ended; the replay goes on, and nobody waits for them."""
    rest = [Record(LoopEnded("the solver is gone", from_outside=True)), aborted("g")]
    recorded = run_of([*records(ASK + drive(2)[:3]), *rest])
    assert [entry.event for entry in recorded.entries][-1] == LoopWaits()
    assert not recorded.is_open
    replay = begun(recorded, "g visit(3)")
    replay.see(ASK[1:] + drive(2)[:3])
    assert replay.finished
    assert not compare(recorded, run(ASK + drive(2)[:3])).differences


def test_a_recording_that_ends_within_a_step() -> None:
    """More events of the last step, or another order of them, make no difference."""
    both = [
        Record(StatusSet(goal, Status.ACCEPTED, slot)) for goal, slot in (("h", "1"), ("g", "2"))
    ]
    begin = records([*ASK[:2], ("goal", "h", "visit(1)", 0), ASK[2]])
    assert not compare(run_of([*begin, both[0]]), run_of([*begin, *both])).differences


def aborted(goal: str) -> Record:
    return Record(StatusSet(goal, Status.ABORTED, "1", "the solver is gone"))


def test_a_plan_that_is_published() -> None:
    made: List[Made] = [("plan", "", "", 0), ("command", "", "publish", 0)]
    replay = Replay(run(made))
    replay.see(made[:1])
    assert not replay.finished
    replay.see(made[1:])
    assert replay.finished


def test_a_recording_that_ends_in_between_needs_no_more_than_it_has() -> None:
    replay = Replay(run(RUN[: RUN.index(drive(3, first=2)[0]) + 1]))
    for place, made in enumerate(RUN):
        replay.send()
        if made == drive(3, first=2)[0]:
            assert not replay.finished
            replay.see([made])
            assert replay.finished
            break
        replay.see(RUN[place : place + 1])


def test_in_real_time() -> None:
    replay = begun(run(RUN, gap=3.0), rate=2.0)
    assert replay.progress.wake(replay.now) <= 1.5
    replay.now += 1.4
    assert replay.send() == []
    replay.now += 0.2
    assert replay.send() == ["g visit(3)"]


@pytest.mark.costly
def test_not_too_many_at_once() -> None:
    many: List[Made] = [("message", "sensor", f"reading({n})", 0) for n in range(5000)]
    replay = Replay(run([ASK[0], *many, ASK[2], *END], gap=0.001))
    replay.see(ASK[:1])
    sent = replay.send()
    assert len(sent) < 5000
    while sent:
        replay.see([("message", *one.split(), 0) for one in sent])  # type: ignore[list-item, misc]  # two words
        sent = replay.send()
    assert len(replay.sent) == 5000


HELD: Made = ("waiting", "", "for the replay", 0)


def test_with_a_gate_nothing_waits_for_the_loop() -> None:
    both: List[Made] = [("goal", "h", "visit(1)", 0), ("message", "info", "a", 0)]
    replay = Replay(run([*ASK, *both, *status("accepted", 1), *drive(2), *END]), is_exact=True)
    assert replay.send() == ["g visit(3)", "h visit(1)", "info a"]
    assert replay.is_exact


def test_what_a_node_took_that_went_on_is_sent_to_that() -> None:
    resumed: List[Made] = [("resumed", "planner", "", 0), ("resumed", "rosoclingo", "", 0)]
    recorded = run([*ASK, *resumed, ("message", "info", "a", 0), *END])
    assert Replay(recorded, is_exact=True).send() == ["g visit(3)", "info a"]
    replay = Replay(recorded, is_exact=True, kills=True)
    assert replay.send() == ["g visit(3)"]
    replay.exact.go_on(replay.now, restarts=False)
    assert replay.send() == []
    replay.exact.go_on(replay.now, restarts=True)
    assert replay.send() == ["info a"]


def test_a_command_that_differs_ends_the_step() -> None:
    replay = Replay(run(RUN), is_exact=True)
    replay.see(ASK[1:])
    assert replay.is_exact
    replay.see([("command", "", "ground(1)", 0)])
    assert not replay.is_exact


def test_a_loop_that_its_gate_has_let_go_on_may_take_its_time() -> None:
    """Such as to ground for long: it does not wait in vain."""
    recorded = [("goal", "g", "visit(3)", 0), *status("accepted", 1), *drive(2), *END]
    replay = Replay(run(recorded), is_exact=True)
    replay.see([HELD])
    assert replay.send() == ["g visit(3)"]
    replay.see(recorded[:1])
    replay.now += 100.0
    assert replay.send() == []
    assert not replay.finished
    assert replay.is_exact
    replay.see(recorded[1:4])
    assert replay.send() == ["robot success"]


def test_a_loop_that_its_gate_has_wait_in_vain() -> None:
    recorded = [*status("accepted", 1), *drive(2), *END]
    replay = Replay(run(recorded), is_exact=True)
    replay.see([HELD])
    assert replay.send() == []
    assert replay.progress.stalls
    assert not replay.is_exact


def test_a_gate_that_is_to_be_opened_holds_nothing() -> None:
    """The loop was held before the replay could open it, and does what is expected afterwards."""
    recorded = [("command", "", "ground(1)", 0), *status("accepted", 1), *drive(2), *END]
    replay = Replay(run(recorded), is_exact=True)
    replay.see([("command", "", "ground(9)", 0), *status("accepted", 1), HELD])
    assert replay.send() == []
    assert not replay.is_exact
    replay.see(drive(2)[:3])
    assert replay.send() == ["robot success"]
    assert replay.progress.stalls == []


def test_a_gate_gets_all_that_it_waits_for() -> None:
    many: List[Made] = [("message", "sensor", f"reading({n})", 0) for n in range(5000)]
    replay = Replay(run([*many, *END]), is_exact=True)
    assert len(replay.send()) < 5000
    replay.see([HELD])
    replay.send()
    assert len(replay.sent) == 5000


def test_a_goal_whose_cancel_request_is_missing_was_not_recalled() -> None:
    """The recording has ended in between."""
    assert [entry.event for entry in run_of([GOAL, RECALL]).entries] == [GOAL.event]


@pytest.mark.parametrize("quiet", [0.5, 5.0])
def test_without_a_journal(quiet: float) -> None:
    """After some quiet, the loop is taken to have waited."""
    made: List[Made] = [("goal", "g", "visit(3)", 0), ("message", "info", "a", 0)]
    recorded = run(made, gap=quiet, has_journal=False)
    points = [one.point for one in ReplayProgress(recorded).planned]
    assert points == [
        LoopActivity.WAITING,
        LoopActivity.WAITING if quiet > 1 else LoopActivity.BUSY,
    ]
    replay = Replay(recorded, is_exact=True)
    assert not replay.is_exact  # as nobody knows when the loop has taken them
