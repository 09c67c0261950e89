"""What a console knows of a system, from its messages."""

from __future__ import annotations

import json
from typing import Any, Dict, List, Sequence, Tuple

import pytest

from rosclingo.wire.commands import Result
from rosoclingo.bags.holds import OperatorDecisions
from rosoclingo.encodings.known import KnownEncoding
from rosoclingo.loop import journal
from rosoclingo.loop.journal import Entry, Event, Status
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo_console.model.messages import MessageFate
from rosoclingo_console.model.metrics import METRICS, exposition
from rosoclingo_console.model.sentences import tell
from rosoclingo_console.model.system import SystemModel
from rosoclingo_console.model.values import PlanAhead, TokenRow, read_quality

HOSTILE = '<img src=x onerror="alert(1)">\u202e\x00\ud800'


class Run:
    """A run of a system, which is told event by event."""

    def __init__(self) -> None:
        self.model = SystemModel()
        self.shown: Dict[str, Dict[str, Any]] = {}
        self.lines: List[Any] = []
        self.number = 0
        self.time = 1000.0

    def hear(self, *events: Event, step: int = 0) -> None:
        for event in events:
            self.number += 1
            self.time += 1.0
            self.model.hear(Entry(event, step, 9, self.number, self.time))

    def look(self) -> None:
        """Takes the changes as a page does; what it has then is what a new page gets."""
        changes = json.loads(json.dumps(self.model.changes(), allow_nan=False))
        if changes.get("all"):
            self.shown, self.lines = {}, []
        for table, rows in changes.get("tables", {}).items():
            for key, row in rows.items():
                self.shown.setdefault(table, {})[key] = row
                if row is None:
                    del self.shown[table][key]
        self.lines += changes.get("lines", [])
        fresh = json.loads(json.dumps(self.model.snapshot()))
        kept = {table: rows for table, rows in self.shown.items() if rows}
        assert {table: rows for table, rows in fresh["tables"].items() if rows} == kept
        assert fresh["lines"][-50:] == self.lines[-50:]  # of more at once, a page has the last

    def row(self, table: str, key: str) -> Any:
        self.look()
        return self.shown[table][key]


@pytest.fixture
def run() -> Run:
    return Run()


def act(actuator: str, action: str, is_aborted: bool = False) -> TokenRow:
    return TokenRow(7, 1, actuator, action, True, is_aborted)


def test_a_goal_from_its_arrival_to_its_end(run: Run) -> None:
    run.hear(journal.GoalArrived("g", "bring(1,3)", ("a book",)))
    run.model.tell_goal("g", "queued 2")
    run.model.tell_goal("g", f"queued {'9' * 5000}")  # whoever says so
    goal = run.row("goals", "g")
    assert (goal["status"], goal["place"], goal["information"]) == ("pending", 2, ["a book"])
    assert (run.row("run", "run")["open"], run.row("run", "run")["waiting"]) == (1, 1)

    run.hear(journal.StatusSet("g", Status.ACCEPTED, "1"))
    timed = "timed(do(robot,go(2),1),30,42)"
    run.model.set_plan(1, 9, ["do(robot,go(2),1)", "expected(1,42)", "due(1,40)", timed])
    run.model.tell_goal("g", "expected in 5 s")
    run.model.tell_goal("g", "late by 3 s")
    run.model.tell_goal("g", "why: a way is blocked")
    run.model.tell_goal("g", "step 1 of 9")
    goal = run.row("goals", "g")
    assert (goal["slot"], goal["place"], goal["expected"], goal["due"]) == ("1", 0, 42.0, 40.0)
    assert run.row("plan", "plan")["times"] == [["robot", "go(2)", 30.0, 42.0]]
    assert (goal["why"], goal["late"], goal["line"]) == ("a way is blocked", "3 s", "step 1 of 9")
    run.model.tell_goal("g", "plan 4 steps")
    assert run.row("goals", "g")["why"] == ""
    for line, why in (
        ("waiting in step 2: the plan has no action for now", "the plan has no action for it now"),
        ("why: a way is blocked", "a way is blocked"),
        ("waiting in step 3: the plan has no action for now", "a way is blocked"),
        ("no plan within the horizon of 9 steps: looking for the reason",) * 2,
        (
            "no reason found yet: there was no time",
            "no plan within the horizon of 9 steps: looking for the reason",
        ),
        ("why: two ways are blocked", "two ways are blocked"),
    ):
        run.model.tell_goal("g", line)
        goal = run.row("goals", "g")
        is_unexplained = line.startswith("no reason")
        assert (goal["why"], goal["unexplained"]) == (why, "there was no time" * is_unexplained)

    run.hear(journal.CancelArrived("g"))
    assert run.row("goals", "g")["canceling"]
    run.hear(journal.StatusSet("g", Status.CANCELED, "1", "because"))
    goal = run.row("goals", "g")
    assert (goal["status"], goal["reason"], goal["expected"]) == ("canceled", "because", None)
    assert goal["ended"] - goal["came"] == 3.0
    assert run.row("run", "run")["open"] == 0


