"""Marks each statement of a program, so that its ground instances can be counted.

clingo does not say which statement a ground rule comes from. So each statement gets a rule beside
it, with its body and with a head of its own that has the statement's variables: a marker. There
are as many atoms of a marker as the statement has ground instances, before clingo simplifies any.
Elements of choices, disjunctions, aggregates and conditional literals have markers of their own.

Markers are for grounding. They constrain nothing, but are shown if the program shows all. A plain
fact has none: a program may have thousands, of one instance each.
"""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from itertools import chain
from typing import Dict, Iterable, Iterator, List, Sequence, Set, Tuple

import clingo
from clingo import ast
from clingo.ast import ASTType

from rosclingo.solver.programs import Program

PredicateSignature = Tuple[str, int]
"""A predicate's name and its number of arguments; the name of -p begins with a dash."""

MARKER = "rosoclingo_profile_"
"""Prefix of the names of markers."""

_ANONYMOUS = "_"
_MOST_LETTERS = 60  # of a statement that is quoted
_AGGREGATES = (ASTType.Aggregate, ASTType.BodyAggregate)
_PLAIN = (ASTType.SymbolicAtom, ASTType.Comparison, ASTType.BooleanConstant)

_POSITION = ast.Position("<profile>", 1, 1)
_PLACE = ast.Location(_POSITION, _POSITION)

_Terms = List[ast.AST]
_Body = List[ast.AST]
_Element = Tuple[_Terms, _Body]
_Counted = Tuple[_Body, List[str], _Terms]


@dataclass(frozen=True)
class Statement:
    """A statement that has ground instances.

    Attributes:
        file: The file that it is in, as clingo names it.
        line: In which line it begins.
        text: The statement, shortened.
        markers: What its instances are counted by.
    """

    file: str
    line: int
    text: str
    markers: Tuple[PredicateSignature, ...]


def mark(program: Program) -> Tuple[Program, List[Statement]]:
    """Returns a program with markers, and the statements that they count."""
    marked: List[ast.AST] = []
    found: List[Statement] = []
    lines: Dict[str, List[bytes]] = {}
    parameters: List[str] = []
    for statement in program.statements:
        marked.append(statement)
        if statement.ast_type is ASTType.Program:
            parameters = [one.name for one in statement.parameters]
        elif hasattr(statement, "body") and (parameters or not _is_plain_fact(statement)):
            markers = []
            for counted in chain.from_iterable(map(_instances, statement.unpool())):
                marker = _marker(f"{MARKER}{len(marked)}", parameters, counted)
                marked.append(marker)
                symbol = marker.head.atom.symbol
                markers.append((symbol.name, len(symbol.arguments)))
            begin = statement.location.begin
            text = _quote(statement, program, lines)
            found.append(Statement(begin.filename, begin.line, text, tuple(markers)))
    return dataclasses.replace(program, statements=marked), found


def _is_plain_fact(statement: ast.AST) -> bool:
    """Tells whether it is a fact with one instance."""
    return (
        statement.ast_type is ASTType.Rule
        and not statement.body
        and statement.head.ast_type is ASTType.Literal
        and not any(
            node.ast_type in (ASTType.Interval, ASTType.Pool, ASTType.Variable)
            for node in _walk([statement.head])
        )
    )


def _marker(name: str, parameters: Sequence[str], counted: _Counted) -> ast.AST:
    """Returns the rule of a marker."""
    body, variables, terms = counted
    names = dict.fromkeys([*variables, *_variables(terms)])
    arguments = [
        *(ast.SymbolicTerm(_PLACE, clingo.Function(one)) for one in parameters),
        *(ast.Variable(_PLACE, one) for one in names),
        *terms,
    ]
    atom = ast.SymbolicAtom(ast.Function(_PLACE, name, arguments, 0))
    return ast.Rule(_PLACE, ast.Literal(_PLACE, ast.Sign.NoSign, atom), body)


def _instances(statement: ast.AST) -> Iterator[_Counted]:
    """Yields body, variables and terms of what is to be counted for a statement."""
    body = list(statement.body)
    kept = [literal for literal in body if not _is_theory(literal)]
    variables = _global_variables(kept)
    elements: List[_Element] = []
    if statement.ast_type is ASTType.Rule:
        elements = list(_elements(statement.head))
    for terms, condition in elements or [(_head_terms(statement), [])]:
        yield [*kept, *condition], variables, terms
    plain = [literal for literal in body if _is_plain(literal)]
    bound = _bound(plain)
    kept = [literal for literal in plain if bound.issuperset(_variables([literal]))]
    unbound = {*_global_variables(body)} - bound  # by what is kept
    for terms, condition in _body_elements(body):
        # clingo has an element once for all values of what does not occur in it.
        names = _variables([*terms, *condition])
        if unbound.isdisjoint(names):
            yield [*kept, *condition], names, terms


