"""The import of PDDL: its parser, what it refuses, SAS+ tasks, names, variables and numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Dict, List, Optional, Tuple

import pytest
from downward_versions import VERSIONS, use_version

from plan_validator import PlanValidator
from rosoclingo.tools.pddl import alternatives, translator
from rosoclingo.tools.pddl.conditions import compile_conditions
from rosoclingo.tools.pddl.declarations import check_declarations
from rosoclingo.tools.pddl.domain import Domain, Problem, read_domain, read_problem
from rosoclingo.tools.pddl.expressions import ListForm, PddlError, Word, parse, read_file
from rosoclingo.tools.pddl.names import Identifiers
from rosoclingo.tools.pddl.numbers import Numbers, NumericUse
from rosoclingo.tools.pddl.sas import SasRule, parse_sas
from rosoclingo.tools.pddl.translator import translate
from rosoclingo.tools.pddl.variables import variables

DOMAIN = """(define (domain Lift)
(:requirements :strips :typing :action-costs)
(:types floor - object)
(:predicates (at ?f - floor) (open))
(:functions (total-cost) - number)
(:action Move ; from a floor to another
  :parameters (?a ?b - floor)
  :precondition (and (at ?a) (not (open)) (not (= ?a ?b)))
  :effect (and (at ?b) (not (at ?a)) (increase (total-cost) 2)))
(:action toggle :parameters () :precondition (and)
  :effect (and (when (open) (not (open))) (when (not (open)) (open)))))