def test_what_is_told_before_the_goal_is_heard_counts(run: Run) -> None:
    """Feedback and journal are two topics."""
    run.model.tell_goal("g", "queued 2")
    for number in range(15):
        run.model.tell_goal(f"other{number}", "queued 1")
    assert run.model.goals.fate("g") is None
    run.hear(journal.GoalArrived("g", "visit(3)"))
    assert run.row("goals", "g")["place"] == 2
    for number in range(15, 40):  # such as of another run
        run.model.tell_goal(f"other{number}", "queued 1")
    run.hear(journal.GoalArrived("other0", "visit(3)"))
    run.hear(journal.GoalArrived("other39", "visit(3)"))
    assert [run.row("goals", name)["place"] for name in ("other0", "other39")] == [0, 1]


def test_what_has_become_of_a_goal(run: Run) -> None:
    def fate(goal: str = "g") -> Tuple[str, bool, bool]:
        found = run.model.goals.fate(goal)
        assert found is not None
        return found.text, found.is_refused, found.canceling

    assert run.model.goals.fate("g") is None
    run.hear(journal.GoalArrived("g", "visit(3)"))
    assert fate() == ("", False, False)
    run.model.tell_goal("g", "queued 2")
    assert fate() == ("queued, place 2", False, False)
    run.hear(journal.StatusSet("g", Status.ACCEPTED, "1"))
    run.hear(journal.CancelArrived("g"))
    assert fate() == ("accepted, in slot 1", False, True)
    run.hear(journal.StatusSet("g", Status.ABORTED, "1", "no way"))
    assert fate() == ("aborted: no way", True, True)
    for status, reason, text in (
        (Status.REJECTED, "no such cell", "rejected: no such cell"),
        (Status.CANCELED, "", "cancelled"),
        (Status.SUCCEEDED, "as asked", "succeeded"),
    ):
        run.hear(journal.StatusSet(text, status, "", reason))
        assert fate(text)[0] == text


def test_only_the_last_goals_that_have_ended_are_kept(run: Run) -> None:
    for number in range(60):
        run.hear(journal.GoalArrived(f"g{number}", "r"))
        run.hear(journal.StatusSet(f"g{number}", Status.SUCCEEDED, "1"))
        run.look()
    assert set(run.shown["goals"]) == {f"g{number}" for number in range(10, 60)}
    assert len(run.model.run.goals) == 50
    assert run.model.goals.counts == {Status.SUCCEEDED: 60}


def test_of_many_goals_that_wait_the_first_are_shown(run: Run) -> None:
    for number in range(300):
        run.hear(journal.GoalArrived(f"g{number}", "r"))
    assert run.row("run", "run")["open"] == 300
    assert set(run.shown["goals"]) == {f"g{number}" for number in range(200)}
    run.hear(journal.StatusSet("g0", Status.SUCCEEDED))
    run.look()
    assert "g200" in run.shown["goals"]


def test_progress_of_what_is_executed(run: Run) -> None:
    run.model.actuators.set_progress("a", 7, 0.1)  # of which nothing is known yet
    run.model.actuators.set_tokens([act("r", "go(2)")], "a")
    assert run.row("actuators", "r")["progress"] is None
    run.model.actuators.set_progress("b", 7, 0.5)  # of an earlier run
    run.model.actuators.set_progress("a", 7, 0.257)
    assert run.row("actuators", "r")["progress"] == 0.26
    for no_progress in (-1.0, 1.5, float("nan"), float("inf")):
        run.model.actuators.set_progress("a", 7, no_progress)
    assert run.row("actuators", "r")["progress"] == 0.26
    run.model.actuators.set_tokens([TokenRow(8, 2, "r", "go(3)", True, False)], "a")
    assert run.row("actuators", "r")["progress"] is None