def _head_terms(statement: ast.AST) -> _Terms:
    """Returns the terms of a statement besides its body, if its head has no elements."""
    kind = statement.ast_type
    if kind is ASTType.Rule:
        return _symbols([statement.head])
    if kind is ASTType.Minimize:
        return [statement.weight, statement.priority, *statement.terms]
    if kind is ASTType.ShowTerm:
        return [statement.term]
    if kind is ASTType.Edge:
        return [statement.node_u, statement.node_v]
    return [statement.atom.symbol]


def _elements(head: ast.AST) -> Iterator[_Element]:
    """Yields the terms and the condition of each element of a choice or a disjunction."""
    if head.ast_type in (ASTType.Aggregate, ASTType.Disjunction):
        for one in head.elements:
            yield _symbols([one.literal]), [*one.condition]
    elif head.ast_type is ASTType.HeadAggregate:
        for one in head.elements:
            chosen = one.condition
            yield [*one.terms, *_symbols([chosen.literal])], [*chosen.condition]


def _body_elements(body: _Body) -> Iterator[_Element]:
    """Yields the terms and the condition of each element in a body."""
    for literal in body:
        if literal.ast_type is ASTType.ConditionalLiteral:
            yield _symbols([literal.literal]), [*literal.condition]
        elif literal.ast_type is ASTType.Literal and literal.atom.ast_type is ASTType.Aggregate:
            for one in literal.atom.elements:
                yield [], [one.literal, *one.condition]
        elif literal.ast_type is ASTType.Literal and literal.atom.ast_type is ASTType.BodyAggregate:
            for one in literal.atom.elements:
                yield [*one.terms], [*one.condition]


def _symbols(literals: Iterable[ast.AST]) -> _Terms:
    """Returns the terms of those literals that are plain atoms."""
    return [
        one.atom.symbol
        for one in literals
        if one.ast_type is ASTType.Literal and one.atom.ast_type is ASTType.SymbolicAtom
    ]


def _is_theory(literal: ast.AST) -> bool:
    return literal.ast_type is ASTType.Literal and literal.atom.ast_type is ASTType.TheoryAtom


def _is_plain(literal: ast.AST) -> bool:
    """Returns whether it is an atom or a comparison."""
    return literal.ast_type is ASTType.Literal and literal.atom.ast_type in _PLAIN


def _bound(body: _Body) -> Set[str]:
    """Returns the variables that atoms of a body bind, and equations such as ``X = Y+1``."""
    positive = [one.atom for one in body if one.sign == ast.Sign.NoSign]
    bound = {*_variables(one for one in positive if one.ast_type is ASTType.SymbolicAtom)}
    equations = [sides for one in positive for sides in _sides(one)]
    for _ in equations:  # each may bind what another one needs
        for variable, value in equations:
            if variable.ast_type is ASTType.Variable and bound.issuperset(_variables([value])):
                bound.add(variable.name)
    return bound


def _sides(atom: ast.AST) -> List[Tuple[ast.AST, ast.AST]]:
    """Returns the sides of an equation, both ways; nothing of other atoms."""
    if atom.ast_type is not ASTType.Comparison:
        return []
    if not hasattr(atom, "guards"):  # before clingo 5.6
        operator, left, right = atom.comparison, atom.left, atom.right
    elif len(atom.guards) == 1:
        operator, left, right = atom.guards[0].comparison, atom.term, atom.guards[0].term
    else:
        return []
    return [(left, right), (right, left)] if operator == ast.ComparisonOperator.Equal else []


def _global_variables(body: _Body) -> List[str]:
    """Returns the variables of a body outside of elements."""
    nodes: List[ast.AST] = []
    for literal in body:
        if _is_plain(literal):
            nodes.append(literal)
        elif literal.ast_type is ASTType.Literal and literal.atom.ast_type in _AGGREGATES:
            guards = (literal.atom.left_guard, literal.atom.right_guard)
            nodes += [guard for guard in guards if guard is not None]
    return _variables(nodes)


def _variables(nodes: Iterable[ast.AST]) -> List[str]:
    names = (one.name for one in _walk(nodes) if one.ast_type is ASTType.Variable)
    return list(dict.fromkeys(name for name in names if name != _ANONYMOUS))


def _walk(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yields nodes and all below them."""
    for node in nodes:
        yield node
        for key in node.child_keys:
            child = getattr(node, key)
            if isinstance(child, ast.AST):
                yield from _walk([child])
            elif child is not None:
                yield from _walk(child)


def _quote(statement: ast.AST, program: Program, lines: Dict[str, List[bytes]]) -> str:
    """Returns a statement as it is written, in one line, and shortened."""
    begin, end = statement.location.begin, statement.location.end
    path = os.path.realpath(begin.filename)
    if path not in lines:
        lines[path] = program.texts.get(path, "").encode().splitlines()  # clingo counts bytes
    rows = lines[path][begin.line - 1 : end.line]
    if rows:
        rows[-1] = rows[-1][: end.column - 1]
        rows[0] = rows[0][begin.column - 1 :]
    plain = (row.decode("utf-8", "replace").partition("%")[0] for row in rows)
    text = " ".join(" ".join(plain).split()) or str(statement)
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
