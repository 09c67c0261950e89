"""Patterns of terms, such as ``go(W)``, with variables as clingo has them. Needs no ROS.

>>> pattern = TermPattern.parse("go(_,W)")
>>> pattern.variables, pattern.match(parse_term("go(c3,c4)")), pattern.match(parse_term("go(c3)"))
(('W',), {'W': 'c4'}, None)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Tuple

import clingo

from rosclingo.errors import TermError
from rosclingo.solver.terms import parse_term, quote
from rosoclingo_interfaces.errors import EntryError

_ANY = "_"
_WORD = re.compile(r'"(?:[^"\\]|\\.)*"|_*[A-Za-z][\w\']*|_')
_VARIABLE = re.compile(r"_*[A-Z]\w*|_")


def term_text(term: clingo.Symbol) -> str:
    """Returns a term as it is written into messages: strings without their quotes."""
    return term.string if term.type is clingo.SymbolType.String else str(term)


@dataclass(frozen=True)
class TermPattern:
    """A term with variables; ``_`` stands for any term.

    Attributes:
        text: In clingo's syntax.
        variables: Those that it has, without ``_``, in order.
    """

    text: str
    variables: Tuple[str, ...]
    _term: clingo.Symbol
    _names: Mapping[str, str]  # variables, by the constants that stand for them in the term

    @classmethod
    def parse(cls, text: str) -> TermPattern:
        """Parses a pattern.

        Raises:
            EntryError: It is none, or has no name.
        """
        prefix = "v_"
        while prefix in text:
            prefix += "_"
        found: List[str] = []

        def replace(match: re.Match[str]) -> str:
            if not _VARIABLE.fullmatch(match[0]):
                return match[0]
            if match[0] not in found:
                found.append(match[0])
            return f"{prefix}{found.index(match[0])}"

        try:
            term = parse_term(_WORD.sub(replace, text))
        except TermError as err:
            raise EntryError(f"expected a term such as go(W), not {quote(text)}: {err}") from err
        if term.type is not clingo.SymbolType.Function or not term.name or not term.positive:
            raise EntryError(f"expected a term with a name, such as go(W), not {quote(text)}")
        if term.name.startswith(prefix):
            raise EntryError(f"expected a name in lower case, as of go(W), not {quote(text)}")
        names = {f"{prefix}{place}": name for place, name in enumerate(found)}
        return cls(text, tuple(name for name in found if name != _ANY), term, names)

    @property
    def name(self) -> str:
        """The name of the terms that fit."""
        return self._term.name

    def match(self, term: clingo.Symbol) -> Optional[Dict[str, str]]:
        """Returns the texts that variables stand for; None if the term does not fit."""
        bound: Dict[str, clingo.Symbol] = {}
        if not self._fits(self._term, term, bound):
            return None
        return {name: term_text(value) for name, value in bound.items()}

    def _fits(
        self, pattern: clingo.Symbol, term: clingo.Symbol, bound: Dict[str, clingo.Symbol]
    ) -> bool:
        if pattern.type is not clingo.SymbolType.Function:
            return pattern == term
        variable = self._names.get(pattern.name)
        if variable is not None and not pattern.arguments:
            return variable == _ANY or bound.setdefault(variable, term) == term
        return (
            term.type is clingo.SymbolType.Function
            and (pattern.name, pattern.positive) == (term.name, term.positive)
            and len(pattern.arguments) == len(term.arguments)
            and all(map(lambda one, other: self._fits(one, other, bound),
                        pattern.arguments, term.arguments))
        )  # fmt: skip
