"""Why there is no plan, and what would be instead: against a fresh clingo for each question.

``WHY_DRAWS=0:50 python -m pytest rosoclingo/test/unit/test_why.py`` takes more draws of each
dialect, those from 0 to 49, each of which asks two questions why this action and not that.
"""

from __future__ import annotations

import itertools
import os
import pickle
import random
from pathlib import Path
from typing import Any, Callable, FrozenSet, Iterable, List, Optional, Tuple, Type

import clingo
import pytest
from conftest import PACKAGE, Make
from draws import draws
from waiting import wait_for

from rosclingo.solver.options import Options
from rosclingo.wire.commands import (
    AssignExternal,
    Assumption,
    Ground,
    Part,
    ReleaseExternal,
    Restart,
    Truth,
)
from rosclingo.wire.term_text import last_number, split_term
from rosoclingo.errors import InterruptedQuestionError, QuestionError
from rosoclingo.loop.single.dialects import Dialect1, Dialect2, PaperDialect
from rosoclingo.loop.situation import Situation
from rosoclingo.loop.values.snapshot import decode, encode
from rosoclingo.why.answers import WhyGoal, WhyNoPlan
from rosoclingo.why.copy_by_assumptions import AssumingCopy
from rosoclingo.why.copy_by_regrounding import RebuildingCopy
from rosoclingo.why.explainer import Explainer
from rosoclingo.why.facts import Fact, Facts
from rosoclingo.why.phrases import Phrases
from rosoclingo.why.planner_copy import CopyAnswer, Deadline, PlanQuery, Verdict
from rosoclingo.why.query import Case
from rosoclingo.why.reason import MinimalReason, ReasonSearch
from rosoclingo.why.rules import is_relaxed

LINES = {
    dialect: str(PACKAGE / f"example/line{name}.lp")
    for dialect, name in ((Dialect2, ""), (Dialect1, "_1.0"), (PaperDialect, "_paper"))
}
LINE = LINES[Dialect2]
SECONDS = 600.0  # no more than a bound
FARTHEST = 16  # steps; no plan takes more
Dialect = Type[Dialect2]


def one_shot(
    dialect: Dialect, told: Iterable[str], first: int, last: int, demand: str = ""
) -> Optional[int]:
    """Returns the first horizon with a plan, found by a fresh clingo for each of them."""
    events = [split_term(atom)[1] for atom in told]
    for horizon in range(first, last + 1):
        control = clingo.Control(["--opt-mode=ignore"], logger=lambda *_: None)
        control.load(LINES[dialect])
        steps = range(horizon + 1) if dialect is Dialect2 else range(1, horizon + 1)
        parts: List[Tuple[str, List[clingo.Symbol]]] = [("base", [])]
        for step in steps:
            names = ["transition", "query"] if dialect is PaperDialect else ["state", "query"]
            names += ["transition"] if step and dialect is not PaperDialect else []
            parts += [(name, [clingo.Number(step)]) for name in names]
        control.ground(parts)
        rules = [demand]
        for source, content, step in events:
            atom = f"event({source},{content},{step})"
            if dialect is PaperDialect and source in ("1", "2"):
                atom = f"event(request,({source},{content}),{step})"
            if dialect is Dialect1:
                rules.append(f"{atom}.")
            else:
                control.assign_external(clingo.parse_term(atom), True)
        control.add("demand", [], " ".join(rules))
        control.ground([("demand", [])])
        query = "horizon" if dialect is PaperDialect else "query"
        control.assign_external(clingo.parse_term(f"{query}({horizon})"), True)
        if control.solve().satisfiable:
            return horizon
    return None


class Draw:
    """A random state of the robot on a line: it is on its way, and something happens.

    Attributes:
        situation: The state.
        pick: The source of random numbers.
    """

    def __init__(self, seed: int, dialect: Dialect = Dialect2) -> None:
        pick = self.pick = random.Random(seed)
        first = dialect.first_step
        goals = {str(slot): pick.randint(2, 6) for slot in range(1, pick.randint(2, 3))}
        told = [f"event({slot},visit({cell}),{first})" for slot, cell in goals.items()]
        step, place = first, 1
        for _ in range(pick.randint(0, 2) if dialect is Dialect2 else 0):
            if place + 1 >= min(goals.values()):
                break
            told.append(f"event(info,passed,{step})")
            step += 1
            told.append(f"event(commit,do(robot,go({place + 1})),{step})")
            answer = pick.choice(["success", "success", "failure"])
            told.append(f"event(robot,{answer},{step})")
            place += answer == "success"
        for cell in pick.sample(range(2, 7), pick.randint(0, 3)):
            told.append(f"event(info,close({cell}),{step})")
        self.situation = Situation(
            tuple(told),
            step=step,
            last=pick.choice([9, 4]) + step,
            goals=tuple((slot, f"visit({cell})") for slot, cell in goals.items()),
        )

    def explainer(self, dialect: Dialect = Dialect2) -> Explainer:
        return Explainer(Options((LINES[dialect],)), self.situation, dialect, seconds=SECONDS)

    def one_shot(self, dialect: Dialect, told: Iterable[str], **others: Any) -> Optional[int]:
        last = others.pop("last", self.situation.last)
        return one_shot(dialect, told, self.situation.step, last, **others)


