"""Overflow check: exact arithmetic of terms, where clingo's 32 bits would wrap silently.

>>> find_overflow("f(65536*65536+3)")
'(65536*65536) is no whole number from -2147483647 to 2147483647'
>>> find_overflow("f(32768*65535+3)") is None
True
"""

from __future__ import annotations

import operator
from typing import Callable, Dict, List, Optional

from clingo import SymbolType, ast

from rosclingo.errors import shorten

LARGEST = 2**31 - 1
"""The largest number; the smallest one is its negative, as clingo prints others but reads none."""


def find_overflow(text: str) -> Optional[str]:
    """Returns the message about the first overflow in a term; None without one.

    Args:
        text: A ground term that clingo parses.
    """
    statements: List[ast.AST] = []
    ast.parse_string(f"p({text}).", statements.append)
    values: List[Optional[int]] = []  # of the subterms so far; None for what is no number
    for term in reversed(_subterms(statements[-1].head.atom.symbol)):
        value = None
        if term.ast_type is ast.ASTType.SymbolicTerm:
            if term.symbol.type is SymbolType.Number:
                value = term.symbol.number
        elif term.ast_type is ast.ASTType.Function:
            del values[len(values) - len(term.arguments) :]
        elif term.ast_type is ast.ASTType.UnaryOperation:
            argument = values.pop()
            if argument is not None:  # else it is the sign of a name
                value = _UNARY[term.operator_type](argument)
        else:
            right, left = values.pop(), values.pop()
            assert left is not None  # clingo knows no operations on others
            assert right is not None
            value = _BINARY[term.operator_type](left, right)
        if value is not None and abs(value) > LARGEST:
            return f"{shorten(str(term))} is no whole number from {-LARGEST} to {LARGEST}"
        values.append(value)
    return None


def _subterms(term: ast.AST) -> List[ast.AST]:
    """Returns all subterms of a term in preorder, arguments in reverse.

    It does not recurse, since terms may nest deeper than Python's calls may.
    """
    found, pending = [], [term]
    while pending:
        one = pending.pop()
        found.append(one)
        if one.ast_type is ast.ASTType.Function:
            pending += one.arguments
        elif one.ast_type is ast.ASTType.UnaryOperation:
            pending.append(one.argument)
        elif one.ast_type is ast.ASTType.BinaryOperation:
            pending += (one.left, one.right)
    return found


def _divide(left: int, right: int) -> int:
    """Divides and rounds towards zero, as clingo does."""
    quotient = abs(left) // abs(right)
    return quotient if (left < 0) == (right < 0) else -quotient


def _power(base: int, exponent: int) -> int:
    """Returns a power, or a number that is too large for clingo as well, without computing it."""
    if exponent < 0:
        return LARGEST + 1  # it is no whole number, and clingo says 0
    return LARGEST + 1 if abs(base) > 1 and exponent > LARGEST.bit_length() else base**exponent


_UNARY: Dict[int, Callable[[int], int]] = {
    ast.UnaryOperator.Minus: operator.neg,
    ast.UnaryOperator.Negation: operator.invert,
    ast.UnaryOperator.Absolute: abs,
}
_BINARY: Dict[int, Callable[[int, int], int]] = {
    ast.BinaryOperator.Plus: operator.add,
    ast.BinaryOperator.Minus: operator.sub,
    ast.BinaryOperator.Multiplication: operator.mul,
    ast.BinaryOperator.Division: _divide,
    ast.BinaryOperator.Modulo: lambda left, right: left - right * _divide(left, right),
    ast.BinaryOperator.Power: _power,
    ast.BinaryOperator.And: operator.and_,
    ast.BinaryOperator.Or: operator.or_,
    ast.BinaryOperator.XOr: operator.xor,
}