@pytest.mark.parametrize(
    ("tokens", "decisions", "state", "waits"),
    [
        ([act("r", "go(2)")], OperatorDecisions(), "acts", ""),
        ([act("r", "go(2)", True)], OperatorDecisions(), "stops", "is to stop"),
        ([], OperatorDecisions(held=(("r", "go(2)", "approval"),)), "approval", "approves"),
        ([], OperatorDecisions(on_hold=("r",), held=(("r", "go(2)", "hold"),)), "hold", "released"),
        ([], OperatorDecisions(True, held=(("r", "go(2)", "pause"),)), "pause", "resumed"),
        ([], OperatorDecisions(held=(("r", "go(2)", "retry"),)), "retry", "tried again"),
        ([], OperatorDecisions(on_hold=("r",)), "hold", "released"),
        ([], OperatorDecisions(True), "pause", "resumed"),
        ([act("s", "wait")], OperatorDecisions(), "others", "until s has done wait"),
        ([], OperatorDecisions(), "begins", "step"),
    ],
)
def test_what_an_actuator_waits_for(
    run: Run, tokens: Sequence[TokenRow], decisions: OperatorDecisions, state: str, waits: str
) -> None:
    run.model.set_plan(1, 3, ["do(r,go(2),1)", "do(r,go(3),2)"])
    run.model.actuators.set_tokens(tokens)
    run.model.decide(decisions, run.time)
    row = run.row("actuators", "r")
    assert row["state"] == state
    assert waits in row["waits"]


def test_an_actuator_without_a_next_action(run: Run) -> None:
    run.model.actuators.set_tokens([TokenRow(7, 1, "r", "go(2)", False, False)])
    run.hear(journal.CommandDone("solve", Result.UNSAT))
    assert run.row("actuators", "r")["state"] == "plan"
    run.hear(journal.LoopWaits())
    assert run.row("actuators", "r")["state"] == "idle"
    run.hear(journal.ControlArrived(journal.Control.HOLD, "r"))
    run.model.decide(OperatorDecisions(on_hold=("r",)), run.time)
    row = run.row("actuators", "r")
    assert (row["state"], row["waits"]) == (
        "hold", "until it is released; nothing is planned for it",
    )  # fmt: skip
    assert run.row("run", "run")["state"] == "waits"


FLEET = KnownEncoding(
    messages=("info:at(r,a)", "info:at(r,b)", "info:blocked(a,b)"),
    answers={"r": ("success", "failure", "unknown"), "s": ("success", "unknown")},
)


@pytest.mark.parametrize("answer", ["unknown", "lost"])
def test_a_robot_whose_place_is_unknown(run: Run, answer: str) -> None:
    """It has nothing to do because it is left out."""
    run.model.set_encoding(FLEET)

    def state() -> Tuple[str, str]:
        row = run.row("actuators", "r")
        return row["state"], row["doubt"]

    run.hear(journal.ActionPublished("r", "go(b)"), journal.MessageArrived("r", answer))
    run.hear(journal.CommandDone("assign_messages(1)"), journal.LoopWaits())
    assert state() == ("lost", "go(b)")
    assert "told where it is: info:at(r,PLACE)" in run.row("actuators", "r")["waits"]
    run.hear(journal.MessageArrived("info", "at(r,c)"), journal.LoopWaits())
    assert state() == ("idle", "")
    run.hear(journal.MessageDropped("id info, value at(r,c): there is no such event"))
    assert state() == ("lost", "go(b)")
    run.hear(journal.MessageArrived("info", "at(r,b)"), journal.CommandDone("assign_messages(1)"))
    run.hear(journal.LoopWaits())
    assert state() == ("idle", "")
    run.hear(journal.ActionPublished("r", "go(a)"), journal.MessageArrived("r", answer))
    run.hear(journal.ActionPublished("r", "go(a)"), journal.MessageArrived("r", "success"))
    run.hear(journal.LoopWaits())
    assert state() == ("idle", "")


@pytest.mark.parametrize(
    ("actuator", "answer"),
    [("r", "timeout"), ("s", "unknown"), ("other", "unknown"), ("r", "failure")],
)
def test_a_robot_that_the_encoding_does_not_leave_out(run: Run, actuator: str, answer: str) -> None:
    """The answer is not declared, or no message could say where it is."""
    run.model.set_encoding(FLEET)
    run.hear(journal.ActionPublished(actuator, "go(b)"), journal.MessageArrived(actuator, answer))
    run.hear(journal.LoopWaits())
    row = run.row("actuators", actuator)
    assert (row["state"], row["doubt"]) == ("idle", "" if answer == "failure" else "go(b)")


