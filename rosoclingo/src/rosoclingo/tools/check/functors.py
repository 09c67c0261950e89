"""Finds functions in atoms that unify with no head, fact or external.

So ``holds(batery(R,N),t)`` in a body is found where all that makes ``holds/2`` true has other
functions in it. A variable in a head has the functions of the body's atom in which it stands.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field
from typing import (
    Dict,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Set,
    Tuple,
)

from clingo import SymbolType, ast

from rosclingo.solver.programs import Program
from rosoclingo.why.rules import atom_terms

Functor = Tuple[str, int]
"""Name and number of arguments; no argument for a constant."""

Place = Tuple[str, int, int]
"""Name and number of arguments of a predicate, and which argument of it, from 0."""

_ANYTHING: Optional[FrozenSet[Functor]] = None
_OF_EVENTS = frozenset({("event", 3), ("holds", 2), ("do", 3), ("occurs", 3), ("status", 3)})
_ALIKE = 0.75  # how alike names are of which one is meant for the other, 0 to 1


@dataclass(frozen=True)
class UnmatchedFunction:
    """A function in an atom that unifies with no atom on the other side of rules.

    Attributes:
        atom: The atom that has it.
        functor: Its name and number of arguments.
        meant: One that can be there, if it is alike.
        is_used: Whether the atom is in a body; else nothing uses what its head makes true.
    """

    atom: ast.AST
    functor: Functor
    meant: Optional[Functor]
    is_used: bool


@dataclass
class _Rule:
    """A head, and the places at which its variables stand in the body."""

    head: ast.AST
    variables: Mapping[str, Sequence[Place]]
    parameters: FrozenSet[str]


@dataclass
class _Reader:
    """Sorts the atoms of statements into heads and bodies."""

    heads: List[_Rule] = field(default_factory=list)
    uses: List[Tuple[ast.AST, FrozenSet[str]]] = field(default_factory=list)
    constants: Set[str] = field(default_factory=set)
    declared: Set[Functor] = field(default_factory=set)
    has_script: bool = False

    def read(self, program: Program) -> None:
        parameters: FrozenSet[str] = frozenset()
        for statement in program.statements:
            kind = statement.ast_type
            if kind is ast.ASTType.Program:
                parameters = frozenset(one.name for one in statement.parameters)
            elif kind is ast.ASTType.Definition:
                self.constants.add(statement.name)
            elif kind is ast.ASTType.Defined:
                self.declared.add((statement.name, statement.arity))
            elif kind is ast.ASTType.Script:
                self.has_script = True
            elif kind is ast.ASTType.External:
                self._head(statement.atom, list(statement.body), parameters)
                self._uses(statement.body, parameters)
            elif kind is ast.ASTType.Rule:
                self._rule(statement, parameters)
            elif hasattr(statement, "body"):
                self._uses(statement.body, parameters)

    def _rule(self, rule: ast.AST, parameters: FrozenSet[str]) -> None:
        body = list(rule.body)
        self._uses(body, parameters)
        elements = getattr(rule.head, "elements", None)
        if elements is None:
            self._head(rule.head, body, parameters)
            return
        for element in elements:
            literal, conditions = element, list(getattr(element, "condition", ()))
            while hasattr(literal, "literal"):
                conditions += getattr(literal, "condition", ())
                literal = literal.literal
            self._uses(conditions, parameters)
            self._head(literal, [*conditions, *body], parameters)

    def _head(self, node: ast.AST, body: List[ast.AST], parameters: FrozenSet[str]) -> None:
        variables = _variables(body)
        self.heads += [_Rule(atom, variables, parameters) for atom in atom_terms([node])]

    def _uses(self, nodes: Iterable[ast.AST], parameters: FrozenSet[str]) -> None:
        self.uses += [(atom, parameters) for atom in atom_terms(nodes)]


def unmatched_functions(program: Program) -> Iterator[UnmatchedFunction]:
    """Yields the functions that unify with nothing, once for each place."""
    reader = _Reader()
    reader.read(program)
    if reader.has_script:
        return
    known = _Possible(reader)
    used: Dict[Place, Set[Functor]] = {}
    told: Set[Tuple[Place, Functor]] = set()
    for atom, parameters in reader.uses:
        for place, term in _arguments(atom):
            found = known.functors(term, {}, parameters)
            used.setdefault(place, set()).update(found or ())
            there = known.at.get(place)
            if found is None or there is None or place[:2] in reader.declared:
                continue
            for functor in sorted(found - there):
                meant = _meant(functor, there)
                is_told = functor[1] > 0 or (meant is not None and place[:2] in _OF_EVENTS)
                if is_told and (place, functor) not in told:
                    told.add((place, functor))
                    yield UnmatchedFunction(atom, functor, meant, is_used=True)
    for rule in reader.heads:
        for place, term in _arguments(rule.head):
            if place[:2] not in _OF_EVENTS or term.ast_type is not ast.ASTType.Function:
                continue
            functor = (term.name, len(term.arguments))
            meant = _meant(functor, used.get(place, set()))
            if functor not in used.get(place, set()) and meant and (place, functor) not in told:
                told.add((place, functor))
                yield UnmatchedFunction(rule.head, functor, meant, is_used=False)


class _Possible:
    """The functions that each argument of the defined predicates can have.

    Attributes:
        at: The functions; ``None`` for any.
    """

    def __init__(self, reader: _Reader) -> None:
        self._constants = reader.constants
        self.at: Dict[Place, Optional[FrozenSet[Functor]]] = {}
        for rule in reader.heads:
            self.at.update({place: frozenset() for place, _ in _arguments(rule.head)})
        changes = True
        while changes:
            changes = False
            for rule in reader.heads:
                for place, term in _arguments(rule.head):
                    before = self.at[place]
                    new = self.functors(term, rule.variables, rule.parameters)
                    after = None if before is None or new is None else before | new
                    changes |= after != before
                    self.at[place] = after

    def functors(
        self,
        term: ast.AST,
        variables: Mapping[str, Sequence[Place]],
        parameters: FrozenSet[str],
    ) -> Optional[FrozenSet[Functor]]:
        """Returns the functions that a term may have; ``None`` for any, nothing for a number."""
        kind = term.ast_type
        if kind is ast.ASTType.Function and not term.external:
            return frozenset({(term.name, len(term.arguments))})
        if kind is ast.ASTType.SymbolicTerm:
            if term.symbol.type is not SymbolType.Function:
                return frozenset()
            name = term.symbol.name
            is_open = name in self._constants or name in parameters
            return _ANYTHING if is_open else frozenset({(name, 0)})
        if kind in (ast.ASTType.Interval, ast.ASTType.BinaryOperation):
            return frozenset()
        if kind is ast.ASTType.Pool:
            found = [self.functors(one, variables, parameters) for one in term.arguments]
            sure = [one for one in found if one is not None]
            return frozenset().union(*sure) if len(sure) == len(found) else _ANYTHING
        if kind is ast.ASTType.Variable:
            places = (place for place in variables.get(term.name, ()) if place in self.at)
            return next((self.at[place] for place in places), _ANYTHING)
        return _ANYTHING


def _variables(body: Iterable[ast.AST]) -> Dict[str, List[Place]]:
    """Returns at which places of positive literals each variable stands alone."""
    found: Dict[str, List[Place]] = {}
    for literal in body:
        if literal.ast_type is ast.ASTType.Literal and literal.sign == ast.Sign.NoSign:
            for atom in atom_terms([literal]):
                for place, term in _arguments(atom):
                    if term.ast_type is ast.ASTType.Variable:
                        found.setdefault(term.name, []).append(place)
    return found


def _meant(functor: Functor, others: Iterable[Functor]) -> Optional[Functor]:
    names = sorted({name for name, arity in others if arity == functor[1]} - {functor[0], ""})
    alike = difflib.get_close_matches(functor[0], names, 1, _ALIKE)
    return (alike[0], functor[1]) if alike else None


def _arguments(atom: ast.AST) -> Iterator[Tuple[Place, ast.AST]]:
    """Yields the arguments of an atom, with their places."""
    if atom.ast_type is ast.ASTType.Function:
        for index, term in enumerate(atom.arguments):
            yield (atom.name, len(atom.arguments), index), term
