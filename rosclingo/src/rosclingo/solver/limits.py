"""Limits of a statement's size, beyond which clingo grounds a short program for minutes.

clingo orders the literals of a body, or of a condition, in a time that grows with the square of
their number, and with the cube for those that are no plain atoms. And it repeats a statement for
each combination of its pools. Nothing ends it meanwhile. So programs that are not trusted are
refused if they have more than any real one.

>>> statements: List[ast.AST] = []
>>> ast.parse_string("a :- " + ", ".join(["b"] * 501) + ".", statements.append)
>>> check_sizes(statements)
Traceback (most recent call last):
rosclingo.errors.ProgramError: <string>:1:6: there are more than 500 literals in a body or \
condition; give parts of them a predicate of their own
"""

from __future__ import annotations

import re
from typing import Iterable, Iterator, List, Sequence, Tuple

from clingo import ast
from clingo.ast import ASTType

from rosclingo.errors import ProgramError

MOST_LITERALS = 500
"""Literals in a body or condition."""
MOST_COMPARISONS = 100
"""Comparisons among them."""
MOST_AGGREGATES = 30
"""Conditional literals, aggregates and theory atoms among them."""
MOST_COMBINATIONS = 20_000
"""Combinations of pools, in all statements that have several pools."""

_AGGREGATES = (ASTType.Aggregate, ASTType.BodyAggregate, ASTType.TheoryAtom)
_SHORT = 2 * MOST_AGGREGATES  # characters, in which there is room for no limit
_IN_POOL = re.compile(r";(?! )")  # in the text that clingo makes of a statement


def check_sizes(statements: Iterable[ast.AST]) -> None:
    """Checks the sizes of statements.

    Raises:
        ProgramError: One is too large; the message quotes line and column, and names the limit.
    """
    combinations = 0
    for statement in statements:
        text = str(statement)
        pools = len(_IN_POOL.findall(text))  # or more: their semicolons
        if len(text) > _SHORT:
            for literals in _lists(statement):
                _check_list(literals, has_pools=pools > 0)
        if pools > 1:
            combinations += _combinations(statement)
            if combinations > MOST_COMBINATIONS:
                raise _too_many(
                    statement, "combinations of pools, with those before", MOST_COMBINATIONS
                )


def _lists(statement: ast.AST) -> Iterator[Sequence[ast.AST]]:
    """Yields the body and the conditions of a statement."""
    body = getattr(statement, "body", ())
    yield body
    atoms = [getattr(statement, "head", None), getattr(statement, "atom", None)]
    for literal in body:
        if literal.ast_type is ASTType.ConditionalLiteral:
            yield literal.condition
        else:
            atoms.append(literal.atom)
    for atom in atoms:
        for element in getattr(atom, "elements", ()):
            condition = element.condition
            # In an aggregate of a head, an element has a conditional literal.
            yield condition.condition if isinstance(condition, ast.AST) else condition


def _check_list(literals: Sequence[ast.AST], *, has_pools: bool) -> None:
    if len(literals) > MOST_LITERALS:
        raise _too_many(literals[0], "literals in a body or condition", MOST_LITERALS)
    comparisons = aggregates = 0
    for literal in literals:
        if literal.ast_type is ASTType.ConditionalLiteral:
            aggregates += max(1, _combinations(literal, 1)) if has_pools else 1
        elif literal.atom.ast_type in _AGGREGATES:
            aggregates += 1
        elif literal.atom.ast_type is ASTType.Comparison:
            comparisons += len(getattr(literal.atom, "guards", (None,)))  # clingo 5.5 has no chains
        if comparisons > MOST_COMPARISONS:
            raise _too_many(literal, "comparisons in a body or condition", MOST_COMPARISONS)
        if aggregates > MOST_AGGREGATES:
            raise _too_many(
                literal,
                "conditional literals, aggregates and theory atoms in a body",
                MOST_AGGREGATES,
            )


def _combinations(root: ast.AST, least: int = 2) -> int:
    """Counts the combinations by which pools repeat a tree, and each element in it by itself.

    Args:
        root: The tree.
        least: How many pools a tree or element must have to count.
    """
    total = 0
    # Of each node: the number of that in which it is, and whether its pools repeat it alone. There
    # may be thousands of levels.
    nodes: List[Tuple[ast.AST, int, bool]] = [(root, 0, True)]
    for number, (node, _, _) in enumerate(nodes):
        for key in node.child_keys:
            child = getattr(node, key)
            for tree in [child] if isinstance(child, ast.AST) else child or ():
                alone = key == "elements" or tree.ast_type is ASTType.ConditionalLiteral
                nodes.append((tree, number, alone))
    pools = [int(node.ast_type is ASTType.Pool) for node, _, _ in nodes]
    sums, products = [0] * len(nodes), [1] * len(nodes)
    for number in range(len(nodes) - 1, -1, -1):
        node, parent, alone = nodes[number]
        count = sums[number] if node.ast_type is ASTType.Pool else products[number]
        if alone:
            total += count if pools[number] >= least else 0
        else:
            sums[parent] += count
            products[parent] = min(products[parent] * count, MOST_COMBINATIONS + 1)
            pools[parent] += pools[number]
    return total


def _too_many(tree: ast.AST, what: str, most: int) -> ProgramError:
    begin = tree.location.begin
    return ProgramError(
        f"{begin.filename}:{begin.line}:{begin.column}: there are more than {most} {what}; give "
        "parts of them a predicate of their own"
    )
