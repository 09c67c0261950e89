"""Divisions that cannot end the process.

clingo ends the process when it divides -2147483648 by -1. So all divisions are replaced by calls of
functions, which are evaluated here: those of the command line's files too, because a client may add
the facts that they are applied to.
"""

from __future__ import annotations

from typing import List, Sequence

import clingo
from clingo import ast

_NUMBERS_END = 2**31
_NAMES = {
    ast.BinaryOperator.Division: "_rosclingo_divide",
    ast.BinaryOperator.Modulo: "_rosclingo_modulo",
}


class _Guard(ast.Transformer):
    def visit_BinaryOperation(self, node: ast.AST) -> ast.AST:  # noqa: N802 (clingo names it)
        node = node.update(**self.visit_children(node))
        name = _NAMES.get(ast.BinaryOperator(node.operator_type))
        if name is None:
            return node
        return ast.Function(node.location, name, [node.left, node.right], 1)


def guard(statement: ast.AST) -> ast.AST:
    """Returns a statement with calls of :data:`FUNCTIONS` in the place of its divisions.

    Raises:
        RecursionError: It nests deeper than Python can follow.
    """
    text = str(statement)  # far quicker than a walk through the tree
    if "/" not in text and "\\" not in text:
        return statement
    result: ast.AST = _Guard().visit(statement)
    return result


def _divide(*operands: clingo.Symbol) -> List[clingo.Symbol]:
    if not _divisible(operands):
        return []
    a, b = (operand.number for operand in operands)
    return _numbers(_quotient(a, b))


def _modulo(*operands: clingo.Symbol) -> List[clingo.Symbol]:
    if not _divisible(operands):
        return []
    a, b = (operand.number for operand in operands)
    return _numbers(a - b * _quotient(a, b))


def _divisible(operands: Sequence[clingo.Symbol]) -> bool:
    """Whether these are two numbers and the second is not 0; a program may call with any others."""
    number = clingo.SymbolType.Number
    return (
        len(operands) == 2
        and all(operand.type is number for operand in operands)
        and operands[1].number != 0
    )


def _quotient(a: int, b: int) -> int:
    """Divides as clingo does: towards zero."""
    quotient = abs(a) // abs(b)
    return quotient if (a < 0) == (b < 0) else -quotient


def _numbers(result: int) -> List[clingo.Symbol]:
    return [clingo.Number(result)] if result < _NUMBERS_END else []


FUNCTIONS = {"_rosclingo_divide": _divide, "_rosclingo_modulo": _modulo}
"""What :func:`guard` calls. Without a result there is no instance of the rule, as in clingo."""