def check(draw: Draw, reason: MinimalReason, dialect: Dialect, demand: str = "") -> None:
    """Checks that the facts suffice, and that each is needed."""
    assert reason.is_complete
    assert reason.is_smallest
    # With a demand, the goals are given.
    passed = [
        atom for atom in draw.situation.told if "passed" in atom or (demand and "visit" in atom)
    ]
    atoms = {atom for fact in reason.facts for atom in fact.atoms}
    assert draw.one_shot(dialect, [*passed, *atoms], demand=demand) is None
    for member in reason.members:
        rest = [*passed, *atoms.difference(member.fact.atoms)]
        assert member.without is not None
        assert draw.one_shot(dialect, rest, demand=demand) == member.without.horizon


MORE = range(*map(int, os.environ.get("WHY_DRAWS", "0:0").split(":")))
CASES = [(Dialect2, seed) for seed in MORE or draws([0, 1, 2, 7, 8, 21], 22)]
OTHERS = (Dialect1, PaperDialect)
CASES += [(dialect, seed) for dialect in OTHERS for seed in MORE or draws([0, 2], 3)]


@pytest.mark.costly
@pytest.mark.parametrize(("dialect", "seed"), CASES)
def test_why_there_is_no_plan(dialect: Dialect, seed: int) -> None:
    draw = Draw(seed, dialect)
    told = draw.situation.told
    answer = draw.explainer(dialect).no_plan()
    if answer.reason is not None:
        assert draw.one_shot(dialect, told, last=FARTHEST) is None
        check(draw, answer.reason, dialect)
    elif answer.horizon is not None:
        assert draw.one_shot(dialect, told) is None
        assert draw.one_shot(dialect, told, last=FARTHEST) == answer.horizon
    else:
        assert answer.plan is not None
        assert draw.one_shot(dialect, told) == answer.plan.horizon


@pytest.mark.costly
@pytest.mark.parametrize(("dialect", "seed"), CASES)
def test_why_this_and_not_that(dialect: Dialect, seed: int) -> None:
    draw = Draw(seed, dialect)
    situation, pick = draw.situation, draw.pick
    step = situation.step + pick.randint(1, 3)
    action = f"do(robot,go({pick.randint(1, 5)}),{step})"
    atom = action if dialect is not PaperDialect else f"occurs{action[2:]}"
    explainer = draw.explainer(dialect)
    best = draw.one_shot(dialect, situation.told, last=FARTHEST)
    for answer, demand in (
        (explainer.why(action), f":- {atom}."),
        (explainer.why_not(action), f":- not {atom}."),
    ):
        expected = draw.one_shot(dialect, situation.told, last=FARTHEST, demand=demand)
        assert (answer.other.horizon if answer.other else None) == expected
        if best is not None and expected is not None:
            assert answer.longer == expected - best
        if expected is None:
            assert answer.reason is not None
            check(draw, answer.reason, dialect, demand if best is not None else "")


@pytest.mark.costly
def test_the_answer_is_said() -> None:
    told = ("event(1,visit(6),0)", "event(2,visit(2),0)", "event(info,close(3),0)")
    situation = Situation(
        (*told, "event(info,close(5),1)", "event(info,open(3),1)", "event(info,passed,0)"),
        step=1,
        last=12,
        goals=(("1", "visit(6)"), ("2", "visit(2)")),
        queued=("visit(4)",),
        silent=(("robot", 12.3),),
    )
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    assert explainer.no_plan().text == (
        "There is no plan for visit(6) because info says close(5). Without that, there would be a "
        "plan of 5 steps. visit(4) waits for a slot."
    )
    assert explainer.goal("visit(2)").text == (
        "There is no plan for visit(2) because visit(6) is asked for and info says close(5). Each "
        "is needed: without the first, a plan of 1 step and without the second, a plan of 5 steps. "
        "robot has not answered for 12 s."
    )
    assert explainer.goal("visit(4)").text == (
        "visit(4) waits for a slot, which visit(6) (slot 1) and visit(2) (slot 2) have. robot has "
        "not answered for 12 s."
    )
    assert explainer.what_if(["info:open(5)"]).text == "There would be a plan of 5 steps."
    assert explainer.why_not("do(robot,go(2),2)").text.startswith(
        "There is no plan in any case for visit(6) because info says close(5). Without that, there"
    )


def test_its_turn_comes_later() -> None:
    situation = Situation(
        ("event(1,visit(6),0)", "event(2,visit(3),0)"),
        last=9,
        goals=(("1", "visit(6)"), ("2", "visit(3)")),
    )
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    answer = explainer.goal("visit(6)")
    assert (answer.ends, answer.after) == (5, ("visit(3)",))
    assert answer.text == (
        "visit(6) ends in step 5, and it is step 0 now: its turn comes after visit(3)."
    )
    assert explainer.goal("2").after == ()
    text = explainer.why("do(robot,go(2),1)").text
    assert text.endswith("in step 1, the best plan would take 6 steps, 1 more than now.")


