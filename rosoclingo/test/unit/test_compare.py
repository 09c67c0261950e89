"""What is the same in two runs, at each level, and how it is said."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple
from xml.etree import ElementTree

import pytest
from replay_maker import ASK, END, RUN, Made, drive, entries, events, status

from rosoclingo.bags.comparison import Comparison, Level, compare
from rosoclingo.bags.junit import write_error, write_results
from rosoclingo.bags.model import Entry
from rosoclingo.bags.schedule import Stall
from rosoclingo.bags.show import describe, summary
from rosoclingo.journal import Event

OTHER_WAY = ASK + status("accepted", 1) + drive(1, 3) + status("succeeded", 2) + END
LONGER = ASK + status("accepted", 1) + drive(2, 2, 3) + status("succeeded", 3) + END
FAILS = ASK + status("accepted", 1) + drive(2) + status("aborted", 2) + END


def differences(seen: List[Made]) -> Tuple[int, ...]:
    """Returns how many differences there are at each level, the strictest first."""
    return tuple(compare(entries(RUN), entries(seen), level).differences for level in Level)


def test_levels() -> None:
    assert differences(RUN) == (0, 0, 0)
    assert differences(OTHER_WAY) == (1, 0, 0)
    assert differences(LONGER)[1:] == (2, 0)
    assert differences(FAILS)[1:] == (2, 1)
    exact = compare(entries(RUN), entries(LONGER))
    assert exact.differences > 1
    assert (exact.steps, exact.seen_steps) == (2, 3)


def test_what_is_said() -> None:
    said = describe(compare(entries(RUN), entries(OTHER_WAY)))
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
    said = describe(compare(entries(RUN), entries(FAILS), Level.OUTCOME))
    assert "expected  accepted in step 1, succeeded in step 2; succeeded after 2 steps" in said
    assert "seen      accepted in step 1, aborted in step 2; aborted after 1 step" in said
    assert describe(compare(entries(RUN), entries(RUN))) == ""


def test_summary() -> None:
    comparison = compare(entries(RUN), entries(RUN))
    assert summary(comparison, 2.0, 50.0) == (
        "no difference at level exact: 1 goal, 2 steps, 2.0 s, 25.0 times as fast as recorded"
    )
    allowed = compare(entries(RUN), entries(OTHER_WAY), Level.OUTCOME)
    assert "no difference at level outcome (1 of what was done" in summary(allowed, 2.0, 50.0)


def test_only_what_is_around_differences_is_shown() -> None:
    long = ASK + status("accepted", 1) + drive(*range(2, 500)) + END
    seen = [
        made if made[2] != "go(300)" else ("action", "robot", "go(7)", made[3]) for made in long
    ]
    lines = describe(compare(entries(long), entries(seen))).splitlines()
    assert len(lines) < 40
    assert any("rows alike" in text for text in lines)


def test_many_differences_are_not_all_shown() -> None:
    long = ASK + status("accepted", 1) + drive(*range(2, 5000)) + END
    other = ASK + status("accepted", 1) + drive(*range(5000, 9998)) + END
    comparison = compare(entries(long), entries(other))
    assert comparison.differences == 4998
    said = describe(comparison)
    assert "and 4958 more differences" in said
    assert len(said.splitlines()) < 300


def test_the_order_within_a_step_does_not_matter() -> None:
    both: List[Made] = [("action", "arm", "grasp", 3), ("action", "robot", "stop", 3)]
    assert compare(entries(RUN + both), entries(RUN + both[::-1])).differences == 0
    later = [both[0], ("action", "robot", "stop", 4)]
    assert compare(entries(RUN + both + END), entries(RUN + later + END)).differences == 1


def test_where_the_replay_waited() -> None:
    comparison = compare(entries(RUN), entries(RUN), stalls=[Stall(2, ("robot",))])
    assert comparison.differences == 1
    lines = describe(comparison).splitlines()
    place = next(
        n for n, text in enumerate(lines) if "! the replay waits for an answer of robot" in text
    )
    assert lines[place + 1].split()[:4] == [">>", "2", "robot:", "go(3)"]
    assert (
        compare(entries(RUN), entries(RUN), Level.OUTCOME, stalls=[Stall(2, ())]).differences == 0
    )


def test_the_end_of_the_process_does_not_count() -> None:
    """When it is told to end, a node aborts its goals."""
    begun = ASK + status("accepted", 1) + drive(2)[:3]
    stop: List[Made] = [("end", "", "the node is shutting down", 1), *status("aborted", 1)]
    for one, other in ((begun + stop, begun), (begun, begun + stop), (begun + stop, begun + stop)):
        assert compare(entries(one), entries(other)).differences == 0
    assert compare(entries(begun), entries([*begun, *status("aborted", 1)])).differences > 0


def test_a_recording_that_ends_while_the_loop_works() -> None:
    """What the replay does afterwards is not compared."""
    for end in range(len(RUN) - 1):
        if RUN[end][0] != "waiting":
            assert compare(entries(RUN[: end + 1]), entries(RUN)).differences == 0, end


def test_the_reason_of_an_end() -> None:
    runs = [[*RUN[:-1], ("end", "", reason, 2)] for reason in ("no plan", "no planner")]
    for level, count in ((Level.EXACT, 1), (Level.EQUIVALENT, 0), (Level.OUTCOME, 0)):
        assert compare(entries(runs[0]), entries(runs[1]), level).differences == count
    assert compare(entries(runs[0]), entries(RUN), Level.OUTCOME).differences == 1


def published(*atoms: str) -> Tuple[Entry, ...]:
    events = [Event("plan", details=atoms), Event("command", text="publish")]
    return tuple(Entry(n, float(n), event) for n, event in enumerate(events, 1))


def test_a_plan_that_is_published() -> None:
    plan = published("do(arm,pickup(1),1)", "do(arm,putdown(2),2)")
    other = published("do(arm,pickup(1),1)", "do(arm,putdown(3),2)")
    shorter = published("do(arm,pickup(1),1)")
    for seen, counts in (
        (plan, (0, 0, 0)),
        (other, (1, 0, 0)),
        (shorter, (1, 1, 0)),
        ((), (1, 1, 1)),
    ):
        assert tuple(compare(plan, seen, level).differences for level in Level) == counts


def test_a_replay_that_was_given_up() -> None:
    for level in Level:
        comparison = compare(entries(RUN), entries(RUN), level, failure="planner has ended")
        assert comparison.differences == 1
        assert "given up: planner has ended" in describe(comparison)


def test_without_a_journal() -> None:
    """Steps are not known then, nor the order of statuses and actions."""
    old = entries([made for made in RUN if made[0] not in ("waiting", "command")])
    old = tuple(
        Entry(e.number, e.seconds, Event(e.event.kind, e.event.id, e.event.text)) for e in old
    )
    assert compare(old, entries(RUN), has_journal=False).differences == 0
    assert compare(old, entries(OTHER_WAY), has_journal=False).differences == 1


def test_statuses_of_goals_without_a_slot_have_no_order() -> None:
    """Another thread may set them, at any time."""
    rejected = [Event("goal", "h", "fly"), Event("status", "h", "rejected", ("", "no term"))]
    run = events(RUN)
    early, late = [*run[:3], *rejected, *run[3:]], [*run[:-1], *rejected, run[-1]]
    journals = [tuple(Entry(n, 0.0, e) for n, e in enumerate(made, 1)) for made in (early, late)]
    assert compare(*journals).differences == 0
    assert compare(journals[0], entries(RUN)).differences == 1


def results(comparison: Comparison, folder: Path) -> ElementTree.Element:
    file = folder / "new" / "results.xml"
    write_results(file, Path("a/run.bag"), comparison, 1.5)
    return ElementTree.parse(file).getroot()


def test_junit(tmp_path: Path) -> None:
    suite = results(compare(entries(RUN), entries(RUN)), tmp_path)
    assert [case.get("name") for case in suite] == ["goal 1 visit(3)", "plan"]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("2", "0", "0")
    suite = results(compare(entries(RUN), entries(LONGER)), tmp_path)
    assert suite.get("failures") == "2"
    assert [case[0].tag for case in suite] == ["failure", "failure"]
    assert "first divergence" in str(suite[1][0].text)


def test_junit_of_a_bag_that_cannot_be_replayed(tmp_path: Path) -> None:
    file = tmp_path / "results.xml"
    write_error(file, Path("run.bag"), "no\x1b[31m system")
    suite = ElementTree.parse(file).getroot()
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")
    assert suite[0][0].tag == "error"


@pytest.mark.parametrize("character", ["\x00", "\ud800", "<", "é"])
def test_junit_takes_any_text(tmp_path: Path, character: str) -> None:
    run = [
        (kind, i, text.replace("visit(3)", f'"{character}"'), step) for kind, i, text, step in RUN
    ]
    suite = results(compare(entries(run), entries(RUN)), tmp_path)
    assert len(suite) == 2
