"""Marks each statement of a program, so that its ground instances can be counted.

clingo does not say which statement a ground rule comes from. So each statement gets a rule beside
it, with its body and with a head of its own that has the statement's variables: a marker. There
are as many atoms of a marker as the statement has ground instances, before clingo simplifies any.
Elements of choices, disjunctions, aggregates and conditional literals have markers of their own.

Markers are for grounding. They constrain nothing, but are shown if the program shows all.
"""

from __future__ import annotations

import dataclasses
import enum
import os
from dataclasses import dataclass
from typing import Dict, Iterable, Iterator, List, Optional, Sequence, Set, Tuple

import clingo
from clingo import ast
from clingo.ast import ASTType

from rosclingo.solver.programs import Program

PredicateSignature = Tuple[str, int]
"""A predicate's name and its number of arguments; the name of -p begins with a dash."""

MARKER = "rosoclingo_profile_"
"""How the name of each marker begins."""

_ANONYMOUS = "_"
_MOST_LETTERS = 60  # of a statement that is quoted
_LINEAR = (ast.BinaryOperator.Plus, ast.BinaryOperator.Minus)
_MINUS = ast.UnaryOperator.Minus
_AGGREGATES = (ASTType.Aggregate, ASTType.BodyAggregate)


class StatementForm(enum.Enum):
    """The form of a statement, as far as advice depends on it."""

    RULE = "rule"
    CONSTRAINT = "constraint"
    CHOICE = "choice"
    EXTERNAL = "external"
    MINIMIZE = "minimize"
    OTHER = "other"


@dataclass(frozen=True)
class BodyAtom:
    """A positive atom in a body.

    Attributes:
        signature: Its predicate.
        in_step: Whether it names a parameter of the part, such as ``t``.
    """

    signature: PredicateSignature
    in_step: bool


@dataclass(frozen=True)
class Marker:
    """A predicate whose atoms are counted.

    Attributes:
        name: Its name.
        arguments: For each argument, the variable that it is; empty for other terms.
    """

    name: str
    arguments: Tuple[str, ...]

    @property
    def signature(self) -> PredicateSignature:
        """Its name and its number of arguments."""
        return self.name, len(self.arguments)


@dataclass(frozen=True)
class Statement:
    """A statement that has ground instances.

    Attributes:
        file: The file that it is in, as clingo names it.
        line: In which line it begins.
        text: The statement, shortened.
        part: The name of its program part.
        parameters: Those of the part.
        form: Its form.
        heads: The predicates that it derives, chooses or declares.
        body: The predicates of all positive atoms of the body.
        groups: Those with variables, in groups that share none: clingo tries all combinations.
        computed: The variables with which it computes.
        is_constant: Whether its head is of the step, and its body of none.
        markers: What its instances are counted by; none for a fact, which is one.
    """

    file: str
    line: int
    text: str
    part: str
    parameters: Tuple[str, ...]
    form: StatementForm
    heads: Tuple[PredicateSignature, ...] = ()
    body: Tuple[BodyAtom, ...] = ()
    groups: Tuple[Tuple[BodyAtom, ...], ...] = ()
    computed: Tuple[str, ...] = ()
    is_constant: bool = False
    markers: Tuple[Marker, ...] = ()

    @property
    def place(self) -> str:
        """The file and the line."""
        return f"{self.file}:{self.line}"


def mark(program: Program) -> Tuple[Program, List[Statement]]:
    """Returns a program with markers, and the statements that they count."""
    marked: List[ast.AST] = []
    found: List[Statement] = []
    lines: Dict[str, List[bytes]] = {}
    name, parameters = "base", ()  # type: Tuple[str, Tuple[str, ...]]
    number = 0
    for statement in program.statements:
        marked.append(statement)
        if statement.ast_type is ASTType.Program:
            name, parameters = statement.name, tuple(one.name for one in statement.parameters)
        elif hasattr(statement, "body"):
            reader = _Reader(statement, parameters, number)
            marked += reader.rules
            number += len(reader.rules)
            begin = statement.location.begin
            text = _quote(statement, program, lines)
            found.append(reader.statement(begin.filename, begin.line, text, name))
    return dataclasses.replace(program, statements=marked), found