@pytest.mark.parametrize(
    ("action", "has"),
    [
        ("go(3)", "go(3) in step 2"),
        ("go(5)", "go(2) in step 1 and go(3) in step 2"),
        ("dance", "go(2) in step 1 and go(3) in step 2"),
    ],
)
def test_an_action_that_is_planned_for_another_step(action: str, has: str) -> None:
    situation = Situation(told=("event(1,visit(3),0)",), last=9, goals=(("1", "visit(3)"),))
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    text = explainer.why(f"do(robot,{action},1)").text
    assert text.startswith(f"The plan has no such action in step 1, but {has}. If robot were not ")
    with pytest.raises(QuestionError, match="it is step 0 now, and the plan has") as refused:
        explainer.why(f"do(robot,{action},-1)")
    assert str(refused.value).endswith(f"the plan has {has}")


DOOR = """
#program state(t).
#external event(info,(key;rain;passed),t).
key(t) :- event(info,key,t).
key(t) :- key(t-1).
#program transition(t).
{ do(r,open,t) }.
#external event(commit,do(r,open),t).
:- event(commit,do(r,open),t), not do(r,open,t).
:- do(r,open,t), not event(commit,do(r,open),t), event(info,passed,t).
:- do(r,open,t), not key(t-1).
opened(t) :- do(r,open,t).
opened(t) :- opened(t-1).
#program query(t).
#external query(t).
:- query(t), opened(t).
"""


def test_what_an_action_rests_on_is_given(tmp_path: Path) -> None:
    file = tmp_path / "door.lp"
    file.write_text(DOOR)
    told = ("event(info,key,0)", "event(info,passed,0)", "event(info,rain,0)")
    situation = Situation((*told, "event(commit,do(r,open),1)"), step=1, last=3)
    answer = Explainer(Options((str(file),)), situation, seconds=SECONDS).no_plan()
    assert answer.reason is not None
    assert [member.fact.content for member in answer.reason.members] == ["open"]
    assert [fact.content for fact in answer.reason.given] == ["key"]
    assert answer.text == (
        "There is no plan because r was told open in step 1, given what had happened up to step 0. "
        "Without that, there would be a plan of 0 steps."
    )


def test_what_was_done_for_another_goal_is_given() -> None:
    """The robot has passed cell 3, which is closed now, before it was to go back."""
    told = ["event(1,visit(4),0)", "event(2,visit(2),3)", "event(info,close(3),4)"]
    answers = ("failure", "success", "success", "success")
    for step, (cell, answer) in enumerate(zip((2, 2, 3, 4), answers), 1):
        told.append(f"event(info,passed,{step - 1})")
        told.append(f"event(commit,do(robot,go({cell})),{step})")
        told.append(f"event(robot,{answer},{step})")
    situation = Situation(tuple(told), step=4, last=12, goals=(("2", "visit(2)"),))
    answer = Explainer(Options((LINE,)), situation, seconds=SECONDS).no_plan()
    assert answer.reason is not None
    named = [member.fact.content for member in answer.reason.members]
    assert named == ["visit(2)", "close(3)"]
    given = sorted((fact.step, fact.content) for fact in answer.reason.given)
    assert given == [(0, "visit(4)"), (2, "go(2)"), (3, "go(3)"), (4, "go(4)")]
    assert answer.text == (
        "There is no plan for visit(2) because info says close(3), given what had happened up to "
        "step 4. Without that, there would be a plan of 2 steps."
    )


def test_a_goal_that_has_ended_is_history() -> None:
    told = ("event(1,visit(2),0)", "event(1,cancel,1)", "event(1,visit(3),9)", "event(1,cancel,9)")
    facts = Facts.of(Situation(told, step=9, goals=(("1", "visit(3)"),)), ["1", "2"])
    assert [str(fact) for fact in facts.history] == [told[0], told[1]]
    assert [str(fact) for fact in facts.free] == [told[3], told[2]]


def test_what_was_saved_of_a_goal_is_that_goal() -> None:
    """Numbers of slots may be those of places, too."""
    told = ("at(r,9)", "carries(r,3)", "origin(1,3)", "origin(3,2)", "blocked(1,8)", "blocked(7,2)")
    saved = tuple(f"event(save,{fluent},0)" for fluent in told)
    situation = Situation(saved, last=9, goals=(("1", "bring(3,2)"), ("3", "bring(2,9)")))
    facts = Facts.of(situation, ["1", "2", "3"])
    assert [(fact.kind.value, fact.content, len(fact.atoms)) for fact in facts.free] == [
        ("request", "bring(2,9)", 2),
        ("request", "bring(3,2)", 1),
        ("saved", "at(r,9)", 1),
        ("saved", "blocked(1,8)", 1),
        ("saved", "blocked(7,2)", 1),
    ]


def test_what_was_saved_of_a_goal_that_has_ended_is_history() -> None:
    """The package of goal 1 was carried, and is delivered; goal 2 is open."""
    told = ("at(r,9)", "carries(r,1)", "origin(1,3)", "origin(2,7)", "blocked(4,8)")
    saved = tuple(f"event(save,{fluent},0)" for fluent in told)
    done = ("event(commit,do(r,deliver(1)),1)", "event(r,success,1)")
    situation = Situation((*saved, *done), step=1, last=9, goals=(("2", "bring(7,2)"),))
    facts = Facts.of(situation, ["1", "2", "3"])
    assert [(fact.kind.value, fact.content, fact.atoms) for fact in facts.free] == [
        ("request", "bring(7,2)", (saved[3],)),
        ("saved", "at(r,9)", (saved[0],)),
        ("saved", "blocked(4,8)", (saved[4],)),
    ]
    assert [fact.content for fact in facts.history] == ["carries(r,1)", "origin(1,3)", "deliver(1)"]


