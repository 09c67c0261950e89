"""Theories: constraints beyond clingo's own, which an installed package adds to a solver.

>>> make_theory("").name
''
>>> make_theory("linear")
Traceback (most recent call last):
    ...
rosclingo.errors.OptionsError: option --theory does not know 'linear'; it knows dl
"""

from __future__ import annotations

import importlib
from typing import List, NamedTuple, Optional, Sequence

import clingo
from clingo import ast
from clingo.theory import Theory as Extension

from rosclingo.errors import OptionsError, ProgramError


class _Source(NamedTuple):
    """The package, module and class of a theory.

    Attributes:
        wheel: What pip installs.
        versions: Which versions of it fit.
        module: The module in that.
        maker: The class in that.
        atom: The theory's atom, as clingo's messages name it.
    """

    wheel: str
    versions: str
    module: str
    maker: str
    atom: str


_SOURCES = {"dl": _Source("clingo-dl", ">=1.5,<1.6", "clingodl", "ClingoDLTheory", "diff/0")}


class Theory:
    """A theory that extends one solver; that with the name "" extends nothing.

    Attributes:
        name: As on the command line.
    """

    def __init__(self, name: str, extension: Optional[Extension] = None) -> None:
        """Wraps an extension; see :func:`make_theory`.

        Args:
            name: As on the command line.
            extension: What does it, for this solver alone; None for the name "".
        """
        self.name = name
        self._extension = extension

    def register(self, control: clingo.Control) -> None:
        """Extends a solver that has no program yet; defines the theory's atoms."""
        if self._extension is not None:
            self._extension.register(control)

    def rewritten(self, statements: Sequence[ast.AST]) -> Sequence[ast.AST]:
        """Rewrites statements into the form that the theory needs.

        Raises:
            ProgramError: An atom of the theory is not as it has to be; the message quotes line and
                column.
        """
        if self._extension is None:
            return statements
        # A list takes them, because clingo loses what a callback raises.
        taken: List[ast.AST] = []
        for statement in statements:
            try:
                self._extension.rewrite_ast(statement, taken.append)
            except RuntimeError as err:
                begin = statement.location.begin
                raise ProgramError(
                    f"{begin.filename}:{begin.line}:{begin.column}: the theory {self.name} cannot "
                    f"read '{statement}': {err}"
                ) from err
        return taken

    def remedy(self, message: str) -> str:
        """Returns a remedy to add to a message of clingo's, if an option would help."""
        if self.name or "definition found for theory atom" not in message:
            return ""
        options = (
            f"--theory {name}" for name, source in _SOURCES.items() if source.atom in message
        )
        return "".join(f"\nthe option {option} defines it" for option in options)

    def prepare(self, control: clingo.Control) -> None:
        """Prepares the theory for the ground program; to be called before each search."""
        if self._extension is not None:
            self._extension.prepare(control)

    def symbols(self, model: clingo.Model) -> Sequence[clingo.Symbol]:
        """Returns a model's shown symbols, then the theory's values, such as ``dl(x,3)``."""
        if self._extension is None:
            return model.symbols(shown=True)
        self._extension.on_model(model)
        return [*model.symbols(shown=True), *model.symbols(theory=True)]


def make_theory(name: str) -> Theory:
    """Returns a theory for a solver.

    Args:
        name: The value of the option ``--theory``; "" without it.

    Raises:
        OptionsError: There is no such theory, or its package is not installed.
    """
    if not name:
        return Theory(name)
    source = _SOURCES.get(name)
    if source is None:
        known = ", ".join(sorted(_SOURCES))
        raise OptionsError(f"option --theory does not know '{name}'; it knows {known}")
    try:
        module = importlib.import_module(source.module)
    except ImportError as err:  # also if it does not fit this clingo
        raise OptionsError(
            f"option --theory {name} needs the package {source.wheel}, which cannot be loaded "
            f"({err}); install it with: python -m pip install '{source.wheel}{source.versions}'"
        ) from err
    return Theory(name, getattr(module, source.maker)())