def test_since_when_a_run_has_stopped(run: Run) -> None:
    def stopped() -> Any:
        return run.row("run", "run")["stopped"]

    assert stopped() is None  # it may come
    run.model.connect(True, 5.0)
    assert stopped() is None
    run.model.connect(False, 7.0)
    assert stopped() == 7.0
    run.model.connect(True, 9.0)
    assert stopped() is None
    run.hear(journal.LoopEnded("shutdown"))
    run.model.connect(False, run.time + 1)
    assert stopped() == run.time
    run.model.connect(True, run.time + 2)
    run.hear(journal.NodeResumed("rosoclingo", seconds=0.5))
    assert stopped() is None
    assert run.row("run", "run")["state"] == "works"


def test_how_far_the_actions_of_a_plan_are(run: Run) -> None:
    run.hear(journal.ActionPublished("r", "go(2)"), journal.ActionPublished("s", "go(4)"), step=1)
    run.hear(journal.MessageArrived("s", "success"), step=1)
    run.model.actuators.set_tokens([act("r", "go(2)")])
    atoms = ["do(s,go(4),1)", "do(r,go(2),1)", "do(t,give,1)", "do(r,go(3),2)", "do(s,go(4),2)"]
    run.model.set_plan(1, 2, atoms)
    decisions = OperatorDecisions.read(False, [], ["do(t,give)"], ["approval"])
    run.model.decide(decisions, run.time)
    plan = run.row("plan", "plan")
    states = {(step, who): state for step, who, _, state in plan["actions"]}
    assert states == {
        (1, "s"): "done", (1, "r"): "acts", (1, "t"): "held", (2, "r"): "planned",
        (2, "s"): "planned",
    }  # fmt: skip
    assert run.row("actuators", "r")["next"] == [2, "go(3)"]
    assert run.row("actuators", "s")["next"] == [2, "go(4)"]
    run.hear(journal.CommandDone("reset(1)"))
    run.model.set_plan(1, 2, ["do(s,go(4),1)"])  # the same action in a step of the same number
    assert run.row("plan", "plan")["actions"] == [[1, "s", "go(4)", "planned"]]


def test_a_long_plan_is_cut(run: Run) -> None:
    run.model.set_plan(0, 400, [f"do(r,go({step}),{step})" for step in range(400)])
    plan = run.row("plan", "plan")
    assert (len(plan["actions"]), plan["more"]) == (300, 100)


def test_actions_are_bars(run: Run) -> None:
    run.hear(journal.ActionPublished("r", "go(2)"), journal.MessageArrived("info", "blocked(1,2)"))
    run.hear(journal.ActionPublished("r", "abort"), journal.ActionPublished("r", "go(3)"))
    run.hear(journal.MessageArrived("r", "success"), journal.MessageArrived("r", "success"))
    run.look()
    first, second = run.shown["bars"].values()
    assert (first["action"], first["ended"] is not None, first["answer"]) == ("go(2)", True, "")
    assert (second["action"], second["ended"] - second["began"]) == ("go(3)", 1.0)
    assert run.shown["means"]["r"]["seconds"] == 1.0
    for _ in range(300):
        run.hear(journal.ActionPublished("r", "go(2)"), journal.MessageArrived("r", "failure"))
    run.look()
    assert len(run.shown["bars"]) == 200


def test_what_an_operator_held_is_a_bar(run: Run) -> None:
    run.model.decide(OperatorDecisions(on_hold=("r",)), 5.0)
    run.model.decide(OperatorDecisions(on_hold=("r",), held=(("r", "go(2)", "hold"),)), 6.0)
    assert run.row("holds", "5.0") == {
        "began": 5.0, "ended": None, "kind": "hold", "name": "r on hold",
    }  # fmt: skip
    run.model.decide(OperatorDecisions(), 7.5)
    assert run.row("holds", "5.0")["ended"] == 7.5
    for number in range(200):
        run.model.decide(OperatorDecisions(number % 2 == 0), 10.0 + number)
    run.look()
    assert len(run.shown["holds"]) == 100