def test_a_number_that_could_be_a_slot_is_none_if_the_encoding_says_so() -> None:
    """Of a tank with 0 to 2 fillings, 1 was saved: that belongs to no goal."""
    saved = ("event(save,tank(1),0)", "event(save,wanted(1,visit(3)),0)")
    savable = [f"event(save,tank({filling}),0)" for filling in range(3)]
    situation = Situation(saved, goals=(("1", "visit(3)"),))
    facts = Facts.of(situation, ["1", "2"], savable)
    assert [(fact.kind.value, fact.content) for fact in facts.free] == [
        ("request", "visit(3)"),
        ("saved", "tank(1)"),
    ]


def test_what_was_saved_before_a_goal_came_is_not_of_that_goal() -> None:
    told = ("event(save,tank(1),0)", "event(1,visit(3),2)")
    facts = Facts.of(Situation(told, step=2, goals=(("1", "visit(3)"),)), ["1", "2"])
    assert [(fact.kind.value, fact.atoms) for fact in facts.free] == [
        ("request", (told[1],)),
        ("saved", (told[0],)),
    ]


def test_a_slot_that_had_another_goal_before_has_a_reason() -> None:
    """Without the goal, none has to end: the one that was in its slot has ended long ago."""
    told = ["event(1,visit(4),0)", "event(info,close(3),3)", "event(1,visit(2),4)"]
    for step, cell in enumerate((2, 3, 4), 1):
        told.append(f"event(info,passed,{step - 1})")
        told.append(f"event(commit,do(robot,go({cell})),{step})")
        told.append(f"event(robot,success,{step})")
    told.append("event(info,passed,3)")
    situation = Situation(tuple(told), step=4, last=12, goals=(("1", "visit(2)"),))
    answer = Explainer(Options((LINE,)), situation, seconds=SECONDS).no_plan()
    assert answer.reason is not None
    named = [member.fact.content for member in answer.reason.members]
    assert named == ["visit(2)", "close(3)"]


def test_a_goal_that_would_have_ended_in_an_idle_step() -> None:
    """At its start, the robot is where it is to go back to; since then, steps have gone by."""
    saved = ("event(save,at(3),0)", "event(save,closed(2),0)", "event(save,want(1,1),0)")
    passed = tuple(f"event(info,passed,{step})" for step in range(4))
    situation = Situation((*saved, *passed), step=4, last=12, goals=(("1", "visit(1)"),))
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    assert explainer.goal("1").text == (
        "There is no plan for visit(1) because at(3) and closed(2). Each is needed: without the "
        "first, a plan of 0 steps and without the second, a plan of 2 steps."
    )


def test_a_place_that_could_be_a_slot_belongs_to_no_goal() -> None:
    """There are more slots than floors."""
    saved = ("event(save,floor(2),0)", "event(save,want(2,3),0)")
    savable = [f"event(save,floor({n}),0)" for n in (1, 2)]
    savable += [f"event(save,want({n},{cell}),0)" for n in (1, 2, 3) for cell in range(9)]
    facts = Facts.of(Situation(saved, goals=(("2", "visit(3)"),)), ["1", "2", "3"], savable)
    assert [(fact.kind.value, fact.content, fact.atoms) for fact in facts.free] == [
        ("request", "visit(3)", saved[1:]),
        ("saved", "floor(2)", saved[:1]),
    ]


GATE = """
#program base. fluent(ajar).
#program state(t).
#external event(info,(unlatch;push),t).
holds(ajar,0) :- before(ajar,0), t = 0.
holds(ajar,t) :- event(info,unlatch,t).
#program transition(t).
holds(ajar,t) :- holds(ajar,t-1).
:- do(robot,go(4),t), not holds(ajar,t-1).
"""


@pytest.mark.costly
def test_a_fact_that_makes_plans_possible_is_no_reason(tmp_path: Path) -> None:
    """A gate has to be unlatched, which it is; and then a cell behind it is closed."""
    gate = tmp_path / "gate.lp"
    gate.write_text(GATE)
    options = Options((LINE, str(gate)))
    told = ["event(1,visit(6),0)", "event(info,push,0)", "event(info,unlatch,0)"]
    blocked = Situation((*told, "event(info,close(5),0)"), last=9, goals=(("1", "visit(6)"),))
    explainer = Explainer(options, blocked, seconds=SECONDS)
    for text in (explainer.goal("1").text, explainer.no_plan().text):
        assert text == (
            "There is no plan for visit(6), although info says unlatch, because info says "
            "close(5). Without that, there would be a plan of 5 steps."
        )
    latched = Situation((*told[:2], "event(info,close(5),0)"), last=9, goals=(("1", "visit(6)"),))
    found = Explainer(options, latched, seconds=SECONDS).goal("1")
    assert found.no_plan is not None
    assert found.no_plan.reason is not None
    assert found.no_plan.reason.is_absolute
    assert found.text.startswith("There is no plan for visit(6), whatever was told: ")


