"""How an action went, and the causes that are believed, in words."""

from __future__ import annotations

import re
from pathlib import Path
from typing import List, Sequence, Tuple

import pytest
from conftest import PACKAGE

from rosclingo.errors import TermError
from rosclingo.solver.options import Options
from rosoclingo.in_process.parts import make_parts
from rosoclingo.in_process.system import System
from rosoclingo.loop.journal import (
    ActionPublished,
    ActionRetried,
    BeliefsChanged,
    CommandDone,
    MessageArrived,
    MessageDropped,
    Record,
    naming,
)
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.why.answers import Happened
from rosoclingo.why.happened import happened
from rosoclingo.why.past import Deed, Past, PastReader, deeds_of

MAILBOT = PACKAGE.parent / "rosoclingo_aspprograms" / "mailbot"
OFFICE = Options(
    tuple(str(MAILBOT / file) for file in ("instances/graph_wg.lp", "mailbot_causes.lp"))
)
PHRASES = TermPhrases((
    ("shut(W,N)", "the door of W is shut"),
    ("flat(R)", "the battery of R is flat"),
    ("jam(W)", "W is full"),
    ("place(R)", "the place of R"),
    ("observed(sight(R,V),elsewhere)", "R was not at V"),
))  # fmt: skip
SEEN = ("observes(d,failure,1)", "is_about(d,1,r,go(b))")
LATER = ("observes(e,success,2)", "is_about(e,2,r,go(a))")
FLAT = ("speaks_for(flat(r),d,1)", "speaks_against(flat(r),e,2,failure)")
FULL = ("belief(3,3,jam(b))", "speaks_for(jam(b),d,1)")
PLACE = ("observes(place(r),a,2)", "speaks_against(flat(r),place(r),2,none)")
SIGHT = ("observes(sight(r,a),a,2)", "speaks_against(flat(r),sight(r,a),2,elsewhere)")
SHUT = ("belief(1,2,shut(b,1))", "speaks_for(shut(b,1),d,1)", "certain(shut(b,1))")
FAILED = "go(b) of r failed in step 1"
PROBABLY = f"{FAILED}, probably because the door of b is shut"


def told(*deeds: str) -> Tuple[str, ...]:
    """Returns the events of actions in one step after the other, each with its answer."""
    events: List[str] = []
    for step, deed in enumerate(deeds, 1):
        action, _, answer = deed.partition(" ")
        events.append(f"event(commit,do(r,{action}),{step})")
        events += [f"event(r,{answer},{step})"] if answer else []
    return tuple(events)


DONE = told("go(b) failure", "go(a) success", "lift busy", "wait")


@pytest.mark.parametrize(
    ("beliefs", "text"),
    [
        ((), f"{FAILED}; no cause of that is believed."),
        (SEEN, f"{FAILED}."),
        ((*SEEN, "unexplained(d,1)"), f"{FAILED}, and nothing explains that."),
        ((*SEEN, *SHUT), f"{PROBABLY}."),
        (
            (*SEEN, *LATER, *SHUT, *FLAT),
            f"{PROBABLY}; it may also be that the battery of r is flat, but then go(a) of r would "
            "have failed in step 2.",
        ),
        (
            (*SEEN, *SHUT, "belief(2,2,flat(r))", FLAT[0]),
            f"{PROBABLY}; as likely is that the battery of r is flat.",
        ),
        (
            (*SEEN, *SHUT, "belief(2,3,flat(r))", FLAT[0], *FULL),
            f"{PROBABLY}; nearly as likely is that the battery of r is flat, or that b is full.",
        ),
        ((*SEEN, *SHUT, FLAT[0]), f"{PROBABLY}; less likely is that the battery of r is flat."),
        (
            (*SEEN, *SHUT, "belief(2,2,shut(b,0))", "speaks_for(shut(b,0),d,1)"),
            f"{PROBABLY}.",  # since when, the words do not say
        ),
        (
            (*SEEN, *SHUT, FLAT[0], *PLACE),
            f"{PROBABLY}; it may also be that the battery of r is flat, but then none would have "
            "been observed of the place of r.",
        ),
        (
            (*SEEN, *SHUT, FLAT[0], *SIGHT),
            f"{PROBABLY}; it may also be that the battery of r is flat, but then it would have "
            "been observed that r was not at a.",
        ),
        ((*SHUT, "observes(d,failure,1)"), f"{FAILED}; no cause of that is believed."),
    ],
)
def test_causes(beliefs: Sequence[str], text: str) -> None:
    known = (("observes(d,failure,1)", 1), ("observes(e,success,2)", 2))
    answer = happened("go(b)", Past(deeds_of(DONE), beliefs=tuple(beliefs), known=known), PHRASES)
    assert answer.text == text
    assert (answer.actuator, answer.step, answer.answer) == ("r", 1, "failure")


@pytest.mark.parametrize(
    ("asked", "text"),
    [
        ("go(a)", "go(a) of r succeeded in step 2."),
        ("do(r,go(a))", "go(a) of r succeeded in step 2."),
        ("do(r,go(a),3)", "go(a) was never done, as far as is known."),
        ("do(s,go(a))", "go(a) was never done, as far as is known."),
        ("lift", "lift of r is under way since step 3."),
        ("wait", "wait of r is under way since step 4."),
        ("fly( \"x\" )", "fly(\"x\") was never done, as far as is known."),
    ],
)  # fmt: skip
def test_actions_of_which_nothing_is_noted(asked: str, text: str) -> None:
    assert happened(asked, Past(deeds_of(DONE)), PHRASES).text == text