def test_numbers_that_were_heard_are_ignored_and_missed_ones_counted(run: Run) -> None:
    run.hear(journal.GoalArrived("g", "r"))
    run.model.hear(Entry(journal.GoalArrived("g", "r"), 0, 0, 1, 1001.0))
    run.look()
    assert [line["number"] for line in run.lines] == [1]
    run.number = 4
    run.hear(journal.LoopWaits())
    assert run.row("run", "run")["missed"] == 3


def test_what_has_become_of_messages(run: Run) -> None:
    messages = run.model.messages
    assert run.row("run", "run")["dropped"] is None
    run.hear(journal.MessageArrived("info", "close(2)"), journal.MessageArrived("info", "close(9)"))
    assert messages.fate("info", "close(2)") == MessageFate(1)
    run.hear(journal.MessageDropped("id info, value close(9): there is no such cell"))
    assert messages.fate("info", "close(9)") == MessageFate(2, "there is no such cell")
    assert run.row("run", "run")["dropped"] == {
        "time": 1003.0, "text": "id info, value close(9): there is no such cell",
    }  # fmt: skip
    run.hear(journal.MessageDropped("'a(' is not a ground term"), journal.CommandDone("solve"))
    assert messages.fate("info", "close(2)") == MessageFate(1)
    run.hear(journal.CommandDone("assign_messages(1)"))
    assert messages.fate("info", "close(2)") == MessageFate(1, "")
    assert messages.fate("info", "close(9)") == MessageFate(2, "there is no such cell")
    run.hear(journal.MessageArrived("info", "close(2)"))
    assert messages.fate("info", "close(2)") == MessageFate(7)
    for number in range(1000):
        run.hear(journal.MessageArrived("info", f"a({number})"))
    assert messages.fate("info", "close(2)") is None
    assert messages.fate("info", "a(0)") == MessageFate(8)


def test_another_run_begins_anew(run: Run) -> None:
    run.model.decide(OperatorDecisions(True), run.time)
    run.hear(journal.GoalArrived("g", "r"), journal.LoopEnded("no plan"))
    assert run.row("run", "run")["state"] == "ended"
    run.number = 0
    run.hear(journal.LoopWaits())
    run.look()
    assert (len(run.lines), run.shown.get("goals", {}), run.shown["run"]["run"]["state"]) == (
        1, {}, "waits",
    )  # fmt: skip
    assert run.shown["run"]["run"]["paused"]  # as its latched topic says


def test_a_run_that_goes_on_is_the_same(run: Run) -> None:
    run.hear(journal.GoalArrived("g", "r"), journal.LoopWaits())
    run.number = 1  # the last events are forgotten, since power had failed
    run.hear(journal.NodeResumed("rosoclingo", seconds=0.5))
    run.look()
    assert list(run.shown["goals"]) == ["g"]
    assert [line["number"] for line in run.lines] == [1, 2, 2]


def test_contact(run: Run) -> None:
    assert not run.row("run", "run")["connected"]
    run.model.connect(True, 5.0)
    run.model.connect(True, 6.0)
    assert (run.row("run", "run")["connected"], run.row("run", "run")["since"]) == (True, 5.0)
    run.model.connect(False, 7.0)
    assert (run.row("run", "run")["connected"], run.row("run", "run")["since"]) == (False, 7.0)


def test_beliefs(run: Run) -> None:
    seen = ("observes(d,failure,1)", "is_about(d,1,r,go(b))", "observes(e,success,2)")
    shut = ("belief(1,2,shut(b))", "certain(shut(b))", "speaks_for(shut(b),d,1)")
    full = ("belief(2,3,full(b))", "speaks_for(full(b),d,1)")
    flat = ("speaks_for(flat,d,1)", "speaks_against(flat,e,2,failure)")
    run.look()
    assert not run.shown.get("beliefs")
    run.hear(journal.BeliefsChanged((*seen, *shut, *full)))
    best, other = run.row("beliefs", "1"), run.row("beliefs", "2")
    assert (best["causes"], best["weight"], best["since"]) == (["shut(b)"], 2, run.time)
    assert (best["is_certain"], best["speaks_for"]) == (True, ["r: go(b) failure"])
    assert (other["causes"], other["weight"], other["since"]) == (["full(b)"], 3, None)
    since = run.time
    run.hear(journal.BeliefsChanged((*seen, *shut, *flat)))
    assert run.row("beliefs", "1")["since"] == since
    other = run.row("beliefs", "2")
    assert (other["causes"], other["weight"]) == (["flat"], None)
    assert other["speaks_against"] == ["e: success"]
    run.hear(journal.BeliefsChanged(("belief(1,3,full(b))",)))
    assert run.row("beliefs", "1")["since"] == run.time > since
    run.hear(journal.BeliefsChanged(()))
    run.look()
    assert not run.shown["beliefs"]