BATTERY = """
#const full=3.
#program base. fluent(battery(0..full)).
before(battery(full),0) :- not event(save,battery(_),0).
#program state(t).
holds(battery(N),0) :- before(battery(N),0), t = 0.
#program transition(t).
holds(battery(N-1),t) :- holds(battery(N),t-1), do(robot,_,t).
holds(battery(N),t) :- holds(battery(N),t-1), not do(robot,_,t).
% Each move takes some.
%! the battery
%! does not last.
:- do(robot,_,t), holds(battery(0),t-1).
{more}
"""
SLOWLY = """
:- do(robot,_,t),
   do(robot,_,t-1).
"""


@pytest.mark.costly
@pytest.mark.parametrize("dialect", [Dialect2, None])
def test_a_rule_is_named_where_no_fact_is_the_reason(dialect: Any, tmp_path: Path) -> None:
    """Cell 6 is 5 moves away; and so for a copy that begins anew for each set of facts."""
    battery = tmp_path / "battery.lp"
    battery.write_text(BATTERY.replace("{more}", ""))
    told = ("event(1,visit(6),0)", "event(2,visit(3),0)", "event(info,close(1),0)")
    situation = Situation(told, last=12, goals=(("1", "visit(6)"), ("2", "visit(3)")))
    explainer = Explainer(Options((LINE, str(battery))), situation, seconds=SECONDS)
    explainer._must_rebuild = dialect is None
    text = (
        "There is no plan for visit(6) because the battery does not last. Without that, there "
        "would be a plan of 5 steps."
    )
    assert explainer.no_plan().text == text
    found = explainer.goal("1")
    assert found.text == text
    assert decode(WhyGoal, encode(found)) == found
    assert explainer.what_if(["info:close(2)"]).text.startswith("There would be no plan for visit")


@pytest.mark.costly
def test_the_smallest_set_of_rules_is_named(tmp_path: Path) -> None:
    """The third rule is that the robot goes slowly, which prevents nothing."""
    battery = tmp_path / "battery.lp"
    more = f"%! it goes slowly{SLOWLY}%! cell 5 is not for robots\n:- do(robot,go(5),t)."
    battery.write_text(BATTERY.replace("{more}", more))
    situation = Situation(("event(1,visit(6),0)",), last=12, goals=(("1", "visit(6)"),))
    explainer = Explainer(Options((LINE, str(battery))), situation, seconds=SECONDS)
    assert explainer.no_plan().text == (
        "There is no plan for visit(6) because cell 5 is not for robots and the battery does "
        "not last. Without these, there would be a plan of 9 steps."
    )


@pytest.mark.costly
def test_a_rule_without_a_name_is_quoted_with_its_place(tmp_path: Path) -> None:
    line, battery = tmp_path / "line.lp", tmp_path / "battery.lp"
    line.write_text(
        "\n".join(row for row in Path(LINE).read_text().splitlines() if "%!" not in row)
    )
    text = "\n".join(
        row for row in BATTERY.replace("{more}", SLOWLY).splitlines() if "%!" not in row
    )
    battery.write_text(text)
    situation = Situation(("event(1,visit(6),0)",), last=12, goals=(("1", "visit(6)"),))
    explainer = Explainer(Options((str(line), str(battery))), situation, seconds=SECONDS)
    found = explainer.no_plan()
    assert found.reason is not None
    named = [rule.content for rule in found.reason.rules]
    line_number, number = (
        next(n for n, row in enumerate(file.read_text().splitlines(), 1) if words in row)
        for file, words in ((line, "|X-Y| != 1"), (battery, ":- do(robot,_,t), holds(battery(0)"))
    )
    assert named == [
        f"':- do(robot,_,t), holds(battery(0),t-1).' (battery.lp:{number})",
        f"':- do(robot,go(X),t), holds(at(Y),t-1), |X-Y| != 1.' (line.lp:{line_number})",
    ]
    assert found.text == (
        "There is no plan for visit(6), whatever else was told: the encoding excludes it by "
        f"{named[0]} and {named[1]}."
    )