"""
PROBLEM = """(define (problem p) (:domain Lift) (:objects f1 2nd-floor - floor)
(:init (at f1) (open) (= (total-cost) 0)) (:goal (and (at 2nd-floor) (open)))
(:metric minimize (total-cost)))
"""
WHEN = "(when (open) (not (open)))"
SAS = """begin_version
3
end_version
begin_metric
1
end_metric
2
begin_variable
var0
-1
2
Atom at(2nd-floor)
Atom at(f1)
end_variable
begin_variable
var1
-1
2
Atom open()
NegatedAtom open()
end_variable
1
begin_mutex_group
2
0 0
0 1
end_mutex_group
begin_state
1
0
end_state
begin_goal
2
0 0
1 0
end_goal
2
begin_operator
move f1 2nd-floor
1
1 1
1
0 0 1 0
2
end_operator
begin_operator
toggle@
0
2
1 1 0 1 -1 1
1 1 1 1 -1 0
0
end_operator
0
""".replace("@", " ")  # a blank at a line's end


def test_words_have_their_lines() -> None:
    form = parse(DOMAIN, "d.pddl")
    assert form.head == "define"
    move = next(f for f in form.forms() if f.head == ":action")
    assert (move.place, move.parts[1]) == ("d.pddl:6", Word("move", "d.pddl:6"))
    assert ListForm((), "d.pddl:10") in list(form.forms())


def test_a_variable_begins_a_word() -> None:
    (inner,) = parse("((at?x ?y?z ?))", "d").parts
    assert inner.text == "(at ?x ?y ?z ?)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(define\n(a)", "d:1: this parenthesis is not closed"),
        ("(a)\n)", "d:2: a parenthesis is closed"),
        ("; nothing\n", "d:1: the file is empty"),
        ("\nword (a)", "d:2: word is not in parentheses"),
        ("(a)\n(b)", "d:2: there is more"),
        ("(a\n" + 5000 * "b" + ")", "d:2: the word bbb"),
        ("(a\n" + 5000 * "(not " + 5001 * ")", "d:2: there are more than 100 parentheses open"),
    ],
)
def test_what_is_no_list_is_refused(text: str, message: str) -> None:
    with pytest.raises(PddlError, match=re.escape(message)):
        parse(text, "d")


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PddlError, match=r"cannot read .*domain\.pddl"):
        read_file(tmp_path / "domain.pddl")


def test_what_is_understood_passes() -> None:
    domain = read_domain(parse(DOMAIN, "d"))
    assert [action.name for action in domain.actions] == ["move", "toggle"]
    problem = read_problem(parse(PROBLEM, "p"))
    assert problem.objects == {"f1": "floor", "2nd-floor": "floor"}
    assert problem.numbers == {"(total-cost)": 0}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (":action-costs", ":preferences", "d:2: :preferences is not understood"),
        ("(:action toggle", "(:derived toggle", "d:10: (:derived toggle :parameters () :preco"),
        ("(not (open)) (not", "(or (open)) (not", "d:8: or in :precondition is not understood"),
        ("(increase (total-cost) 2)", "(scale-up (fuel) 2)", "d:9: scale-up in :effect is not"),
        ("(:action Move ;", "(:action ;", "d:7: one of"),
        (":precondition (and)", ":observe (and)", "d:10: :observe is not understood"),
        ("(domain Lift)", "(problem Lift)", "d:1: this is no domain"),
        ("(when (open) (not (open)))", "(when (open))", "d:11: when has a condition"),
        ("(when (open) (not (open)))", "(when (> (fuel) 1) (open))", "d:11: > in a condition of"),
        ("(not (open)) (not", "(not) (not", "d:8: not has one part"),
        ("(not (open)) (not", "((open)) (not", "d:8: a predicate is expected"),
        ("?a ?b - floor", "?a ?b - (either floor lift)", "d:7: the name of one type"),
    ],
)
def test_what_is_not_understood_is_refused_by_name_and_line(
    old: str, new: str, message: str
) -> None:
    assert old in DOMAIN
    with pytest.raises(PddlError, match=re.escape(message)):
        read_domain(parse(DOMAIN.replace(old, new), "d"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(and (at", "(exists (?f - floor) (at", "p:2: exists in :goal is not understood"),
        ("(and (at", "(and (not (> (total-cost) 3)) (at", "p:2: > in not is not understood"),
        ("(open) (=", "(at 5 (open)) (=", r"p:2: (at 5 (open)) in :init is not understood"),
        ("minimize", "maximize", "p:3: (:metric maximize (total-cost)) is not understood"),
        ("(= (total-cost) 0)", "(= (total-cost) none)", "p:2: none is no number"),
        ("(:objects", "(:domain x) (:objects", "p:1: :domain is there twice"),
    ],
)
def test_a_problem_that_is_not_understood_is_refused(old: str, new: str, message: str) -> None:
    assert old in PROBLEM
    with pytest.raises(PddlError, match=re.escape(message)):
        read_problem(parse(PROBLEM.replace(old, new), "p"))


@pytest.mark.parametrize(
    ("words", "terms"),
    [
        (["pick-up", "pick_up"], ["pick_up_", "pick_up"]),
        (["room1", "12", "007", "2nd-floor"], ["room1", "12", "x007", "x2nd_floor"]),
        (["not", "goal", "cancel"], ["not_", "goal_", "cancel_"]),
        (["_a", "_1", "b'"], ["_a", "x_1", "b_"]),
    ],
)
def test_each_name_has_a_term_of_its_own(words: List[str], terms: List[str]) -> None:
    names = Identifiers(words)
    assert [names.term(word) for word in words] == terms


@pytest.mark.parametrize(
    ("values", "name", "terms"),
    [
        (["Atom at(t, a)", "Atom at(t, b)", "<none of those>"], "at(t)", ["a", "b", "none"]),
        (["Atom at(p, a)", "Atom in(p, t)"], "at_or_in(p)", ["at(p,a)", "in(p,t)"]),
        (["Atom on(a, b)", "NegatedAtom on(a, b)"], "on(a,b)", ["yes", "no"]),
        (["Atom open()", "<none of those>"], "open", ["yes", "no"]),
        (["Atom here(a)", "Atom here(b)"], "here", ["a", "b"]),
        (["Atom level(none)", "Atom level(a)", "<none of those>"], "variable(1)",
         ["level(none)", "level(a)", "none"]),
    ],
)  # fmt: skip
def test_a_variable_is_called_by_what_its_values_have_in_common(
    values: List[str], name: str, terms: List[str]
) -> None:
    names = Identifiers(["at", "in", "on", "open", "here", "level", "t", "p", "a", "b", "none"])
    (variable,) = variables([values], names)
    assert (variable.name, list(variable.values)) == (name, terms)


def test_two_variables_have_two_names() -> None:
    names = Identifiers(["at", "t", "a", "b"])
    groups = [["Atom at(t, a)", "Atom at(t, b)"], ["Atom at(t)", "NegatedAtom at(t)"]]
    assert [each.name for each in variables(groups, names)] == ["at(t)", "variable(2)"]


@pytest.mark.parametrize("text", ["", SAS[:200], SAS.replace("begin_goal", "begin_gaol")])
def test_what_is_not_sas_is_refused(text: str) -> None:
    with pytest.raises(PddlError, match=r"line \d+, is not SAS\+"):
        parse_sas(text)


def test_rules_of_derived_variables_are_read() -> None:
    derived = "begin_variable\nvar2\n1\n2\nAtom dark()\nNegatedAtom dark()\nend_variable\n"
    text = SAS.replace("\n2\nbegin_variable", f"\n3\n{derived}begin_variable", 1)
    text = text.replace("begin_state\n", "begin_state\n1\n")
    task = parse_sas(text[: -len("0\n")] + "1\nbegin_rule\n1\n1 0\n0 1 0\nend_rule\n")
    assert (task.strata, task.rules) == ({0: 1}, (SasRule(0, ((1, 0),)),))
    assert task.init == (1, 1, 0)


def test_the_remedy_is_named_without_fast_downward(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(translator, "find_fast_downward", lambda: None)
    with pytest.raises(PddlError, match="pip install up-fast-downward"):
        translate(read_domain(parse(DOMAIN, "d")), read_problem(parse(PROBLEM, "p")))


def test_the_remedy_is_named_for_another_layout(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(translator, "find_fast_downward", lambda: tmp_path)
    with pytest.raises(PddlError, match=r"\d has no translator in .*: run pip install .*==1.0.0"):
        translate(read_domain(parse(DOMAIN, "d")), read_problem(parse(PROBLEM, "p")))


@pytest.mark.costly
@pytest.mark.parametrize("version", VERSIONS)
def test_each_version_translates(monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    use_version(monkeypatch, version)
    task = translate(read_domain(parse(DOMAIN, "d")), read_problem(parse(PROBLEM, "p")))
    assert task.goal
    assert [one.name for one in task.operators] == [
        "move 2nd-floor f1",
        "move f1 2nd-floor",
        "toggle",
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(not (= ?a ?b))", "(not (= ?a ?c))", "d:8: the variable ?c is no parameter: there are"),
        ("(not (open))", "(not (opne))", "d:8: opne is not declared: there are at, open"),
        ("(at ?b) (not", "(at ?b ?a) (not", "d:9: (at ?b ?a) has 2 objects: at is declared"),
        ("?a ?b - floor", "?a ?b - room", "d:6: the type room is not declared: there are floor"),
        ("(at 2nd-floor)", "(at f3)", "p:2: there is no object f3: there are 2nd-floor, f1"),
        ("(at f1)", "(it f1)", "p:2: it is not declared"),
        ("2nd-floor - floor", "2nd-floor - flor", "p:1: f1 is of the type flor, which is not"),
        (WHEN, "(forall (?x - flor) (not (at ?x)))", "d:11: the type flor is not declared"),
        (WHEN, "(forall (?x - floor) (not (at ?y)))", "d:11: the variable ?y is no parameter"),
    ],
)
def test_a_name_that_is_not_declared_is_refused_with_its_line(
    old: str, new: str, message: str
) -> None:
    assert old in DOMAIN + PROBLEM
    domain, problem = DOMAIN.replace(old, new), PROBLEM.replace(old, new)
    with pytest.raises(PddlError, match=re.escape(message)):
        check_declarations(read_domain(parse(domain, "d")), read_problem(parse(problem, "p")))


def _execute(*plan: str) -> PlanValidator:
    validator = PlanValidator(read_domain(parse(DOMAIN, "d")), read_problem(parse(PROBLEM, "p")))
    for step in plan:
        name, *objects = step.split()
        validator.execute(name, objects)
    validator.require_goal()
    return validator


def test_a_plan_is_validated() -> None:
    validator = _execute("toggle", "move f1 2nd-floor", "toggle")
    assert validator.numbers[("total-cost",)] == 2


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (["move f1 2nd-floor"], "move f1 2nd-floor: (not (open)) does not hold"),
        (["toggle", "move f1 2nd-floor"], "the goal: (open) does not hold"),
        (["fly"], "there is no action fly"),
        (["move f1"], "move has 2 objects"),
        (["toggle", "move f1 f1"], "(not (= ?a ?b)) does not hold"),
        (["toggle", "move f1 f9"], "f9 is no floor"),
    ],
)
def test_a_plan_that_is_not_valid_is_refused(plan: List[str], message: str) -> None:
    with pytest.raises(PddlError, match=re.escape(message)):
        _execute(*plan)


FLEET = """(define (domain fleet)
(:requirements :typing :durative-actions :numeric-fluents)
(:types robot place)
(:predicates (at ?r - robot ?p - place) (door) (busy ?r - robot))
(:functions (battery ?r - robot) (far ?a ?b - place) (bags ?r - robot) (walked))
(:durative-action go :parameters (?r - robot ?a ?b - place)
 :duration (= ?duration (/ (far ?a ?b) 2))
 :condition (and (at start (at ?r ?a)) (at start (door)) (at start (not (busy ?r)))
  (over all (busy ?r)) (at start (>= (battery ?r) (far ?a ?b))) (at start (< 0 (far ?a ?b))))
 :effect (and (at start (and (busy ?r) (not (door)) (not (at ?r ?a)))) (at end (door))
  (at end (not (busy ?r))) (at end (at ?r ?b)) (at end (decrease (battery ?r) (far ?a ?b)))
  (at end (increase (walked) ?duration))))
(:durative-action charge :parameters (?r - robot ?a - place) :duration (= ?duration 3)
 :condition (over all (at ?r ?a)) :effect (at end (assign (battery ?r) 9)))
(:action load :parameters (?r - robot) :precondition (<= (bags ?r) 1)
 :effect (increase (bags ?r) 1)))
