"""Writes the files of a planning task: an encoding, an instance and examples."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

from rosoclingo.in_process.shared import shared
from rosoclingo.tools.pddl.actuators import Actuators
from rosoclingo.tools.pddl.conditions import compile_conditions
from rosoclingo.tools.pddl.declarations import check_declarations
from rosoclingo.tools.pddl.domain import Domain, Problem
from rosoclingo.tools.pddl.encoding import GOAL, Encoder
from rosoclingo.tools.pddl.expressions import PddlError, read_file
from rosoclingo.tools.pddl.names import Identifiers
from rosoclingo.tools.pddl.numbers import Numbers
from rosoclingo.tools.pddl.translator import translate

_MARK = "made by pddl.py"
_LIBRARY = Path("rosoclingo_aspprograms", "lib", "actions.lp")
_TERM = re.compile(r"_*[a-z][A-Za-z0-9_]*", re.ASCII)


@dataclass(frozen=True)
class ImportOptions:
    """Options for choices that PDDL leaves open.

    Attributes:
        name: What the files are called; by default as the domain.
        library: The library's file; by default that of this installation.
        actuator: Who does actions without an actuator among their objects.
        actuators: Types whose objects are actuators, or predicates that hold for them.
        changing: Predicates whose facts messages may change, though no action does.
        limits: For functions, how large their numbers can get.
        slots: How many requests are planned for at the same time; None for the library's default.
    """

    name: Optional[str] = None
    library: Optional[str] = None
    actuator: str = "robot"
    actuators: Sequence[str] = ()
    changing: Sequence[str] = ()
    limits: Dict[str, int] = field(default_factory=dict)
    slots: Optional[int] = None


def read_task(
    domain_file: Path, problem_file: Path, changing: Sequence[str] = ()
) -> Tuple[Domain, Problem]:
    """Returns a task whose conditions are conjunctions of literals.

    Raises:
        PddlError: The task is not understood; the message says where.
    """
    forms = read_file(domain_file), read_file(problem_file)
    return compile_conditions(*forms, [each.lower() for each in changing])


def import_task(domain_file: Path, problem_file: Path, options: ImportOptions) -> Dict[str, str]:
    """Returns the texts of the files of a task, by their names.

    Raises:
        PddlError: The task is not understood, or an option is wrong; the message says where. Or the
            files would be called as those of the library.
    """
    domain, problem = read_task(domain_file, problem_file, options.changing)
    name = options.name or Identifiers([domain.name]).term(domain.name)
    _refuse_names_of_library(f"{name}.lp", f"{name}_instance.lp")
    check_declarations(domain, problem)
    if not _TERM.fullmatch(options.actuator):
        raise PddlError(f"--actuator {options.actuator}: this is no name, such as robot")
    for function in options.limits:
        _check_function(domain, function)
    names = Identifiers.of(domain.form, problem.form)
    actuators = Actuators(domain, problem, names, options.actuators, options.actuator)
    task = translate(domain, problem, [each.lower() for each in options.changing])
    numbers = Numbers(domain, problem, options.limits)
    encoder = Encoder(task, domain, numbers, names, actuators)
    actions = encoder.actions()
    made = f"{_MARK} of {domain_file.name} and {problem_file.name}"
    encoding = [
        f"% The domain {domain.name}, {made}. What can be done is that of the problem's objects.",
        "%",
        f"% Actuators: {', '.join(sorted(actuators.names))}.",
        f"% Requests: {GOAL}, and each fact F, or -F if it is to hold no longer.",
        "% Messages of the source info: F and -F; and value(L,N), the number L is N.",
        "",
        f'#include "{options.library or _library()}".',
        *([] if options.slots is None else ["", f"#const slots={options.slots}. [override]"]),
        "", *encoder.rules(), "", "#program base.", *encoder.facts(), *actions,
        "", "#program phrases.", *encoder.phrases(),
    ]  # fmt: skip
    instance = [
        f"% The first values and the goal of the problem, {made}.",
        "",
        "#program base.",
        *encoder.instance(),
    ]
    examples = _examples(f"{name}_instance.lp", encoder, actuators, made)
    texts = {f"{name}.lp": encoding, f"{name}_instance.lp": instance, f"{name}.examples": examples}
    return {file: "\n".join([*lines, ""]) for file, lines in texts.items()}


def write_files(texts: Dict[str, str], folder: Path) -> List[Path]:
    """Writes files into a folder, in the place of those that were written before.

    Returns:
        Their paths.

    Raises:
        PddlError: The folder cannot be written to, or has such a file that pddl.py has not written.
    """
    paths = {folder / name: text for name, text in texts.items()}
    for path in paths:
        if path.exists() and _MARK not in _first_line(path):
            raise PddlError(f"{path} exists already, and was not {_MARK}: choose another name by "
                            "--name, or another folder by --folder")  # fmt: skip
    try:
        for path, text in paths.items():
            path.write_text(text, encoding="utf-8")
    except OSError as err:
        raise PddlError(f"cannot write {err.filename}: {err.strerror}: name a folder by --folder "
                        "that is there and can be written to") from err  # fmt: skip
    return list(paths)


def _first_line(path: Path) -> str:
    try:
        with path.open(encoding="utf-8", errors="replace") as file:
            return file.readline()
    except OSError as err:
        raise PddlError(f"cannot read {path}: {err.strerror}") from err


def _installed() -> Path:
    """Returns where the library is, if it is installed."""
    return shared().parent / _LIBRARY


def _refuse_names_of_library(*files: str) -> None:
    """Refuses names of the library's files: an include finds those in the working directory first.

    Raises:
        PddlError: One is such a name.
    """
    for file in files:
        if (_installed().parent / file).is_file():
            raise PddlError(
                f"{file} is the name of a file of the library, which would include the encoding in "
                "its place: choose another name by --name"
            )


def _library() -> Path:
    library = _installed()
    if not library.is_file():
        raise PddlError(f"there is no {library}: say by --library where actions.lp of "
                        "rosoclingo_aspprograms is")  # fmt: skip
    return library


def _check_function(domain: Domain, name: str) -> None:
    known = sorted({f.head for each in domain.form.lists(":functions") for f in each.lists()})
    if name not in known:
        there = f"there are {', '.join(known)}" if known else "there are none"
        raise PddlError(f"--most {name}: there is no such function; {there}")


def _examples(instance: str, encoder: Encoder, actuators: Actuators, made: str) -> List[str]:
    goal = f"{instance} -c steps=1000 --goal {GOAL}"
    lines = [f"# What is expected, {made}: see docs/check.md, section Examples."]
    if encoder.begins_at_goal:
        return [*lines, "", "# All is as it is to be.", f"{goal} => 0 steps"]
    lines += ["", "# The goal is reached.", f"{goal} => succeeded"]
    if len(actuators.names) == 1:
        fails = f"{goal} --at 1 {actuators.names[0]}:failure"
        lines += [
            "",
            "# What has failed is done again, or in another way.",
            f"{fails} => succeeded",
        ]
    return [
        *lines,
        "",
        "# The goal is canceled before anything is done.",
        f"{goal} --at 0 cancel:1 => 0 steps, canceled",
    ]
