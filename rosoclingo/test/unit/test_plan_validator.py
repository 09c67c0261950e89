"""The validator of the benchmarks: it evaluates conditions as they stand in the files, in full."""

from __future__ import annotations

from pathlib import Path
from typing import List, Tuple

import pytest

from plan_validator import read_validator
from rosoclingo.tools.pddl.expressions import PddlError

DOMAIN = """(define (domain harbour)
(:requirements :adl :derived-predicates :numeric-fluents :typing)
(:types ship quay)
(:predicates (at ?s - ship ?q - quay) (deep ?q - quay) (small ?s - ship) (loaded ?s - ship)
 (next ?p ?q - quay) (linked ?p ?q - quay))
(:functions (crates) (tugs) (spare))
(:derived (linked ?p ?q - quay)
 (or (next ?p ?q) (exists (?r - quay) (and (linked ?p ?r) (next ?r ?q)))))
(:action sail :parameters (?s - ship ?p ?q - quay)
 :precondition (and (at ?s ?p) (linked ?p ?q) (or (deep ?q) (small ?s))
  (forall (?o - ship) (imply (at ?o ?q) (small ?o))))
 :effect (and (not (at ?s ?p)) (at ?s ?q)))
(:action load :parameters (?s - ship)
 :precondition (and (exists (?q - quay) (and (at ?s ?q) (deep ?q)))
  (>= (crates) (+ (tugs) (spare) 1)))
 :effect (and (loaded ?s) (decrease (crates) (- (- (spare) 1)))))
)
"""
PROBLEM = """(define (problem p) (:domain harbour)
(:objects big tiny - ship a b c - quay)
(:init (at big a) (at tiny a) (small tiny) (deep b) (next a b) (next b c)
 (= (crates) 4) (= (tugs) 1) (= (spare) 0))
(:goal (and (loaded big) (or (at tiny c) (exists (?q - quay) (and (deep ?q) (at tiny ?q)))))))
"""


@pytest.fixture(name="files")
def _files(tmp_path: Path) -> Tuple[Path, Path]:
    files = tmp_path / "domain.pddl", tmp_path / "problem.pddl"
    for file, text in zip(files, (DOMAIN, PROBLEM)):
        file.write_text(text)
    return files


@pytest.mark.parametrize(
    ("plan", "wrong"),
    [
        (["sail(big,a,b)", "load(big)", "sail(tiny,a,c)"], ""),
        (["sail(tiny,a,b)", "sail(big,a,b)", "load(big)"], ""),
        (["sail(big,a,c)"], "(or (deep ?q) (small ?s)) does not hold"),
        (["sail(big,a,b)", "sail(tiny,a,b)"], "(forall (?o - ship)"),
        (["sail(tiny,a,c)", "sail(tiny,c,b)"], "(linked ?p ?q) does not hold"),
        (["load(big)"], "(exists (?q - quay)"),
        (["sail(big,a,b)", "load(big)"], "the goal: (or (at tiny c)"),
        (["sail(big,a,b)", *["load(big)"] * 4], "(>= (crates) (+ (tugs) (spare) 1)) does not hold"),
    ],
)  # fmt: skip
def test_conditions_of_any_form_are_evaluated(
    files: Tuple[Path, Path], plan: List[str], wrong: str
) -> None:
    validator = read_validator(*files)
    said = ""
    try:
        for step in plan:
            validator.execute_term(step)
        validator.require_goal()
    except PddlError as err:
        said = str(err)
    assert wrong in said
    assert bool(said) == bool(wrong)


@pytest.mark.costly
def test_the_benchmark_judges_plans_with_conditions_of_any_form(
    files: Tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("unified_planning", reason="for Python 3.9 and later")
    from tasks_bench import Planned, is_valid  # noqa: PLC0415 (they take a second)

    right = Planned(0, ["sail(big,a,b)", "load(big)", "sail(tiny,a,c)"])
    assert is_valid("harbour", *files, right)
    assert "is not understood" not in capsys.readouterr().out
    assert not is_valid("harbour", *files, Planned(0, right.actions[:2]))