"""
FLEET_PROBLEM = """(define (problem p) (:domain fleet)
(:objects r1 - robot a b - place)
(:init (at r1 a) (door) (= (battery r1) 5) (= (far a b) 4) (= (far b a) 4) (= (far a a) 0)
 (= (bags r1) 0) (= (walked) 0))
(:goal (at r1 b))
(:metric minimize (+ (* 10 (total-time)) (walked))))
"""


def _uses(domain: str, problem: str = FLEET_PROBLEM, **limits: int) -> Dict[str, object]:
    numbers = Numbers(read_domain(parse(domain, "d")), read_problem(parse(problem, "p")), limits)
    actions = {
        "go": ["r1", "a", "b"], "stay": ["r1", "a", "a"], "charge": ["r1", "a"], "load": ["r1"]
    }  # fmt: skip
    named = [("go" if name == "stay" else name, objects) for name, objects in actions.items()]
    uses: Dict[str, object] = dict(zip(actions, numbers.read(named)))
    return {**uses, "largest": numbers.largest}


def test_an_action_with_a_duration_is_one_change() -> None:
    go, charge, _ = read_domain(parse(FLEET, "d")).actions
    assert go.precondition.text == "(and (at ?r ?a) (door) (not (busy ?r)))"
    assert go.effect.text == "(and (not (at ?r ?a)) (at ?r ?b))"
    assert [lock.text for lock in go.locks] == ["(door)", "(busy ?r)"]
    assert charge.precondition.text == "(and (at ?r ?a))"


def test_numbers_are_used_given_and_filled() -> None:
    battery, bags = ("battery", "r1"), ("bags", "r1")
    assert _uses(FLEET) == {
        "go": NumericUse({}, {battery: 4}, {}, (), 22),
        "stay": None,  # it is not far enough
        "charge": NumericUse({}, {}, {}, (battery,), 30),
        "load": NumericUse({}, {}, {bags: 1}, (), 10),
        "largest": {battery: 9, bags: 2},
    }


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(battery ?r) 9", "(battery ?r) 2.5", "d:14: 2.5 is 2.5 for charge"),
        ("(battery ?r) 9", "(battery ?r) 1e999", "d:14: 1e999 is no amount"),
        ("(battery ?r) 9", "(battery ?r) nan", "d:14: nan is no amount"),
        ("(battery ?r) 9", "(battery ?r) (* 1e300 1e300)", "(* 1e300 1e300) is too large for"),
        ("(battery ?r) 9", "(battery ?r) 4000000000", "d:14: 4000000000 is 4e+09 for charge: it "
         "has to be a whole number from 0 to 999999999"),
        ("(battery ?r) 9", "(battery ?r) (bags ?r)", "d:14: (bags ?r) changes, and an amount"),
        ("(= ?duration 3)", "(= ?duration (/ 3 0))", "d:13: (/ 3 0) divides by 0"),
        ("(= ?duration 3)", "(= ?duration (age ?r))", "d:13: (age r1) has no value in :init"),
        ("(= ?duration 3)", "(<= ?duration 3)", "d:13: (<= ?duration 3) as :duration is not"),
        ("(over all (busy ?r))", "(over all (door))", "d:9: (door) never holds then"),
        (":condition (over all (at ?r ?a))", ":condition (over all (busy ?r))",
         "d:11: (busy ?r) holds only while go lasts, and charge needs it"),
    ],
)  # fmt: skip
def test_numbers_and_durations_that_the_library_has_not_are_refused(
    old: str, new: str, message: str
) -> None:
    assert old in FLEET
    with pytest.raises(PddlError, match=re.escape(message)):
        _uses(FLEET.replace(old, new))


@pytest.mark.parametrize("value", ["1e999", "-inf", "nan", "9" * 400, "1_0", "x"])
def test_what_is_no_number_in_init_is_refused(value: str) -> None:
    with pytest.raises(PddlError, match=r"^p:3: .* is no number"):
        _uses(FLEET, FLEET_PROBLEM.replace("(battery r1) 5", f"(battery r1) {value}"))


@pytest.mark.parametrize("wrong", ["(forall)", "(forall () y ?r)", "(forall x (door))"])
@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("(decrease (battery ?r) ", "(decrease {} ", 11),
        ("(decrease (battery ?r) (far ?a ?b))", "(decrease (battery ?r) {})", 11),
        ("(= ?duration 3)", "(= ?duration {})", 13),
    ],
)
def test_a_broken_forall_as_an_amount_is_refused(old: str, new: str, line: int, wrong: str) -> None:
    assert old in FLEET
    problem = read_problem(parse(FLEET_PROBLEM, "p"))
    with pytest.raises(PddlError, match=f"^d:{line}: "):
        check_declarations(read_domain(parse(FLEET.replace(old, new.format(wrong)), "d")), problem)


BOUNDS = """(define (domain bounds) (:requirements :typing :numeric-fluents)
(:types robot) (:predicates (done)) (:functions (battery ?r - robot))
(:action go :parameters (?r ?s - robot) :precondition (and {needed})
 :effect (and (done) {changes})))