WORDS = TermPhrases((
    ("shut(W)", "the door of W is shut"), ("full(W)", "W is full"), ("go(W)", "go to W"),
    ("observed(bell(W),no)", "the bell of W did not ring"),
))  # fmt: skip


@pytest.mark.parametrize("is_late", [False, True])
def test_beliefs_are_told_in_the_words_of_the_encoding(run: Run, is_late: bool) -> None:
    """Also where the encoding is known later than the journal."""
    if not is_late:
        run.model.set_encoding(KnownEncoding(phrases=WORDS))
    run.hear(journal.BeliefsChanged((
        "observes(d,failure,1)", "is_about(d,1,r,go(b))", "observes(bell(b),no,2)",
        "belief(1,2,shut(b))", "speaks_for(shut(b),d,1)", "speaks_against(full(b),bell(b),2,yes)",
        "belief(2,3,full(b))", "speaks_for(full(b),d,1)",
    )))  # fmt: skip
    run.look()
    if is_late:
        assert run.lines[-1]["text"] == "believed: shut(b)"
        run.model.set_encoding(KnownEncoding(phrases=WORDS))
    run.look()
    best, other = run.row("beliefs", "1"), run.row("beliefs", "2")
    assert (best["causes"], best["likelihood"]) == (["the door of b is shut"], "")
    assert best["speaks_for"] == ["r could not go to b"]
    assert (other["causes"], other["likelihood"]) == (["b is full"], "nearly as likely")
    assert other["speaks_against"] == ["the bell of b did not ring"]
    assert [line["text"] for line in run.lines] == ["believed: the door of b is shut"]


ALL_EVENTS = (
    journal.GoalArrived(HOSTILE, HOSTILE, (HOSTILE,), 1.0),
    journal.CancelArrived(HOSTILE),
    journal.MessageArrived(HOSTILE, HOSTILE),
    journal.ControlArrived(journal.Control.HOLD, HOSTILE),
    journal.AnswerArrived(HOSTILE, 1, HOSTILE),
    journal.MessageDropped(HOSTILE),
    journal.CommandDone(HOSTILE, Result.SAT, float("nan")),
    journal.PlanFound((HOSTILE,)),
    journal.BeliefsChanged((HOSTILE, f"belief(1,2,{HOSTILE})", "speaks_for(a,b,c)")),
    journal.BeliefsChanged(("belief(1,2,)", "belief(,,,)", "certain()", "observes(,,)")),
    journal.SearchEnded(journal.Ended.BETTER, (HOSTILE,)),
    journal.ActionPublished(HOSTILE, HOSTILE),
    journal.ActionRetried(HOSTILE, HOSTILE, 1, HOSTILE),
    journal.ActionWithdrawn(HOSTILE, HOSTILE),
    journal.ActionTook(HOSTILE, HOSTILE, 1, float("inf")),
    journal.ClockRead(1, float("inf")),
    journal.StatusSet(HOSTILE, Status.ABORTED, HOSTILE, HOSTILE),
    journal.LoopWaits(),
    journal.Explained(HOSTILE, HOSTILE, HOSTILE),
    journal.NodeResumed(HOSTILE, HOSTILE),
    journal.LoopEnded(HOSTILE),
    journal.Unknown(journal.Fields(HOSTILE, HOSTILE, HOSTILE)),
)


def test_every_kind_of_event_is_told() -> None:
    kinds = {type(event) for event in ALL_EVENTS}
    assert kinds == set(journal.Event.__subclasses__())
    for event in ALL_EVENTS:
        assert tell(event, {})[0] != "other" or isinstance(
            event, (journal.Unknown, journal.AnswerArrived)
        )