class _Reader:
    """Reads one statement, and makes its markers."""

    def __init__(self, statement: ast.AST, parameters: Tuple[str, ...], number: int) -> None:
        self.rules: List[ast.AST] = []
        self._markers: List[Marker] = []
        self._whole = statement
        self._parameters = parameters
        self._number = number
        self._place = statement.location
        if self._is_plain_fact(statement):
            return
        for one in statement.unpool():
            self._mark(one)

    def statement(self, file: str, line: int, text: str, part: str) -> Statement:
        """Returns the statement with its markers."""
        statement = self._whole
        one = next(iter(statement.unpool()), statement)
        atoms = [(self._body_atom(atom), _variables([atom])) for atom in _positive_atoms(one.body)]
        head = _head_terms(statement)
        return Statement(
            file,
            line,
            text,
            part,
            self._parameters,
            _form(statement),
            tuple(dict.fromkeys(filter(None, map(_signature, head)))),
            tuple(atom for atom, _ in atoms),
            _groups(atoms, one.body),
            tuple(_variables(n for n in _walk([one]) if n.ast_type is ASTType.BinaryOperation)),
            is_constant=(
                _form(statement) is StatementForm.RULE
                and self._names_parameter(head)
                and bool(statement.body)
                and not self._names_parameter(statement.body)
            ),
            markers=tuple(self._markers),
        )

    def _is_plain_fact(self, statement: ast.AST) -> bool:
        """Tells whether it is a fact with one instance, of which a program may have many."""
        return (
            not self._parameters
            and statement.ast_type is ASTType.Rule
            and not statement.body
            and statement.head.ast_type is ASTType.Literal
            and not _has(statement.head, ASTType.Interval, ASTType.Pool, ASTType.Variable)
        )

    def _mark(self, statement: ast.AST) -> None:
        body = list(statement.body)
        kept = [literal for literal in body if not _is_theory(literal)]
        of_body = _global_variables(kept)
        if statement.ast_type is not ASTType.Rule:
            self._add(kept, of_body, _head_terms(statement))
        else:
            elements = list(_elements(statement.head))
            for terms, condition in elements:
                self._add([*kept, *condition], of_body, terms)
            if not elements:
                self._add(kept, of_body, _head_terms(statement))
        self._mark_body_elements(body)

    def _mark_body_elements(self, body: Sequence[ast.AST]) -> None:
        """Marks the elements of aggregates and of conditional literals."""
        plain = [one for one in body if _is_plain(one)]
        bound = _bound(plain)
        kept = [one for one in plain if bound.issuperset(_variables([one]))]
        bindable = {*_global_variables(body)} - bound  # by what is not kept
        for literal in body:
            if literal.ast_type is ASTType.ConditionalLiteral:
                elements = [([*_symbols([literal.literal])], [*literal.condition])]
            elif literal.ast_type is ASTType.Literal and literal.atom.ast_type in _AGGREGATES:
                elements = list(_elements(literal.atom, chooses=False))
            else:
                continue
            for terms, condition in elements:
                # clingo has an element once for all values of what does not occur in it.
                names = _variables([*terms, *condition])
                if not bindable.intersection(names):
                    self._add([*kept, *condition], names, terms)

    def _add(
        self, body: Sequence[ast.AST], variables: Sequence[str], terms: Sequence[ast.AST]
    ) -> None:
        name = f"{MARKER}{self._number + len(self.rules)}"
        place = self._place
        names = list(dict.fromkeys([*variables, *_variables(terms)]))
        constants = [ast.SymbolicTerm(place, clingo.Function(one)) for one in self._parameters]
        arguments = [*constants, *(ast.Variable(place, one) for one in names), *terms]
        atom = ast.SymbolicAtom(ast.Function(place, name, arguments, 0))
        head = ast.Literal(place, ast.Sign.NoSign, atom)
        self.rules.append(ast.Rule(place, head, body))
        labels = (*("" for _ in constants), *names, *("" for _ in terms))
        self._markers.append(Marker(name, labels))

    def _body_atom(self, atom: ast.AST) -> BodyAtom:
        signature = _signature(atom.symbol)
        assert signature is not None
        return BodyAtom(signature, self._names_parameter([atom]))

    def _names_parameter(self, nodes: Iterable[ast.AST]) -> bool:
        names = {clingo.Function(one) for one in self._parameters}
        return any(
            one.ast_type is ASTType.SymbolicTerm and one.symbol in names for one in _walk(nodes)
        )