"""
BOUNDS_PROBLEM = """(define (problem p) (:domain bounds) (:objects r1 r2 - robot)
(:init (= (battery r1) 5) (= (battery r2) 5)) (:goal (done)))
"""
R1 = ("battery", "r1")


def _bounds(needed: str, changes: str = "", *objects: str) -> Optional[NumericUse]:
    domain = read_domain(parse(BOUNDS.format(needed=needed, changes=changes), "d"))
    numbers = Numbers(domain, read_problem(parse(BOUNDS_PROBLEM, "p")), {"battery": 50})
    return numbers.read([("go", objects or ("r1", "r2"))])[0]


@pytest.mark.parametrize(
    ("needed", "changes", "use"),
    [
        ("(>= (battery ?r) 20) (>= (battery ?r) 6)", "(decrease (battery ?r) 6)",
         NumericUse({R1: 20}, {R1: 6}, {}, (), 1)),
        ("(>= (battery ?r) 6) (>= (battery ?r) 20)", "(decrease (battery ?r) 6)",
         NumericUse({R1: 20}, {R1: 6}, {}, (), 1)),
        ("(<= (battery ?r) 9) (< (battery ?r) 4)", "(increase (battery ?r) 1)",
         NumericUse({}, {}, {R1: 1}, (), 1, {R1: 3})),
        ("(>= (battery ?r) 0)", "(increase (battery ?r) 1) (increase (battery ?r) 1)",
         NumericUse({}, {}, {R1: 2}, (), 1)),
        ("(>= (battery ?r) 0)", "(increase (battery ?r) 1) (decrease (battery ?r) 3)",
         NumericUse({}, {R1: 2}, {}, (), 1)),
        ("(= (battery ?r) 4)", "(assign (battery ?r) 7)",
         NumericUse({R1: 4}, {}, {}, (), 1, {R1: 4}, {R1: 7})),
        ("(> 4.5 (battery ?r))", "(assign (battery ?r) (+ (battery ?r) 2))",
         NumericUse({}, {}, {R1: 2}, (), 1, {R1: 4})),
        ("(>= (- (battery ?r) 3) 4)", "(decrease (battery ?r) 1)",
         NumericUse({R1: 7}, {R1: 1}, {}, (), 1)),
        ("(>= (battery ?r) 4) (<= (battery ?r) 3)", "(decrease (battery ?r) 1)", None),
    ],
)  # fmt: skip
def test_all_that_is_said_of_a_number_counts(
    needed: str, changes: str, use: Optional[NumericUse]
) -> None:
    assert _bounds(needed, changes) == use


def test_two_variables_may_be_the_same_object() -> None:
    both = "(decrease (battery ?r) 2) (decrease (battery ?s) 3)"
    assert _bounds("(>= (battery ?r) 0)", both, "r1", "r1") == NumericUse({}, {R1: 5}, {}, (), 1)
    with pytest.raises(PddlError, match=r"d:4: go assigns \(battery r1\), and changes it"):
        _bounds("(>= (battery ?r) 1)", "(assign (battery ?r) 2) (increase (battery ?s) 1)",
                "r1", "r1")  # fmt: skip
    with pytest.raises(PddlError, match=r"d:3: .* compares .* which both change"):
        _bounds("(>= (battery ?r) (battery ?s))", both)


@pytest.mark.parametrize(
    ("start", "later", "least"),
    [("(decrease (battery ?r) 5)", "(over all (>= (battery ?r) 3))", 8),
     ("(decrease (battery ?r) 5)", "(at start (>= (battery ?r) 3))", 5)],
)  # fmt: skip
def test_a_bound_over_all_is_about_what_the_start_leaves(
    start: str, later: str, least: int
) -> None:
    domain = f"""(define (domain lasting) (:types robot) (:predicates (done))
(:functions (battery ?r - robot)) (:durative-action go :parameters (?r - robot)
:duration (= ?duration 1) :condition {later} :effect (and (at start {start}) (at end (done)))))"""
    numbers = Numbers(
        read_domain(parse(domain, "d")), read_problem(parse(BOUNDS_PROBLEM, "p")), {"battery": 50}
    )
    (use,) = numbers.read([("go", ["r1"])])
    assert use is not None
    assert max(use.needs.get(R1, 0), use.uses[R1]) == least


ADL = """(define (domain adl) (:types robot box - thing)
(:predicates (on ?t - thing) (red ?t - thing) (done)) (:functions (load))
(:action act :parameters (?r - robot) :precondition {needed} :effect (done))
(:action put :parameters (?t - thing) :effect (and (on ?t) (increase (load) 1))))
"""
ADL_PROBLEM = """(define (problem p) (:domain adl) (:objects r1 - robot b1 b2 - box)
(:init (red b1) (= (load) 0)) (:goal {goal}))
"""


def _compiled(needed: str, goal: str = "(done)") -> Tuple[Domain, Problem]:
    forms = parse(ADL.format(needed=needed), "d"), parse(ADL_PROBLEM.format(goal=goal), "p")
    return compile_conditions(*forms)


@pytest.mark.parametrize(
    ("needed", "found"),
    [
        ("(or (on ?r) (not (done)))", {"act": "(and (on ?r))", "act-or-2": "(and (not (done)))"}),
        ("(forall (?b - box) (imply (red ?b) (on ?b)))", {"act": "(and (on b1))"}),
        ("(exists (?b - box) (on ?b))", {"act": "(and (on ?b-1))"}),
        ("(not (or (on ?r) (done)))", {"act": "(and (not (act-unless-1 ?r)))"}),
        ("(not (exists (?b - box) (on ?b)))", {"act": "(and (not (act-unless-1)))"}),
        ("(or (on ?r) (and (on ?r) (done)))", {"act": "(and (on ?r))"}),
        ("(and (or (on ?r) (done)) (not (on ?r)))", {"act": "(and (done) (not (on ?r)))"}),
        ("(forall (?b - (either box robot)) (on ?b))",
         {"act": "(and (on b1) (on b2) (on r1))"}),
    ],
)  # fmt: skip
def test_alternatives_are_actions(needed: str, found: Dict[str, str]) -> None:
    domain, _ = _compiled(needed)
    assert {each.name: each.precondition.text for each in domain.actions[:-1]} == found


LIGHTS = """(define (domain lights) (:requirements :derived-predicates :durative-actions)
(:types room lamp) (:predicates (on ?l - lamp) (in ?l - lamp ?r - room) (bright ?r - room)
  (next ?a ?b - room) (all)) (:functions (power))
(:derived (bright ?r - room) (or (exists (?l - lamp) (and (in ?l ?r) (on ?l)))
  (exists (?q - room) (and (next ?q ?r) (bright ?q)))))
(:derived (all) (and (forall (?r - room) (bright ?r)) (> (power) 2)))
(:action light :parameters (?l - lamp) :precondition (not (all)) :effect (on ?l))
(:durative-action dim :parameters (?l - lamp) :duration (= ?duration 2)
  :condition (over all (all)) :effect (and (at end (not (on ?l))) (at end (decrease (power) 1)))))
