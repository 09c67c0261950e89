"""The import of PDDL: its parser, what it refuses, SAS+ tasks, their plans and their facts."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import clingo
import pytest

from rosoclingo.pddl import translator
from rosoclingo.pddl.expressions import Form, PddlError, Word, parse, read_file
from rosoclingo.pddl.facts import action_term, facts, operator_names
from rosoclingo.pddl.sas import parse_sas
from rosoclingo.pddl.support import check_domain, check_problem
from rosoclingo.pddl.translator import translate

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
    assert Form((), "d.pddl:10") in list(form.forms())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(define\n(a)", "d:1: this parenthesis is not closed"),
        ("(a)\n)", "d:2: a parenthesis is closed"),
        ("; nothing\n", "d:1: the file is empty"),
        ("\nword (a)", "d:2: word is not in parentheses"),
        ("(a)\n(b)", "d:2: there is more"),
    ],
)
def test_what_is_no_list_is_refused(text: str, message: str) -> None:
    with pytest.raises(PddlError) as err:
        parse(text, "d")
    assert message in str(err.value)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PddlError, match=r"cannot read .*domain\.pddl"):
        read_file(tmp_path / "domain.pddl")


def test_what_is_understood_passes() -> None:
    check_domain(parse(DOMAIN, "d"))
    check_problem(parse(PROBLEM, "p"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (":action-costs", ":adl", "d:2: :adl is not understood"),
        ("(:action toggle", "(:durative-action toggle", "d:10: :durative-action is not"),
        ("(not (open)) (not", "(or (open)) (not", "d:8: or in :precondition is not understood"),
        ("(increase (total-cost) 2)", "(decrease (fuel) 2)", "d:9: decrease in :effect is not"),
        ("(total-cost) 2)", "(fuel) 2)", "d:9: only (increase (total-cost) AMOUNT)"),
        ("(:action Move ;", "(:action ;", "d:7: one of"),
        (":precondition (and)", ":observe (and)", "d:10: :observe is not understood"),
        ("(domain Lift)", "(problem Lift)", "d:1: this is no domain"),
        ("(when (open) (not (open)))", "(when (open))", "d:11: when has a condition"),
        ("(not (open)) (not", "(not) (not", "d:8: not has one part"),
    ],
)
def test_what_is_not_understood_is_refused_by_name_and_line(
    old: str, new: str, message: str
) -> None:
    assert old in DOMAIN
    with pytest.raises(PddlError) as err:
        check_domain(parse(DOMAIN.replace(old, new), "d"))
    assert message in str(err.value)


def test_a_goal_that_is_not_understood_is_refused() -> None:
    text = PROBLEM.replace("(and (at", "(exists (?f - floor) (at")
    with pytest.raises(PddlError, match="p:2: exists in :goal is not understood"):
        check_problem(parse(text, "p"))


def test_plans_are_validated() -> None:
    task = parse_sas(SAS)
    assert task.cost_of(["toggle", "move f1 2nd-floor", "toggle"]) == 2
    for plan, message in (
        (["move f1 2nd-floor"], r"step 1: move f1 2nd-floor needs NegatedAtom open\(\)"),
        (["toggle", "move f1 2nd-floor"], r"the goal needs Atom open\(\)"),
        (["fly"], "step 1: there is no action fly"),
    ):
        with pytest.raises(PddlError, match=message):
            task.cost_of(plan)


def test_facts_keep_the_names() -> None:
    task = parse_sas(SAS)
    lines = facts(task)
    move = 'move(f1,"2nd-floor")'
    assert f"needs({move},1,neg(open))." in lines
    assert f'sets({move},0,at("2nd-floor")).' in lines
    assert "condition(toggle,2,1,neg(open))." in lines
    assert {"initially(0,at(f1)).", f"costs({move},2)."} < set(lines)
    assert operator_names(task)[clingo.parse_term(move)] == "move f1 2nd-floor"
    control = clingo.Control()
    control.add("base", [], "\n".join(lines))
    control.ground([("base", [])])
    assert sum(1 for _ in control.symbolic_atoms.by_signature("action", 1)) == 2


@pytest.mark.parametrize(
    ("name", "term"),
    [
        ("pick-up Room1", '("pick-up","Room1")'),
        ("go a 1 01", 'go(a,1,"01")'),
        ("not not", '("not","not")'),
        ("noop", "noop"),
    ],
)
def test_each_name_is_a_term(name: str, term: str) -> None:
    assert action_term(name) == clingo.parse_term(term)


@pytest.mark.parametrize("text", ["", SAS[:200], SAS.replace("begin_goal", "begin_gaol")])
def test_what_is_not_sas_is_refused(text: str) -> None:
    with pytest.raises(PddlError, match=r"line \d+, is not SAS\+"):
        parse_sas(text)


def test_axioms_are_refused() -> None:
    with pytest.raises(PddlError, match="needs axioms"):
        parse_sas(SAS[: -len("0\n")] + "1\n")


def test_the_remedy_is_named_without_fast_downward(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(translator, "find_spec", lambda _: None)
    (tmp_path / "d.pddl").write_text(DOMAIN)
    (tmp_path / "p.pddl").write_text(PROBLEM)
    with pytest.raises(PddlError, match="pip install up-fast-downward"):
        translate(tmp_path / "d.pddl", tmp_path / "p.pddl")


@pytest.mark.skipif(
    importlib.util.find_spec("up_fast_downward") is None,
    reason="Fast Downward is not installed: scripts/setup --bench",
)
def test_a_task_is_translated(tmp_path: Path) -> None:
    (tmp_path / "d.pddl").write_text(DOMAIN)
    (tmp_path / "p.pddl").write_text(PROBLEM)
    task = translate(tmp_path / "d.pddl", tmp_path / "p.pddl")
    assert task.cost_of(["toggle", "move f1 2nd-floor", "toggle"]) == 2
    (tmp_path / "p.pddl").write_text(PROBLEM.replace("(at f1)", "(at f9)"))
    with pytest.raises(PddlError, match="not understood by the translator"):
        translate(tmp_path / "d.pddl", tmp_path / "p.pddl")