def test_hostile_words_are_words(run: Run) -> None:
    run.hear(*ALL_EVENTS)
    run.model.set_plan(1, 2, [HOSTILE, f"do({HOSTILE},{HOSTILE},1)", "do(", "expected(1)", ""])
    run.model.actuators.set_tokens([act(HOSTILE, HOSTILE)])
    run.model.decide(
        OperatorDecisions.read(True, [HOSTILE], [HOSTILE, "do(a,b)"], [HOSTILE, HOSTILE]), run.time
    )
    run.model.tell_goal(HOSTILE, HOSTILE)
    run.look()
    assert HOSTILE in run.shown["actuators"]
    text = exposition({HOSTILE: run.model.samples()})
    values = [line for line in text.splitlines() if not line.startswith("#")]
    assert all(line.startswith("rosoclingo_") for line in values)


def test_a_plan_of_nonsense_is_empty() -> None:
    assert PlanAhead.read(0, 0, ["do(a,b)", "do(a,b,c)", "go", "(", "expected(1,x)"]).actions == ()


def test_metrics(run: Run) -> None:
    run.model.connect(True, 1.0)
    run.hear(journal.GoalArrived("g", "r"), journal.GoalArrived("h", "r"))
    run.hear(journal.StatusSet("g", Status.SUCCEEDED), step=3)
    run.hear(journal.ActionPublished("r", "go"), journal.MessageArrived("r", 'a"b'), step=3)
    run.hear(journal.CommandDone("solve", Result.SAT, 0.5), journal.CommandDone("idle"), step=3)
    run.model.actuators.set_tokens([act("r", "go")])
    text = exposition({"/r": run.model.samples()})
    for line in (
        'rosoclingo_up{system="/r"} 1',
        'rosoclingo_step{system="/r"} 3',
        'rosoclingo_goals_open{system="/r"} 1',
        'rosoclingo_goals_total{system="/r",status="succeeded"} 1',
        'rosoclingo_answers_total{system="/r",answer="a\\"b"} 1',
        'rosoclingo_events_total{system="/r",kind="goal"} 2',
        'rosoclingo_search_seconds_sum{system="/r"} 0.5',
        'rosoclingo_search_seconds_count{system="/r"} 1',
        'rosoclingo_actions_open{system="/r"} 1',
    ):
        assert f"{line}\n" in text
    families = [line.split()[2] for line in text.splitlines() if line.startswith("# TYPE")]
    assert len(families) == len(set(families))
    assert set(families) <= set(METRICS)


def test_answers_of_strangers_need_no_memory(run: Run) -> None:
    for number in range(200):
        run.hear(journal.ActionPublished("r", "go"), journal.MessageArrived("r", f"a({number})"))
    assert len(run.model.actuators.answers) == 51
    assert sum(run.model.actuators.answers.values()) == 200


def test_an_answer_stays_when_the_same_is_said_again_and_dropped(run: Run) -> None:
    run.hear(journal.ActionPublished("r", "go"), journal.MessageArrived("r", "success"))
    run.hear(journal.MessageArrived("r", "success"))
    dropped = journal.MessageDropped(f"{journal.naming('r', 'success')}it has answered")
    run.hear(dropped)
    run.look()
    assert (run.row("bars", "1")["answer"], run.model.actuators.answers) == (
        "success",
        {"success": 1},
    )
    assert run.shown["means"]["r"]["seconds"] == 1.0
    run.hear(dropped)  # such as one of which the arrival was missed
    run.look()
    assert (run.row("bars", "1")["ended"], run.model.actuators.answers) == (None, {"success": 0})
    assert run.shown["means"] == {}


def test_a_message_may_be_dropped_when_the_planner_was_told(run: Run) -> None:
    """If the program has no answer set with it."""
    run.hear(journal.MessageArrived("info", "close(2)"), journal.CommandDone("assign_messages(1)"))
    run.hear(journal.MessageDropped(f"{journal.naming('info', 'close(2)')}no answer set"))
    assert run.model.messages.fate("info", "close(2)") == MessageFate(1, "no answer set")


def test_what_a_plan_costs() -> None:
    assert read_quality('{"cost": [3, 17], "optimal": true}') == "3 17, the best"
    assert read_quality('{"cost": [3, 17], "optimal": false}') == "3 17"
    assert read_quality("{}") == ""


@pytest.mark.parametrize(
    "text",
    ["", "[]", "7", "null", '{"cost": 7}', '{"cost": ["x"]}', '{"cost": [1e999]}', "[" * 100_000],
)
def test_a_quality_that_is_none(text: str) -> None:
    with pytest.raises(ValueError, match="expected what a plan costs"):
        read_quality(text)