"""
LIGHTS_PROBLEM = """(define (problem p) (:domain lights) (:objects a b - room l - lamp)
(:init (in l a) (next a b) (= (power) 5))
(:goal (and (bright b) (not (all)))))
"""


def _check_lights(old: str = "", new: str = "") -> Domain:
    assert old in LIGHTS + LIGHTS_PROBLEM
    forms = [
        parse(text.replace(old, new) if old else text, name)
        for text, name in ((LIGHTS, "d"), (LIGHTS_PROBLEM, "p"))
    ]
    domain, problem = compile_conditions(*forms)
    check_declarations(domain, problem)
    return domain


def test_a_derived_predicate_has_a_rule_for_each_alternative() -> None:
    assert [rule.text for rule in _check_lights().rules] == [
        "(:derived (bright ?r - room) (exists (?l-1 - lamp) (and (in ?l-1 ?r) (on ?l-1))))",
        "(:derived (bright ?r - room) (exists (?q-2 - room) (and (next ?q-2 ?r) (bright ?q-2))))",
        "(:derived (all ) (and (bright a) (bright b) (all-number-1)))",
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("(bright ?q))", "(not (bright ?q)))", "d:5: bright depends on the contrary of bright"),
        ("(next ?q ?r)", "(not (all))", "d:5: bright depends on the contrary of all, which"),
        (":effect (on ?l))", ":effect (bright ?l))", "d:7: light changes bright, which is derived"),
        (":init (in", ":init (bright a) (in", "p:2: (bright a) in :init: bright is derived"),
        ("?b - room) (all))", "?b - room))", "d:7: all is not declared: there are bright, in,"),
        ("(:derived (all) (and", "(:derived all (and", "d:6: (:derived all (and (forall (?r"),
        ("(:derived (all) (and", "(:derived (all) x (and", "d:6: (:derived (all) x (and"),
        ("(bright ?r - room) (or", "(bright a) (or", "d:4: a in (bright a): what is derived has"),
        ("(bright ?r - room) (or", "(bright ?r ?s) (or", "d:4: (bright ?r ?s) has 2 objects"),
        ("(?l - lamp) (and", "(?l - lmp) (and", "d:4: the type lmp is not declared"),
        ("(in ?l ?r)", "(in ?k ?r)", "d:4: the variable ?k is no parameter"),
        ("(> (power) 2)", "(> (powre) 2)", "d:6: powre is not declared"),
        ("(> (power) 2)", "(assign (power) 2)", "d:6: assign in a condition is not understood"),
        ("(> (power) 2)", "(>= (power))", "d:6: >= has two parts, and this has 1"),
        ("(and (at end (not (on", "(and (at start (not (on",
         "d:9: all is derived from what dim changes at its start"),
        ("(at end (decrease", "(at start (decrease", "d:9: all is derived from what dim changes"),
        ("(at end (not (on ?l)))", "(at start (on ?l)) (at end (not (on ?l)))",
         "d:9: all is derived from what dim changes at its start"),
        ("(power))", "(place ?l - lamp) - room)", "d:3: a function of the type room is not under"),
    ],
)  # fmt: skip
def test_derived_predicates_are_refused_by_name_and_line(old: str, new: str, message: str) -> None:
    with pytest.raises(PddlError, match=re.escape(message)):
        _check_lights(old, new)


def test_what_an_action_takes_and_gives_back_is_not_derived_from() -> None:
    old = ":condition (over all (all)) :effect (and (at end (not (on ?l)))"
    new = ":condition () :effect (and (at start (not (on ?l))) (at end (on ?l))"
    with pytest.raises(PddlError, match="d:9: on is another one while dim lasts, and light needs"):
        _check_lights(old, new)


@pytest.mark.costly
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("needed", "strata"),
    [
        (" ".join(f"(or (on {box}) (done))" for box in ("b1", "b2")), 0),
        (" ".join(f"(imply (red {box}) (on {box}))" for box in ("b1", "b2")), 0),
        (" ".join(f"(or (on {a}) (on {b}))" for a in ("b1", "b2") for b in ("b1", "r1")), 3),
        ("(forall (?b - box) (not (on ?b))) (not (done)) (not (on ?r))", 0),
        (" ".join("(exists (?b - box) (on ?b))" for _ in range(20)), 1),
    ],
)
def test_parts_of_a_condition_are_derived_only_if_they_have_to_be(
    needed: str, strata: int, version: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_version(monkeypatch, version)
    monkeypatch.setattr(alternatives, "MOST_ALTERNATIVES", 2)
    monkeypatch.setattr(alternatives, "_MOST_SIZE", 4)
    task = translate(*_compiled(f"(and {needed})"))
    assert len(task.strata) == strata
    assert {one.name.split()[0] for one in task.operators} >= {"act", "put"}


DENIED = """(define (domain denied) (:predicates (at ?p) (lit))
(:action go :parameters (?a ?b) :precondition (and (at ?a) (not (at ?b)) (not (lit)))
  :effect (and (not (at ?a)) (at ?b) (not (lit))))
(:action light :parameters (?a) :precondition (and (not (at ?a)) (not (lit))) :effect (lit)))
"""
DENIED_PROBLEM = """(define (problem p) (:domain denied) (:objects a b c)
(:init (at a)) (:goal (and (lit) (not (at c)))))
"""


@pytest.mark.costly
@pytest.mark.parametrize("version", VERSIONS)
def test_what_is_denied_is_in_its_place(version: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A goal that denies one of several values ended the translator."""
    use_version(monkeypatch, version)
    task = translate(*compile_conditions(parse(DENIED, "d"), parse(DENIED_PROBLEM, "p")))
    by_name = {one.name: one for one in task.operators}
    assert sorted(name for name in by_name if name.startswith("go")) == [
        f"go {a} {b}" for a in "abc" for b in "abc" if a != b
    ]
    (at,) = (v for v, values in enumerate(task.variables) if "Atom at(a)" in values)
    (lit,) = (v for v, values in enumerate(task.variables) if "Atom lit()" in values)
    go, light = by_name["go a b"], by_name["light b"]
    assert {variable for variable, _ in go.preconditions} == {at, lit}
    assert ([one.variable for one in go.effects], go.exclusions) == ([at], ())
    assert light.exclusions == ((at, task.variables[at].index("Atom at(b)")),)
    assert len(task.strata) == 1


