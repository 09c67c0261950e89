"""Runs Fast Downward's translator, which grounds a task and finds variables with one value each."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Collection, List

from rosclingo.errors import shorten
from rosoclingo.tools.pddl.domain import Domain, Problem
from rosoclingo.tools.pddl.downward import (
    DOWNWARD_PACKAGE,
    REINSTALL,
    find_fast_downward,
    installed_version,
)
from rosoclingo.tools.pddl.expressions import ListForm, PddlError
from rosoclingo.tools.pddl.inlining import simplify
from rosoclingo.tools.pddl.sas import TranslatedTask, parse_sas

_MODULES = ("translate", "fast_downward.translate")  # of up-fast-downward 0.5 and 1.0
_CHANGES = "changes-"  # begins the name of an action by which a fact may change
_MET = "changes-goal"  # a fact that stands for the numbers of the goal, for the translator
_ASKED = "changes-asked"  # one that has the translator keep what may be requested


def fast_downward() -> Path:
    """Returns the folder of Fast Downward, an optional dependency.

    Raises:
        PddlError: It is not installed.
    """
    folder = find_fast_downward()
    if folder is None:
        raise PddlError(f"importing PDDL needs Fast Downward: pip install {DOWNWARD_PACKAGE}")
    return folder


def _find_module(programs: Path) -> str:
    """Returns the name of the translator's module in Fast Downward's folder of programs.

    Raises:
        PddlError: The installed version has it nowhere.
    """
    for module in _MODULES:
        if (programs / module.replace(".", "/") / "__main__.py").exists():
            return module
    raise PddlError(
        f"{DOWNWARD_PACKAGE} {installed_version()} has no translator in {programs}: {REINSTALL}"
    )


def translate(domain: Domain, problem: Problem, changing: Collection[str] = ()) -> TranslatedTask:
    """Returns the task of a domain and a problem, without numbers.

    Args:
        domain: The domain.
        problem: The problem.
        changing: Predicates whose facts may change though no action changes them.

    Raises:
        PddlError: Fast Downward is missing, or it does not understand the files.
    """
    programs = fast_downward() / "builds/release/bin"
    module = _find_module(programs)
    with tempfile.TemporaryDirectory() as folder:
        output, *files = (Path(folder) / name for name in ("sas", "domain.pddl", "problem.pddl"))
        is_numeric = bool(problem.comparisons)
        texts = (
            _domain_text(domain, problem, changing, is_numeric),
            _problem_text(problem, is_numeric),
        )
        for file, text in zip(files, texts):
            file.write_text(text, encoding="utf-8")
        ended = subprocess.run(  # noqa: S603 (a list, without a shell)
            # It needs no packages, and to find them (without -S) takes as long as some tasks.
            [sys.executable, "-S", "-m", module, *map(str, files),
             "--keep-unimportant-variables", "--keep-no-ops", "--sas-file", str(output)],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(programs), "PYTHONHASHSEED": "0"},
            capture_output=True,
            text=True,
            check=False,
        )  # fmt: skip
        if ended.returncode or not output.exists():
            said = (ended.stderr.strip() or ended.stdout.strip()).splitlines()
            reason = said[-1] if said else f"exit status {ended.returncode}"
            raise PddlError(
                f"{domain.form.place}, {problem.form.place}: not understood by the translator: "
                f"{reason}"
            )
        if "empty goal" in ended.stdout.lower():
            raise PddlError(f"{problem.goal.place}: the goal is met whatever is done")
        if "Generating unsolvable task" in ended.stdout:
            raise PddlError(f"{problem.goal.place}: the goal can never be met, whatever is done")
        task = parse_sas(output.read_text(encoding="utf-8"))
    operators = tuple(one for one in task.operators if not one.name.startswith(_CHANGES))
    task = replace(task, operators=operators)
    return simplify(task, domain.made, {_MET, _ASKED, *(test.name for test in domain.tests)})


def _sections(form: ListForm, *names: str) -> List[str]:
    """Returns the sections that stay as they are, in the order that the translator expects."""
    found = {part.head: part.text for part in form.lists()}
    return [found[name] for name in names if name in found]


def _domain_text(
    domain: Domain, problem: Problem, changing: Collection[str], is_numeric: bool
) -> str:
    head, *types = _sections(domain.form, "domain", ":types")
    # Actions name objects of the problem, too, where a quantifier was compiled away.
    objects = {**domain.constants, **problem.objects}
    constants = f"(:constants {' '.join(f'{each} - {kind}' for each, kind in objects.items())})"
    predicates = _sections(domain.form, ":predicates")
    actions = [
        f"(:action {schema.name} :parameters "
        f"({' '.join(f'{v} - {t}' for v, t in zip(schema.parameters, schema.types))}) "
        f":precondition {schema.precondition.text} :effect {schema.effect.text})"
        for schema in domain.actions
    ]
    actions += _changes(domain, changing)
    tests = [(test.name, test.types) for test in domain.tests]
    for name, of_test in [*tests, (_MET, {})] if is_numeric else tests:
        typed = " ".join(f"{variable} - {kind}" for variable, kind in of_test.items())
        first, *_ = predicates or ["(:predicates)"]
        predicates = [f"{first[:-1]} ({name} {typed}))"]
        actions.append(
            f"(:action {_CHANGES}{name} :parameters ({typed}) :precondition (and) "
            f":effect ({' '.join([name, *of_test])}))"
        )
    requestable = [rule for rule in domain.rules if rule.head.head not in domain.made]
    if requestable:
        first, *_ = predicates
        predicates = [f"{first[:-1]} ({_ASKED}))"]
        actions += [
            f"(:action {_CHANGES}ask-{number} :parameters ({rule.own_types}) "
            f":precondition {rule.head.text} :effect ({_ASKED}))"
            for number, rule in enumerate({r.head.head: r for r in requestable}.values())
        ]
    rules = [rule.text for rule in domain.rules]
    parts = [head, "(:requirements :adl)", *types, constants, *predicates, *rules, *actions]
    return "\n".join(["(define", *parts, ")"])


def _changes(domain: Domain, changing: Collection[str]) -> List[str]:
    """Returns actions that change facts, so that the translator has variables of them."""
    sections = domain.form.lists(":predicates")
    predicates = {part.head: part for section in sections for part in section.lists()}
    actions = []
    for name in changing:
        if name not in predicates:
            raise PddlError(f"there is no predicate {shorten(name)}: there can be "
                            f"{', '.join(sorted(predicates))}")  # fmt: skip
        parameters = " ".join(part.text for part in predicates[name].parts[1:])
        variables = [p.text for p in predicates[name].parts[1:] if p.text.startswith("?")]
        atom = f"({' '.join([name, *variables])})"
        actions.append(f"(:action {_CHANGES}{name} :parameters ({parameters}) "
                       f":precondition {atom} :effect (not {atom}))")  # fmt: skip
    return actions


def _problem_text(problem: Problem, is_numeric: bool) -> str:
    before = _sections(problem.form, "problem", ":domain")
    goal = f"(and {problem.goal.text} ({_MET}))" if is_numeric else problem.goal.text
    atoms = " ".join(atom.text for atom in problem.init)
    return "\n".join(["(define", *before, f"(:init {atoms})", f"(:goal {goal})", ")"])