@pytest.mark.costly
@pytest.mark.parametrize(
    ("slow", "has_names", "text"),
    [
        (
            lambda last, relaxed: last == 12 and 0 < relaxed < 4,
            False,
            "whatever else was told: the encoding excludes it by ':- do(robot,_,t), "
            "do(robot,_,t-1).' (battery.lp:15) and '{way}' (line.lp:{row}) up to step 8; there "
            "was no time to look farther.",
        ),
        (
            lambda last, relaxed: relaxed,
            False,
            "whatever else was told. There was no time to look which constraints prevent it.",
        ),
        (
            lambda last, relaxed: relaxed == 1,
            True,
            "because cell 5 is not for robots, the battery does not last and the robot enters no "
            "closed cell. Without these, there would be a plan of 9 steps. There was no time to "
            "look whether all of these are needed.",
        ),
    ],
)
def test_what_is_known_of_rules_is_said_when_the_time_is_over(
    slow: Callable[[int, int], bool],
    has_names: bool,
    text: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Some searches never end: those for all steps, all of them, or those without one rule."""
    more = f"%! it goes slowly{SLOWLY}%! cell 5 is not for robots\n:- do(robot,go(5),t)."
    texts = {"line.lp": Path(LINE).read_text(), "battery.lp": BATTERY.replace("{more}", SLOWLY)}
    if has_names:
        texts["battery.lp"] = BATTERY.replace("{more}", more)
    for name, content in texts.items():
        (tmp_path / name).write_text(content if has_names else content.replace("%!", "%"))
    files = tuple(str(tmp_path / name) for name in texts)

    def with_time(ask: Callable[..., Verdict]) -> Callable[..., Verdict]:
        def asked(copy: AssumingCopy, query: PlanQuery, *others: Any, **more: Any) -> Verdict:
            if slow(copy.last, sum(map(is_relaxed, query.told))):
                raise InterruptedQuestionError
            return ask(copy, query, *others, **more)

        return asked

    monkeypatch.setattr(AssumingCopy, "ask", with_time(AssumingCopy.ask))
    monkeypatch.setattr(AssumingCopy, "ask_any", with_time(AssumingCopy.ask_any))
    situation = Situation(("event(1,visit(6),0)",), last=12, goals=(("1", "visit(6)"),))
    found = Explainer(Options(files), situation, seconds=SECONDS).no_plan()
    way = ":- do(robot,go(X),t), holds(at(Y),t-1), |X-Y| != 1."
    row = texts["line.lp"].splitlines().index(way) + 1
    assert found.text == (
        f"There is no plan for visit(6){'' if has_names else ','} {text.format(way=way, row=row)}"
    )
    assert decode(WhyNoPlan, encode(found)) == found


def test_a_rule_of_an_encoding_that_is_told_its_events_is_named(tmp_path: Path) -> None:
    """Its copy begins anew for each set of rules that are relaxed."""
    file = tmp_path / "line.lp"
    rule = "#program walk(k,d).\n%! cell 6 is not for robots\n:- goes(k,6,T), not newer(k)."
    file.write_text(f"{(PACKAGE / 'example/line_demand.lp').read_text()}\n{rule}\n")
    told = ("event(1,visit(6),0)", "event(info,close(1),0)")
    situation = Situation(told, last=20, goals=(("1", "visit(6)"),), tells=True)
    found = Explainer(Options((str(file),)), situation, seconds=SECONDS).no_plan()
    assert found.is_contradictory
    assert found.text.endswith(
        " because cell 6 is not for robots. Without that, there would be a plan of 5 steps."
    )


def test_a_constraint_is_quoted_why_an_action_is_not_possible() -> None:
    situation = Situation(("event(1,visit(3),0)",), last=9, goals=(("1", "visit(3)"),))
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    text = explainer.why_not("do(robot,go(5),1)").text
    assert text.startswith("If robot were to do go(5) in step 1, there would be no plan, whatever ")
    assert "':- do(robot,go(X),t), holds(at(Y),t-1), |X-Y| != 1.' (line.lp:" in text


@pytest.mark.costly
def test_the_least_change_is_named(tmp_path: Path) -> None:
    """A robot that need not go from cell to cell would be there at once."""
    battery = tmp_path / "battery.lp"
    battery.write_text(BATTERY.replace("{more}", "%! the robot cannot hop\n:- hops(t)."))
    text = Path(LINE).read_text()
    rule = ":- do(robot,go(X),t), holds(at(Y),t-1), |X-Y| != 1."
    assert rule in text
    line = tmp_path / "line.lp"
    line.write_text(text.replace(rule, f"hops(t) {rule}"))
    situation = Situation(("event(1,visit(6),0)",), last=12, goals=(("1", "visit(6)"),))
    explainer = Explainer(Options((str(line), str(battery))), situation, seconds=SECONDS)
    assert "because the battery does not last. " in explainer.no_plan().text


def test_a_plan_that_nobody_has_executed_begins_anew() -> None:
    """The last that has happened surprises nobody, so that the plan from before would stand."""
    told = ("event(1,visit(4),0)", "event(info,passed,0)", "event(robot,success,3)")
    situation = Situation(told, step=4, last=20, goals=(("1", "visit(4)"),))
    options = Options((str(PACKAGE / "example/line_demand.lp"),))
    plan = Explainer(options, situation, seconds=SECONDS).no_plan().plan
    assert plan is not None
    assert plan.actions[0] == "do(robot,go(2),5)"
    assert (plan.steps, plan.horizon) == (3, 7)


@pytest.mark.parametrize("dialect", [Dialect1, PaperDialect])
def test_what_is_demanded_does_not_contradict_the_program(dialect: Dialect) -> None:
    situation = Situation(("event(1,visit(4),1)",), 1, 9, 9, (("1", "visit(4)"),))
    options = Options((LINES[dialect],))
    copy = RebuildingCopy(options, situation, Deadline(SECONDS), dialect)
    demand = Assumption("do(robot,go(5),2)", True)
    assert (
        copy.ask(PlanQuery(frozenset(situation.told), demands=(demand,))).answer is CopyAnswer.NONE
    )


def test_an_encoding_that_excludes_all_is_named(tmp_path: Path) -> None:
    file = tmp_path / "never.lp"
    file.write_text("#program query(t). #external query(t). :- query(t).")
    answer = Explainer(Options((str(file),)), Situation(last=3), seconds=SECONDS).no_plan()
    assert answer.text == "There is no plan, whatever was told: the encoding excludes it."


def test_a_contradiction_is_named(tmp_path: Path) -> None:
    file = tmp_path / "line.lp"
    rules = "#program state(t). :- event(info,close(2),t), event(1,visit(X),T), T < t."
    file.write_text(f"{Path(LINE).read_text()}\n{rules}\n")
    told = ("event(1,visit(6),0)", "event(info,close(4),1)", "event(info,close(2),1)")
    situation = Situation((*told, "event(info,passed,0)"), 1, 9, 9, (("1", "visit(6)"),))
    answer = Explainer(Options((str(file),)), situation, seconds=SECONDS).no_plan()
    assert answer.is_contradictory
    assert answer.reason is not None
    named = {atom for fact in answer.reason.facts for atom in fact.atoms}
    assert named == {told[0], told[2]}


def test_there_is_no_answer_without_time() -> None:
    draw = Draw(1)
    with pytest.raises(InterruptedQuestionError, match="no time"):
        Explainer(Options((LINE,)), draw.situation, stopped=lambda: True).no_plan()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda e: e.goal("visit(3)"), r"no open goal visit\(3\); there are visit\(6\)"),
        (lambda e: e.why("go(2)"), "no action; one is do"),
        (lambda e: e.what_if(["info:close(99)"]), "no external event"),
        (lambda e: e.what_if(["close(3)"]), "goal:REQUEST"),
        (lambda e: e.what_if(["goal:visit(2)", "goal:visit(3)"]), "no free slot for visit"),
    ],
)
def test_a_wrong_question_is_refused(ask: Callable[[Explainer], object], words: str) -> None:
    situation = Situation(("event(1,visit(6),0)",), last=9, goals=(("1", "visit(6)"),))
    with pytest.raises(QuestionError, match=words):
        ask(Explainer(Options((LINE,)), situation, seconds=SECONDS))


def test_an_answer_can_be_written_as_json() -> None:
    told = ("event(1,visit(6),0)", "event(info,close(5),0)")
    situation = Situation(told, last=9, goals=(("1", "visit(6)"),))
    answer = Explainer(Options((LINE,)), situation, seconds=SECONDS).no_plan()
    assert decode(WhyNoPlan, encode(answer)) == answer


class Hurried:
    """Asks a copy, and has no time after some questions.

    Attributes:
        asked: How many there were.
    """

    def __init__(self, case: Case, enough: int) -> None:
        self.asked = 0
        self._case = case
        self._enough = enough

    def ask(self, facts: FrozenSet[Fact]) -> Verdict:
        self.asked += 1
        if self.asked > self._enough:
            raise InterruptedQuestionError("no time")
        return self._case.ask(facts)


@pytest.mark.costly
def test_what_is_found_in_part_suffices() -> None:
    """There is time for some questions to the copy only."""
    told = [f"event(info,{what}({cell}),0)" for what in ("open", "close") for cell in range(2, 7)]
    told += ["event(1,visit(6),0)", "event(2,visit(3),0)"]
    told = [atom for atom in told if "open(5)" not in atom and "open(3)" not in atom]
    goals = (("1", "visit(6)"), ("2", "visit(3)"))
    situation, deadline = Situation(tuple(told), last=9, goals=goals), Deadline(SECONDS)
    copy = AssumingCopy(Options((LINE,)), situation, deadline)
    sizes = []
    for enough in (*range(1, 20, 4), 100):
        case = Case(copy, situation, deadline, says_ends=True)
        hurried = Hurried(case, enough)
        reason = ReasonSearch(hurried.ask, case.facts, deadline).run()
        atoms = [atom for fact in reason.facts for atom in fact.atoms]
        assert one_shot(Dialect2, atoms, 0, 9) is None
        sizes.append(len(reason.members))
        if reason.is_complete and reason.is_smallest:
            break
        assert hurried.asked > enough
    assert reason.is_smallest
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] == len(told)
    assert sizes[-1] == 2


def test_phrases_are_read(tmp_path: Path) -> None:
    file = tmp_path / "phrases.lp"
    file.write_text(
        '#program phrases. phrase("visit(X)", "X is to be visited").'
        'phrase("close(X)", "cell X is closed"). phrase("pair(X,X)", "X twice").'
    )
    phrases = Phrases.read([file.read_text()])
    assert phrases.of("close(f(3))") == "cell f(3) is closed"
    assert phrases.of("pair(a,b)") == "pair(a,b)"
    situation = Situation(
        ("event(1,visit(6),0)", "event(info,close(5),0)"), last=9, goals=(("1", "visit(6)"),)
    )
    text = Explainer(Options((LINE, str(file))), situation, seconds=SECONDS).no_plan().text
    assert text.startswith("There is no plan for visit(6) because cell 5 is closed. Without that")


def test_the_situation_of_a_loop(system: Make) -> None:
    made = system("dynamic.incremental.recording", "-c", "steps=30")
    made.world.answer = lambda actuator, action: None
    goal = made.begin("visit(4)")
    goal.wait_until_accepted()
    commit = "event(commit,do(robot,go(2)),1)"
    wait_for(lambda: made.loop.state.externals.is_true(commit))
    situation = Situation.of(made.loop.state, 30)  # the loop waits for an answer
    assert commit in situation.told
    assert situation.goals == (("1", "visit(4)"),)
    assert [actuator for actuator, _ in situation.silent] == ["robot"]
    sent = pickle.loads(pickle.dumps(situation))
    assert sent == situation
    answer = Explainer(Options((LINE,)), sent, seconds=SECONDS).goal("1")
    assert answer.ends == 3
    assert pickle.loads(pickle.dumps(answer)) == answer
    assert decode(WhyGoal, encode(answer)) == answer
    assert "robot has not answered for 0 s; it was told to do go(2)." in answer.text


@pytest.mark.costly
def test_a_long_run_is_told_as_what_holds(system: Make) -> None:
    """The robot goes up and down the line, and does not answer any more in the end."""
    made = system("dynamic.incremental.recording", "-c", "steps=90")
    answers = itertools.chain(["success"] * 24, itertools.repeat(None))
    made.world.answer = lambda actuator, action: next(answers)
    made.send("info", "close(5)")
    made.start()
    for cell in (4, 1) * 4:
        assert made.goal(f"visit({cell})").wait() == "succeeded"
    made.goal("visit(3)")
    made.world.wait_for(lambda world: len(world.actions) == 25)
    situation = Situation.of(made.loop.state)  # the loop waits for an answer
    step = made.loop.state.step
    assert situation.step + situation.offset == step
    assert situation.step <= 2
    assert set(situation.told) >= {"event(save,at(1),0)", "event(save,closed(5),0)"}
    explainer = Explainer(Options((LINE,)), situation, seconds=SECONDS)
    goal = explainer.goal("1")
    assert goal.ends == step + 1
    assert f"visit(3) ends in step {step + 1}, and it is step {step} now" in goal.text
    contrast = explainer.why(f"do(robot,go(3),{step + 1})")
    assert contrast.is_planned
    assert contrast.longer == 1
    for question in (explainer.why, explainer.why_not):
        with pytest.raises(QuestionError, match=f"step {step - 1} has gone by; it is step {step}"):
            question(f"do(robot,go(2),{step - 1})")
    shut = explainer.what_if(["info:close(3)"])
    assert shut.told == (f"event(info,close(3),{step})",)
    assert shut.text == (
        "There would be no plan for visit(3) because info says close(3). Without that, there "
        "would be a plan of 2 steps."
    )


def test_the_situation_of_a_control_log() -> None:
    def ground(name: str, *values: str) -> Ground:
        return Ground((Part(name, values),))

    true, false = Truth.TRUE, Truth.FALSE
    situation = Situation.after(
        [
            AssignExternal("event(1,visit(2),0)", true),
            Restart(),
            ReleaseExternal("rosoclingo_slot(1)"),
            ground("state", "0"),
            ground("state", "7"),
            AssignExternal("query(0)", true),
            AssignExternal("event(1,visit(6),0)", true),
            AssignExternal("event(info,close(3),0)", true),
            AssignExternal("event(info,close(4),0)", true),
            AssignExternal("event(info,close(3),0)", false),
            ground("event", "info", "passed", "0"),
            ground("commit", "robot", "go(2)", "1"),
            AssignExternal("event(request,(1,cancel),1)", true),
            AssignExternal("query(0)", false),
            AssignExternal("query(7)", true),
        ]
    )
    assert situation == Situation(
        told=(
            "event(1,visit(6),0)",
            "event(info,close(4),0)",
            "event(info,passed,0)",
            "event(1,cancel,1)",
            "event(commit,do(robot,go(2)),1)",
        ),
        step=1,
        horizon=7,
        last=7,
        goals=(("1", "visit(6)"),),
    )


ACTIONS = str(Path(LINE).parents[2] / "rosoclingo_aspprograms/lib/actions.lp")
BRINGING = f"""
#include "{ACTIONS}".
#program base.
way((a;b),(a;b)). moves(r). initially(at(r),a). initially(bell,works).
request((bring;ring)). wants(ring,bell,rung).
#program present(k,t).
own(ID,thing(ID),a,k) :- asked(ID,bring,k).
wants(ID,thing(ID),b,k) :- asked(ID,bring,k).
action(r,bring(ID),k) :- asked(ID,bring,k).
needs(r,bring(ID),thing(ID),a,k) :- asked(ID,bring,k).
sets(r,bring(ID),thing(ID),b,k) :- asked(ID,bring,k).
"""


@pytest.mark.costly
@pytest.mark.parametrize("slots", [3, 1])
@pytest.mark.parametrize("library", [False, True], ids=["line", "library"])
def test_a_slot_whose_goal_has_just_ended(
    system: Make, slots: int, library: bool, tmp_path: Path
) -> None:
    """What nobody has a slot for until the step ends is asked in the next step."""
    file, request, then, steps = Path(LINE), "visit(2)", "visit(4)", 2
    if library:
        file, request, then, steps = tmp_path / "bringing.lp", "bring", "bring", 1
        file.write_text(BRINGING)
    options = ("-c", f"slots={slots}")
    made = system("dynamic.incremental.recording", "-c", "steps=30", encoding=(str(file), *options))
    made.start()
    assert made.goal(request).wait() == "succeeded"
    made.world.wait_for(lambda world: not made.loop.state.executions.silent)
    situation = Situation.of(made.loop.state).up_to(30)
    assert situation.used == ("1",)
    explainer = Explainer(Options((str(file),), options), situation, seconds=SECONDS)
    plan = explainer.what_if([f"goal:{then}"]).plan
    assert plan is not None
    assert sum((last_number(action) or 0) > situation.step for action in plan.actions) == steps