def test_an_action_without_parameters_gets_those_that_exist() -> None:
    domain = ADL.format(needed="(exists (?b - box) (on ?b))")
    problem = ADL_PROBLEM.format(goal="(done)")
    forms = parse(domain.replace(" :parameters (?r - robot)", ""), "d"), parse(problem, "p")
    act = compile_conditions(*forms)[0].actions[0]
    assert (act.parameters, act.types) == (("?b-1",), ("box",))


def test_what_is_nested_as_deeply_as_can_be_is_compiled() -> None:
    deep = 46 * "(not (and " + "(on ?r)" + 46 * "))"
    domain, _ = _compiled(deep)
    assert domain.actions[0].precondition.text == "(and (on ?r))"


def test_alternatives_of_a_goal_are_derived() -> None:
    domain, problem = _compiled("(done)", "(and (on b1) (or (done) (> (load) 4)))")
    assert problem.goal.text == "(and (on b1) (goal-if-1))"
    assert [each.text for each in domain.rules] == [
        "(:derived (goal-if-1 ) (and (done)))",
        "(:derived (goal-if-1 ) (and (goal-if-1-number-1)))",
    ]
    assert [each.comparison.text for each in domain.tests] == ["(> (load) 4)"]
    _, problem = _compiled("(done)", "(and (forall (?b - box) (on ?b)) (not (>= (load) 4)))")
    assert problem.goal.text == "(and (on b1) (on b2))"
    assert [each.text for each in problem.comparisons] == ["(< (load) 4)"]