def test_the_last_time_counts() -> None:
    events = told("go(b) failure", "go(b) failure", "go(b) success")
    again = ("observes(d,failure,2)", "is_about(d,2,r,go(b))", "speaks_for(shut(b,1),d,2)")
    known = ((SEEN[0], 1), (again[0], 2))
    beliefs = (*SEEN, *SHUT, *again)
    past = Past(deeds_of(events[:4]), beliefs=beliefs, known=known)
    assert happened("go(b)", past, PHRASES).text == f"{PROBABLY}.".replace("step 1", "step 2")
    assert happened("do(r,go(b),1)", past, PHRASES).text == f"{PROBABLY}."
    past = Past(deeds_of(events), beliefs=beliefs, known=known)
    assert happened("go(b)", past, PHRASES).text == (
        "go(b) of r succeeded in step 3. Before that, go(b) of r failed in step 2, probably "
        "because the door of b is shut."
    )


def test_after_a_reset() -> None:
    past = Past(was_reset=True, beliefs=(*SEEN, *SHUT), known=((SEEN[0], -2),))
    lead = "go(b) of r failed before the last reset, probably because"
    assert happened("go(b)", past, PHRASES).text == f"{lead} the door of b is shut."
    text = "go(a) was not done since the last reset, as far as is known."
    assert happened("go(a)", past, PHRASES).text == text


def test_what_is_no_term_is_refused() -> None:
    with pytest.raises(TermError, match="is not a ground term"):
        happened("go(", Past(), PHRASES)


def test_the_journal_is_read() -> None:
    """Busy answers end no action, tries that are repeated are one, a reset counts steps anew."""
    events = [
        (1, ActionPublished("r", "go(b)")), (1, MessageArrived("r", "busy")),
        (2, MessageArrived("info", "blocked(a,b)")), (2, MessageArrived("r", "failure")),
        (2, ActionRetried("r", "go(b)", 1, "failure")), (2, MessageArrived("r", "lost")),
        (2, MessageArrived("r", "success")), (3, ActionPublished("s", "lift")),
        (3, BeliefsChanged(SEEN)),
    ]  # fmt: skip
    reader = PastReader()
    for step, event in events:
        reader.hear(Record(event, step))
    assert reader.now() == Past(
        (Deed(1, "r", "go(b)", "lost"), Deed(3, "s", "lift")), False, SEEN, ((SEEN[0], 3),)
    )
    again = PastReader()
    again.take_over(reader.now())
    for one in (reader, again):
        one.hear(Record(CommandDone("forget(2)"), 3))
        one.hear(Record(MessageArrived("s", "success"), 1))
        assert one.now() == Past((Deed(1, "s", "lift", "success"),), True, SEEN, ((SEEN[0], 0),))


def test_a_dropped_answer_is_none() -> None:
    reader = PastReader()
    for event in (
        ActionPublished("r", "go(b)"), MessageArrived("r", "yes"),
        MessageDropped(f"{naming('r', 'yes')}it is unknown"),
    ):  # fmt: skip
        reader.hear(Record(event, 1))
    assert reader.now().deeds == (Deed(1, "r", "go(b)"),)
    reader.hear(Record(MessageArrived("r", "failure"), 1))
    assert reader.now().deeds == (Deed(1, "r", "go(b)", "failure"),)
    reader.hear(Record(ActionPublished("r", "go(c)"), 2))
    reader.hear(Record(MessageDropped(f"{naming('r', 'failure')}late"), 2))
    assert [deed.answer for deed in reader.now().deeds] == ["failure", ""]


class Office(System):
    """The mailbot, which cannot get to c6."""

    def turn(self) -> bool:
        for actuator, action in sorted(self.acting.items()):
            self.answer(actuator, "failure" if action == "go(c6)" else "success")
        return bool(self._items)


@pytest.mark.costly
def test_the_mailbot() -> None:
    """With the phrases of its encoding; nothing is searched for, however long it has gone."""
    run = Office(make_parts("dynamic.incremental.recording", OFFICE, ("-c", "steps=40")).loop)
    run.request("bring(o1,o9)")
    assert run.run() is None
    run.request("bring(o9,o14)")
    assert run.run() is None
    state = run.loop.state
    assert state.step > 20  # more than a copy of the planner is told one by one

    reader = PastReader()
    for entry in run.journal:
        reader.hear(entry)
    assert reader.now() == Past.of(state)  # so that a node that is started again says the same
    phrases = TermPhrases.read(Path(file).read_text() for file in OFFICE.files)

    def ask(action: str) -> Happened:
        return happened(action, reader.now(), phrases)

    answer = ask("go(c6)")
    assert re.match(
        r"go\(c6\) of mailbot failed in step \d+, probably because something stands between c6 and "
        "open1; .*it may also be that .*the wheels of mailbot are stuck.*, but then "
        r"go\(c1\) of mailbot would have failed in step \d+",
        answer.text,
    )
    assert answer.because == ("blocked(c6,open1,1)",)
    assert "stuck(mailbot,1)" in answer.refuted
    assert ask("go(o1)").text == "go(o1) of mailbot succeeded in step 2."
