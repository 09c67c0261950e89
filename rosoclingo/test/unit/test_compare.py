"""What is the same in two runs, at each level, and how it is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import List, Sequence, Tuple
from xml.etree import ElementTree

import pytest
from replay_maker import ASK, END, RUN, Made, drive, records, run, run_of, status

from rosoclingo.bags.compare.comparison import Comparison, Level, Stall, compare
from rosoclingo.bags.compare.junit import Suite, write_error, write_results
from rosoclingo.bags.compare.text_report import describe, speed, summary
from rosoclingo.bags.read.run import Run
from rosoclingo.bags.replay.input_schedule import input_schedule
from rosoclingo.bags.replay.inputs import inputs
from rosoclingo.loop.journal import (
    CommandDone,
    GoalArrived,
    PlanFound,
    Record,
    Status,
    StatusSet,
)

OTHER_WAY = ASK + status("accepted", 1) + drive(1, 3) + status("succeeded", 2) + END
LONGER = ASK + status("accepted", 1) + drive(2, 2, 3) + status("succeeded", 3) + END
FAILS = ASK + status("accepted", 1) + drive(2) + status("aborted", 2) + END
SUITE = Suite("replay of run.bag", "replay.run")


def differences(seen: List[Made]) -> Tuple[int, ...]:
    """Returns how many differences there are at each level, the strictest first."""
    return differences_of(run(RUN), run(seen))


def differences_of(expected: Run, seen: Run) -> Tuple[int, ...]:
    return tuple(compare(expected, seen, level).differences for level in Level)


def test_levels() -> None:
    assert differences(RUN) == (0, 0, 0)
    assert differences(OTHER_WAY) == (1, 0, 0)
    assert differences(LONGER)[1:] == (2, 0)
    assert differences(FAILS)[1:] == (2, 1)
    exact = compare(run(RUN), run(LONGER))
    assert exact.differences > 1
    assert (exact.steps, exact.seen_steps) == (2, 3)


def test_questions_change_nothing() -> None:
    """Whether and when somebody asks is of no matter, to a comparison and to a replay."""
    together: List[Made] = [*ASK[:2], ("goal", "h", "visit(4)", 0), *ASK[2:]]
    plain = together + status("rejected", 0, "h") + RUN[len(ASK) :]
    why: Made = ("why", "goal 1", "It waits.", 0)
    asked = run([made for one in plain for made in (why, one, why)])
    assert differences_of(run(plain), asked) == differences_of(asked, run(plain)) == (0, 0, 0)
    assert input_schedule(asked) == input_schedule(run(plain))
    assert [replace(one, gap=0.0) for one in inputs(asked)] == [
        replace(one, gap=0.0) for one in inputs(run(plain))
    ]


def test_what_is_said() -> None:
    said = describe(compare(run(RUN), run(OTHER_WAY)))
    (first,) = (text for text in said.splitlines() if "first divergence" in text)
    assert first.split() == [
        ">>",
        "1",
        "robot:",
        "go(2)",
        "robot:",
        "go(1)",
        *["<-", "first", "divergence"],
    ]
    assert "goal 1 visit(3): accepted" in said
    assert said.index("goal 1 visit(3) came") < said.index("go(1)")
    said = describe(compare(run(RUN), run(FAILS), Level.OUTCOME))
    assert "expected  accepted in step 1, succeeded in step 2; succeeded after 2 steps" in said
    assert "seen      accepted in step 1, aborted in step 2; aborted after 1 step" in said
    assert describe(compare(run(RUN), run(RUN))) == ""


def test_summary() -> None:
    comparison = compare(run(RUN), run(RUN))
    assert summary(comparison) == "no difference at level exact: 1 goal, 2 steps"
    assert speed(2.0, 50.0) == "2.0 s, 25.0 times as fast as recorded"
    allowed = compare(run(RUN), run(OTHER_WAY), Level.OUTCOME)
    assert "no difference at level outcome (1 of what was done" in summary(allowed)


def test_only_what_is_around_differences_is_shown() -> None:
    long = ASK + status("accepted", 1) + drive(*range(2, 500)) + END
    seen = [
        made if made[2] != "go(300)" else ("action", "robot", "go(7)", made[3]) for made in long
    ]
    lines = describe(compare(run(long), run(seen))).splitlines()
    assert len(lines) < 40
    assert any("rows alike" in text for text in lines)


@pytest.mark.costly
def test_many_differences_are_not_all_shown() -> None:
    long = ASK + status("accepted", 1) + drive(*range(2, 5000)) + END
    other = ASK + status("accepted", 1) + drive(*range(5000, 9998)) + END
    comparison = compare(run(long), run(other))
    assert comparison.differences == 4998
    said = describe(comparison)
    assert "and 4958 more differences" in said
    assert len(said.splitlines()) < 300


def test_the_order_within_a_step_does_not_matter() -> None:
    both: List[Made] = [("action", "arm", "grasp", 3), ("action", "robot", "stop", 3)]
    assert compare(run(RUN + both), run(RUN + both[::-1])).differences == 0
    later = [both[0], ("action", "robot", "stop", 4)]
    assert compare(run(RUN + both + END), run(RUN + later + END)).differences == 1


def test_where_the_replay_waited() -> None:
    comparison = compare(run(RUN), run(RUN), stalls=[Stall(2, ("robot",))])
    assert comparison.differences == 1
    lines = describe(comparison).splitlines()
    place = next(
        n for n, text in enumerate(lines) if "! the replay waits for an answer of robot" in text
    )
    assert lines[place + 1].split()[:4] == [">>", "2", "robot:", "go(3)"]
    assert compare(run(RUN), run(RUN), Level.OUTCOME, stalls=[Stall(2, ())]).differences == 0


def test_the_end_of_the_process_does_not_count() -> None:
    """When it is told to end, a node aborts its goals."""
    begun = ASK + status("accepted", 1) + drive(2)[:3]
    stop: List[Made] = [("end", "", "the node is shutting down", 1), *status("aborted", 1)]
    for one, other in ((begun + stop, begun), (begun, begun + stop), (begun + stop, begun + stop)):
        assert compare(run(one), run(other)).differences == 0
    assert compare(run(begun), run([*begun, *status("aborted", 1)])).differences > 0


def test_a_recording_that_ends_while_the_loop_works() -> None:
    """What the replay does afterwards is not compared."""
    for end in range(len(RUN) - 1):
        if RUN[end][0] != "waiting":
            assert compare(run(RUN[: end + 1]), run(RUN)).differences == 0, end


def test_the_reason_of_an_end() -> None:
    runs = [[*RUN[:-1], ("end", "", reason, 2)] for reason in ("no plan", "no planner")]
    for level, count in ((Level.EXACT, 1), (Level.EQUIVALENT, 0), (Level.OUTCOME, 0)):
        assert compare(run(runs[0]), run(runs[1]), level).differences == count
    assert compare(run(runs[0]), run(RUN), Level.OUTCOME).differences == 1


def published(*atoms: str) -> Run:
    return run_of([Record(PlanFound(atoms)), Record(CommandDone("publish"))])


def test_a_plan_that_is_published() -> None:
    plan = published("do(arm,pickup(1),1)", "do(arm,putdown(2),2)")
    other = published("do(arm,pickup(1),1)", "do(arm,putdown(3),2)")
    shorter = published("do(arm,pickup(1),1)")
    for seen, counts in (
        (plan, (0, 0, 0)),
        (other, (1, 0, 0)),
        (shorter, (1, 1, 0)),
        (Run(()), (1, 1, 1)),
    ):
        assert tuple(compare(plan, seen, level).differences for level in Level) == counts


def test_a_replay_that_was_given_up() -> None:
    for level in Level:
        comparison = compare(run(RUN), run(RUN), level, failure="planner has ended")
        assert comparison.differences == 1
        assert "given up: planner has ended" in describe(comparison)


def test_without_a_journal() -> None:
    """Steps are not known then, nor the order of statuses and actions."""
    told = [made for made in RUN if made[0] not in ("waiting", "command")]
    old = run([(kind, i, text, 0) for kind, i, text, _ in told], has_journal=False)
    assert compare(old, run(RUN)).differences == 0
    assert compare(old, run(OTHER_WAY)).differences == 1


def test_statuses_of_goals_without_a_slot_have_no_order() -> None:
    """Another thread may set them, at any time."""
    status = StatusSet("h", Status.REJECTED, reason="no term")
    rejected = [Record(GoalArrived("h", "fly")), Record(status)]
    rest = records(RUN)
    early, late = [*rest[:3], *rejected, *rest[3:]], [*rest[:-1], *rejected, rest[-1]]
    assert compare(run_of(early), run_of(late)).differences == 0
    assert compare(run_of(early), run(RUN)).differences == 1


def test_a_status_before_its_goal_is_no_harm() -> None:
    early = [*status("accepted", 1), *ASK, *END]
    assert compare(run(early), run(early)).differences == 0


# Two runs that were recorded independently.


def other(made: Sequence[Made], *ids: str) -> Run:
    """Makes a journal whose goals have other ids: ``g`` becomes the first one."""
    names = dict(zip("ghi", ids))
    return run([(k, names.get(i, i), text, step) for k, i, text, step in made])


def independent(old: Run, new: Run, level: Level) -> Comparison:
    return compare(old, new, level, is_replay=False)


def asks(*goals: Tuple[str, str]) -> List[Made]:
    """Goals that come while the loop waits, each after the one before; all are accepted at once."""
    came: List[Made] = [("goal", goal, request, 0) for goal, request in goals]
    accepted: List[Made] = [("status", goal, "accepted", 1) for goal, _ in goals]
    return [("waiting", "", "", 0), *came, ("command", "", "idle", 0), *accepted]


@pytest.mark.parametrize("level", Level)
def test_ids_of_goals_do_not_matter(level: Level) -> None:
    for ids in ("/client-1-1700000000.1", "h"):
        assert independent(run(RUN), other(RUN, ids), level).differences == 0
        assert independent(run(RUN), other(FAILS, ids), level).differences > 0


@pytest.mark.parametrize("level", Level)
def test_goals_belong_together_by_their_requests(level: Level) -> None:
    end = drive(2) + status("succeeded", 1, "g") + status("rejected", 1, "h") + END
    old = asks(("g", "visit(2)"), ("h", "fly")) + end
    # Another order of arrival, other spaces, and an id that is that of the other goal.
    new = asks(("h", "fly"), ("g", "visit( 2)")) + end
    comparison = independent(run(old), other(new, "h", "g"), level)
    assert comparison.differences == 0
    assert [pair.request for pair in comparison.goals] == ["visit(2)", "fly"]


def test_the_first_of_two_goals_alike_belongs_to_the_first() -> None:
    goals = (("g", "visit(2)"), ("h", "visit(2)"))
    ends = [status(word, 1, "g") + status(other, 1, "h") for word, other in (
        ("succeeded", "aborted"), ("aborted", "succeeded"))]  # fmt: skip
    old, new = (asks(*goals) + end + END for end in ends)
    assert independent(run(old), other(old, "x", "y"), Level.OUTCOME).differences == 0
    assert independent(run(old), other(new, "x", "y"), Level.OUTCOME).differences == 2


@pytest.mark.parametrize("level", Level)
def test_a_goal_that_only_one_run_has(level: Level) -> None:
    more = asks(("g", "visit(2)"), ("h", "visit(5)")) + END
    less = asks(("g", "visit(2)")) + END
    for old, new, word in ((more, less, "seen"), (less, more, "expected")):
        comparison = independent(run(old), other(new, "x", "y"), level)
        # One for the goal, and in exact ones for its status.
        assert comparison.differences == (2 if level is Level.EXACT else 1)
        (first,) = [pair for pair in comparison.goals if not pair.same]
        assert first.request == "visit(5)"
        said = describe(comparison)
        assert "goal 2 visit(5) (" in said
        assert f"  {word:8}  it did not come" in said


def test_what_came_after_the_end_of_the_recording() -> None:
    """A recording that ends while the loop works says nothing of later goals."""
    both = asks(("g", "visit(2)")) + drive(2)[:1]
    later: List[Made] = [("goal", "h", "visit(5)", 1), ("status", "h", "accepted", 1)]
    for level in Level:
        assert independent(run(both), other(both + later, "x", "y"), level).differences == 0
        assert independent(run(both + later), other(both, "x"), level).differences > 0
    # But one that came before what is compared does not belong there.
    assert independent(run(both), run(later + both), Level.OUTCOME).differences == 1


def test_inputs_that_came_at_another_time() -> None:
    door: List[Made] = [("message", "door", "open", 1)]
    done = status("succeeded", 2) + END
    begin = ASK + status("accepted", 1)
    expected = run(begin + drive(2) + door + drive(3, 4, first=2) + done)
    for seen, said in (
        (begin + drive(2, 4, first=1) + done, "message door: open: expected in step 1, not seen"),
        (begin + drive(2, 5, first=1) + door + done,
         "message door: open: expected in step 1, seen later in step 1"),
        (begin + door + drive(2) + door + drive(1, 4, first=2) + done,
         "message door: open: not expected, seen in step 1"),
    ):  # fmt: skip
        text = describe(independent(expected, run(seen), Level.EXACT))
        lines = text[text.index("inputs that the runs did not have at the same time") :]
        assert said in [line.strip() for line in lines.splitlines()], text
    late = [*begin, *drive(2)[:3], ("message", "robot", "failure", 1), *drive(7, first=2), *done]
    text = describe(independent(expected, run(late), Level.OUTCOME))
    assert text == ""  # the level allows it
    text = describe(independent(expected, run(late), Level.EXACT))
    assert "message robot: failure: not expected, seen in step 1" in text
    same = begin + drive(2) + door + drive(3, 5, first=2) + done
    text = describe(independent(expected, run(same), Level.EXACT))
    assert text.endswith("both runs had the same inputs until the first divergence")
    assert "inputs" not in describe(compare(expected, run(same)))  # of a replay that is sure


def test_other_steps_of_inputs_are_told_too() -> None:
    """What changes a later plan may have come in another step."""
    runs = []
    for step, last in ((1, 4), (2, 5)):
        door: List[Made] = [("message", "door", "open", step)]
        moves = [drive(2), drive(3, first=2)]
        moves.insert(step, door)
        runs.append(ASK + [made for part in moves for made in part] + drive(last, first=3) + END)
    text = describe(independent(run(runs[0]), run(runs[1]), Level.EXACT))
    assert "message door: open: expected in step 1, seen in step 2" in text


HOSTILE = "\x1b]0;x\x07\x9b2J\r\u202e\x00\nno difference"


def test_nothing_of_a_bag_commands_the_terminal() -> None:
    made = [
        ("waiting", "", "", 0), ("goal", HOSTILE, HOSTILE, 0), ("status", HOSTILE, HOSTILE, 1),
        ("message", HOSTILE, HOSTILE, 1), ("action", HOSTILE, HOSTILE, 1), ("end", "", HOSTILE, 2),
    ]  # fmt: skip
    stalls = [Stall(0, (HOSTILE,))]
    for is_replay in (True, False):
        comparison = compare(
            run(made), run(END), failure="the end\nof " + HOSTILE, stalls=stalls,
            is_replay=is_replay,
        )  # fmt: skip
        said = describe(comparison)
        assert "\\x1b]0;x\\x07" in said
        assert all(letter.isprintable() or letter == "\n" for letter in said)
        lines = said.splitlines()
        assert "of \\x1b" in "".join(lines)
        # Only what processes have said may have several lines.
        assert [line for line in lines if line.startswith("no difference")] == lines[-1:]


def results(comparison: Comparison, folder: Path) -> ElementTree.Element:
    file = folder / "new" / "results.xml"
    write_results(file, SUITE, comparison, 1.5)
    return ElementTree.parse(file).getroot()


def test_junit(tmp_path: Path) -> None:
    suite = results(compare(run(RUN), run(RUN)), tmp_path)
    assert [case.get("name") for case in suite] == ["goal 1 visit(3)", "plan"]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "0")
    suite = results(compare(run(RUN), run(LONGER)), tmp_path)
    assert suite.get("failures") == "2"
    assert [case[0].tag for case in suite] == ["failure", "failure"]
    assert "first divergence" in str(suite[1][0].text)


def test_junit_of_a_bag_that_cannot_be_replayed(tmp_path: Path) -> None:
    file = tmp_path / "results.xml"
    write_error(file, SUITE, "no\x1b[31m system")
    suite = ElementTree.parse(file).getroot()
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")
    assert suite[0][0].tag == "error"


@pytest.mark.parametrize("character", ["\x00", "\ud800", "<", "é"])
def test_junit_takes_any_text(tmp_path: Path, character: str) -> None:
    made = [
        (kind, i, text.replace("visit(3)", f'"{character}"'), step) for kind, i, text, step in RUN
    ]
    suite = results(compare(run(made), run(RUN)), tmp_path)
    assert len(suite) == 2