@pytest.mark.costly
def test_a_predicate_of_the_domain_may_be_called_as_those_that_are_made() -> None:
    """It is not left out, though neither the goal nor an action reads it."""
    lights = LIGHTS.replace("(not (all))", "()").replace("(over all (all))", "()")
    lights = lights.replace("(all)", "(all-if-1)")
    problem = LIGHTS_PROBLEM.replace("(not (all))", "")
    task = translate(*compile_conditions(parse(lights, "d"), parse(problem, "p")))
    assert ("Atom all-if-1()", "NegatedAtom all-if-1()") in task.variables


@pytest.mark.costly
@pytest.mark.parametrize("version", VERSIONS)
def test_a_condition_over_all_objects_is_translated(
    monkeypatch: pytest.MonkeyPatch, version: str
) -> None:
    """The objects are those of the problem, and the actions are the domain's."""
    use_version(monkeypatch, version)
    task = translate(*_compiled("(forall (?b - box) (on ?b))"))
    (act,) = (one for one in task.operators if one.name.startswith("act "))
    assert len(act.preconditions) == 2


@pytest.mark.costly
@pytest.mark.parametrize("goal", ["(red b1)", "(and (red b1) (on b2))", "(and)"])
def test_a_goal_of_numbers_is_open_whatever_else_it_has(goal: str) -> None:
    """Fast Downward does not know them; some facts hold whatever is done."""
    task = translate(*_compiled("(done)", f"(and {goal} (>= (load) 2))"))
    assert [task.variables[variable][value] for variable, value in task.goal] == (
        ["Atom on(b2)"] if "on" in goal else []
    )