def _form(statement: ast.AST) -> StatementForm:
    kind = statement.ast_type
    if kind is ASTType.Rule:
        head = statement.head
        if head.ast_type is ASTType.Aggregate or head.ast_type is ASTType.HeadAggregate:
            return StatementForm.CHOICE
        is_boolean = head.ast_type is ASTType.Literal and (
            head.atom.ast_type is ASTType.BooleanConstant
        )
        return StatementForm.CONSTRAINT if is_boolean else StatementForm.RULE
    return {ASTType.External: StatementForm.EXTERNAL, ASTType.Minimize: StatementForm.MINIMIZE}.get(
        kind, StatementForm.OTHER
    )


def _head_terms(statement: ast.AST) -> List[ast.AST]:
    """Returns the terms of a statement besides its body."""
    kind = statement.ast_type
    if kind is ASTType.Rule:
        found = [term for terms, _ in _elements(statement.head) for term in terms]
        return found or _symbols([statement.head])
    if kind is ASTType.Minimize:
        return [statement.weight, statement.priority, *statement.terms]
    if kind is ASTType.ShowTerm:
        return [statement.term]
    if kind is ASTType.Edge:
        return [statement.node_u, statement.node_v]
    return [statement.atom.symbol]


def _elements(
    atom: ast.AST, *, chooses: bool = True
) -> Iterator[Tuple[List[ast.AST], List[ast.AST]]]:
    """Yields the terms and the condition of each element.

    Args:
        atom: A head or an aggregate.
        chooses: Whether it derives its elements; in a body, they are conditions themselves.
    """
    if atom.ast_type in (ASTType.Aggregate, ASTType.Disjunction):
        for one in atom.elements:
            counted = [] if chooses else [one.literal]
            yield _symbols([one.literal]), [*counted, *one.condition]
    elif atom.ast_type is ASTType.HeadAggregate:
        for one in atom.elements:
            chosen = one.condition
            yield [*one.terms, *_symbols([chosen.literal])], [*chosen.condition]
    elif atom.ast_type is ASTType.BodyAggregate:
        for one in atom.elements:
            yield [*one.terms], [*one.condition]


def _symbols(literals: Iterable[ast.AST]) -> List[ast.AST]:
    """Returns the terms of those literals that are plain atoms."""
    return [
        one.atom.symbol
        for one in literals
        if one.ast_type is ASTType.Literal and one.atom.ast_type is ASTType.SymbolicAtom
    ]


def _signature(term: ast.AST) -> Optional[PredicateSignature]:
    if term.ast_type is ASTType.UnaryOperation:
        inner = _signature(term.argument)
        return None if inner is None else (f"-{inner[0]}", inner[1])
    if term.ast_type is ASTType.Function and term.name:
        return term.name, len(term.arguments)
    if term.ast_type is ASTType.SymbolicTerm and term.symbol.type is clingo.SymbolType.Function:
        return term.symbol.name, len(term.symbol.arguments)
    return None


def _is_theory(literal: ast.AST) -> bool:
    return (
        literal.ast_type is ASTType.Literal and literal.atom.ast_type is ASTType.TheoryAtom
    ) or literal.ast_type is ASTType.TheoryAtom


def _is_plain(literal: ast.AST) -> bool:
    """Returns whether it is an atom or a comparison."""
    return literal.ast_type is ASTType.Literal and literal.atom.ast_type in (
        ASTType.SymbolicAtom,
        ASTType.Comparison,
        ASTType.BooleanConstant,
    )


def _positive_atoms(body: Iterable[ast.AST]) -> List[ast.AST]:
    return [
        one.atom
        for one in body
        if _is_plain(one)
        and one.atom.ast_type is ASTType.SymbolicAtom
        and one.sign == ast.Sign.NoSign
        and _signature(one.atom.symbol) is not None
    ]


