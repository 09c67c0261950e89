"""Relaxation of an encoding's constraints, which comments name.

A comment that begins with ``%!`` names the constraint below it. It is a comment to clingo, so that
it costs a planner nothing::

    %! the battery does not last
    :- do(R,go(_),t), holds(battery(R,0),t-1).
"""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Sequence, Tuple

from clingo import ast

from rosclingo.errors import shorten
from rosclingo.solver.programs import Program, parse_part
from rosoclingo.why.facts import Fact, FactKind

_RELAXED = "rosoclingo_relaxed"
_NAME = "%!"
_MOST_LETTERS = 200  # of a constraint that has no name
_GOALS = ("query", "horizon")  # parts and atoms that ask for a plan


@dataclass(frozen=True)
class Rules:
    """The relaxable constraints of an encoding, as facts: an event of such a fact relaxes it.

    Those of one name are one rule. Of the others, those are left out that ask for a plan, or keep
    what was done.

    Attributes:
        named: Those with a name.
        others: Those without.
    """

    named: Tuple[Fact, ...] = ()
    others: Tuple[Fact, ...] = ()

    @classmethod
    def read(cls, program: Program) -> Rules:
        """Reads the constraints of encodings."""
        named: Dict[int, Fact] = {}
        others: Dict[int, Fact] = {}
        lines = _lines(program)
        for statement, key, name in _constraints(program):
            rules = named if name else others
            content = name or _quote(statement, lines)
            rules[key] = Fact(FactKind.RULE, 0, "", content, (_relaxed(key),))
        return cls(tuple(named.values()), tuple(others.values()))


def idle_names(program: Program) -> List[Tuple[str, int]]:
    """Returns the file and the line of each comment ``%!`` that names no constraint.

    That is one with no constraint directly below it, of those that can be relaxed.
    """
    lines = _lines(program)
    named = {
        (path, number)
        for statement, _, _ in _constraints(program)
        for path, number, _ in _comments(statement, lines)
    }
    return [
        (path, number)
        for path, rows in lines.items()
        for number, row in enumerate(rows, 1)
        if row.strip().startswith(_NAME) and (path, number) not in named
    ]


NO_RULES = Rules()
"""The rules of an encoding without constraints."""


def is_relaxed(atom: str) -> bool:
    """Returns whether an atom relaxes a constraint."""
    return atom.startswith(_RELAXED)


def relaxable(program: Program) -> Program:
    """Returns a program in which an external for each constraint can relax it."""
    guards = {id(statement): _relaxed(key) for statement, key, _ in _constraints(program)}
    if not guards:
        return program
    names = dict.fromkeys(guards.values())
    declared = parse_part("base", (), " ".join(f"#external {name}." for name in names))
    statements = [*declared.statements]
    for statement in program.statements:
        guard = guards.get(id(statement))
        statements.append(statement if guard is None else _guarded(statement, guard))
    # Explanations are quicker without heuristics, which are made for plans.
    return dataclasses.replace(program, statements=statements, has_heuristics=False)


def _relaxed(key: int) -> str:
    return f"{_RELAXED}(r{key})"  # no number, which would be a step


def _constraints(program: Program) -> List[Tuple[ast.AST, int, str]]:
    """Returns each relaxable constraint, the number of its rule, and its name."""
    lines = _lines(program)
    keys: Dict[str, int] = {}
    found = []
    part = "base"
    for number, statement in enumerate(program.statements):
        if statement.ast_type is ast.ASTType.Program:
            part = statement.name
        elif _is_constraint(statement):
            name = _name(statement, lines)
            if name or not (part in _GOALS or _keeps(statement)):
                key = keys.setdefault(name, number) if name else number
                found.append((statement, key, name))
    return found


def _is_constraint(statement: ast.AST) -> bool:
    if statement.ast_type is not ast.ASTType.Rule:
        return False
    if statement.head.ast_type is ast.ASTType.TheoryAtom:  # such as a difference constraint
        return True
    if statement.head.ast_type is not ast.ASTType.Literal:
        return False
    atom = statement.head.atom
    return bool(atom.ast_type is ast.ASTType.BooleanConstant and not atom.value)


def _keeps(constraint: ast.AST) -> bool:
    """Returns whether a constraint demands a plan, or keeps committed actions."""
    for term in atom_terms(constraint.body):
        if term.ast_type is ast.ASTType.Function:
            words = [str(argument) for argument in term.arguments]
            is_done = words[:1] == ["commit"] or words[:2] == ["info", "passed"]
            if term.name in _GOALS or (term.name == "event" and is_done):
                return True
    return False


def atom_terms(nodes: Iterable[ast.AST]) -> List[ast.AST]:
    """Returns the terms of all atoms in some nodes."""
    found: List[ast.AST] = []

    class Collector(ast.Transformer):
        def visit_SymbolicAtom(self, atom: ast.AST) -> ast.AST:  # noqa: N802 (clingo's name)
            found.append(atom.symbol)
            return atom

    collector = Collector()
    for node in nodes:
        collector(node)
    return found


def _lines(program: Program) -> Dict[str, List[str]]:
    """Returns the lines of each file, by its real path."""
    return {path: text.splitlines() for path, text in program.texts.items()}


def _name(constraint: ast.AST, lines: Mapping[str, Sequence[str]]) -> str:
    """Returns the name that comments directly above a constraint give it; empty without one."""
    names = (name for _, _, name in _comments(constraint, lines))
    return " ".join(filter(None, names)).rstrip(".")


def _comments(
    constraint: ast.AST, lines: Mapping[str, Sequence[str]]
) -> List[Tuple[str, int, str]]:
    """Returns the comments directly above a constraint that name it: file, line, and name."""
    begin = constraint.location.begin
    path = os.path.realpath(begin.filename)
    found: List[Tuple[str, int, str]] = []
    for number in range(begin.line - 1, 0, -1):
        comment = lines.get(path, ())[number - 1 : number]
        row = comment[0].strip() if comment else ""
        if not row.startswith("%"):
            break
        if row.startswith(_NAME):
            found.insert(0, (path, number, row[len(_NAME) :].strip()))
    return found


def _guarded(constraint: ast.AST, guard: str) -> ast.AST:
    place = constraint.location
    name, argument = guard[:-1].split("(")
    atom = ast.SymbolicAtom(ast.Function(place, name, [ast.Function(place, argument, [], 0)], 0))
    literal = ast.Literal(place, ast.Sign.Negation, atom)
    return ast.Rule(place, constraint.head, [*constraint.body, literal])


def _quote(constraint: ast.AST, lines: Mapping[str, Sequence[str]]) -> str:
    """Returns the text of a constraint, and where it stands."""
    begin, end = constraint.location.begin, constraint.location.end
    own = list(lines.get(os.path.realpath(begin.filename), ()))[begin.line - 1 : end.line]
    text = str(constraint)
    if own and len(own) == end.line - begin.line + 1:
        # clingo counts columns in bytes
        encoded = [line.encode() for line in own]
        encoded[-1] = encoded[-1][: end.column - 1]
        encoded[0] = encoded[0][begin.column - 1 :]
        text = " ".join(b" ".join(encoded).decode(errors="replace").split())
    place = f"{os.path.basename(begin.filename)}:{begin.line}"
    return f"'{shorten(text, _MOST_LETTERS)}' ({place})"