def test_what_an_effect_reads_it_does_not_change() -> None:
    """So it is decided at once."""
    reads = ADL.replace(":effect (and (on ?t)", ":effect (and (when (red ?t) (on ?t))")
    problem = ADL_PROBLEM.format(goal="(forall (?b - box) (imply (red ?b) (on ?b)))")
    _, compiled = compile_conditions(parse(reads.format(needed="(done)"), "d"), parse(problem, "p"))
    assert compiled.goal.text == "(and (on b1))"


def test_a_constant_is_no_object_once_more() -> None:
    text = ADL.replace("(:predicates", "(:constants b2 - box)\n(:predicates")
    domain = read_domain(parse(text.format(needed="(done)"), "d"))
    problem = read_problem(parse(ADL_PROBLEM.format(goal="(done)"), "p"))
    with pytest.raises(PddlError, match=r"^p:1: b2 is one of the domain's :constants already"):
        check_declarations(domain, problem)


def test_a_byte_order_mark_and_a_missing_blank_are_read(tmp_path: Path) -> None:
    file = tmp_path / "domain.pddl"
    file.write_bytes(b"\xef\xbb\xbf" + DOMAIN.replace("?f - floor", "?f -floor").encode())
    assert [action.name for action in read_domain(read_file(file)).actions] == ["move", "toggle"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("f1 2nd-floor - floor", "f1\n f1 - floor", "p:2: f1 is there twice"),
        ("(= (total-cost) 0)", "(= (total-cost) 0) (= (total-cost) 1)", "has a value already"),
    ],
)
def test_what_is_there_twice_is_refused(old: str, new: str, message: str) -> None:
    assert old in PROBLEM
    with pytest.raises(PddlError, match=re.escape(message)):
        read_problem(parse(PROBLEM.replace(old, new), "p"))


def test_a_number_that_is_too_large_is_refused_where_it_stands() -> None:
    problem = FLEET_PROBLEM.replace("(battery r1) 5", "(battery r1) 4000000000")
    with pytest.raises(PddlError, match=r"^p:3: \(battery r1\) is 4e\+09 .* from 0 to 999999999"):
        _uses(FLEET, problem)


def test_a_number_has_to_be_larger_than_what_is_used() -> None:
    less = FLEET.replace("(decrease (battery ?r) (far ?a ?b))", "(decrease (battery ?r) 1)")
    battery = ("battery", "r1")
    assert _uses(less)["go"] == NumericUse({battery: 4}, {battery: 1}, {}, (), 22)


def test_a_number_that_no_condition_reads_is_left_out() -> None:
    assert _uses(FLEET.replace("(<= (bags ?r) 1)", "(at ?r a)"))["largest"] == {
        ("battery", "r1"): 9
    }


def test_a_number_without_a_limit_gets_one_by_the_user() -> None:
    domain = FLEET.replace("(assign (battery ?r) 9)", "(increase (battery ?r) 2)")
    with pytest.raises(
        PddlError, match=r"d:14: nothing says how large .* by --most battery=NUMBER"
    ):
        _uses(domain)
    largest = _uses(domain, battery=20)["largest"]
    assert largest == {("battery", "r1"): 20, ("bags", "r1"): 2}