def _equations(body: Iterable[ast.AST]) -> List[Set[str]]:
    """Returns the variables of each comparison of a body by which some are bound."""
    return [
        {*_variables([one])}
        for one in body
        if _is_plain(one)
        and one.atom.ast_type is ASTType.Comparison
        and one.sign == ast.Sign.NoSign
        and _is_equation(one.atom)
    ]


def _is_equation(comparison: ast.AST) -> bool:
    """Returns whether clingo computes the value of a variable by it, and need not try all."""
    if hasattr(comparison, "guards"):
        operators = [guard.comparison for guard in comparison.guards]
        sides = [comparison.term, *(guard.term for guard in comparison.guards)]
    else:  # before clingo 5.6
        operators, sides = [comparison.comparison], [comparison.left, comparison.right]
    return ast.ComparisonOperator.Equal in operators and (
        any(side.ast_type is ASTType.Variable for side in sides) or all(map(_is_linear, sides))
    )


def _is_linear(term: ast.AST) -> bool:
    """Returns whether a term neither multiplies nor divides variables nor takes absolute values."""
    for node in _walk([term]):
        is_operation = node.ast_type is ASTType.BinaryOperation
        if is_operation and node.operator_type not in _LINEAR and len(_variables([node])) > 1:
            return False
        if node.ast_type is ASTType.UnaryOperation and node.operator_type != _MINUS:
            return False
    return True


def _bound(body: Sequence[ast.AST]) -> Set[str]:
    """Returns the variables that atoms and equations of a body bind."""
    bound = {*_variables(_positive_atoms(body))}
    equations = _equations(body)
    while True:
        new = [names for names in equations if len(names - bound) == 1]
        if not new:
            return bound
        bound.update(*new)


def _groups(
    atoms: Sequence[Tuple[BodyAtom, Sequence[str]]], body: Sequence[ast.AST]
) -> Tuple[Tuple[BodyAtom, ...], ...]:
    """Returns the atoms that have variables, in groups between which no value is handed on."""
    groups: List[Tuple[Set[str], List[BodyAtom]]] = []
    links: List[Tuple[Set[str], List[BodyAtom]]] = [
        *(({*names}, [atom]) for atom, names in atoms if names),
        *((names, []) for names in _equations(body)),
    ]
    for names, members in links:
        joined = [group for group in groups if group[0] & names]
        groups = [group for group in groups if not group[0] & names]
        all_names = names.union(*(group[0] for group in joined))
        groups.append((all_names, [*(a for group in joined for a in group[1]), *members]))
    return tuple(tuple(members) for _, members in groups if members)


def _global_variables(body: Iterable[ast.AST]) -> List[str]:
    """Returns the variables that a body binds outside of elements."""
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


def _has(node: ast.AST, *kinds: ASTType) -> bool:
    return any(one.ast_type in kinds for one in _walk([node]))


def _walk(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Yields nodes and all below them."""
    left = [*nodes]
    while left:
        node = left.pop(0)
        yield node
        below: List[ast.AST] = []
        for key in node.child_keys:
            child = getattr(node, key)
            if isinstance(child, ast.AST):
                below.append(child)
            elif child is not None:
                below += child
        left[:0] = below


def _quote(statement: ast.AST, program: Program, lines: Dict[str, List[bytes]]) -> str:
    """Returns a statement as it is written, in one line."""
    begin, end = statement.location.begin, statement.location.end
    path = os.path.realpath(begin.filename)
    if path not in lines:
        lines[path] = program.texts.get(path, "").encode().splitlines()  # clingo counts bytes
    rows = lines[path][begin.line - 1 : end.line]
    if not rows:
        return _shorten(str(statement))
    rows[-1] = rows[-1][: end.column - 1]
    rows[0] = rows[0][begin.column - 1 :]
    plain = (row.decode("utf-8", "replace").partition("%")[0] for row in rows)
    return _shorten(" ".join(" ".join(plain).split()))


def _shorten(text: str) -> str:
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
